"""A trajectory: the poses of a sensor, one for each frame."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..arguments import LARGEST, as_numbers
from ..errors import ArgumentError
from ..motions import Matrix, inverse

_LOOSEST = 1e-3  # that R R^T may differ from the identity: files of other tools have few digits


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The poses of a sensor in the order of its frames; nothing is changed or dropped on the way in.

    times: (n,), seconds. A clock that jumped makes times that do not grow.
    poses: (n, 4, 4), world_from_sensor.
    covariances: (n, 6, 6) or None, of each pose; twist order (w, v).
    has_times: False where nothing tells the time, as in KITTI's files of poses; then times are the frames' numbers.

    Raises ArgumentError where a shape does not fit, a value is not finite or a pose is not rigid.
    """

    times: Matrix
    poses: Matrix
    covariances: Matrix | None = None
    has_times: bool = True

    def __post_init__(self) -> None:
        times, poses = as_numbers(self.times, "times"), as_numbers(self.poses, "poses")
        if times.ndim != 1:
            raise ArgumentError(f"times must have shape (n,), but has shape {times.shape}")
        _check_shape(poses, (len(times), 4, 4), "poses")
        _check_finite(times, "times")
        _check_rigid(poses)
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "poses", poses)
        if self.covariances is not None:
            covariances = as_numbers(self.covariances, "covariances")
            _check_shape(covariances, (len(times), 6, 6), "covariances")
            object.__setattr__(self, "covariances", covariances)

    def __len__(self) -> int:
        return len(self.times)

    def __getitem__(self, rows: Any) -> Trajectory:
        """The poses of an index array, slice or mask."""
        covariances = None if self.covariances is None else self.covariances[rows]
        return Trajectory(self.times[rows], self.poses[rows], covariances, self.has_times)

    @property
    def positions(self) -> Matrix:
        """Where the sensor was, (n, 3)."""
        return self.poses[:, :3, 3]

    @property
    def distances(self) -> Matrix:
        """How far it had gone at each frame, (n,): the length of the path up to there."""
        steps = np.linalg.norm(np.diff(self.positions, axis=0), axis=1)
        return np.concatenate([np.zeros(min(len(self), 1)), np.cumsum(steps)])

    def in_world(self, T_new_world: Matrix) -> Trajectory:
        """The same trajectory in another world frame: poses T P. Without the covariances."""
        return replace(self, poses=T_new_world @ self.poses, covariances=None)

    def of_sensor(self, T_other_sensor: Matrix) -> Trajectory:
        """The trajectory of another sensor on the same body, whose world is its own first frame as this one's was:
        poses T P T^-1 (KITTI's truth is the camera's; calib.txt's Tr is T_camera_lidar). Without the covariances."""
        return replace(self, poses=T_other_sensor @ self.poses @ inverse(T_other_sensor), covariances=None)

    def __repr__(self) -> str:
        return f"Trajectory({len(self)} poses over {self.distances[-1] if len(self) else 0.0:.6g})"


def _check_shape(array: Matrix, shape: tuple[int, ...], name: str) -> None:
    if array.shape != shape:
        raise ArgumentError(f"{name} must have shape {shape} to go with {shape[0]} times, but has shape {array.shape}")


def _check_finite(array: Matrix, name: str) -> None:
    bad = ~np.isfinite(array).all(axis=tuple(range(1, array.ndim)))
    if bad.any():
        raise ArgumentError(f"{name} must be finite, but row {int(np.flatnonzero(bad)[0])} is not")


def _check_rigid(poses: Matrix) -> None:
    _check_finite(poses, "poses")
    R = poses[:, :3, :3]
    with np.errstate(all="ignore"):
        off = np.abs(R @ np.swapaxes(R, 1, 2) - np.eye(3)).max(axis=(1, 2), initial=0.0)
        is_mirrored = np.linalg.det(R) < 0
    far = np.abs(poses[:, :3, 3]).max(axis=1, initial=0.0) > LARGEST
    bad = ~(off <= _LOOSEST) | is_mirrored | far | (poses[:, 3] != [0, 0, 0, 1]).any(axis=1)
    if bad.any():
        row = int(np.flatnonzero(bad)[0])
        raise ArgumentError(f"poses must be rigid motions, but poses[{row}] is none: {poses[row].tolist()}")
