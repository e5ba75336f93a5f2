"""Checks of plain arguments: each error is a sentence that names the argument, what came and what is allowed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .errors import ArgumentError

MAX_NEIGHBOURS = 64  # that the core keeps for a place


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
    """Whether a value is a real number; True and False are none."""
    return isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)


def check_positive(name: str, value: float) -> None:
    """Raises ArgumentError where the value is not a positive, finite number."""
    if not (is_number(value) and np.isfinite(value) and value > 0):
        raise ArgumentError(f"{name} must be a positive number, but is {value!r}")


def as_vector(value: object, name: str) -> NDArray[np.float64]:
    """A vector (3,) of finite numbers; raises ArgumentError that names the argument for anything else."""
    try:
        vector = np.array(value, float)
    except (TypeError, ValueError) as error:
        raise ArgumentError(f"{name} must be three numbers, but is {value!r}") from error
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise ArgumentError(f"{name} must be three finite numbers, but is {value!r}")
    return vector
