"""What must hold of points before they are registered."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from ..arguments import LARGEST
from ..errors import ArgumentError
from .cloud import as_points


@dataclass(frozen=True, eq=False)
class Checked:
    """Points (N, 3) in which nothing is wrong, the corners (2, 3) of their bounding box, their mean (3,), and how many
    NaN rows were left out."""

    points: NDArray[Any]
    bounds: NDArray[np.float64]
    mean: NDArray[np.float64]
    dropped: int


def checked_points(values: ArrayLike, name: str, threads: int, drop_nan: bool = False) -> Checked:
    """Points (N, 3) that are finite, of a size float64 can hold, and at least 3 of them distinct.

    drop_nan: rows with NaN are missing returns, left out and counted. Raises ArgumentError that names the argument
    where anything else is wrong; warns where float32 has already lost precision.
    """
    given = points = as_points(values, name)
    bounds, mean = _core.survey(points, threads)
    if drop_nan and not np.isfinite(mean).all():
        points = without_missing(given, name, threads)
        bounds, mean = _core.survey(points, threads)
    if np.isfinite(mean).all():
        warn_of_lost_precision(points, bounds, name)  # first: it may be why points are not distinct
    _check_distinct(points, name)
    if not np.isfinite(mean).all():
        _raise_not_finite(points, name)
    largest = float(np.abs(bounds).max())
    if largest > LARGEST:
        raise ArgumentError(f"{name} must have coordinates below {LARGEST:g}, but has {largest:g}")
    return Checked(points, bounds, mean, len(given) - len(points))


def without_missing(points: NDArray[Any], name: str, threads: int) -> NDArray[Any]:
    """The points (N, 3) without the rows that hold NaN; raises ArgumentError where infinity is among them."""
    if not len(points) or np.isfinite(_core.survey(points, threads)[1]).all():
        return points
    if np.isinf(points).any():
        _raise_not_finite(points, name)
    return np.asarray(points[~np.isnan(points).any(axis=1)])


def _raise_not_finite(points: NDArray[Any], name: str) -> None:
    bad = ~np.isfinite(points).all(axis=1)
    if not bad.any():  # finite values whose sum is not
        raise ArgumentError(f"{name} must have coordinates below {LARGEST:g}, but has {np.abs(points).max():g}")
    row = int(np.flatnonzero(bad)[0])
    raise ArgumentError(f"{name} must be finite, but {int(bad.sum())} rows are not, first row {row}: {points[row]}")


def _check_distinct(points: NDArray[Any], name: str) -> None:
    """At least 3 distinct points; the first hundred nearly always hold them."""
    for part in (points[:100], points):
        others = part[(part != part[:1]).any(axis=1)]
        if len(others) and (others != others[0]).any():
            return
    distinct = len(np.unique(points, axis=0))
    raise ArgumentError(f"{name} must hold at least 3 distinct points, but holds {distinct} among {len(points)} rows")


def warn_of_lost_precision(points: NDArray[Any], bounds: NDArray[np.float64], name: str) -> None:
    """float32 at UTM size has steps of half a metre: nothing can bring back what it lost. bounds: (2, 3), corners."""
    largest, extent = float(np.abs(bounds).max(initial=0.0)), float(np.ptp(bounds, axis=0).max())
    step = largest * float(np.finfo(np.float32).eps)
    if points.dtype == np.float32 and step > 1e-4 * extent and len(points) > 1:
        warnings.warn(
            f"{name} is float32 with coordinates up to {largest:.3g}: they are rounded to {step:.2g} over an extent of "
            f"{extent:.3g}; give float64 coordinates, or subtract an offset before rounding",
            stacklevel=2,
        )
