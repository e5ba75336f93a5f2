"""The solids that simulated scenes are built of, and the casting of rays at many of them.

Each solid is convex, so a ray is inside it for one interval of ranges: from where it has entered every bound
to where it first leaves one. A box is bounded by three slabs, a cylinder by a slab and a tube, a sphere by
itself.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import cos, hypot, sin
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Vector = tuple[float, float, float]
Interval = tuple[Array, Array]

_CHUNK = 8192  # rays cast together: their temporaries stay in the cache, and memory stays at a few MB
_NEVER_ZERO = 1e-200  # stands for 0 in a divisor: the quotient is "far beyond any scene" instead of NaN


class Primitive(Protocol):
    """A convex solid that rays can meet; it lies within `reach` of its `center`."""

    @property
    def center(self) -> Vector:
        """The middle of the solid, in the scene's frame and unit of length."""

    @property
    def reach(self) -> float:
        """The radius of a sphere around the center that holds the whole solid."""

    def intersect(self, origins: Array, directions: Array) -> Array:
        """Range (N,) at which each ray first meets the surface, from outside or inside; inf where it misses.

        origins: (N, 3) or (3,). directions: (N, 3), unit length.
        """

    def moved(self, shift: Vector, yaw: float = 0.0) -> Self:
        """The solid turned by `yaw` (rad) about the z axis of its frame, then shifted."""


@dataclass(frozen=True)
class Box:
    """A box of edge lengths `size` around `center`, turned by `yaw` (rad) about its vertical axis."""

    center: Vector
    size: Vector
    yaw: float = 0.0

    @property
    def reach(self) -> float:
        """Half the diagonal."""
        return hypot(*self.size) / 2

    def intersect(self, origins: Array, directions: Array) -> Array:
        """Range (N,) to the surface, inf where missed; see Primitive."""
        starts = _turned_back(origins - np.asarray(self.center), self.yaw)
        steps = _turned_back(directions, self.yaw)
        slabs = [_slab(edge / 2, o, d) for edge, o, d in zip(self.size, starts, steps, strict=True)]
        return _first_ahead(slabs)

    def moved(self, shift: Vector, yaw: float = 0.0) -> Box:
        """The box turned about the z axis, then shifted."""
        return replace(self, center=_moved(self.center, shift, yaw), yaw=self.yaw + yaw)


@dataclass(frozen=True)
class Cylinder:
    """A cylinder with flat ends and any axis, from `start` to `end`, the middles of its two ends."""

    start: Vector
    end: Vector
    radius: float

    @property
    def center(self) -> Vector:
        """The middle of the axis."""
        x, y, z = (np.asarray(self.start) + np.asarray(self.end)) / 2
        return float(x), float(y), float(z)

    @property
    def reach(self) -> float:
        """From the middle to the rim of an end."""
        return hypot(float(np.linalg.norm(np.subtract(self.end, self.start))) / 2, self.radius)

    def intersect(self, origins: Array, directions: Array) -> Array:
        """Range (N,) to the surface, inf where missed; see Primitive."""
        axis = np.subtract(self.end, self.start)
        length = float(np.linalg.norm(axis))
        axis = axis / length
        starts = origins - np.asarray(self.center)
        height, rise = starts @ axis, directions @ axis
        across = _ball(self.radius, starts - height[..., None] * axis, directions - rise[:, None] * axis)
        return _first_ahead([_slab(length / 2, height, rise), across])

    def moved(self, shift: Vector, yaw: float = 0.0) -> Cylinder:
        """The cylinder turned about the z axis, then shifted."""
        return replace(self, start=_moved(self.start, shift, yaw), end=_moved(self.end, shift, yaw))


@dataclass(frozen=True)
class Sphere:
    """A sphere."""

    center: Vector
    radius: float

    @property
    def reach(self) -> float:
        """The radius."""
        return self.radius

    def intersect(self, origins: Array, directions: Array) -> Array:
        """Range (N,) to the surface, inf where missed; see Primitive."""
        return _first_ahead([_ball(self.radius, origins - np.asarray(self.center), directions)])

    def moved(self, shift: Vector, yaw: float = 0.0) -> Sphere:
        """The sphere turned about the z axis, then shifted."""
        return replace(self, center=_moved(self.center, shift, yaw))


def cast(primitives: Iterable[Primitive], origins: Array, directions: Array) -> Array:
    """Range (N,) at which each ray meets the nearest of the primitives, inf where it meets none.

    origins: (N, 3), or (3,) for rays from one place. directions: (N, 3), unit length.
    """
    solids = tuple(primitives)
    ranges = np.full(len(directions), np.inf)
    for first in range(0, len(directions), _CHUNK):
        rays = slice(first, first + _CHUNK)
        _shorten(ranges[rays], solids, origins[rays] if origins.ndim == 2 else origins, directions[rays])
    return ranges


def _shorten(ranges: Array, primitives: tuple[Primitive, ...], origins: Array, directions: Array) -> None:
    """Cut each range, in place, at the nearest primitive; rays that miss a bounding sphere skip its solid."""
    for primitive in primitives:
        offsets = np.asarray(primitive.center) - origins
        closest = directions @ offsets if offsets.ndim == 1 else np.sum(offsets * directions, axis=1)
        passing = np.sum(offsets**2, axis=-1) - closest**2  # squared distance to the center, at range `closest`
        reach = primitive.reach * (1 + 1e-9)
        meets = (passing <= reach**2) & (closest > -reach) & (closest - reach < ranges)
        rays = np.flatnonzero(meets)
        if len(rays):
            found = primitive.intersect(origins[rays] if origins.ndim == 2 else origins, directions[rays])
            ranges[rays] = np.minimum(ranges[rays], found)


def _slab(half: float, start: Array, step: Array) -> Interval:
    """Where |start + range * step| <= half, per ray."""
    step = np.where(step == 0, _NEVER_ZERO, step)
    one, other = (-half - start) / step, (half - start) / step
    return np.minimum(one, other), np.maximum(one, other)


def _ball(radius: float, starts: Array, steps: Array) -> Interval:
    """Where |starts + range * steps| <= radius, per ray; empty (inf, -inf) where nowhere."""
    squared = np.maximum(np.sum(steps**2, axis=-1), _NEVER_ZERO)
    middle = -np.sum(starts * steps, axis=-1) / squared
    passing = np.sum((starts + middle[:, None] * steps) ** 2, axis=-1)  # no cancellation far from the origin
    half = np.sqrt(np.maximum(radius**2 - passing, 0) / squared)
    missed = passing > radius**2
    return np.where(missed, np.inf, middle - half), np.where(missed, -np.inf, middle + half)


def _first_ahead(bounds: list[Interval]) -> Array:
    """The first end of the intervals' common part that lies ahead (range > 0), inf where there is none."""
    enter, leave = bounds[0]
    for entered, left in bounds[1:]:
        enter, leave = np.maximum(enter, entered), np.minimum(leave, left)
    missed = (enter > leave) | (leave <= 0)
    return np.where(missed, np.inf, np.where(enter > 0, enter, leave))


def _turned_back(vectors: Array, yaw: float) -> tuple[Array, Array, Array]:
    """The x, y and z of vectors (..., 3) in a frame that is turned by `yaw`."""
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    return cos(yaw) * x + sin(yaw) * y, cos(yaw) * y - sin(yaw) * x, z


def _moved(point: Vector, shift: Vector, yaw: float) -> Vector:
    """The point turned about the z axis, then shifted."""
    x, y, z = point
    return cos(yaw) * x - sin(yaw) * y + shift[0], sin(yaw) * x + cos(yaw) * y + shift[1], z + shift[2]
