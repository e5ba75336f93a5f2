"""Simulated scans of rooms at any overlap, with noise, outliers and unequal density; the truth is exact."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

from fieldalign.clouds.simulated import Room, simulate_room

SKETCH = 2000  # rays that are enough to judge a pose


@dataclass(frozen=True, eq=False)
class Simulation:
    """How two scans were made. overlap: share that both sensors see, of the one that shares less of what it sees.

    world_from_source, world_from_target: (4, 4), the sensors; rays: of each; noise: standard deviation of the range,
    metres; outliers: share of points that lie on no surface.
    """

    room: Room
    world_from_source: np.ndarray
    world_from_target: np.ndarray
    rays: tuple[int, int]
    noise: float
    outliers: float
    overlap: float


def changed(what: str, value: float) -> dict:
    """The options of `simulate` for one point of a curve."""
    if what == "noise":
        return {"noise_percent": value}
    if what == "density":
        return {"rays": (100_000, round(100_000 / value))}
    return {what: value}


def simulate(
    number: int,
    overlap: float = 0.6,
    rays: tuple[int, int] = (30_000, 30_000),
    noise: float = 0.005,
    noise_percent: float | None = None,
    outliers: float = 0.0,
) -> tuple:
    """Target and source in their sensors' frames, T_target_source, and the Simulation.

    number: of the room; its poses depend on the overlap alone, so that all else on a curve is equal.
    noise_percent: noise in per cent of the room's diagonal instead of in metres.
    """
    room = simulate_room(number)
    world_from_source, world_from_target, shared = _sensors(number, overlap)
    if noise_percent is not None:
        noise = noise_percent / 100 * float(np.linalg.norm(room.size))
    made = Simulation(room, world_from_source, world_from_target, rays, noise, outliers, shared)
    rng = np.random.default_rng([number, 1])
    source = _clutter(room.scan(world_from_source, rays[0], noise, seed=2 * number).points, outliers, rng)
    target = _clutter(room.scan(world_from_target, rays[1], noise, seed=2 * number + 1).points, outliers, rng)
    return target, source, np.linalg.inv(world_from_target) @ world_from_source, made


def surface(room: Room, world_from_sensor: np.ndarray, rays: int) -> np.ndarray:
    """The points (N, 3) that a sensor sees, without noise, in the world frame."""
    points = room.scan(world_from_sensor, rays, noise=0).points
    return points @ world_from_sensor[:3, :3].T + world_from_sensor[:3, 3]


def _clutter(points: np.ndarray, share: float, rng: np.random.Generator) -> np.ndarray:
    """The points, `share` of them replaced by points anywhere in their bounding box."""
    lost = rng.permutation(len(points))[: round(share * len(points))]
    cluttered = points.copy()
    cluttered[lost] = rng.uniform(points.min(axis=0), points.max(axis=0), (len(lost), 3))
    return cluttered


@cache
def _sensors(number: int, overlap: float) -> tuple[np.ndarray, np.ndarray, float]:
    """world_from_source, world_from_target and their overlap, within 0.02 (0.01 below 0.2) of what is asked."""
    room, rng = simulate_room(number), np.random.default_rng([number, round(1000 * overlap)])
    while True:
        start, end = _free_pose(room, rng), _free_pose(room, rng)
        found = _move_until(room, start, end, overlap)
        if found is not None and _is_free(room, found[0]):
            return start, *found


def _move_until(room: Room, start: np.ndarray, end: np.ndarray, overlap: float) -> tuple[np.ndarray, float] | None:
    """The pose on the way from start to end that still shares this much; None where no pose on the way does."""
    turn = Rotation.from_matrix(end[:3, :3] @ start[:3, :3].T).as_rotvec()
    step = end[:3, 3] - start[:3, 3]
    seen = surface(room, start, SKETCH)
    near, far = 0.0, 1.0
    if _shared(room, start, seen, end) > overlap:
        return None
    for _ in range(10):
        middle = (near + far) / 2
        pose = _pose(Rotation.from_rotvec(middle * turn).as_matrix() @ start[:3, :3], start[:3, 3] + middle * step)
        share = _shared(room, start, seen, pose)
        if abs(share - overlap) < (0.02 if overlap >= 0.2 else 0.01):
            return pose, share
        near, far = (middle, far) if share > overlap else (near, middle)
    return None


def _shared(room: Room, start: np.ndarray, seen: np.ndarray, pose: np.ndarray) -> float:
    """The smaller of the two shares: of what one sensor sees, that the other sees too."""
    return float(min(room.sees(pose, seen).mean(), room.sees(start, surface(room, pose, SKETCH)).mean()))


def _free_pose(room: Room, rng: np.random.Generator) -> np.ndarray:
    """A sensor at a person's height, turned anywhere, that keeps clear of everything and looks into the room."""
    x, y, _ = room.size
    while True:
        position = rng.uniform((0.5, 0.5, 1.0), (x - 0.5, y - 0.5, 1.9))
        yaw, pitch, roll = rng.uniform(-180, 180), 5 + 10 * rng.standard_normal(), 8 * rng.standard_normal()
        pose = _pose(Rotation.from_euler("ZYX", [yaw, pitch, roll], degrees=True).as_matrix(), position)
        if _is_free(room, pose):
            return pose


def _is_free(room: Room, pose: np.ndarray) -> bool:
    ranges = np.linalg.norm(room.scan(pose, SKETCH, noise=0).points, axis=1)
    return bool(ranges.min() > 0.4 and np.median(ranges) > 1.5)


def _pose(R: np.ndarray, position: np.ndarray) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, position
    return T
