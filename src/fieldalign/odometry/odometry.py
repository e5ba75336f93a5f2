"""Odometry: a stream of scans in, the pose of each out."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..clock import Clock
from ..clouds.cloud import PointCloud
from ..errors import ArgumentError
from ..fields.protocol import Floats
from ..motions import exp_twist
from .measure import measure_of
from .pace import Pace
from .reason import Tracking
from .result import OdometryResult
from .scan import Scan, Sweep, sweep_of, thin_scan
from .settings import OdometrySettings
from .tracker import Placed, Tracker


class Odometry:
    """Poses of a sensor that moves, scan by scan; the world is the frame of the first scan.

    settings: an OdometrySettings, of which nothing has to be chosen. deskew: whether points are carried to one moment,
    where their times are known.

    last: what is known of the latest pose, an OdometryResult; None before the first step. stamps, poses: of all steps
    so far, each pose (4, 4).
    """

    def __init__(self, settings: OdometrySettings | None = None, *, deskew: bool = True) -> None:
        if not isinstance(settings, OdometrySettings | None):
            raise ArgumentError(f"settings must be an OdometrySettings or None, but is {settings!r}")
        self.settings, self.deskew = settings or OdometrySettings(), bool(deskew)
        self.last: OdometryResult | None = None
        self.stamps: list[float] = []
        self.poses: list[Floats] = []
        self._pace = Pace()
        self._tracker: Tracker | None = None

    @property
    def trajectory(self) -> tuple[Floats, Floats]:
        """The stamps (n,) and the poses (n, 4, 4) so far."""
        return np.array(self.stamps), np.array(self.poses).reshape(-1, 4, 4)

    @property
    def map(self) -> PointCloud:
        """The map around the sensor: a point with its normal for each plane, in the frame of the world."""
        return PointCloud(np.zeros((0, 3))) if self._tracker is None else self._tracker.map.cloud()

    def step(
        self, cloud: PointCloud | ArrayLike, times: ArrayLike | None = None, stamp: float | None = None
    ) -> Floats:
        """The pose (4, 4) world_from_sensor of the next scan.

        cloud: a PointCloud or points (N, 3), in the sensor's frame; rows that are not finite are missing returns.
        times: (N,), seconds, when each point was seen (or the cloud's own): on any clock, or counted from the stamp or
            from each sweep's beginning. With them the scan is deskewed: carried to the middle of the sweep.
        stamp: seconds, the moment that the pose is for; None: the middle of the sweep.

        Raises ArgumentError for arrays of a wrong shape. A scan without points raises nothing: `last` says so.
        """
        clock = Clock()
        sweep = sweep_of(cloud, times, stamp)
        elapsed, event = self._pace.advance(sweep.middle, sweep.span)
        tracker = self._tracker or self._begun(sweep)
        if tracker is None:
            return self._told(Placed(np.eye(4), elapsed, Tracking.EMPTY), sweep, clock)
        tracker.look_around(sweep)
        scan = self._thinned(sweep, tracker)
        if tracker.is_worn(scan):
            tracker = self._begun(sweep) or tracker
            scan = self._thinned(sweep, tracker)
        clock.lap("thin")
        placed = tracker.place(scan, elapsed, self._pace.interval, event)     # Gauss-Newton (eq. 11 to 16)
        clock.lap("align")
        tracker.motion.follow(placed.pose, placed.seconds if placed.hold else None)
        if placed.reason.is_on_map:
            tracker.map.add(*scan.at_once(tracker.motion.velocity), placed.pose)  # the target's field has grown
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
            ahead = sweep.stamp - sweep.middle
            pose, now = pose @ exp_twist(ahead * self._tracker.motion.velocity), now + ahead
        found = placed.found
        self.last = OdometryResult(
            pose, now, placed.reason, 0 if found is None else found.points, 0.0 if found is None else found.agreement,
            0 if found is None else found.iterations, clock.laps, placed.hold, placed.prediction,
        )
        self.stamps.append(now)
        self.poses.append(pose)
        return pose.copy()
