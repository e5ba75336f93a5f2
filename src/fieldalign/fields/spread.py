"""Places on a surface that is known by its distance alone: from them come surfels and pseudo points."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..errors import FieldError
from .protocol import DistanceField, Floats, HasSpread, bounds_of, newton_foot, sampled

_FIRST = 16     # cells along the longest edge of the box
_STRAY = 1.2    # half diagonals of a cell: if the surface is nearer, by what is nearly a distance, it may cross
_STEPS = 3      # to the foot, its foot, and so on: what is nearly a distance leads near the surface only
_ON = 0.1       # of a cell's edge: a place so near the surface lies on it
_MOST = 2**22   # cells: a field that is near a surface everywhere has none


def spread_over(field: DistanceField, count: int) -> Floats:
    """About `count` places (n, 3) on a field's surface, spread evenly; the same at every call.

    Raises FieldError where there is no surface within the field's bounds.
    """
    if isinstance(field, HasSpread):
        return field.spread(count)
    return spread_by(
        lambda x: sampled(field, x).value,
        lambda x: sampled(field, x).gradient,
        bounds_of(field), count, type(field).__name__,
    )


def spread_by(
    values: Callable[[Floats], Floats], gradients: Callable[[Floats], Floats], bounds: Floats, count: int, name: str
) -> Floats:
    """About `count` places (n, 3) on the surface in a box (2, 3), from a distance and its gradient.

    Cells of the box that the surface may cross are halved until they are `count`; the feet of some of their centres,
    which lie evenly along the surface, are the places. name: of the field, for errors.
    """
    centres, edge = _cells_near(values, bounds, count, name)
    # They are in the order of an octree's leaves, so that a part of them, taken evenly, lies evenly in space.
    places = centres[np.linspace(0, len(centres), min(count, len(centres)), endpoint=False, dtype=int)]
    found, downhill = values(places), gradients(places)
    for _ in range(_STEPS):  # by one gradient: it costs as much as several values
        places = newton_foot(places, found, downhill)
        found = values(places)
    places = places[np.abs(found) <= _ON * edge]
    if len(places) < 3:
        raise FieldError(f"{name} has no surface within its bounds that its gradient leads to")
    return places


def _cells_near(
    values: Callable[[Floats], Floats], bounds: Floats, count: int, name: str
) -> tuple[Floats, float]:
    """Centres (n, 3) of at least `count` cells that the surface may cross, and their edge."""
    low, high = bounds
    edge = float((high - low).max()) / _FIRST
    if not edge > 0:
        raise FieldError(f"{name} has bounds without an extent: {low} to {high}")
    numbers = np.maximum(np.ceil((high - low) / edge).astype(int), 1)
    centres = low + (np.indices(numbers).reshape(3, -1).T + 0.5) * edge
    found = values(centres)
    reach = _STRAY * np.sqrt(3) / 2 * _steepness(found.reshape(numbers), edge)
    octants = (np.indices((2, 2, 2)).reshape(3, -1).T - 0.5) / 2
    while True:
        centres = centres[np.abs(found) <= reach * edge]
        if not 0 < len(centres) <= _MOST:
            raise FieldError(f"{name} has no surface within its bounds, {low} to {high}")
        if len(centres) >= count:
            return centres, edge
        centres = (centres[:, None] + edge * octants).reshape(-1, 3)
        edge /= 2
        found = values(centres)


def _steepness(values: Floats, edge: float) -> float:
    """By what factor values on a grid change faster than a distance would, at least 1."""
    changes = np.stack([np.diff(values, axis=axis, append=values.take([-1], axis)) for axis in range(3)])
    return max(1.0, float(np.linalg.norm(changes, axis=0).max()) / edge)
