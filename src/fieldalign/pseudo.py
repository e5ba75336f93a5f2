"""The third set: pseudo points, drawn once in the target's frame; nothing else moves during a registration."""

from __future__ import annotations

import numpy as np

from .errors import ArgumentError
from .fields import DistanceField, PointField, sampled, spread_over
from .fields.protocol import Floats
from .settings import Settings

_CHOICE = 5  # places on a surface for each that is drawn


def draw_pseudo_points(target: DistanceField, centre: Floats, settings: Settings, seed: int) -> Floats:
    """L pseudo points (L, 3) near the target's surface, or around its centre (paper Sec. V-E, V-H, V-I)."""
    if settings.pseudo_points is not None:
        return np.asarray(settings.pseudo_points, float)
    rng = np.random.default_rng(seed)
    if settings.pseudo_set == "uniform":
        return centre + rng.uniform(-settings.half_width, settings.half_width, (settings.pseudo_count, 3))
    if settings.pseudo_set == "neighbourhood":
        base, normals = draw_surface(target, settings.pseudo_count, rng)
        # Along the normals only, as the authors' program has it: better than the text's isotropic Gaussian.
        return base + normals * rng.normal(0, settings.spread, (settings.pseudo_count, 1))
    base = _keypoints(target)
    drawn = base[rng.integers(0, len(base), settings.pseudo_count)]
    return np.asarray(drawn + rng.normal(0, settings.spread, drawn.shape))


def draw_surface(field: DistanceField, count: int, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Places (count, 3) on a field's surface, drawn with replacement, and the unit normals (count, 3) there."""
    if isinstance(field, PointField):
        places = field.drawn(count, rng)
        return places, field.normals(places)
    even = spread_over(field, _CHOICE * count)
    places = even[rng.integers(0, len(even), count)]
    return places, sampled(field, places).normal


def _keypoints(field: DistanceField) -> Floats:
    if not isinstance(field, PointField):
        raise ArgumentError("pseudo_set 'keypoints' needs a target of points; use 'neighbourhood' for other fields")
    rows = field.keypoints()
    if not len(rows):
        raise ArgumentError("pseudo_set 'keypoints' found no ISS keypoint in the target; use 'neighbourhood' instead")
    return np.asarray(field.points[rows], float)
