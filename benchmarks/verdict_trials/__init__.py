"""The trials that the verdict is judged by: right pairs, and everything that must never be accepted.

    from verdict_trials import trials
    for trial in trials(seed=0):
        source, target, T_true, tolerance, init, ask = trial.make()

T_true is None where no pose is right: the clouds do not meet, a reflection lies between them, or the data cannot tell
their poses apart. Clouds are made when they are asked for, from the seed and the trial's name alone. Where the sensor's
place is known, a part of the trials tells it (PointClouds with a viewpoint); the rest are plain arrays.

Scenes are cut into two halves for good: thresholds may be chosen on "fit", figures count on "report". No trial mixes
the two.
"""

from __future__ import annotations

from .right import changed, right_pairs
from .shapes import degenerate, periodic, symmetric
from .trial import REGISTER, VERIFY, Trial, evenly, points_of
from .wrong import crossed, mirrored, of_one, opposite_ends, pushed, similar_rooms

__all__ = ["REGISTER", "VERIFY", "Trial", "evenly", "points_of", "trials"]


def trials(seed: int = 0, scale: float = 1.0) -> list[Trial]:
    """All trials of a seed, scale: the share of each kind that is kept."""
    right = right_pairs()
    kinds = (
        right,
        changed(),
        crossed(1250, seed),
        similar_rooms(80, seed),
        of_one("ends", opposite_ends, 350, seed),
        of_one("mirrored", mirrored, 420, seed),
        pushed("pushed", REGISTER, right, 600, seed),
        pushed("pushed, verify", VERIFY, right, 300, seed),
        periodic(20),
        symmetric(6),
        degenerate(2),
    )
    return [trial for kind in kinds for trial in evenly(kind, round(scale * len(kind)))]
