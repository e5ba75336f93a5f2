"""Two scans of one simulated room, their exact relative pose and their exact overlap."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...errors import ArgumentError
from ...motions import exp_twist, inverse, translation
from ..cloud import PointCloud
from .primitives import Array
from .room import Room, simulate_room
from .scene import check_count, generator

MAX_ANGLE = float(np.radians(45))  # between the two sensors: the range of the paper's indoor experiment
MAX_SHIFT = 0.8  # metres
ALLOWED_OVERLAP = (0.4, 0.95)  # such motions give these

_ATTEMPTS = 200
_HALVINGS = 8
_SKETCH = 2000  # rays that are enough to judge a pose
_CLEARANCE = 0.4  # metres: no sensor inside a piece of furniture or right before a wall


@dataclass(frozen=True, eq=False)
class ScanPair:
    """Two scans, each in its own sensor frame, and the truth about them.

    source, target: what each sensor measured, noise included.
    T_target_source: (4, 4), maps source points into the target frame; exact.
    overlap: share of the source's surface points that the target sensor sees too, 0..1; exact.
    world_from_target: (4, 4), the target sensor in the room.
    """

    source: PointCloud
    target: PointCloud
    T_target_source: Array
    overlap: float
    world_from_target: Array


def simulate_pair(seed: int = 0, points: int = 100_000, overlap: float = 0.6, noise: float = 0.005) -> ScanPair:
    """Two scans of `simulate_room(seed)`, `points` points each, with an overlap within 0.05 of what is asked.

    The sensors are at most 45 degrees (about a general axis) and 0.8 m apart. noise: of the range, metres.
    Raises ArgumentError for an overlap that such motions do not give, and for what Scene.scan refuses.
    """
    low, high = ALLOWED_OVERLAP
    if not low <= overlap <= high:
        raise ArgumentError(f"overlap must be a share from {low} to {high}, but is {overlap}")
    check_count(points, "points")
    room = simulate_room(seed)
    rng = generator(seed, stream=1)  # another stream than the room's own
    world_from_source, world_from_target = _poses(room, overlap, rng)
    source_seed, target_seed = rng.integers(2**32, size=2)
    return ScanPair(
        source=room.scan(world_from_source, points, noise, seed=int(source_seed)),
        target=room.scan(world_from_target, points, noise, seed=int(target_seed)),
        T_target_source=inverse(world_from_target) @ world_from_source,
        overlap=float(room.sees(world_from_target, _surface(room, world_from_source, points)).mean()),
        world_from_target=world_from_target,
    )


def _poses(room: Room, overlap: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """world_from_source and world_from_target of the first drawn pair with about this overlap."""
    for _ in range(_ATTEMPTS):
        world_from_source = _handheld_pose(room, rng)
        turn, shift = _longest_motion(rng)
        if _is_free(room, world_from_source):
            world_from_target = _move_until(room, world_from_source, turn, shift, overlap)
            if world_from_target is not None and _is_free(room, world_from_target):
                return world_from_source, world_from_target
    raise ArgumentError(f"overlap {overlap} is met by none of {_ATTEMPTS} drawn motions; ask for about 0.6")


def _move_until(room: Room, start: Array, turn: Array, shift: Array, overlap: float) -> Array | None:
    """The pose, on the way from `start` by (turn, shift), that still sees this share of what `start` sees.

    None where even the end of the way sees more, or where the share jumps past `overlap` (behind an edge).
    """
    surface = _surface(room, start, _SKETCH)
    near, far = 0.0, 2.0  # the first middle is the end of the way
    for _ in range(_HALVINGS):
        middle = (near + far) / 2
        pose = _pose(_rotation(middle * turn) @ start[:3, :3], start[:3, 3] + middle * shift)
        share = float(room.sees(pose, surface).mean())
        if share > overlap and middle == 1:
            return None
        near, far = (middle, far) if share > overlap else (near, middle)
    return pose if abs(share - overlap) < 0.02 else None


def _surface(room: Room, world_from_sensor: Array, rays: int) -> Array:
    """The noise-free points (N, 3) that a sensor sees, in the world frame."""
    points = room.scan(world_from_sensor, rays, noise=0).points
    return np.asarray(points @ world_from_sensor[:3, :3].T + world_from_sensor[:3, 3])


def _is_free(room: Room, world_from_sensor: Array) -> bool:
    """Whether the sensor keeps clear of everything and looks into the room, not at a wall right before it."""
    ranges = np.linalg.norm(room.scan(world_from_sensor, _SKETCH, noise=0).points, axis=1)
    return bool(ranges.min() > _CLEARANCE and np.median(ranges) > 2)


def _handheld_pose(room: Room, rng: np.random.Generator) -> Array:
    """A sensor in a standing person's hands, turned to the middle of the room more or less."""
    x, y, _ = room.size
    position = rng.uniform((0.6, 0.6, 1.2), (x - 0.6, y - 0.6, 1.8))
    ahead = np.arctan2(y / 2 - position[1], x / 2 - position[0])
    yaw, pitch, roll = np.array([ahead, 0.1, 0.0]) + np.radians([25, 6, 4]) * rng.standard_normal(3)
    R = _rotation([0, 0, yaw]) @ _rotation([0, pitch, 0]) @ _rotation([roll, 0, 0])
    return _pose(R, position)


def _longest_motion(rng: np.random.Generator) -> tuple[Array, Array]:
    """Rotation vector (rad), mostly about the vertical, and shift (m) of the longest motion to try."""
    axis = np.array([0, 0, rng.choice((-1, 1))]) + 0.35 * rng.standard_normal(3)
    step = rng.standard_normal(3) * (1, 1, 0.3)
    length = rng.uniform(0.2, MAX_SHIFT)
    return MAX_ANGLE * axis / np.linalg.norm(axis), length * step / np.linalg.norm(step)


def _rotation(vector: ArrayLike) -> Array:
    """The rotation matrix (3, 3) of a rotation vector (axis times angle in rad)."""
    return exp_twist(np.r_[np.asarray(vector, float), 0, 0, 0])[:3, :3]


def _pose(R: Array, position: Array) -> Array:
    """The (4, 4) pose of a rotation and a position."""
    T = translation(position)
    T[:3, :3] = R
    return T
