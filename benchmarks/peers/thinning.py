"""What the peers share that compare all points with all points: few points, at unit size."""

from __future__ import annotations

import numpy as np

MOST = 2000  # points of each cloud


def few(points, count) -> np.ndarray:
    """At most so many of the points (N, 3), drawn without replacement: two copies of one cloud stay copies."""
    if len(points) <= count:
        return points
    return points[np.sort(np.random.default_rng(0).choice(len(points), count, replace=False))]


def at_unit_size(source, target, init, count=MOST) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Both clouds thinned, the target centred and at unit size, the source where init has it (None: its centroid on the
    target's); and the two (4, 4) that map the clouds as they came there."""
    moving, fixed = few(source, count), few(target, count)
    size = np.sqrt(np.mean(np.sum((fixed - fixed.mean(axis=0)) ** 2, axis=1)))
    to_fixed = _scaling(1 / size, fixed.mean(axis=0))
    to_moving = _scaling(1 / size, moving.mean(axis=0)) if init is None else to_fixed @ init
    return apply(to_moving, moving), apply(to_fixed, fixed), to_moving, to_fixed


def apply(T, points) -> np.ndarray:
    return points @ T[:3, :3].T + T[:3, 3]


def as_came(R, t, to_moving, to_fixed) -> np.ndarray:
    """T_target_source (4, 4) of a motion between the clouds at unit size."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, t
    return np.linalg.solve(to_fixed, T @ to_moving)


def _scaling(factor, origin) -> np.ndarray:
    T = factor * np.eye(4)
    T[:3, 3], T[3, 3] = -factor * origin, 1
    return T
