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
from .race import Race
from .reason import Tracking
from .record import Record
from .result import OdometryResult
from .scan import Scan, Sweep, sweep_of, thin_scan
from .settings import OdometrySettings
from .spin import Spin
from .tracker import Placed, Tracker
from .trajectory import Trajectory

_MOVES = 0.2  # voxels a scan: slower, scans are hardly bent
_STEADY = Tracking.TRACKED, Tracking.STANDSTILL, Tracking.DOUBTFUL, Tracking.SPARSE


class Odometry:
    """Poses of a sensor that moves, scan by scan; the world is the frame of the first scan.

    settings: an OdometrySettings, of which nothing has to be chosen. deskew: whether points are carried to one moment:
    by their times or, where they have none, by how the scans themselves tell that the sensor spins; False: scans are
    taken as they are. whole: whether the map of the whole drive is kept, not only what is around the sensor;
    `fa.close_loops` asks for it.

    spin: how the sensor spins, where points come without times and the scans have told it; None otherwise.
    results: what is known of the poses of the latest 1000 steps, OdometryResults. last: of the latest; None before the
    first.
    """

    def __init__(
        self, settings: OdometrySettings | None = None, *, deskew: bool = True, whole: bool = False
    ) -> None:
        if not isinstance(settings, OdometrySettings | None):
            raise ArgumentError(f"settings must be an OdometrySettings or None, but is {settings!r}")
        self.settings, self.deskew = settings or OdometrySettings(), bool(deskew)
        self.spin: Spin | None = None
        self._record = Record()
        self._pace, self._ahead = Pace(), 0.0  # seconds from a sweep's stamp to its middle
        self._tracker: Tracker | None = None
        self._keyframes = Keyframes() if whole else None
        self._race: Race | None = None
        self._raced = 0.0  # voxels a scan, at which the last race was begun that told nothing

    @property
    def last(self) -> OdometryResult | None:
        """What is known of the latest pose."""
        return self._record.latest[-1] if self._record.latest else None

    @property
    def results(self) -> list[OdometryResult]:
        """What is known of the poses of the latest 1000 steps."""
        return list(self._record.latest)

    @property
    def trajectory(self) -> Trajectory:
        """The stamps, poses and covariances of all steps so far."""
        return self._record.trajectory

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
            from each sweep's beginning. With them the scan is deskewed: carried to the middle of the sweep. Without,
            the first scans in motion tell whether the sensor spins, and the later ones are deskewed by that.
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
        seen = self._spun(scan)
        clock.lap("thin")
        placed = tracker.place(seen, elapsed, self._pace.interval, event)     # Gauss-Newton (eq. 11 to 16)
        if placed.reason is Tracking.EMPTY:
            placed = replace(placed, reason=_nothing(sweep))
        clock.lap("align")
        points = tracker.take(placed, seen)                                   # the target's field has grown
        if self._keyframes is not None and points is not None:
            self._keyframes.follow(len(self._record), placed.pose, points, tracker.map)
        clock.lap("map")
        if self.deskew and sweep.times is None:
            self._learn_spin(tracker, scan, placed)
            clock.lap("spin")
        return self._told(placed, sweep, clock)

    def _thinned(self, sweep: Sweep, tracker: Tracker) -> Scan:
        wanted = tracker.pseudo_points(self.settings.pseudo_points)
        return thin_scan(sweep, tracker.measure, self.settings.points, wanted, self.deskew)

    def _spun(self, scan: Scan) -> Scan:
        """The scan, with times where it has none and they are known from how the sensor spins."""
        if self.spin is None or scan.is_timed or not self.deskew:
            return scan
        return scan.seen_by(self.spin, self._pace.interval)

    def _learn_spin(self, tracker: Tracker, scan: Scan, placed: Placed) -> None:
        """Whether scans without times are bent, and how: a race tells, once the sensor moves. Where it told nothing,
        there is another one once the sensor moves twice as fast."""
        pace = tracker.motion.size(tracker.motion.velocity) * self._pace.interval / tracker.measure.voxel
        if placed.reason not in _STEADY:
            self._race = None
        elif self._race is None and self.spin is None and pace > max(_MOVES, 2 * self._raced):
            self._race = Race(tracker, pace)
        elif self._race is not None:
            taking = self._race.step(scan, placed, placed.seconds, self._pace.interval, pace > _MOVES)
            self._tracker, self.spin = taking or tracker, self._race.leader
            if self._race.is_over:
                self._raced, self._race = self._race.pace, None

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
        self._record.add(OdometryResult(
            pose, now, placed.reason, 0 if found is None else found.points, 0.0 if found is None else found.agreement,
            0 if found is None else found.iterations, clock.laps, placed.hold, placed.prediction,
        ))
        return pose.copy()


def _nothing(sweep: Sweep) -> Tracking:
    """What is to be said of a scan with hardly any points."""
    return Tracking.MISSING if sweep.is_missing else Tracking.EMPTY
