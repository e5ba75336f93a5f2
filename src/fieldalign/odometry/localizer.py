"""Localisation: where a sensor is on a map that is known, from no guess; then it is tracked there."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import as_count
from ..clock import Clock
from ..clouds.checks import warn_of_lost_precision
from ..clouds.cloud import PointCloud, as_points
from ..clouds.files import read_cloud
from ..errors import ArgumentError
from ..fields.protocol import Floats
from ..methods import Start, register_robust
from ..prepare import prepare_named
from ..prepared import PreparedCloud
from ..result import RegistrationResult
from ..threads import resolve_threads
from .hold import Hold
from .known_map import KnownMap, tiles_of
from .measure import Measure, measure_of
from .motion import SteadyMotion
from .pace import Pace
from .reason import Tracking
from .result import OdometryResult
from .scan import Scan, Sweep, sweep_of, thin_scan
from .settings import OdometrySettings
from .track import Matched, track
from .tracker import Placed, Tracker

_BEYOND = 1.5         # by so much a scan's range is more than nearly all of its points' distance
_LEAST_STRENGTH = 0.4  # of the evidence for a place: with less it is none
_LEAST_SCORE = 0.5    # of a scan at a place, on the map's planes
_AS_GOOD = 0.95       # of the best score: another place that agrees nearly as well contradicts it
_FAR_WORSE = 0.75     # of the best score: where all others agree less, the place is clear though the search doubts it
_PATIENCE = 5         # scans that are lost in a row, after which nothing is known of the place
_ALIKE = 1.25         # the ratio of lengths that make no difference
_FEWEST = 1000        # points of a map
_APART = 5.0          # voxels: places farther from each other are others


@dataclass(frozen=True, eq=False)
class _Found:
    """A place that the search came to: what the registration says, and how the scan lies there."""

    result: RegistrationResult
    matched: Matched


@dataclass(frozen=True, eq=False)
class Localization(OdometryResult):
    """What is known of a scan's pose on the map, as of an odometry's step.

    search: what the registration answered, where the scan was searched for and found; None where it was tracked.
    Without a place (UNPLACED) the pose is NaN.
    """

    search: RegistrationResult | None = None

    def to_dict(self) -> dict[str, Any]:
        """In numbers and strings, ready for JSON; pose and covariance are null without a place."""
        has_place = bool(np.isfinite(self.pose).all())
        return {
            "pose": self.pose.tolist() if has_place else None,
            "covariance": self.covariance.tolist() if has_place else None,
            "stamp": self.stamp, "tracked": self.tracked, "reason": self.reason.value, "message": str(self.reason),
            "agreement": self.agreement, "search": None if self.search is None else self.search.verdict,
        }


class Localizer:
    """A sensor on a map: found by the any-pose search, then tracked; where it is lost, it is searched again.

    map: a PointCloud, points (N, 3), or a path. With normals, as `fa.Odometry(whole=True).map` has them, a point for
    each voxel is enough; without, it takes some ten points to a voxel of the scans. seed: of every random draw.
    threads: of the search; None means all cores.

    results: a Localization for each scan so far. last: the latest; None before the first.

    Raises ArgumentError for a map that is no cloud or has too few points, CloudFileError where it cannot be read.
    """

    def __init__(
        self, map: PointCloud | ArrayLike | str | os.PathLike[str], *, seed: int = 0, threads: int | None = None,
        deskew: bool = True,
    ) -> None:
        self._cloud = _as_map(map)
        self._seed, self._threads, self.deskew = as_count(seed, "seed", 0), resolve_threads(threads), bool(deskew)
        self.settings, self.results = OdometrySettings(), list[Localization]()
        self._pace = Pace()
        self._read: Measure | None = None  # of a scan
        self._measure: Measure | None = None  # of the scan on the map
        self._tracker: Tracker | None = None
        self._lost = 0  # scans in a row

    @property
    def last(self) -> Localization | None:
        """What is known of the latest scan."""
        return self.results[-1] if self.results else None

    def step(
        self, cloud: PointCloud | ArrayLike | None, times: ArrayLike | None = None, stamp: float | None = None
    ) -> Floats | None:
        """The pose (4, 4) map_from_sensor of the next scan, in the middle of its sweep; None where it has no place yet.

        cloud, times, stamp: as of `Odometry.step`. A scan that was lost keeps the prediction; `last` says so.

        Raises ArgumentError for arrays of a wrong shape.
        """
        clock, sweep = Clock(), sweep_of(cloud, times, stamp)
        elapsed, event = self._pace.advance(sweep.middle, sweep.span)
        placed, found = self._predicted(elapsed, Tracking.MISSING if sweep.is_missing else Tracking.EMPTY), None
        if self._is_known(sweep):
            scan = self._thinned(sweep)
            if self._tracker is not None:
                placed = self._tracker.place(scan, elapsed, self._pace.interval, event)
                clock.lap("track")
            if not scan.is_empty and (self._tracker is None or not self._tracker.is_sure(placed)):
                found = self._searched(sweep, scan)
                placed = self._agreed(scan, placed, found, elapsed)
                clock.lap("search")
        if self._tracker is not None and placed.reason is not Tracking.FOUND:
            self._tracker.motion.follow(placed.pose, placed.seconds if placed.hold else None)
        self._lost = self._lost + 1 if placed.reason is Tracking.LOST else 0
        if self._lost > _PATIENCE:
            self._tracker = None
        return self._told(placed, found, clock)

    def _is_known(self, sweep: Sweep) -> bool:
        """Whether the lengths are known: of the first scan that is found; the map is made for them."""
        read = measure_of(sweep.points, None) if self._tracker is None else None
        if read is not None and (self._read is None or not _are_alike(read, self._read)):
            self._read, self._map = read, KnownMap(self._cloud, read)
            self._measure = Measure(self._map.voxel, read.range)
            self._tiles = tiles_of(self._cloud, read.range / _BEYOND, self._threads)
        return self._measure is not None and not sweep.is_missing

    def _thinned(self, sweep: Sweep) -> Scan:
        assert self._measure is not None
        wanted = self.settings.pseudo_points
        wanted = 2 * wanted if self._tracker is None else self._tracker.pseudo_points(wanted)
        return thin_scan(sweep, self._measure, self.settings.points, wanted, self.deskew)

    def _predicted(self, elapsed: float, reason: Tracking) -> Placed:
        """What the last poses predict; none where there are none."""
        if self._tracker is None:
            return Placed(np.full((4, 4), np.nan), elapsed, reason)
        motion = self._tracker.motion
        return Placed(motion.predicted(elapsed), elapsed, reason, prediction=motion.covariance)

    def _agreed(self, scan: Scan, placed: Placed, found: _Found | None, elapsed: float) -> Placed:
        """What the search says of where a scan was tracked to: the same, another place, where tracking begins anew, or
        nothing, and then the scan is lost."""
        if found is None:
            return self._predicted(elapsed, Tracking.UNPLACED if self._tracker is None else Tracking.LOST)
        if placed.reason.is_on_map and self._is_near(found.matched, placed.pose):
            return placed
        assert self._measure is not None
        self._tracker = Tracker(self._measure)
        self._tracker.stand(self._map, scan, found.matched)
        return Placed(found.matched.pose, elapsed, Tracking.FOUND, found.matched, Hold(found.matched))

    def _is_near(self, matched: Matched, pose: Floats) -> bool:
        """Whether both are one place; NaN is far."""
        return bool(np.linalg.norm(matched.pose[:3, 3] - pose[:3, 3]) < _APART * self._map.voxel)

    def _searched(self, sweep: Sweep, scan: Scan) -> _Found | None:
        """The place where the scan agrees best with the map's planes, of the best pose on each tile, if the search
        accepts it and no other place agrees nearly as well; or, if it does not, where all others agree far worse."""
        source = self._source(sweep)
        places = [place for tile in self._tiles if (place := self._on_tile(source, scan, tile)) is not None]
        if not places:
            return None
        best = max(places, key=lambda p: p.matched.score)
        there = [p for p in places if self._is_near(p.matched, best.matched.pose)]
        elsewhere = max((p.matched.score for p in places if p not in there), default=0.0)
        is_accepted = any(p.result.accepted for p in there)
        is_clear = elsewhere < (_AS_GOOD if is_accepted else _FAR_WORSE) * best.matched.score
        best = max(there, key=lambda p: (p.result.accepted, p.matched.score))
        return best if is_clear and best.matched.score >= _LEAST_SCORE else None

    def _source(self, sweep: Sweep) -> PreparedCloud:
        """What of a scan is searched for: as much as a tile may show."""
        assert self._measure is not None
        reach, points = self._measure.range / _BEYOND, np.asarray(sweep.points, float)
        near = points[((points**2).sum(axis=1) < reach**2) & (points != 0).any(axis=1)]  # NaN is far
        prepared = prepare_named(PointCloud(near, viewpoint=np.eye(4)), "cloud", self._threads, True)
        assert isinstance(prepared, PreparedCloud)  # points (N, 3)
        return prepared

    def _on_tile(self, source: PreparedCloud, scan: Scan, tile: PreparedCloud) -> _Found | None:
        """The best pose on a part of the map, and how the scan lies there on its planes."""
        # Not by points: a scan in which there are no surfaces has no place among those of a map.
        start = Start(None, searches=True, by_points=False)
        result = register_robust(source, tile, start, self._seed, self._threads, Clock())
        if result.evidence is None or result.evidence.strength < _LEAST_STRENGTH:
            return None
        guess, motion = result.T_target_source, SteadyMotion(self._map.voxel)
        matched = track(self._map, scan.all_at_once(), guess, motion, 1.0, is_rough=True)
        return _Found(result, matched) if Hold(matched).is_whole else None

    def _told(self, placed: Placed, found: _Found | None, clock: Clock) -> Floats | None:
        matched = placed.found
        points, agreement, steps = (0, 0.0, 0) if matched is None else (
            matched.points, matched.agreement, matched.iterations)
        self.results.append(Localization(
            placed.pose, self._pace.now, placed.reason, points, agreement, steps, clock.laps, placed.hold,
            placed.prediction, None if found is None else found.result,
        ))
        return placed.pose.copy() if np.isfinite(placed.pose).all() else None


def _are_alike(one: Measure, other: Measure) -> bool:
    ratios = one.voxel / other.voxel, one.range / other.range
    return all(1 / _ALIKE < ratio < _ALIKE for ratio in ratios)


def _as_map(map: PointCloud | ArrayLike | str | os.PathLike[str]) -> PointCloud:
    """The cloud of a map, without missing returns."""
    if isinstance(map, str | os.PathLike):
        map = read_cloud(map)
    cloud = map if isinstance(map, PointCloud) else PointCloud(as_points(map, "map"))
    cloud = cloud[np.isfinite(cloud.points).all(axis=1)]
    if len(cloud) < _FEWEST:
        raise ArgumentError(f"map must have at least {_FEWEST} points, but has {len(cloud)}")
    warn_of_lost_precision(cloud.points, np.array([cloud.points.min(axis=0), cloud.points.max(axis=0)]), "map")
    return cloud
