"""A scene of solids, and what a range sensor in it sees: occlusion is true, only the noise is drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...errors import ArgumentError
from ..cloud import PointCloud
from .primitives import Array, Primitive, cast

HANDHELD = (90.0, 70.0)  # field of view in degrees, horizontal and vertical, of a wide depth sensor


@dataclass(frozen=True)
class Scene:
    """Solids in one world frame: metres, z up."""

    primitives: tuple[Primitive, ...]

    def scan(
        self,
        world_from_sensor: ArrayLike,
        rays: int = 100_000,
        noise: float = 0.005,
        field_of_view: tuple[float, float] = HANDHELD,
        seed: int = 0,
    ) -> PointCloud:
        """What a sensor at the (4, 4) pose sees, in the SENSOR frame: x ahead, y left, z up; metres, float64.

        rays: the number of rays; each gives one point, or none where it meets nothing.
        noise: standard deviation of the range along the ray, metres.
        field_of_view: horizontal (up to 360) and vertical (up to 180) opening in degrees, centred on x.
        seed: of the noise; the rays themselves are always the same.
        Raises ArgumentError for a value out of these bounds or a pose that is not rigid.
        """
        pose = _rigid(world_from_sensor, "world_from_sensor")
        if not (np.isfinite(noise) and noise >= 0):
            raise ArgumentError(f"noise must be a standard deviation in metres >= 0, but is {noise}")
        directions = ray_pattern(rays, field_of_view)
        ranges = self.ranges(pose[:3, 3], directions @ pose[:3, :3].T)
        measured = ranges + noise * generator(seed).standard_normal(len(ranges))
        hit = np.isfinite(ranges)
        return PointCloud(directions[hit] * measured[hit, None], viewpoint=np.eye(4))

    def ranges(self, origins: Array, directions: Array) -> Array:
        """Range (N,) to the nearest surface, inf where none is met; origins, unit directions: (N, 3)."""
        return cast(self.primitives, origins, directions)

    def sees(self, world_from_sensor: ArrayLike, points: Array, field_of_view: tuple[float, float] = HANDHELD) -> Array:
        """Which surface points (N, 3), in the world frame, a sensor at the (4, 4) pose sees: (N,) bool.

        A point is seen if it lies within the field of view and nothing is nearer on the ray to it.
        Raises ArgumentError for a pose that is not rigid or a field of view that cannot be.
        """
        pose = _rigid(world_from_sensor, "world_from_sensor")
        offsets = points - pose[:3, 3]
        distances = np.linalg.norm(offsets, axis=1)
        within = _within(field_of_view, offsets @ pose[:3, :3])
        seen = np.zeros(len(points), bool)
        directions = offsets[within] / distances[within, None]
        seen[within] = self.ranges(pose[:3, 3], directions) > distances[within] - 1e-6
        return seen


def ray_pattern(rays: int, field_of_view: tuple[float, float]) -> Array:
    """Unit directions (rays, 3) of a scanner: a mirror sweeps upward while the head turns left.

    Lines, and the rays within a line, are about equally far apart in angle. Raises as Scene.scan does.
    """
    check_count(rays, "rays")
    horizontal, vertical = _openings(field_of_view)
    lines = max(1, round(np.sqrt(rays * horizontal / vertical)))
    turn = (np.arange(rays) + 0.5) / rays
    azimuth = horizontal * (turn - 0.5)
    elevation = vertical * (turn * lines % 1 - 0.5)
    flat = np.cos(elevation)
    return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)], axis=1)


def check_count(value: int, name: str) -> None:
    """Raise ArgumentError unless the value is a whole number >= 1."""
    if value < 1 or value != int(value):
        raise ArgumentError(f"{name} must be a whole number >= 1, but is {value}")


def generator(seed: int, stream: int = 0) -> np.random.Generator:
    """Random numbers of a seed, independent per stream; raises ArgumentError for a negative seed."""
    if seed < 0:
        raise ArgumentError(f"seed must be a whole number >= 0, but is {seed}")
    return np.random.default_rng([seed, stream])


def _within(field_of_view: tuple[float, float], vectors: Array) -> Array:
    """Which vectors (N, 3) of the sensor frame point into the field of view."""
    horizontal, vertical = _openings(field_of_view)
    x, y, z = vectors.T
    azimuth, elevation = np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))
    return np.asarray((np.abs(azimuth) <= horizontal / 2) & (np.abs(elevation) <= vertical / 2))


def _openings(field_of_view: tuple[float, float]) -> tuple[float, float]:
    """Horizontal and vertical opening in radians."""
    horizontal, vertical = field_of_view
    if not (0 < horizontal <= 360 and 0 < vertical <= 180):
        raise ArgumentError(
            "field_of_view must be two angles in degrees, horizontal in (0, 360] and vertical in (0, 180], "
            f"but is {field_of_view}"
        )
    return float(np.radians(horizontal)), float(np.radians(vertical))


def _rigid(pose: ArrayLike, name: str) -> Array:
    """The pose as a (4, 4) array; raises ArgumentError where it is not a rigid motion."""
    T = np.asarray(pose, float)
    if T.shape != (4, 4):
        raise ArgumentError(f"{name} must be a (4, 4) pose, but has shape {T.shape}")
    R = T[:3, :3]
    orthonormal = np.allclose(R @ R.T, np.eye(3), atol=1e-6) and np.linalg.det(R) > 0
    if not (np.isfinite(T).all() and orthonormal and np.array_equal(T[3], [0, 0, 0, 1])):
        raise ArgumentError(f"{name} must be a rigid motion with last row 0 0 0 1, but is {T.tolist()}")
    return T
