"""A scan is laid on the map: the paper's Gauss-Newton on pseudo points of the scan's own surface.

Their own distance is zero by construction, so the residual (eq. 11) is the signed distance to the map's plane alone.
The schedule is told here; the loop, weights and scale stand in cpp/tracking.hpp, the step's formulas in
cpp/linearise.hpp. In Python, the loop took a quarter of the time of a scan.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..alignment.steps import LARGEST_TURN
from ..fields.protocol import Floats
from .local_map import COARSER, LocalMap
from .measure import FEWEST, FLATNESS, WIDTH
from .motion import ARM, SteadyMotion
from .scan import Scan

_STEPS, _STEPS_COARSE = 15, 30  # at most
_FREE = 5           # steps, in which pseudo points find their planes anew; then in every third
_DEVIATIONS = 2.0   # of residuals: one as large has a quarter of the weight
_THICKNESS = 0.025  # voxels: no plane is taken for thinner, and no scale for finer
_CERTAIN = 0.25     # of the flatness asked for: thicker planes may be edges, and are not to say what holds the scan
_FIRST_SCALE = 0.33  # of how far predictions are off, in the first step: what is off tells where to go
_GATE = 3.0         # of how far predictions are off: beyond, a pseudo point has no partner
_LEAST_GATE = 0.3   # voxels
_KNOWN = 0.25       # of the pseudo points: where fewer are on known surface, the agreement of these tells little
_STILL = 0.005      # voxels: steps no longer are the last
_RIM = 50           # voxels: at that range, turns no longer


@dataclass(frozen=True, eq=False)
class Matched:
    """Where a scan came to lie: a motion (4, 4) about `origin` (3,), and the sums of the last step there.

    H, hold, scatter: (6, 6), as in cpp/linearise.hpp; stretch: by how much a step is lengthened. lever: the length over
    which turns and shifts are of one size; least_hold: of the least held direction, a share of the best one's.
    points: how many pseudo points were aligned; met: that have a plane; on: of these, that lie on it;
    away: how far they are from it (a length), none counted as more than 0.3 voxels, summed up; middle: the median.
    """

    motion: Floats
    origin: Floats
    H: Floats
    hold: Floats
    scatter: Floats
    stretch: float
    lever: float
    least_hold: float
    scale: float
    points: int
    met: int
    on: int
    away: float
    middle: float
    iterations: int

    @cached_property
    def pose(self) -> Floats:
        """world_from_sensor (4, 4)."""
        pose = self.motion.copy()
        # One step of Newton's: the rotation that rounding has left.
        R = pose[:3, :3]
        pose[:3, :3] = R @ (3 * np.eye(3) - R.T @ R) / 2
        pose[:3, 3] += self.origin
        return pose

    @property
    def agreement(self) -> float:
        """Share of the pseudo points on known surface that lie on it."""
        return self.on / self.met if self.met else 0.0

    @property
    def score(self) -> float:
        """The agreement, where enough is on known surface to say so."""
        return self.on / max(self.met, _KNOWN * self.points, 1)


def track(
    local: LocalMap, scan: Scan, guess: Floats, motion: SteadyMotion, seconds: float, is_rough: bool,
    held: Floats | None = None,
) -> Matched:
    """Where a scan lies on the map, from a guess (4, 4); a rough one is brought nearer on the coarse map first.

    motion: that led here in so many seconds. held: (6, 6), its columns are the twists that may be told from the scan.
    """
    origin = guess[:3, 3].copy()
    start, last = _about(origin, guess), _about(origin, motion.pose) if scan.is_timed else None
    if is_rough:
        settings = _settings(COARSER * local.voxel, motion.spread, _STEPS_COARSE)
        start = local.coarse.track(scan.pseudo, start, origin, last, seconds, held, True, settings)["motion"]
    settings = _settings(local.voxel, motion.spread, _STEPS) | {"trust": 0.0 if is_rough else motion.trust}
    found = local.fine.track(scan.pseudo, start, origin, last, seconds, held, False, settings)
    return Matched(origin=origin, **found)


def _about(origin: Floats, pose: Floats) -> Floats:
    """A pose (4, 4) as seen from a place (3,), in the world's axes."""
    moved = pose.copy()
    moved[:3, 3] -= origin
    return moved


def _settings(voxel: float, spread: float, steps: int) -> dict[str, float]:
    """The schedule on a map of such voxels, where guesses are so far off (lengths)."""
    thickness, gate = _THICKNESS * voxel, max(_GATE * spread, _LEAST_GATE * voxel)
    return {
        "steps": steps, "free_steps": _FREE, "still_shift": _STILL * voxel, "still_turn": _STILL / _RIM,
        "largest_turn": LARGEST_TURN, "deviations": _DEVIATIONS, "first_scale": _FIRST_SCALE * spread,
        "least_scale": thickness, "gate": gate, "fewest": FEWEST, "flatness": FLATNESS, "width": WIDTH * voxel,
        "trust": 0.0, "arm": ARM * voxel,
        "thickness": thickness, "certain_gate": _LEAST_GATE * voxel, "certain_flatness": _CERTAIN * FLATNESS,
    }
