"""A scan is laid on the map: the paper's Gauss-Newton on pseudo points of the scan's own surface.

Their own distance is zero by construction, so the residual (eq. 11) is the signed distance to the map's plane alone;
weights and scale stand in cpp/tracking.hpp, the step's formulas in cpp/linearise.hpp.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..alignment import Step, descend
from ..alignment.steps import LARGEST_TURN, minimisers, stretch_of, take_steps
from ..fields.protocol import Floats
from ..motions import exp_twist
from .local_map import COARSER, FEWEST, LocalMap
from .motion import SteadyMotion
from .scan import Rows, Scan

_THICKNESS = 0.05   # voxels: no plane is taken for thinner
_FLATNESS = 0.2     # of the variance along the shorter axis: what is thicker is no plane
_DEVIATIONS = 3.0   # of residuals: one as large has a quarter of the weight
_LEAST_GATE = 0.3   # voxels
_STILL = 0.003      # voxels, and of a turn's effect at the map's rim: steps no longer are the last
_RIM = 50           # voxels
_STEPS_COARSE, _STEPS = 30, 15
_FREE = 5           # steps, in which pseudo points find their planes anew; then in every third


@dataclass(frozen=True, eq=False)
class Matched:
    """Where a scan came to lie: a motion (4, 4) about `origin` (3,), the pseudo points as deskewed there, their cells,
    and the last step's sums.

    met: pseudo points that have a plane. on: of these, those that lie on it.
    """

    motion: Floats
    origin: Floats
    pseudo: Rows
    cells: NDArray[np.int32]
    H: Floats
    totals: Floats
    scale: float
    met: int
    on: int
    iterations: int

    @property
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


class TrackStage:
    """One map, one pose: pseudo points (L, 4) about `origin` (3,) against its planes."""

    def __init__(
        self, voxels: _core.VoxelMap, pseudo: Rows, origin: Floats, voxel: float, spread: float, iterations: int,
        is_coarse: bool, deskewed: Callable[[Floats], Rows] | None, held: Floats | None,
    ) -> None:
        """spread: how far off the guess may be (a length). deskewed: the pseudo points for a pose (4, 4) about origin.
        held: columns (6, m), the twists that the map holds; None: all."""
        self.voxels, self.pseudo, self.origin, self.deskewed, self.held = voxels, pseudo, origin, deskewed, held
        self.iterations, self.is_coarse, self.voxel = iterations, is_coarse, voxel
        self.gate = max(3 * spread, _LEAST_GATE * voxel)
        # At first the guess is off, and what is off tells where to go; later it is what moved, and is to be left out.
        self.least_scale = max(spread / 3, _THICKNESS * voxel)
        self.taken = 0

    def step(self, poses: Floats) -> tuple[Floats, Step]:
        """A Gauss-Newton step (eq. 14 to 16)."""
        (G,) = poses
        if self.deskewed is not None and self.taken <= _FREE:
            self.pseudo = self.deskewed(G)
        if self.taken < _FREE or self.taken % 3 == 0:
            self.cells = self.voxels.match(self.pseudo, G, self.origin, FEWEST, self.is_coarse)
        (H, g, totals), self.scale, self.met, self.on = self.voxels.sums(
            self.pseudo, self.cells, G, self.origin, _DEVIATIONS, self.least_scale, self.gate,
            _THICKNESS * self.voxel, _FLATNESS, self.is_coarse,
        )
        self.H, self.totals = H[0], totals[0]
        self.least_scale = _THICKNESS * self.voxel
        self.taken += 1
        if self.held is None:
            twists, poses = take_steps(poses, H, g, stretch_of(totals), None)
        else:
            twists = minimisers(H, g, self.held[None])
            twists *= min(1.0, LARGEST_TURN / max(float(np.linalg.norm(twists[0, :3])), LARGEST_TURN))
            poses = (exp_twist(twists[0]) @ G)[None]
        return poses, Step(twists[0], self.scale, self.met)

    def is_still(self, step: Step) -> bool:
        """Whether the step moved the scan by next to nothing."""
        w, v = step.increment[:3], step.increment[3:]
        return bool(max(w @ w * _RIM**2 * self.voxel**2, v @ v) < (_STILL * self.voxel) ** 2)

    def run(self, G: Floats) -> Matched:
        """The motion (4, 4) about the origin after as many steps as it takes."""
        (found,), steps = descend(self, G[None])
        return Matched(
            found, self.origin, self.pseudo, self.cells, self.H, self.totals, self.scale, self.met, self.on, len(steps)
        )


def certainty_sums(voxels: _core.VoxelMap, found: Matched, voxel: float) -> tuple[Floats, Floats]:
    """What holds a scan where it was found (6, 6), and the scatter (6, 6) of the gradient there."""
    return voxels.certainty(
        found.pseudo, found.cells, found.motion, found.origin, found.scale, _LEAST_GATE * voxel, _THICKNESS * voxel,
        _FLATNESS,
    )


def track(
    local: LocalMap, scan: Scan, guess: Floats, motion: SteadyMotion, seconds: float, is_rough: bool,
    held: Floats | None = None,
) -> Matched:
    """Where a scan lies on the map, from a guess (4, 4); a rough one is brought nearer on the coarse map first.

    motion: that led here in so many seconds. held: columns (6, m), the twists that may be told from the scan.
    """
    origin, G = guess[:3, 3].copy(), guess.copy()
    G[:3, 3] = 0

    def deskewed(at: Floats) -> Rows:
        pose = at.copy()
        pose[:3, 3] += origin
        return _core.deskew(scan.pseudo, motion.between(pose, seconds))

    carried = deskewed if scan.is_timed else None
    if is_rough:
        coarse = TrackStage(
            local.coarse, scan.pseudo, origin, COARSER * local.voxel, motion.spread, _STEPS_COARSE, True, carried, held
        )
        G = coarse.run(G).motion
    fine = TrackStage(local.fine, scan.pseudo, origin, local.voxel, motion.spread, _STEPS, False, carried, held)
    return fine.run(G)
