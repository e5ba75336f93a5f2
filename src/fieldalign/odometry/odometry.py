"""Odometry: a stream of scans in, the pose of each out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ..clock import Clock
from ..clouds.cloud import PointCloud
from ..errors import ArgumentError
from ..fields.protocol import Floats
from ..motions import exp_twist
from .keyframes import Keyframe, Keyframes, fused
from .measure import measure_of
from .pace import Pace
from .reason import Tracking
from .result import OdometryResult
from .scan import Scan, Sweep, sweep_of, thin_scan
from .settings import OdometrySettings
from .tracker import Placed, Tracker
from .trajectory import Trajectory


class Odometry:
    """Poses of a sensor that moves, scan by scan; the world is the frame of the first scan.

    settings: an OdometrySettings, of which nothing has to be chosen. deskew: whether points are carried to one moment,
    where their times are known. whole: whether the map of the whole drive is kept, not only what is around the sensor;
    `fa.close_loops` asks for it.

    results: what is known of the pose of each step so far, OdometryResults. last: the latest; None before the first.
    """

    def __init__(
        self, settings: OdometrySettings | None = None, *, deskew: bool = True, whole: bool = False
    ) -> None:
        if not isinstance(settings, OdometrySettings | None):
            raise ArgumentError(f"settings must be an OdometrySettings or None, but is {settings!r}")
        self.settings, self.deskew = settings or OdometrySettings(), bool(deskew)
        self.results: list[OdometryResult] = []
        self._pace, self._ahead = Pace(), 0.0  # seconds from a sweep's stamp to its middle
        self._tracker: Tracker | None = None
        self._keyframes = Keyframes() if whole else None

    @property
    def last(self) -> OdometryResult | None:
        """What is known of the latest pose."""
        return self.results[-1] if self.results else None

    @property
    def trajectory(self) -> Trajectory:
        """The stamps, poses and covariances so far; they are worked out here."""
        steps, n = self.results, len(self.results)
        return Trajectory(
            np.array([step.stamp for step in steps]), np.reshape([step.pose for step in steps], (n, 4, 4)),
            np.reshape([step.covariance for step in steps], (n, 6, 6)),
        )

    @property
    def map(self) -> PointCloud:
        """The map around the sensor, or of the whole drive: a point with its normal for each voxel, in the frame of the
        world."""
        if self._tracker is None:
            return PointCloud(np.zeros((0, 3)))
        return self._tracker.map.cloud() if self._keyframes is None else fused(self.keyframes)

    @property
    def keeps_all(self) -> bool:
        """Whether the map of the whole drive is kept."""
        return self._keyframes is not None

    @property
    def keyframes(self) -> list[Keyframe]:
        """What is kept of the whole drive, up to the latest step; empty where that was not asked for."""
        return [] if self._keyframes is None else self._keyframes.with_last()

    def step(
        self, cloud: PointCloud | ArrayLike | None, times: ArrayLike | None = None, stamp: float | None = None
    ) -> Floats:
        """The pose (4, 4) world_from_sensor of the next scan.

        cloud: a PointCloud or points (N, 3), in the sensor's frame; rows that are not finite are missing returns. None:
            the scan is missing, and the pose is the prediction.
        times: (N,), seconds, when each point was seen (or the cloud's own): on any clock, or counted from the stamp or
            from each sweep's beginning. With them the scan is deskewed: carried to the middle of the sweep.
        stamp: seconds, the moment that the pose is for; None: the middle of the sweep.

        Raises ArgumentError for arrays of a wrong shape. A scan without points raises nothing: `last` says so.
        """
        clock = Clock()
        sweep = sweep_of(cloud, times, stamp, self._ahead)
        elapsed, event = self._pace.advance(sweep.middle, sweep.span)
        tracker = self._tracker or self._begun(sweep)
        if tracker is None:
            return self._told(Placed(np.eye(4), elapsed, _nothing(sweep)), sweep, clock)
        tracker.look_around(sweep)
        scan = self._thinned(sweep, tracker)
        if tracker.is_worn(scan):
            tracker = self._begun(sweep) or tracker
            scan = self._thinned(sweep, tracker)
        clock.lap("thin")
        placed = tracker.place(scan, elapsed, self._pace.interval, event)     # Gauss-Newton (eq. 11 to 16)
        if placed.reason is Tracking.EMPTY:
            placed = replace(placed, reason=_nothing(sweep))
        clock.lap("align")
        tracker.motion.follow(placed.pose, placed.seconds if placed.hold else None)
        if placed.reason.is_on_map:
            points, sparse = scan.at_once(tracker.motion.velocity)
            tracker.map.add(points, sparse, placed.pose)                      # the target's field has grown
            if self._keyframes is not None:
                self._keyframes.follow(len(self.results), placed.pose, points, tracker.map)
        clock.lap("map")
        return self._told(placed, sweep, clock)

    def _thinned(self, sweep: Sweep, tracker: Tracker) -> Scan:
        wanted = tracker.pseudo_points(self.settings.pseudo_points)
        return thin_scan(sweep, tracker.measure, self.settings.points, wanted, self.deskew)

    def _begun(self, sweep: Sweep) -> Tracker | None:
        """A tracker, begun with a scan that tells the lengths of the drive; it goes on from the one before."""
        measure = measure_of(sweep.points, self.settings.voxel)
        if measure is not None:
            self._tracker = Tracker(measure, self._tracker)
        return self._tracker

    def _told(self, placed: Placed, sweep: Sweep, clock: Clock) -> Floats:
        """The pose, at the moment that was asked for, after it was written down."""
        pose, now = placed.pose, self._pace.now
        if self._tracker is not None and sweep.middle is not None and sweep.stamp not in (None, sweep.middle):
            self._ahead, ahead = sweep.middle - sweep.stamp, sweep.stamp - sweep.middle
            pose, now = pose @ exp_twist(ahead * self._tracker.motion.velocity), now + ahead
        found = placed.found
        self.results.append(OdometryResult(
            pose, now, placed.reason, 0 if found is None else found.points, 0.0 if found is None else found.agreement,
            0 if found is None else found.iterations, clock.laps, placed.hold, placed.prediction,
        ))
        return pose.copy()


def _nothing(sweep: Sweep) -> Tracking:
    """What is to be said of a scan with hardly any points."""
    return Tracking.MISSING if sweep.is_missing else Tracking.EMPTY
