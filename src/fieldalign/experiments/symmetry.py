"""Errors modulo the symmetries of a shape: a table turned by half a turn is the same table."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..errors import ArgumentError
from ..evaluation import rotation_error, translation_error
from ..fields.protocol import Floats
from ..motions import Matrix, apply, inverse
from ..register import register

_SLACK = 0.01  # of the extent: a motion is a symmetry if it lays nearly all points so near to the shape
_SHARE = 0.99  # of the points
_HOLES = 0.03  # of the extent: points farther apart are the shape themselves, not a sample of its surface
_SEEN = 2000   # points that are looked at
_RIGHT = 0.01  # degrees and share of the extent: nothing to look for


def errors_modulo_symmetry(points: Floats, T: Matrix, T_true: Matrix, threads: int) -> tuple[float, float]:
    """RRE (degrees) and RTE of T against the nearest of the poses that lay the shape as T_true does.

    points: (N, 3), of the shape itself, in the source's frame. A symmetry is a motion that lays 99 of 100 points within
    1 % of the extent of the shape, over what points are apart anyway. What T is off by, inv(T_true) T, is refined on
    the shape itself; if that gives a symmetry, T is measured from there, else from T_true.
    """
    plain = rotation_error(T, T_true), translation_error(T, T_true)
    extent = float(np.ptp(points, axis=0).max())
    if plain[0] < _RIGHT and plain[1] < _RIGHT * extent:
        return plain
    off = inverse(T_true) @ T
    try:
        G = register(points, points, init=off, search=False, threads=threads).T_target_source
    except ArgumentError:  # a shape that the default cannot take
        return plain
    if not _is_symmetry(points, G, extent):
        return plain
    return min(plain, (rotation_error(off, G), translation_error(off, G)))


def _is_symmetry(points: Floats, G: Matrix, extent: float) -> bool:
    """Both ways: a motion that lays a part of the shape on another part is none.

    A sample of the same surface lies as far from the points as these from each other, and one of a surface d off as far
    as the root of the sum of the squares.
    """
    tree, looked_at = cKDTree(points), points[:: max(1, len(points) // _SEEN)]
    spacing = np.asarray(tree.query(looked_at, 2)[0])[:, 1]
    apart = min(float(np.quantile(spacing, _SHARE)), _HOLES * extent)
    allowed = np.hypot(_SLACK * extent, apart)
    distances = [tree.query(apply(motion, looked_at))[0] for motion in (G, inverse(G))]
    return all(float(np.quantile(d, _SHARE)) < allowed for d in distances)
