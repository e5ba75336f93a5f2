"""Where a drive may have come back to, and what the surfaces of then and now say of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .. import _core
from ..assembly.consensus import consensus
from ..assembly.graph import accepted_if_held
from ..assembly.pair_result import PairResult
from ..assembly.pose_graph import Edge
from ..clouds.cloud import PointCloud
from ..fields.protocol import Floats
from ..motions import inverse
from ..register import register
from ..result import RegistrationResult
from .hold import Hold
from .keyframes import Keyframe, surface_of
from .local_map import LocalMap
from .loop_graph import Chain
from .measure import Measure
from .motion import SteadyMotion
from .scan import Scan
from .track import Matched, track

_LEFT = 4.0      # radii of a keyframe's surface: so far must the sensor have gone from where it comes back to
_SPACING = 0.4   # radii, from one keyframe that is looked at to the next
_NEAR = 0.75     # radii: surfaces of two keyframes so near each other overlap enough
_SCANS = 0.8     # radii, to either side of a keyframe: the scans of its map
_DRIFT = 0.01    # of the way between: by so much the odometry may be off
_BEYOND = 2.0    # times that, and as many voxels: so far it is searched
_VISITS = 2      # earlier visits of a place that a keyframe is laid on, the nearest ones
_TRUSTED = 10.0  # strength of the odometry's own edges, beside an accepted loop's of 1 or more
_PSEUDO = 2000   # pseudo points of a scan
_LEAST_SCORE = 0.5  # of a scan on the map of then

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class Loop:
    """Keyframe j came back to keyframe i.

    T_ij: (4, 4), maps what j saw into the frame of i. covariance: (6, 6) of a twist (w, v) on its left, about the place
    of j. result: what the registration of the surfaces around them answered.
    """

    i: int
    j: int
    T_ij: Floats
    covariance: Floats
    result: PairResult

    @property
    def edge(self) -> Edge:
        """The same for a pose graph."""
        strength = 1.0 if self.result.evidence is None else max(self.result.evidence.strength, 1e-6)
        information = np.asarray(np.linalg.inv(self.covariance), float)
        return Edge(self.i, self.j, self.T_ij, information, self.T_ij[:3, 3].copy(), strength)

    def to_dict(self) -> dict[str, Any]:
        """What was found, in numbers, ready for JSON."""
        return {
            "source": self.result.source, "target": self.result.target, "T_target_source": self.T_ij.tolist(),
            "covariance": self.covariance.tolist(), "reason": self.result.reason.value,
        }


class LoopSearch:
    """The keyframes, and what was found of pairs of them."""

    def __init__(self, keyframes: Sequence[Keyframe], seed: int, threads: int | None) -> None:
        self._keyframes, self._seed, self._threads = keyframes, seed, threads
        self._gone = np.array([k.gone for k in keyframes])
        self.poses = np.stack([k.pose for k in keyframes])
        self._tried: dict[tuple[int, int], Loop | None] = {}

    @property
    def loops(self) -> tuple[Loop, ...]:
        """Those that were found, in the order of the drive."""
        return tuple(loop for _, loop in sorted(self._tried.items()) if loop is not None)

    @property
    def tried(self) -> int:
        """How many pairs were."""
        return len(self._tried)

    def pairs(self, poses: Floats) -> Iterator[tuple[int, int]]:
        """The pairs i < j of keyframes at some poses (n, 4, 4) that may show one place and were not tried."""
        looked = -np.inf
        for j, keyframe in enumerate(self._keyframes):
            if keyframe.gone < looked + _SPACING * keyframe.radius:
                continue
            looked = keyframe.gone
            for i in self._visits(j, poses)[:_VISITS]:
                if (i, j) not in self._tried:
                    yield i, j

    def _visits(self, j: int, poses: Floats) -> list[int]:
        """Of each earlier visit of the place of keyframe j the nearest keyframe; the nearest first."""
        radius, way = self._keyframes[j].radius, self._gone[j] - self._gone[:j]
        away = np.linalg.norm(poses[:j, :3, 3] - poses[j, :3, 3], axis=1)
        near = np.flatnonzero((way > _LEFT * radius) & (away < _NEAR * radius + _DRIFT * way))
        runs = np.split(near, np.flatnonzero(np.diff(near) > 1) + 1)
        nearest = [int(run[np.argmin(away[run])]) for run in runs if len(run)]
        return sorted(nearest, key=lambda i: (away[i], i))

    def lay(self, pairs: Sequence[tuple[int, int]], stage: str, progress: Progress | None) -> None:
        """Registers pairs of keyframes."""
        for done, (i, j) in enumerate(pairs):
            if progress is not None:
                progress(stage, done, len(pairs))
            self._tried[i, j] = self._laid(i, j)
        if progress is not None and pairs:
            progress(stage, len(pairs), len(pairs))

    def _laid(self, i: int, j: int) -> Loop | None:
        """Keyframe j on i: near where the odometry has it, or else wherever it may be."""
        radius = _BEYOND * (_DRIFT * (self._gone[j] - self._gone[i]) + self._keyframes[j].voxel)
        near: dict[str, Any] = {"init": inverse(self.poses[i]) @ self.poses[j], "search_radius": float(radius)}
        surfaces = self.around(j), self.around(i)
        for guess in (near, {}) if radius < self._keyframes[j].radius else ({},):
            result = register(*surfaces, seed=self._seed, threads=self._threads, **guess)
            if (loop := self._confirmed(i, j, result)) is not None:
                return loop
        return None

    def _confirmed(self, i: int, j: int, registered: RegistrationResult) -> Loop | None:
        """The loop, where the registration is accepted, or would be if all were held, and the tracked scan is held."""
        source, target = (f"step {self._keyframes[k].number}" for k in (j, i))
        result = PairResult.of(source, target, registered)
        if not accepted_if_held(result):
            return None
        found = self._tracked(i, j, result.T_target_source)
        hold = Hold(found)
        if not hold.is_whole or found.score < _LEAST_SCORE:
            return None
        return Loop(i, j, found.pose, hold.certainty.covariance, result)

    def _tracked(self, i: int, j: int, guess: Floats) -> Matched:
        """The scan of keyframe j on a map of the scans around i, from a guess (4, 4)."""
        then, now = self._keyframes[i], self._keyframes[j]
        local = LocalMap(Measure(then.voxel, np.inf))
        for row in np.flatnonzero(np.abs(self._gone - then.gone) <= _SCANS * then.radius):
            scan = _scan_of(self._keyframes[int(row)])
            local.add(scan.points, scan.sparse, inverse(then.pose) @ self.poses[row])
        return track(local, _scan_of(now), guess, SteadyMotion(then.voxel), 1.0, is_rough=True)

    def around(self, k: int) -> PointCloud:
        """The surface around a keyframe, in the sensor's frame, as it was seen on that visit, from a whole stretch of
        the way: it has no viewpoint."""
        keyframe = self._keyframes[k]
        rows = np.flatnonzero(np.abs(self._gone - keyframe.gone) <= 2 * keyframe.radius)
        means, _, _ = surface_of([self._keyframes[int(row)] for row in rows], inverse(keyframe.pose) @ self.poses[rows])
        return PointCloud(means[(means**2).sum(axis=1) < keyframe.radius**2])

    def believed(self, chain: Chain) -> list[Edge]:
        """The loops that agree with the odometry and among each other, but for what it may have drifted."""
        loops = [loop.edge for loop in self.loops]
        if not loops:
            return []
        edges = [replace(edge, strength=_TRUSTED) for edge in chain.edges(1.0)] + loops
        voxels = np.array([self._keyframes[edge.j].voxel for edge in edges])
        extents = np.array([2 * self._keyframes[edge.j].radius for edge in edges])
        agreed = consensus(len(self._keyframes), edges, voxels, extents, self._seed).believed
        return [loop for loop, agrees in zip(loops, agreed[-len(loops) :], strict=True) if agrees]


def _scan_of(keyframe: Keyframe) -> Scan:
    """The scan of a keyframe, ready to be tracked."""
    return Scan(keyframe.scan, *_core.thin_twice(keyframe.scan, keyframe.voxel, _PSEUDO), is_timed=False)
