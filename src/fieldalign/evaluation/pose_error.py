"""Relative rotation error (RRE) and relative translation error (RTE) of a pose, and of many."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..motions import Matrix, angles_between


def rotation_errors(T: ArrayLike, T_true: ArrayLike) -> Matrix:
    """RRE in degrees between motions (..., 4, 4): the angle of R^T R_true; shape (...)."""
    return np.asarray(np.degrees(angles_between(T, T_true)))


def translation_errors(T: ArrayLike, T_true: ArrayLike) -> Matrix:
    """RTE between motions (..., 4, 4): the distance of their translations, in the clouds' unit; shape (...)."""
    return np.asarray(np.linalg.norm(np.asarray(T)[..., :3, 3] - np.asarray(T_true)[..., :3, 3], axis=-1))


def rotation_error(T: ArrayLike, T_true: ArrayLike) -> float:
    """RRE in degrees between two motions (4, 4)."""
    return float(rotation_errors(T, T_true))


def translation_error(T: ArrayLike, T_true: ArrayLike) -> float:
    """RTE between two motions (4, 4), in the clouds' unit."""
    return float(translation_errors(T, T_true))


@dataclass(frozen=True, eq=False)
class PoseErrors:
    """RTE and RRE of n motions: translation (n,), in the clouds' unit; rotation (n,), degrees."""

    translation: Matrix
    rotation: Matrix

    @classmethod
    def between(cls, T: Matrix, T_true: Matrix) -> PoseErrors:
        """The errors of motions (n, 4, 4)."""
        return cls(translation_errors(T, T_true), rotation_errors(T, T_true))

    def to_dict(self) -> dict[str, dict[str, float] | None]:
        """Both in a few numbers, None of no motions; the standard deviation is that of the errors themselves."""
        return {"translation": _statistics(self.translation), "rotation_deg": _statistics(self.rotation)}


def _statistics(errors: Matrix) -> dict[str, float] | None:
    if not len(errors):
        return None
    return {
        "rmse": float(np.sqrt(np.mean(errors**2))),
        "mean": float(errors.mean()),
        "median": float(np.median(errors)),
        "standard_deviation": float(errors.std()),
        "minimum": float(errors.min()),
        "maximum": float(errors.max()),
    }
