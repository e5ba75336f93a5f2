"""Loops: where a drive comes back to, the map of then and that of now are registered, and the drive is mended."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..clouds.cloud import PointCloud
from ..errors import ArgumentError
from ..motions import inverse
from .keyframes import fused
from .loop_graph import between_keyframes, chain_of, closed
from .loop_search import Loop, LoopSearch, Progress
from .odometry import Odometry
from .trajectory import Trajectory

_ROUNDS = 2  # loops that are closed show others


@dataclass(frozen=True, eq=False)
class ClosedLoops:
    """A drive after its loops were closed.

    trajectory: of all steps; its covariances are of the place in the world, drift and all. map: of the whole drive.
    loops: those that were found. tried: how many pairs of keyframes were. mended: False where the odometry's own
    trajectory stays as it was: there are no loops, or these find it off by no more than their own errors.
    """

    trajectory: Trajectory
    map: PointCloud
    loops: tuple[Loop, ...]
    tried: int
    mended: bool

    def to_dict(self) -> dict[str, Any]:
        """What was found, in numbers, ready for JSON."""
        loops = [loop.to_dict() for loop in self.loops]
        return {"tried": self.tried, "accepted": len(loops), "mended": self.mended, "loops": loops}


def close_loops(
    odometry: Odometry, *, seed: int = 0, threads: int | None = None, progress: Progress | None = None
) -> ClosedLoops:
    """The drive of an odometry with its loops closed; the odometry itself stays as it is.

    odometry: one that keeps the whole map, fa.Odometry(whole=True). seed: of every random draw. threads: None means all
        cores; the answer is the same. progress: called as progress(stage, finished, of).

    Where the sensor may have come back to a place, the surface it saw then and the one it sees now are registered
    (fa.register), searching as far as the odometry may have drifted. Where that is accepted, the scan of now is tracked
    on a map of the scans of then. Those pairs that agree among themselves enter a pose graph with the odometry's own
    steps. Raises ArgumentError for an odometry that does not keep the whole map.
    """
    if not isinstance(odometry, Odometry) or not odometry.keeps_all:
        raise ArgumentError("odometry must keep the whole map to close loops: make it with fa.Odometry(whole=True)")
    keyframes, trajectory = odometry.keyframes, odometry.trajectory
    if len(keyframes) < 2:
        return ClosedLoops(trajectory, odometry.map, (), 0, False)
    search, found = LoopSearch(keyframes, seed, threads), None
    assert trajectory.covariances is not None
    rows = [k.number for k in keyframes]
    chain = chain_of(search.poses, rows, trajectory.covariances)
    for number in range(_ROUNDS):
        poses = chain.poses if found is None else found[0]
        search.lay(list(search.pairs(poses)), f"loops, round {number + 1}", progress)
        found = closed(chain, search.believed(chain))
    told = ClosedLoops(trajectory, odometry.map, search.loops, search.tried, found is not None)
    if found is None:
        return told
    poses, covariances = found
    before = np.searchsorted(rows, np.arange(len(trajectory)), side="right") - 1
    mended = between_keyframes(trajectory.poses, rows, poses @ inverse(chain.poses))
    known = trajectory.covariances + covariances[np.maximum(before, 0)]
    return replace(told, trajectory=replace(trajectory, poses=mended, covariances=known), map=fused(keyframes, poses))
