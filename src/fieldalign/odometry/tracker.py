"""Where a scan is placed on the map, and what is to be said of it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..fields.protocol import Floats
from .hold import Hold
from .local_map import LocalMap
from .measure import Measure, range_of
from .motion import SteadyMotion
from .reason import Tracking
from .scan import Scan, Sweep
from .track import Matched, track

_LEARNING = 6           # scans, from the first: little is known of the motion yet
_MISJUDGED, _UNUSUAL = 0.3, 2.0  # voxels, and usual errors: a prediction that was off by more than both may have misled
_LEAST_AGREEMENT = 0.3  # of the pseudo points on known surface; with less, a scan is lost
_LEAST_MET = 0.1        # of all pseudo points
_SPARSE = 0.3           # of the usual number of points
_EAGER = 0.1            # of the way that the usual number goes to the latest
_LOOKED = 10            # scans from one look at the range to the next
_STILL = 0.01           # voxels: a sensor that moves by less stands still


@dataclass(frozen=True, eq=False)
class Placed:
    """A pose (4, 4), what is to be said of it, and, where the scan was aligned, how and what holds it there.

    prediction: (6, 6), covariance of the predictions since all was held.
    """

    pose: Floats
    reason: Tracking
    found: Matched | None = None
    hold: Hold | None = None
    prediction: Floats = field(default_factory=lambda: np.zeros((6, 6)))


class Tracker:
    """The map and the motion, and the lengths of a drive."""

    def __init__(self, measure: Measure) -> None:
        self.measure = measure
        self.map = LocalMap(measure)
        self.motion = SteadyMotion(measure.voxel)
        self._held: Floats | None = None  # the twists that the last scan's surfaces held; None: all
        self._blind: Floats = np.zeros((6, 6))
        self._first: Scan | None = None
        self._is_adrift = False
        self._scans, self._usual = 0, 0.0

    def look_around(self, sweep: Sweep) -> None:
        """Now and then the range grows with what is seen."""
        if self._scans % _LOOKED == 0:
            self.measure = replace(self.measure, range=max(self.measure.range, range_of(sweep.points)))
            self.map.reach = self.measure.range

    def place(self, scan: Scan, guess: Floats, seconds: float, event: Tracking) -> Placed:
        """Where a scan lies, so many seconds after the last, near a guess (4, 4)."""
        if scan.is_empty:
            return self._unplaced(guess, Tracking.EMPTY)
        self._scans += 1
        if self._scans == 1:
            self._first, self._usual = scan, len(scan.points)
            return Placed(guess, Tracking.FIRST)
        found = self._laid(scan, guess, seconds, event)
        hold = Hold(found)
        if not hold.is_whole or self._held is not None:  # again, with what is held now
            self._held = None if hold.is_whole else hold.held
            found = self._laid(scan, guess, seconds, event)
            hold = Hold(found)
        if found.agreement < _LEAST_AGREEMENT or found.met < _LEAST_MET * found.points:
            return self._unplaced(guess, Tracking.LOST, found)
        self._is_adrift = False
        self._blind = np.zeros((6, 6)) if hold.is_whole else self._blind + self.motion.covariance
        reason = self._judged(scan, found, hold, event, seconds)
        self._usual += _EAGER * (len(scan.points) - self._usual)
        return Placed(found.pose, reason, found, hold, self._blind)

    def _laid(self, scan: Scan, guess: Floats, seconds: float, event: Tracking) -> Matched:
        """The scan on the map; where the guess may be far off, from others, too, whichever agrees best."""
        if self._scans == 2 and scan.is_timed:
            return self._second(scan, guess, seconds)
        is_rough = self._scans <= _LEARNING or self._is_adrift or event is not Tracking.TRACKED
        guesses = [guess]
        if event is not Tracking.TRACKED or self._is_adrift:
            guesses += [self.motion.pose]
        tried = [track(self.map, scan, start, self.motion, seconds, is_rough, self._held) for start in guesses]
        usual = max(_MISJUDGED * self.measure.voxel, _UNUSUAL * self.motion.spread)
        if not is_rough and self.motion.surprise(tried[0].pose, seconds) > usual:
            tried.append(track(self.map, scan, guess, self.motion, seconds, True, self._held))
        return max(tried, key=lambda one: one.on)

    def _second(self, scan: Scan, guess: Floats, seconds: float) -> Matched:
        """The second scan tells how fast the sensor moved in the first, which is then put into the map once more."""
        assert self._first is not None
        found = track(self.map, scan.all_at_once(), guess, self.motion, seconds, True)
        self.map = LocalMap(self.measure)
        self.map.add(*self._first.at_once(self.motion.between(found.pose, seconds)), self.motion.pose)
        return track(self.map, scan, found.pose, self.motion, seconds, False)

    def _unplaced(self, guess: Floats, reason: Tracking, found: Matched | None = None) -> Placed:
        self._is_adrift = True
        self._blind = self._blind + self.motion.covariance
        return Placed(guess, reason, found, None, self._blind)

    def _judged(self, scan: Scan, found: Matched, hold: Hold, event: Tracking, seconds: float) -> Tracking:
        if not hold.is_whole:
            return Tracking.DEGENERATE
        if event is not Tracking.TRACKED:
            return event
        if len(scan.points) < _SPARSE * self._usual:
            return Tracking.SPARSE
        moved = self.motion.between(found.pose, seconds) * seconds
        return Tracking.STANDSTILL if self.motion.size(moved) < _STILL * self.measure.voxel else Tracking.TRACKED
