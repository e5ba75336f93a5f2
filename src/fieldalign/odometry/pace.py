"""How long ago the last scan was, whatever the clock says."""

from __future__ import annotations

from collections import deque

from .reason import Tracking

_STANDS = 0.25    # of a sweep: times that advance by less are counted from each sweep's own beginning
_GAP = 1.5        # intervals: scans are missing between two that are farther apart
_LONGEST = 100    # intervals: no gap is longer; the clock jumped
_REMEMBERED = 9   # differences between stamps, whose middle is the interval


class Pace:
    """The time from scan to scan: by the clock; where it stands, by the sweep's length; without both, 1 a scan.

    interval: the usual time between scans. now: of the last scan, by a clock that never jumps.
    """

    def __init__(self) -> None:
        self.interval, self.now = 1.0, 0.0
        self._last: float | None = None
        self._ahead = 0.0  # `now`, of the clock
        self._differences: deque[float] = deque(maxlen=_REMEMBERED)
        self._has_begun = False

    def advance(self, stamp: float | None, span: float) -> tuple[float, Tracking]:
        """Seconds since the last scan, and whether they are the usual ones: TRACKED, GAP or CLOCK_JUMPED.

        stamp: when the scan was taken, or None. span: how long it took, 0 where that is not known.
        """
        if not self._differences and span > 0:
            self.interval = span
        last, self._last = self._last, stamp
        if stamp is None or last is None:
            elapsed, event = self.interval if self._has_begun else 0.0, Tracking.TRACKED
        else:
            elapsed, event = self._elapsed(stamp - last, span)
        if stamp is not None and (not self._has_begun or (last is not None and elapsed == stamp - last)):
            self.now = stamp + self._ahead
        else:
            self.now += elapsed
            self._ahead = self.now - (stamp or 0.0)
        self._has_begun = True
        return elapsed, event

    def _elapsed(self, difference: float, span: float) -> tuple[float, Tracking]:
        """Of two stamps that differ by so much."""
        if abs(difference) < _STANDS * span:
            return self.interval, Tracking.TRACKED
        if difference <= 0 or (self._differences and difference > _LONGEST * self.interval):
            return self.interval, Tracking.CLOCK_JUMPED
        is_gap = bool(self._differences) and difference > _GAP * self.interval
        self._differences.append(difference)
        self.interval = sorted(self._differences)[(len(self._differences) - 1) // 2]
        return difference, Tracking.GAP if is_gap else Tracking.TRACKED
