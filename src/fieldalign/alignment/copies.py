"""Two copies of one cloud: the points themselves can meet, to the last digits."""

from __future__ import annotations

import numpy as np

from ..fields import PointField
from ..fields.protocol import Floats
from ..motions import apply, best_motion

_ROUNDS = 20
_MET = 1e-3  # of the distance between neighbouring points: so close, the nearest point is the point itself


def meet(held: PointField, places: Floats, pose: Floats) -> Floats | None:
    """The motion (4, 4) that lays places (M, 3) of a copy on the held points, from a pose that nearly does. None where
    the places do not meet points: the clouds are no copies."""
    spacing = float(np.median(held.spacing(held.spread(1000))))
    pose, typical = closest(held, places, pose)
    return pose if typical < _MET * spacing else None


def closest(held: PointField, places: Floats, pose: Floats) -> tuple[Floats, float]:
    """The motion (4, 4) that lays places (M, 3) near to the held points, and their median distance, a length.

    Closest points, and the motion between them in closed form (Kabsch, Acta Cryst. A 1976), until nothing changes.
    """
    last, place = np.inf, None
    for _ in range(_ROUNDS):
        moved = apply(pose, places)
        sample = held.sample(moved, place)
        place, typical = sample.place, float(np.median(sample.value))
        if not typical < last:
            break
        near = sample.value <= 3 * typical
        pose, last = best_motion(places[near], sample.foot[near]), typical
    return pose, last
