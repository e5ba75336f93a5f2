"""What pairs of scans show of each other where they are laid: each pair is looked at once in each place."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..fields.protocol import Floats
from ..motions import inverse, reach_of

_NEAR = 20         # scans around each one, of its part, that are looked at
_AS_BEFORE = 0.1  # voxels: a pair that lies no further off lies where it was seen


class Laid(NamedTuple):
    """Scan j laid in the frame of scan i by T_ij (4, 4); i < j."""

    i: int
    j: int
    T_ij: Floats


class Look(NamedTuple):
    """on: the share of surface that lies on the other's; through: the share that the other's sensor looked through,
    None where no sensor is known."""

    on: float
    through: float | None


class Looks:
    """The looks at pairs. places: (n, 3), where each scan was taken from, in its own frame; reach: (n,), how far from
    there it shows a surface; unit: a voxel, a length."""

    def __init__(self, places: Floats, reach: Floats, unit: float) -> None:
        self.places, self.reach, self.unit = places, reach, unit
        self._at: dict[tuple[int, int], list[tuple[Floats, Look]]] = defaultdict(list)

    def add(self, laid: Laid, look: Look) -> None:
        """Takes what a pair shows where it is laid."""
        self._at[laid.i, laid.j].append((laid.T_ij, look))

    def find(self, laid: Laid) -> Look | None:
        """What a pair shows where it is laid; None where nobody has looked yet."""
        for T_ij, look in self._at.get((laid.i, laid.j), ()):
            if self.off(laid, T_ij) <= _AS_BEFORE:
                return look
        return None

    def off(self, laid: Laid, T_ij: Floats) -> float:
        """By how many voxels, at most, scan j lies elsewhere than by another T_ij (4, 4)."""
        turn = float(np.linalg.norm(laid.T_ij[:3, :3] - T_ij[:3, :3])) / np.sqrt(2)  # its angle, where it is small
        difference = laid.T_ij - T_ij
        shift = np.linalg.norm(difference[:3, :3] @ self.places[laid.j] + difference[:3, 3])
        return float(shift + turn * self.reach[laid.j]) / self.unit

    def moved(self, scan: int, twist: Floats) -> float:
        """How far a twist (6,) in its own frame moves what a scan shows, at most."""
        about = np.r_[twist[:3], twist[3:] + np.cross(twist[:3], self.places[scan])]
        return reach_of(about, 2 * float(self.reach[scan]))

    def placed(self, poses: Floats, scans: NDArray[np.int64] | int) -> Floats:
        """Where scans (m,) were taken from, in the frame of their poses (m, 4, 4)."""
        return np.asarray(np.einsum("...ab,...b->...a", poses[..., :3, :3], self.places[scans]) + poses[..., :3, 3])

    def apart(self, laid: Laid) -> float:
        """How far apart two scans were taken."""
        return float(np.linalg.norm(self.placed(laid.T_ij, laid.j) - self.places[laid.i]))

    def near(self, poses: Floats, members: NDArray[np.int64], count: int) -> Iterator[Laid]:
        """Pairs of members (m,) that their poses (n, 4, 4) lay near enough to overlap, of either's nearest few."""
        places, reach = self.placed(poses[members], members), self.reach[members]
        away = np.linalg.norm(places[:, None] - places, axis=2)
        rank = np.argsort(np.argsort(away, axis=1, kind="stable"), axis=1)  # 0: the scan itself
        may = (np.minimum(rank, rank.T) <= count) & (away < np.minimum(reach, reach[:, None]))
        for a, b in np.argwhere(np.triu(may, 1)):
            i, j = int(members[a]), int(members[b])
            yield Laid(i, j, inverse(poses[i]) @ poses[j])

    def within(self, poses: Floats, label: NDArray[np.int64]) -> Iterator[Laid]:
        """The near pairs of every part, where label (n,) numbers the part of each scan."""
        for part in np.flatnonzero(np.bincount(label) > 1):
            yield from self.near(poses, np.flatnonzero(label == part), _NEAR)

    def around(self, k: int, pose: Floats, poses: Floats, members: NDArray[np.int64]) -> list[Laid]:
        """The pairs of scan k, at a pose (4, 4), with members (m,) that lie near it, the nearest first."""
        away = np.linalg.norm(self.placed(poses[members], members) - self.placed(pose, k), axis=1)
        close = (away < np.minimum(self.reach[k], self.reach[members])) & (members != k)
        found = []
        for row in np.flatnonzero(close)[np.argsort(away[close], kind="stable")]:
            m = int(members[row])
            found.append(Laid(k, m, inverse(pose) @ poses[m]) if k < m else Laid(m, k, inverse(poses[m]) @ pose))
        return found
