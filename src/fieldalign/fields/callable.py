"""The field of any function: a formula, a solid's own distance, a fitted model."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import LARGEST, as_numbers
from ..errors import ArgumentError, FieldError
from .protocol import FieldSample, Floats, Planes, as_places, exact_planes, newton_foot, unit
from .spread import spread_by
from .torch_module import as_torch_module

_PROBES = 512   # places in the bounds that show whether values are negative somewhere
_FLAT = 0.5     # of a distance's slope: less has no direction
_STEP = 6e-6    # of the bounds' diagonal, between the values that a derivative is made of: about the cube root of 2^-53


class CallableField:
    """The distance field that a function says; immutable.

    function: places (L, 3) -> distances (L,) to the surface, in the places' unit; negative inside, if it knows a side.
        Or a torch.nn.Module that takes tensors (L, 3) to (L,) or (L, 1); it is asked in its own precision, where it is.
    bounds: (2, 3), lowest and highest corner of a box around the surface: there the surface is sampled.
    gradient: places (L, 3) -> the distance's derivative (L, 3); None: by the module's autograd, and for other functions
        by central differences, six more values a place.
    signed: whether the function is negative on one side; None: seen at some places in the bounds.

    A function that is not quite a distance (a fitted model) may be given: feet are one Newton step away, and normals
    are taken at the feet.

    Raises ArgumentError for arguments of a wrong kind, and FieldError where the function raises, or answers with a
    wrong shape, NaN or infinity.
    """

    def __init__(
        self,
        function: Callable[[Floats], ArrayLike],
        bounds: ArrayLike,
        *,
        gradient: Callable[[Floats], ArrayLike] | None = None,
        signed: bool | None = None,
    ) -> None:
        for name, given in (("function", function), ("gradient", gradient)):
            if not callable(given) and not (name == "gradient" and given is None):
                raise ArgumentError(f"{name} must be a function of places (L, 3), but is {given!r}")
        if signed not in (True, False, None):
            raise ArgumentError(f"signed must be True, False or None, but is {signed!r}")
        module = as_torch_module(function)
        self._function, self._gradient, self._with_gradient = function, gradient, None
        if module is not None:
            self._function = module
            if gradient is None:
                self._gradient, self._with_gradient = module.gradient, module.with_gradient
        self.bounds = _checked_bounds(bounds)
        low, high = self.bounds
        places = np.random.default_rng(0).uniform(low, high, (_PROBES, 3))
        values = self._values(places)
        self._gradients(places[:1])  # whatever is wrong with it shall show here, not in the middle of a registration
        self.signed = bool((values < 0).any()) if signed is None else signed

    def sample(self, x: ArrayLike) -> FieldSample:
        """value (L,), gradient (L, 3), foot (L, 3) and normal (L, 3) at the places x (L, 3).

        Raises FieldError where the function raises or answers nonsense.
        """
        places = as_places(x)
        value, gradient = self._values_and_gradients(places)
        foot = newton_foot(places, value, gradient)
        return FieldSample(value, gradient, foot, lambda: self._normals(foot))

    def planes(self, x: Floats, neighbours: int, last: Planes | None = None) -> Planes:
        """The planes at the feet of the places x (L, 3). A distance changes at x as it does at the foot, so no more is
        asked, but where it hardly changes: on the surface of an unsigned field."""
        value, gradient = self._values_and_gradients(x)
        foot, normal = newton_foot(x, value, gradient), unit(gradient)
        flat = np.linalg.norm(gradient, axis=1) < _FLAT
        if flat.any():
            normal[flat] = self._normals(foot[flat])
        return exact_planes(foot, normal)

    def spread(self, count: int) -> Floats:
        """About `count` places (n, 3) on the surface within the bounds, spread evenly."""
        return spread_by(self._values, self._gradients, self.bounds, count, "CallableField")

    def _normals(self, feet: Floats) -> Floats:
        gradient = self._gradients(feet)
        return np.asarray(gradient / np.maximum(np.linalg.norm(gradient, axis=1, keepdims=True), 1e-12))

    def _values(self, places: Floats) -> Floats:
        return _asked(self._function, "function", places, (len(places),))

    def _values_and_gradients(self, places: Floats) -> tuple[Floats, Floats]:
        """Both, of a module from one pass."""
        if self._with_gradient is None:
            return self._values(places), self._gradients(places)
        value, gradient = _tried(self._with_gradient, "function", places)
        return _checked(value, "function", (len(places),)), _checked(gradient, "gradient", places.shape)

    def _gradients(self, places: Floats) -> Floats:
        if self._gradient is not None:
            return _asked(self._gradient, "gradient", places, places.shape)
        step = _STEP * float(np.linalg.norm(self.bounds[1] - self.bounds[0]))
        aside = step * np.concatenate([np.eye(3), -np.eye(3)])
        values = self._values((places + aside[:, None]).reshape(-1, 3)).reshape(6, -1)
        return np.ascontiguousarray((values[:3] - values[3:]).T / (2 * step))


def _asked(function: Callable[[Floats], Any], name: str, places: Floats, shape: tuple[int, ...]) -> Floats:
    """What a function says of the places; raises FieldError for what is no answer."""
    return _checked(_tried(lambda x: as_numbers(function(x), "it"), name, places), name, shape)


def _tried(function: Callable[[Floats], Any], name: str, places: Floats) -> Any:
    try:
        return function(places)
    except Exception as error:
        raise FieldError(f"the {name} of a CallableField raised {type(error).__name__}: {error}") from error


def _checked(answer: Floats, name: str, shape: tuple[int, ...]) -> Floats:
    if answer.shape != shape:
        raise FieldError(f"the {name} of a CallableField must answer with shape {shape}, but gave {answer.shape}")
    if not np.isfinite(answer).all():
        raise FieldError(f"the {name} of a CallableField must give finite values, but gave NaN or infinity")
    return answer


def _checked_bounds(bounds: ArrayLike) -> Floats:
    corners = as_numbers(bounds, "bounds", "(2, 3) numbers")
    if corners.shape != (2, 3) or not (np.abs(corners) <= LARGEST).all() or not (corners[0] < corners[1]).all():
        raise ArgumentError(f"bounds must be (2, 3), the lowest and the highest corner of a box, but is {bounds!r}")
    return corners
