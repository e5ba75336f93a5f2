"""Relative rotation error (RRE) and relative translation error (RTE) of a pose."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


def rotation_error(T: ArrayLike, T_true: ArrayLike) -> float:
    """RRE in degrees between two motions (4, 4): the angle of R^T R_true.

    By the chord, 2 asin(|R - R_true|_F / (2 sqrt 2)): the usual arccos of the trace cannot see below 1e-6 degrees.
    """
    chord = np.linalg.norm(np.asarray(T)[:3, :3] - np.asarray(T_true)[:3, :3])
    return float(np.degrees(2 * np.arcsin(min(chord / np.sqrt(8), 1.0))))


def translation_error(T: ArrayLike, T_true: ArrayLike) -> float:
    """RTE between two motions (4, 4): the distance of their translations, in the clouds' unit."""
    return float(np.linalg.norm(np.asarray(T)[:3, 3] - np.asarray(T_true)[:3, 3]))
