"""Whether, and how, a sensor spins while it moves, told by its scans alone where no point says when it was seen.

A scan that was seen on the way is bent: it lies on a map of straightened scans only where all are straightened rightly.
So where a drive begins to move, trackers race. The odometry's own takes scans as they are, the others straighten them
as if the sensor spun either way, from one of some azimuths on. The one whose scans lie nearest to its map is right.
"""

from __future__ import annotations

from math import log, pi, sqrt

import numpy as np

from ..fields.protocol import Floats
from .reason import Tracking
from .scan import Scan
from .spin import Spin
from .tracker import Placed, Tracker

SPINS = tuple(Spin(turns, begins * pi / 4) for turns in (-1, 1) for begins in range(-3, 5))
_WARM = 4         # scans, until there are maps to lie on
_FEWEST = 20      # scans after these, before which nothing is said
_MOST = 80        # after so many, nothing will tell whether the sensor spins
_LONGEST = 400    # and after so many, where its sweep begins: on a straight way at a steady speed, nothing does
_SURE = 5.0       # standard errors by which the others are worse


class Race:
    """Trackers beside the odometry's own, begun where it is; one for each spin.

    leader: the spin that the odometry is to go by: None where scans are to be taken as they are, or nothing tells yet.
    pace: of the sensor when it began. is_over: whether nothing more will be told.
    """

    def __init__(self, tracker: Tracker, pace: float) -> None:
        self.leader: Spin | None = None
        self.pace, self.is_over = pace, False
        self._racers = {spin: Tracker(tracker.measure, tracker) for spin in SPINS}
        self._off: dict[Spin | None, list[float]] = {spin: [] for spin in (None, *SPINS)}
        self._scans = 0

    def step(self, scan: Scan, placed: Placed, seconds: float, interval: float, is_moving: bool) -> Tracker | None:
        """The next scan, as it came, so many seconds after the last, and where the odometry's own tracker has it. It
        counts where the sensor moves. Answers with the tracker that is to be the odometry's own from now on."""
        self._scans += 1
        found: dict[Spin | None, Placed] = {self.leader: placed}
        for spin, racer in self._racers.items():
            seen = scan.seen_by(spin, interval)
            found[spin] = racer.place(seen, seconds, interval, Tracking.TRACKED)
            racer.take(found[spin], seen)
        if not is_moving or self._scans <= _WARM:
            return None
        for told, there in found.items():
            self._off[told].append(_off(there))
        return self._judged(len(self._off[self.leader]))

    def _judged(self, scans: int) -> Tracker | None:
        """Those that are surely worse than the best one are out. It takes over, when the leader is."""
        if scans < _FEWEST:
            return None
        best = min(self._off, key=lambda spin: sum(self._off[spin]))
        worse = {spin: _certainty(off, self._off[best]) for spin, off in self._off.items()}
        taking = self._racers.pop(best) if best is not None and worse[self.leader] > _SURE else None
        leader = self.leader if taking is None else best
        self._off = {spin: off for spin, off in self._off.items() if spin == leader or worse[spin] < _SURE}
        self._racers = {spin: racer for spin, racer in self._racers.items() if spin in self._off}
        self.leader = leader
        self.is_over = not self._racers or scans >= (_MOST if leader is None else _LONGEST)
        return taking


def _off(placed: Placed) -> float:
    """How far a scan is from its map: by the median of its distances, which tells bends, and by their mean, which tells
    where a sweep begins; on a scale of logarithms."""
    found = placed.found
    if found is None or not found.met:
        return 0.0
    return 0.5 * (log(max(found.middle, 1e-300)) + log(max(found.away / found.met, 1e-300)))


def _certainty(one: list[float], other: list[float]) -> float:
    """By how many standard errors one is farther off than another, scan by scan; 0 for itself."""
    differences: Floats = np.subtract(one, other)
    error = float(differences.std()) / sqrt(len(differences))
    return float(differences.mean()) / error if error > 0 else 0.0
