"""What a distance field is: anything that says, for places in space, how far its surface is and where."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from ..arguments import LARGEST, as_numbers
from ..clouds.cloud import as_points
from ..errors import FieldError

Floats = NDArray[np.float64]


class FieldSample:
    """What a field says at L places.

    value: (L,), distance to the surface, in the cloud's unit; negative inside where the field is signed.
    gradient: (L, 3), the value's derivative; zero where it has none (on an unsigned surface itself).
    foot: (L, 3), place - value * gradient: the nearest place on the surface.
    normal: (L, 3), the surface's unit normal at the foot; its sign means something only where the field is signed.

    place: (L,), where the field keeps each foot; a guess for its next sample nearby. None: it keeps no such thing.

    `normal` may be given as a function without arguments; it is then worked out when first asked for, since few need
    it. A sample unpacks into the four arrays in this order.
    """

    def __init__(
        self,
        value: Floats,
        gradient: Floats,
        foot: Floats,
        normal: Floats | Callable[[], Floats],
        place: NDArray[np.uint32] | None = None,
    ) -> None:
        self.value = value
        self.gradient = gradient
        self.foot = foot
        self.place = place
        self._normal = normal

    @property
    def normal(self) -> Floats:
        """Unit normals at the feet, (L, 3)."""
        if callable(self._normal):
            self._normal = self._normal()
        return self._normal

    @cached_property
    def served(self) -> NDArray[np.int64]:
        """How many of the places each one's foot serves, (L,); 1 where it is its own."""
        return _core.count_equal(np.ascontiguousarray(self.foot))

    @cached_property
    def direction(self) -> Floats:
        """Unit vectors away from the feet, (L, 3), alike for signed and unsigned fields; zero on a surface itself."""
        return _core.directions(np.ascontiguousarray(self.value), np.ascontiguousarray(self.gradient))

    def __iter__(self) -> Iterator[Floats]:
        return iter((self.value, self.gradient, self.foot, self.normal))


@runtime_checkable
class DistanceField(Protocol):
    """A surface, known by the distance to it; anything with these members is one.

    signed: whether `value` is negative on one side. If one field of a pair is unsigned, both are taken so.
    bounds: (2, 3), the lowest and the highest corner of a box around the surface, in the cloud's unit.
    """

    signed: bool

    @property
    def bounds(self) -> Floats:
        """The lowest and the highest corner of a box around the surface, (2, 3)."""
        ...

    def sample(self, x: Floats) -> FieldSample | tuple[Floats, Floats, Floats, Floats]:
        """value (L,), gradient (L, 3), foot (L, 3) and normal (L, 3) at the places x (L, 3)."""
        ...


@runtime_checkable
class HasPlanes(Protocol):
    """A field that smooths its surface by planes of its own."""

    def planes(self, x: Floats, neighbours: int, last: Planes | None = None) -> Planes:
        """As planes_near()."""
        ...


@runtime_checkable
class HasSpread(Protocol):
    """A field that knows places on its surface."""

    def spread(self, count: int) -> Floats:
        """About `count` places (n, 3) on the surface, spread evenly; the same at every call."""
        ...


def as_places(x: ArrayLike) -> Floats:
    """Places (L, 3) that a field can be asked at; raises ArgumentError for what is none, and FieldError where a
    coordinate is not finite, or beyond what float64 resolves."""
    places = np.ascontiguousarray(as_points(x, "x"), float)
    if not np.abs(places).max(initial=0.0) <= LARGEST:
        raise FieldError(f"a field must be asked at finite places below {LARGEST:g}, but x has NaN or infinity or more")
    return places


def bounds_of(field: DistanceField) -> Floats:
    """The corners (2, 3) of the box around a field's surface; raises FieldError where it says none."""
    name = f"{type(field).__name__}.bounds"
    wanted = "(2, 3), lowest and highest corner"
    bounds = as_numbers(field.bounds, name, wanted, FieldError)
    if bounds.shape != (2, 3) or not (np.abs(bounds) <= LARGEST).all() or not (bounds[0] <= bounds[1]).all():
        raise FieldError(f"{name} must be {wanted}, but is {bounds}")
    return bounds


def sampled(field: DistanceField, x: Floats, last: FieldSample | None = None) -> FieldSample:
    """A field at the places x (L, 3), as a FieldSample; raises FieldError where a foreign field answers nonsense.

    last: the field's own sample of the same points a little earlier; those that keep a `place` can start from it.
    """
    guess = {} if last is None or last.place is None else {"guess": last.place}
    answer: Any = field.sample(x, **guess)
    sample = answer if isinstance(answer, FieldSample) else _from_tuple(field, answer)
    if sample.place is not None:  # from the core, which needs no check
        return sample
    for name, shape in (("value", (len(x),)), ("gradient", x.shape), ("foot", x.shape)):
        got = np.shape(getattr(sample, name))
        if got != shape:
            raise FieldError(f"{type(field).__name__}.sample must give a {name} of shape {shape}, but gave {got}")
    if not np.isfinite(sample.value.sum() + sample.gradient.sum()):
        raise FieldError(f"{type(field).__name__}.sample must give finite values and gradients, but gave NaN or inf")
    return sample


@dataclass(frozen=True, eq=False)
class Planes:
    """The surface near L places as planes.

    mean, normal: (L, 3), a place on each and its unit normal, sign free. thickness: (L,), how far the surface scatters
    across, as a standard deviation. width: (L,), how far the points in the plane reach along it; infinite: no points.
    place: (L,), where the field keeps what it found; None: it keeps no such thing.
    """

    mean: Floats
    normal: Floats
    thickness: Floats
    width: Floats
    place: NDArray[np.uint32] | None = None

    def about(self, origin: Floats) -> Planes:
        """The same planes, with places counted from an origin (3,)."""
        return Planes(self.mean - origin, self.normal, self.thickness, self.width)

    def __len__(self) -> int:
        return len(self.mean)

    def __getitem__(self, rows: slice) -> Planes:
        """Some of them."""
        parts = self.mean, self.normal, self.thickness, self.width
        mean, normal, thickness, width = (np.ascontiguousarray(part[rows]) for part in parts)
        return Planes(mean, normal, thickness, width)


def planes_near(field: DistanceField, x: Floats, neighbours: int, last: Planes | None = None) -> Planes:
    """The planes at the feet of the places x (L, 3); for points, those through `neighbours` of them.

    last: the answer for the same places a little earlier; where a foot is the same, so is its plane.
    """
    if isinstance(field, HasPlanes):
        return field.planes(x, neighbours, last)
    sample = sampled(field, x)
    return exact_planes(sample.foot, sample.normal)


def exact_planes(mean: Floats, normal: Floats) -> Planes:
    """Planes of a surface that is known exactly: no thickness, and no points whose spacing would bound them."""
    return Planes(mean, np.ascontiguousarray(normal), np.zeros(len(mean)), np.full(len(mean), np.inf))


def newton_foot(places: Floats, value: Floats, gradient: Floats) -> Floats:
    """Where the tangents at the places (L, 3) are zero (L, 3): the feet, also where a field's slope is not one."""
    slope = np.maximum(np.einsum("li,li->l", gradient, gradient), 1e-12)
    return np.asarray(places - (value / slope)[:, None] * gradient)


def unit(vectors: Floats) -> Floats:
    """Vectors (..., 3) at length 1; those without a length stay as they are."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(length > 0, length, 1.0))


def _from_tuple(field: DistanceField, answer: Any) -> FieldSample:
    parts = list(answer) if isinstance(answer, tuple | list) else []
    if len(parts) != 4:
        raise FieldError(f"{type(field).__name__}.sample must give four arrays, but gave {answer!r}")
    name, wanted = f"an answer of {type(field).__name__}.sample", "an array of numbers"
    value, gradient, foot, normal = (as_numbers(part, name, wanted, FieldError) for part in parts)
    return FieldSample(value, gradient, foot, normal)
