"""What is to be said of a step."""

from __future__ import annotations

from enum import Enum


class Tracking(Enum):
    """What a step of odometry came to; str() is a sentence."""

    FIRST = "first"
    TRACKED = "tracked"
    FOUND = "found"
    STANDSTILL = "standstill"
    SPARSE = "sparse"
    GAP = "gap"
    CLOCK_JUMPED = "clock_jumped"
    DOUBTFUL = "doubtful"
    RESTARTED = "restarted"
    DEGENERATE = "degenerate"
    LOST = "lost"
    EMPTY = "empty"
    MISSING = "missing"
    UNPLACED = "unplaced"

    def __str__(self) -> str:
        return _SENTENCES[self]

    @property
    def is_tracked(self) -> bool:
        """Whether the scan itself tells the pose, all of it; otherwise (part of) it is the prediction's."""
        return self.is_on_map and self not in (Tracking.DEGENERATE, Tracking.RESTARTED)

    @property
    def is_on_map(self) -> bool:
        """Whether the scan was laid on the map, and has entered it."""
        return self not in (Tracking.LOST, Tracking.EMPTY, Tracking.MISSING, Tracking.UNPLACED)


_SENTENCES = {
    Tracking.FIRST: "The first scan: its frame is the world's.",
    Tracking.TRACKED: "Tracked: the scan lies on the map.",
    Tracking.FOUND: "Found: the search in all of the map accepted this place, without a guess.",
    Tracking.STANDSTILL: "Tracked: the sensor stands still.",
    Tracking.SPARSE: "Tracked, though the scan has far fewer points than those before it.",
    Tracking.GAP: "Tracked after a gap: scans between the last one and this one are missing.",
    Tracking.CLOCK_JUMPED: "Tracked, though the clock jumped: the scan was taken to follow the last one as usual.",
    Tracking.DOUBTFUL: "Doubtful: far less of the scan agrees with the map than usual; it may lie elsewhere.",
    Tracking.RESTARTED: "Begun anew: too many scans did not lie on the map; a new one begins where the sensor was "
    "thought to be.",
    Tracking.DEGENERATE: "Degenerate: the scan may slide or turn on the map without a difference; that part of the "
    "motion is the prediction's.",
    Tracking.LOST: "Lost: the scan does not lie on the map near where it was expected; the pose is the prediction, "
    "and the map was left as it is.",
    Tracking.EMPTY: "Empty: the scan has hardly any points; the pose is the prediction, and the map was left as it is.",
    Tracking.MISSING: "Missing: there is no scan; the pose is the prediction.",
    Tracking.UNPLACED: "Unplaced: the search in all of the map found no place that it could accept; there is no pose.",
}
