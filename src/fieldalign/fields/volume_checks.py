"""What a volume is made of, checked."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import LARGEST, as_array, as_numbers
from ..errors import ArgumentError, FieldError
from .protocol import Floats

_SHORTEST = 1e-150  # step: its square is a number still
_ROUNDED = 1 - 1e-6  # of the truncation: a value of this size is meant to be truncated


def checked_numbers(given: ArrayLike, name: str, shape: str, dimensions: int) -> NDArray[Any]:
    """Numbers as float32 where they are that or shorter, else as float64; raises FieldError for what is no volume."""
    numbers = as_array(given, f"{name} of a VolumeField", f"{shape} numbers", FieldError)
    if numbers.dtype.kind not in "fiu" or numbers.ndim != dimensions or min(numbers.shape[-3:]) < 2:
        raise FieldError(
            f"{name} of a VolumeField must be {shape} numbers with sides of at least 2, "
            f"but have shape {numbers.shape} and dtype {numbers.dtype}"
        )
    is_single = numbers.dtype.kind == "f" and numbers.itemsize <= 4
    return numbers.astype(np.float32 if is_single else np.float64, copy=False)


def checked_mask(seen: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Which values were seen; raises FieldError for what is no mask of them."""
    mask = as_array(seen, "seen of a VolumeField", f"{shape} bool", FieldError)
    if mask.dtype != bool or mask.shape != shape:
        raise FieldError(
            f"seen of a VolumeField must be {shape} bool as its values are, but has shape {mask.shape} and dtype "
            f"{mask.dtype}; of weights, give weights > 0"
        )
    return mask


def checked_origin(origin: ArrayLike) -> Floats:
    """The place of the first value (3,); raises ArgumentError for what is none."""
    place = as_numbers(origin, "origin", "(3,) numbers")
    if place.shape != (3,) or not (np.abs(place) <= LARGEST).all():
        raise ArgumentError(f"origin must be (3,) finite numbers, but is {origin!r}")
    return place


def checked_spacing(spacing: ArrayLike) -> Floats:
    """The steps along the axes (3,), from three or one for all; raises ArgumentError for what is none."""
    steps = as_numbers(spacing, "spacing", "a positive number or three")
    if steps.shape not in ((), (3,)) or not ((steps > _SHORTEST) & (steps <= LARGEST)).all():
        raise ArgumentError(f"spacing must be a positive number or three, but is {spacing!r}")
    return np.full(3, steps)


def known_values(numbers: NDArray[Any], seen: NDArray[np.bool_] | None, truncation: float | None) -> NDArray[Any]:
    """The values with NaN where nothing was seen, and infinite of their sign where they are truncated; raises
    FieldError where they say nothing."""
    known = numbers if seen is None else np.where(seen, numbers, numbers.dtype.type(np.nan))
    if np.isinf(known).any():
        raise FieldError("values of a VolumeField must be finite, or NaN where nothing was seen, but have infinity")
    if truncation is not None:
        infinite = np.copysign(numbers.dtype.type(np.inf), known)
        known = np.where(np.abs(known) >= _ROUNDED * float(truncation), infinite, known)
    finite = known[np.isfinite(known)]
    if not finite.size:
        raise FieldError("VolumeField needs values that are seen and below the truncation, but has none")
    if np.abs(finite).max() > LARGEST:
        raise FieldError(f"values of a VolumeField must be below {LARGEST:g}, but reach {np.abs(finite).max():g}")
    if finite.min() == finite.max():
        raise FieldError(
            f"values of a VolumeField must differ from place to place, but all that are known are {finite[0]}"
        )
    return known
