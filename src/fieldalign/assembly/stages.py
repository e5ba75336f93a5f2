"""What is done with scans where the work runs: each a function of its data and of load(name), which gives a scan."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..alignment.agreement import both_ways
from ..dof import Dof
from ..fields.protocol import Floats
from ..methods.pair import Pair
from ..prepared import PreparedCloud
from ..register import register
from ..result import RegistrationResult
from ..scale import common_voxel
from .glance import comparison, glance, looked_through
from .joint import Pull, pull
from .pair_result import PairResult
from .scan import ThinScan
from .work import Load

_NEAR_TURN, _NEAR_SHIFT = 30.0, 0.25  # degrees, and of the scan's extent, that a given pose may be off


def fetch(name: str, load: Load) -> ThinScan:
    """The scan itself, thinned where it was read."""
    scan: ThinScan = load(name)
    return scan


@dataclass(frozen=True)
class Glances:
    """A glance at each pair of a tile: (rows, columns), names of scans."""

    unit: float
    seed: int
    dof: Dof | None

    def __call__(self, tile: tuple[list[str], list[str]], load: Load) -> list[list[float]]:
        """The scores, row by row; 0 where the row's scan does not come before the column's."""
        rows, columns = tile
        return [
            [glance(load(a), load(b), self.unit, self.seed, self.dof) if a < b else 0.0 for b in columns] for a in rows
        ]


@dataclass(frozen=True)
class Relate:
    """The registration of one scan on another: (target, source), and a guess of where it is, if there is one."""

    seed: int
    dof: Dof | None
    threads: int

    def __call__(self, data: tuple[str, str, Floats | None, bool], load: Load) -> PairResult:
        """data: the names, a guess (4, 4) of T_target_source or None, and whether other poses are searched, too.

        What was looked through is told at a finer scale than by register(), and does not change whether it accepts.
        """
        target, source, guess, searches = data
        one, other = load(target).cloud, load(source).cloud
        result = self._registered(one, other, guess, searches)
        evidence = result.evidence
        if evidence is not None and evidence.seen_through is not None:
            pair = Pair(other, one, common_voxel(other.scale, one.scale))
            evidence = replace(evidence, seen_through=looked_through(pair, result.T_target_source))
        return replace(PairResult.of(source, target, result), evidence=evidence)

    def _registered(
        self, one: PreparedCloud, other: PreparedCloud, guess: Floats | None, searches: bool
    ) -> RegistrationResult:
        near: dict[str, Any] = {"init": guess}
        if guess is not None and searches:
            near |= {"search_angle": _NEAR_TURN, "search_radius": _NEAR_SHIFT * other.extent}
        common: dict[str, Any] = {"seed": self.seed, "dof": self.dof, "threads": self.threads}
        result = register(other, one, **near, **common)
        if guess is not None and searches and not result.accepted:  # the guess was none
            result = register(other, one, **common)
        return result


@dataclass(frozen=True)
class Overlaps:
    """How far a scan and others overlap at poses of theirs, and were looked through. unit: as in comparison()."""

    unit: float

    def __call__(self, data: tuple[str, list[str], Floats], load: Load) -> list[tuple[float, float]]:
        """The larger share of either's surface that lies on the other's, and that which the other's sensor looked
        through; data: a name i, other names j, and T_ij (m, 4, 4)."""
        one, others, poses = data
        return [self._of(load(one), load(other), T_ij) for other, T_ij in zip(others, poses, strict=True)]

    def _of(self, scan: ThinScan, other: ThinScan, T_ij: Floats) -> tuple[float, float]:
        pair = comparison(scan, other, self.unit)
        there, back = both_ways(*pair.surfaces(), pair.pose(T_ij)[None], 1)
        return float(max(there.on[0], back.on[0])), looked_through(pair, T_ij) or 0.0


def pulls(data: tuple[str, str, Floats], load: Load) -> Pull:
    """How the fields of two scans pull at the pose T_ij (4, 4) of the second in the frame of the first."""
    one, other, T_ij = data
    return pull(load(one).cloud, load(other).cloud, np.asarray(T_ij))
