"""Checks of plain arguments: each error is a sentence that names the argument, what came and what is allowed."""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import ArgumentError

MAX_NEIGHBOURS = 64  # that the core keeps for a place
MAX_PLACES = 10_000_000  # that may be asked for by a number
LARGEST = 1e15  # of a coordinate: beyond, float64 leaves less than a unit of resolution


def as_count(value: object, name: str, lowest: int, highest: int | None = None) -> int:
    """A whole number in a range; raises ArgumentError that names the argument for anything else."""
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not whole or not lowest <= value or (highest is not None and value > highest):  # type: ignore[operator]
        allowed = f"of at least {lowest}" if highest is None else f"from {lowest} to {highest}"
        raise ArgumentError(f"{name} must be an integer {allowed}, but is {value!r}")
    return int(value)  # type: ignore[call-overload, no-any-return]


def check_one_of(name: str, value: object, allowed: tuple[str, ...]) -> None:
    """Raises ArgumentError where the value is not one of the allowed words."""
    if not isinstance(value, str) or value not in allowed:
        raise ArgumentError(f"{name} must be one of {', '.join(allowed)}, but is {value!r}")


def is_number(value: object) -> bool:
    """Whether a value is a real number that float64 has room for; True and False are none."""
    if isinstance(value, int):
        return not isinstance(value, bool) and abs(value) <= sys.float_info.max
    return isinstance(value, float | np.integer | np.floating)


def check_positive(name: str, value: float) -> None:
    """Raises ArgumentError where the value is not a positive, finite number."""
    if not (is_number(value) and math.isfinite(value) and value > 0):
        raise ArgumentError(f"{name} must be a positive number, but is {value!r}")


def as_vector(value: object, name: str) -> NDArray[np.float64]:
    """A vector (3,) of finite numbers; raises ArgumentError that names the argument for anything else."""
    vector = as_numbers(value, name, "three numbers")
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise ArgumentError(f"{name} must be three finite numbers, but is {value!r}")
    return vector


def as_square(value: Any, name: str, edge: int, use: str = "") -> NDArray[np.float64]:
    """A new matrix (edge, edge) of finite numbers; raises ArgumentError that names the argument."""
    matrix = as_numbers(value, name, f"a ({edge}, {edge}) matrix of numbers")
    if matrix.shape != (edge, edge):
        raise ArgumentError(f"{name} must be a ({edge}, {edge}) matrix{use}, but has shape {matrix.shape}")
    if not np.isfinite(matrix).all():
        raise ArgumentError(f"{name} must be finite, but holds NaN or infinity")
    return matrix


def as_array(value: Any, name: str, wanted: str, kind: type[ArgumentError] = ArgumentError) -> NDArray[Any]:
    """What NumPy makes of a value; masked numbers are missing ones, NaN. Raises an error of that kind, which names the
    argument and what it must be."""
    try:
        if isinstance(value, np.ma.MaskedArray):
            numbers: Any = value if value.dtype.kind == "f" else value.astype(float)
            return np.asarray(numbers.filled(np.nan))
        return np.asarray(value)
    except (TypeError, ValueError, OverflowError) as error:
        reason = "its rows differ in length" if "inhomogeneous" in str(error) else f"is no array: {error}"
        raise kind(f"{name} must be {wanted}, but {reason}") from error


def as_numbers(
    value: Any, name: str, wanted: str = "an array of numbers", kind: type[ArgumentError] = ArgumentError
) -> NDArray[np.float64]:
    """A new array of real numbers, float64; what float64 has no room for is infinite. Raises an error of that kind,
    which names the argument and what it must be."""
    array = as_array(value, name, wanted, kind)
    try:
        if array.dtype.kind in "cmMV":
            raise TypeError(f"it has dtype {array.dtype}")
        with np.errstate(over="ignore"):
            return np.array(array, float)
    except (TypeError, ValueError, OverflowError) as error:
        raise kind(f"{name} must be {wanted}, but is {value!r:.200}") from error
