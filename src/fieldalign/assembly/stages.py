"""What is done with scans where the work runs: each a function of its data and of load(name), which gives a scan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..alignment.agreement import both_ways
from ..dof import Dof
from ..fields.protocol import Floats
from ..methods.pair import Pair
from ..register import register
from ..scale import common_voxel
from .glance import glance
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

    seed: int
    dof: Dof | None

    def __call__(self, tile: tuple[list[str], list[str]], load: Load) -> list[list[float]]:
        """The scores, row by row; 0 where the row's scan does not come before the column's."""
        rows, columns = tile
        return [[glance(load(a), load(b), self.seed, self.dof) if a < b else 0.0 for b in columns] for a in rows]


@dataclass(frozen=True)
class Relate:
    """The registration of one scan on another: (target, source), and a guess of where it is, if there is one."""

    seed: int
    dof: Dof | None
    threads: int

    def __call__(self, data: tuple[str, str, Floats | None, bool], load: Load) -> PairResult:
        """data: the names, a guess (4, 4) of T_target_source or None, and whether other poses are searched, too."""
        target, source, guess, searches = data
        one, other = load(target).cloud, load(source).cloud
        near: dict[str, Any] = {"init": guess}
        if guess is not None and searches:
            near |= {"search_angle": _NEAR_TURN, "search_radius": _NEAR_SHIFT * other.extent}
        common: dict[str, Any] = {"seed": self.seed, "dof": self.dof, "threads": self.threads}
        result = register(other, one, **near, **common)
        if guess is not None and searches and not result.accepted:  # the guess was none
            result = register(other, one, **common)
        return PairResult.of(source, target, result)


@dataclass(frozen=True)
class Overlaps:
    """How far two scans overlap at a pose of theirs."""

    def __call__(self, data: tuple[str, str, Floats], load: Load) -> float:
        """The larger share of either's surface that lies on the other's; data: names (i, j) and T_ij (4, 4)."""
        one, other, T_ij = data
        target, source = load(one).cloud, load(other).cloud
        pair = Pair(source, target, common_voxel(source.scale, target.scale))
        there, back = both_ways(*pair.surfaces(), pair.pose(np.asarray(T_ij))[None], 1)
        return float(max(there.on[0], back.on[0]))


def pulls(data: tuple[str, str, Floats], load: Load) -> Pull:
    """How the fields of two scans pull at the pose T_ij (4, 4) of the second in the frame of the first."""
    one, other, T_ij = data
    return pull(load(one).cloud, load(other).cloud, np.asarray(T_ij))
