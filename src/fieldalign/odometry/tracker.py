"""Where a scan is placed on the map, and what is to be said of it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from ..fields.protocol import Floats
from .hold import Hold
from .local_map import LocalMap
from .measure import Measure, range_of
from .motion import SteadyMotion
from .reason import Tracking
from .scan import Rows, Scan, Sweep
from .track import Matched, track

_LEARNING = 6              # scans, from the first: little is known of the motion yet
_MISJUDGED, _UNUSUAL = 0.3, 2.0  # voxels, and usual errors: a prediction that was off by more than both may have misled
_AHEAD = (0, 1, 2, 4, 7, 12, 20)  # intervals: how far the sensor may have come where scans may be missing
_AS_GOOD = 0.9             # of the best score: of places that agree nearly as well, the first is the more likely
_LEAST_AGREEMENT = 0.3     # of the pseudo points on known surface; with less, a scan is lost
_LEAST_MET = 0.1           # of all pseudo points
_DOUBTFUL = 0.8            # of the usual agreement; with less, a scan may lie elsewhere
_DOUBTFUL_SPUN = 0.9       # where no clock tells of missing scans, and what is seen is straightened by the motion
_SPARSE = 0.3              # of the usual number of points
_EAGER = 0.1               # of the way that what is usual goes to the latest
_USUAL_SHARE, _LEAST_SHARE = 0.67, 0.33  # of the pseudo points, that have a plane
_PATIENCE = 5              # lost scans in a row, after which the map is begun anew
_MEAGRE = 0.3              # of the second scan's points: a first scan with less is none to begin with
_LOOKED = 10               # scans from one look at the range to the next
_EXPECTED = 3.0            # voxels: nearer to the prediction, a scan on a known map is where it should be
_USUAL = (Tracking.TRACKED, Tracking.STANDSTILL, Tracking.DEGENERATE)
_STILL = 0.01              # voxels: a sensor that moves by less stands still


@dataclass(frozen=True, eq=False)
class Placed:
    """A pose (4, 4), so many seconds after the last, what is to be said of it, and, where the scan was aligned, how and
    what holds it there.

    prediction: (6, 6), covariance of the predictions since all was held.
    """

    pose: Floats
    seconds: float
    reason: Tracking
    found: Matched | None = None
    hold: Hold | None = None
    prediction: Floats = field(default_factory=lambda: np.zeros((6, 6)))


class _Laid(NamedTuple):
    """Where a scan came to lie, the seconds that the way there took, and what is to be said of these."""

    found: Matched
    seconds: float
    event: Tracking


class Tracker:
    """The map and the motion, and the lengths of a drive."""

    def __init__(self, measure: Measure, before: Tracker | None = None) -> None:
        """before: what led here, where its map is given up."""
        self.measure = measure
        self.map = LocalMap(measure)
        self.motion = SteadyMotion(measure.voxel)
        self._held: Floats | None = None        # the twists that the last scan's surfaces held; None: all
        self._blind: Floats = np.zeros((6, 6))  # covariance of the predictions since all was held
        self._first: Scan | None = None
        self._scans = self._missed = 0          # scans in the map, and in a row since then those that are not
        self._points = self._agreement = 0.0    # what is usual
        self._met = _USUAL_SHARE
        self._is_first = before is None
        if before is not None:
            self.motion.pose, self.motion.velocity = before.motion.pose, before.motion.velocity
            self._blind = before._blind

    def stand(self, local: LocalMap, scan: Scan, found: Matched) -> None:
        """A map that is known, and where a scan was found on it."""
        self.map, self.motion.pose, self._first, self._points = local, found.pose, scan, len(scan.points)
        self._agreement, self._met = found.agreement, found.met / found.points
        self._scans = 2  # the first two scans of a map that begins are another matter

    def is_sure(self, placed: Placed) -> bool:
        """Whether a scan lies on a known map as usual, and not far from where it was expected."""
        found, seconds = placed.found, max(placed.seconds, 1e-9)
        if found is None or placed.reason not in _USUAL or found.met < _DOUBTFUL * self._met * found.points:
            return False
        return self.motion.surprise(placed.pose, seconds) < _EXPECTED * self.measure.voxel

    def is_worn(self, scan: Scan) -> bool:
        """Whether the map is to be begun anew with a scan: too many did not lie on it, or it has but one, which is far
        too little to begin with."""
        is_meagre = self._scans == 1 and self._points < _MEAGRE * len(scan.points)
        return not scan.is_empty and (self._missed >= _PATIENCE or is_meagre)

    def pseudo_points(self, on_planes: int) -> int:
        """How many it takes for so many to come to lie on planes of the map, as it was of late."""
        return round(on_planes / max(self._met, _LEAST_SHARE))

    def look_around(self, sweep: Sweep) -> None:
        """Now and then the range grows with what is seen."""
        if self._scans % _LOOKED == 0:
            self.measure = replace(self.measure, range=max(self.measure.range, range_of(sweep.points)))
            self.map.reach = self.measure.range

    def place(self, scan: Scan, seconds: float, interval: float, event: Tracking) -> Placed:
        """Where a scan lies, so many seconds after the last, where an interval is usual."""
        guess = self.motion.predicted(seconds)  # constant velocity
        if scan.is_empty:
            return self._unplaced(guess, seconds, Tracking.EMPTY)
        if self._first is None:
            return self._begun(scan, guess, seconds)
        laid = self._laid(scan, guess, seconds, interval, event)
        if self._held is not None or not Hold(laid.found).is_whole:  # again, with what is held now
            self._held = None if Hold(laid.found).is_whole else Hold(laid.found).held
            laid = self._laid(scan, guess, seconds, interval, event)
        found, hold, seconds = laid.found, Hold(laid.found), laid.seconds
        if found.agreement < _LEAST_AGREEMENT or found.met < _LEAST_MET * found.points:
            self._missed += 1
            return self._unplaced(guess, seconds, Tracking.LOST, found)
        self._blind = np.zeros((6, 6)) if hold.is_whole else self._blind + self.motion.covariance
        placed = Placed(found.pose, seconds, self._judged(scan, laid, hold), found, hold, self._blind)
        self._scans, self._missed = self._scans + 1, 0
        self._met += _EAGER * (found.met / found.points - self._met)
        self._points += _EAGER * (len(scan.points) - self._points)
        self._agreement += (_EAGER if self._agreement else 1.0) * (found.agreement - self._agreement)
        return placed

    def take(self, placed: Placed, scan: Scan) -> Rows | None:
        """The motion goes on to where a scan was placed, and the map, the target's field, grows by it: by these points
        (m, 4), as seen at once; None where the scan does not lie on it."""
        self.motion.follow(placed.pose, placed.seconds if placed.hold else None)
        if not placed.reason.is_on_map:
            return None
        points, sparse = scan.at_once(self.motion.velocity)
        self.map.add(points, sparse, placed.pose)
        return points

    def _begun(self, scan: Scan, guess: Floats, seconds: float) -> Placed:
        self._first, self._scans, self._points = scan, 1, len(scan.points)
        return Placed(guess, seconds, Tracking.FIRST if self._is_first else Tracking.RESTARTED, prediction=self._blind)

    def _laid(self, scan: Scan, guess: Floats, seconds: float, interval: float, event: Tracking) -> _Laid:
        """The scan on the map."""
        if self._scans == 1 and scan.is_timed:
            return _Laid(self._second(scan, guess, seconds), seconds, event)
        is_new = self._scans < _LEARNING
        found = track(self.map, scan, guess, self.motion, seconds, is_new, self._held)
        usual = max(_MISJUDGED * self.measure.voxel, _UNUSUAL * self.motion.spread)
        if not is_new and self.motion.surprise(found.pose, seconds) > usual:
            again = track(self.map, scan, guess, self.motion, seconds, True, self._held)
            found = max(found, again, key=lambda one: one.score)
        laid = _Laid(found, seconds, event)
        least = (_DOUBTFUL_SPUN if scan.is_spun else _DOUBTFUL) * self._agreement
        if self._missed or event is not Tracking.TRACKED or found.agreement < least:
            return self._sought(scan, laid, interval)
        return laid

    def _sought(self, scan: Scan, laid: _Laid, interval: float) -> _Laid:
        """The scan wherever along the predicted way it agrees best: scans may be missing, or the clock be wrong."""
        tried = [laid]
        for intervals in _AHEAD:
            seconds = max(intervals, 1) * interval
            guess = self.motion.predicted(intervals * interval)
            found = track(self.map, scan, guess, self.motion, seconds, True, self._held)
            said = laid.event if laid.event is not Tracking.GAP else Tracking.CLOCK_JUMPED
            tried.append(_Laid(found, seconds, Tracking.GAP if intervals > 1 else said))
        best = max(one.found.score for one in tried)
        return next(one for one in tried if one.found.score >= _AS_GOOD * best)

    def _second(self, scan: Scan, guess: Floats, seconds: float) -> Matched:
        """The second scan tells how fast the sensor moved in the first, which is then put into the map once more."""
        assert self._first is not None
        found = track(self.map, scan.all_at_once(), guess, self.motion, seconds, True)
        self.map = LocalMap(self.measure)
        self.map.add(*self._first.at_once(self.motion.between(found.pose, seconds)), self.motion.pose)
        return track(self.map, scan, found.pose, self.motion, seconds, False)

    def _unplaced(self, guess: Floats, seconds: float, reason: Tracking, found: Matched | None = None) -> Placed:
        self._blind = self._blind + self.motion.covariance
        return Placed(guess, seconds, reason, found, None, self._blind)

    def _judged(self, scan: Scan, laid: _Laid, hold: Hold) -> Tracking:
        if not hold.is_whole:
            return Tracking.DEGENERATE
        if laid.found.agreement < _DOUBTFUL * self._agreement:
            return Tracking.DOUBTFUL
        if laid.event is not Tracking.TRACKED:
            return laid.event
        if len(scan.points) < _SPARSE * self._points:
            return Tracking.SPARSE
        moved = self.motion.between(laid.found.pose, laid.seconds) * laid.seconds
        return Tracking.STANDSTILL if self.motion.size(moved) < _STILL * self.measure.voxel else Tracking.TRACKED
