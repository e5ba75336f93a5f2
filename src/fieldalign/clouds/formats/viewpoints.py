"""Poses (4, 4) as the translation and the quaternion (w, x, y, z) that files hold."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ...errors import CloudFileError
from ..cloud import Array


def pose_from_quaternion(translation: ArrayLike, wxyz: ArrayLike) -> Array:
    """The (4, 4) pose; a quaternion is taken for its direction. Raises CloudFileError where it has none."""
    q = np.asarray(wxyz, float)
    length = float(np.linalg.norm(q))
    if not 0 < length < np.inf:
        raise CloudFileError(f"has a pose that turns by no quaternion: {q.tolist()}")
    w, x, y, z = q / length
    pose = np.eye(4)
    pose[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    pose[:3, 3] = translation
    return pose


def quaternion_of(pose: Array) -> Array:
    """(w, x, y, z) with w >= 0, the eigenvector of Bar-Itzhack (2000), which has no special cases."""
    (a, b, c), (d, e, f), (g, h, i) = pose[:3, :3]
    K = [
        [a + e + i, h - f, c - g, d - b],
        [h - f, a - e - i, b + d, c + g],
        [c - g, b + d, e - a - i, f + h],
        [d - b, c + g, f + h, i - a - e],
    ]
    q = np.linalg.eigh(np.array(K))[1][:, -1]
    return np.asarray(-q if q[0] < 0 else q)
