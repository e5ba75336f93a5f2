"""How near the places of one cloud come to the other's surface, and whether they agree with it: for pictures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..alignment.agreement import MIN_COSINE
from ..alignment.residual import row_dot
from ..fields import PointField, sampled
from ..fields.protocol import Floats, planes_near
from ..motions import apply, rotate
from ..prepared import PreparedCloud

ALONE, CONTRADICTS, AGREES = range(3)
_NEIGHBOURS = 10  # points in a plane, as a surfel has


@dataclass(frozen=True, eq=False)
class Closeness:
    """Of n places of one cloud, moved onto another.

    distance: (n,), to the other's surface, a length. signed: whether some are negative; `side` says where.
    state: (n,), ALONE: further than a voxel from the other; AGREES: nearer, with normals alike; else CONTRADICTS.
    normal: (n, 3), the cloud's own normal there, in its own frame.
    """

    distance: Floats
    signed: bool
    state: NDArray[np.uint8]
    normal: Floats
    side: str

    @property
    def meets(self) -> NDArray[np.bool_]:
        """Which places have the other surface nearby."""
        return np.asarray(self.state != ALONE)


def closeness(places: Floats, own: PreparedCloud, other: PreparedCloud, T: Floats, voxel: float) -> Closeness:
    """Of places (n, 3) on a cloud, where T (4, 4) moves it onto another."""
    moved = apply(T, places)
    distance, facing = _from_points(moved, other, voxel) if other.is_points else _from_surface(moved, other)
    normal = _facing(planes_near(own.exact, places, _NEIGHBOURS).normal, places, own)
    cosine = row_dot(rotate(T[:3, :3], normal), facing)
    if own.eye is None or other.eye is None:
        cosine = np.abs(cosine)
    near = np.abs(distance) <= voxel
    state = np.where(near, np.where(cosine >= MIN_COSINE, AGREES, CONTRADICTS), ALONE).astype(np.uint8)
    return Closeness(distance, other.is_points or bool(other.field.signed), state, normal, _side(other))


def _from_points(x: Floats, other: PreparedCloud, voxel: float) -> tuple[Floats, Floats]:
    """Signed distances (n,) and normals (n, 3): from the plane through the nearest points, where these are near."""
    field = other.fine
    foot = sampled(field, x)
    mean, normal, _ = field.surfels(foot.foot, _NEIGHBOURS)
    facing = _facing(normal, foot.foot, other)
    across = row_dot(mean - x, facing)
    return np.where(foot.value > voxel, np.copysign(foot.value, across), across), facing


def _from_surface(x: Floats, other: PreparedCloud) -> tuple[Floats, Floats]:
    """Distances (n,), signed where the surface has sides, and normals (n, 3)."""
    sample = sampled(other.field, x)
    return sample.value, sample.normal


def _facing(normal: Floats, places: Floats, cloud: PreparedCloud) -> Floats:
    """Normals (n, 3) turned towards the sensor, or towards the cloud's middle where no sensor is known."""
    away = row_dot(normal, places - (cloud.centre if cloud.eye is None else cloud.eye)) > 0
    return np.where(away[:, None], -normal, normal)


def _side(other: PreparedCloud) -> str:
    """What a negative distance means."""
    if not isinstance(other.field, PointField):
        return "negative inside" if other.field.signed else "without a sign: the surface is open"
    return "negative " + ("on the sensor’s side" if other.eye is not None else "towards the middle of the other cloud")
