"""Constant velocity: where the sensor should be by now, and how far off that has been of late."""

from __future__ import annotations

import numpy as np

from ..fields.protocol import Floats
from ..motions import exp_twist, inverse, log_motion

_REMEMBERED = 30  # steps, of how far off predictions were
_UNKNOWN = 2.0    # voxels: how far off they may be at first
_LEAST = 0.1      # voxels: how far off they may be at any time


class SteadyMotion:
    """Pose (4, 4) world_from_sensor in the middle of the last sweep, and the sensor's velocity, a twist (6,) a second
    in its own frame."""

    def __init__(self, voxel: float, reach: float) -> None:
        """reach: at which a turn counts by what it moves (a length)."""
        self.pose: Floats = np.eye(4)
        self.velocity: Floats = np.zeros(6)
        self._reach, self._least = reach, _LEAST * voxel
        self._square, self._seen = (_UNKNOWN * voxel) ** 2, 0

    def predicted(self, seconds: float) -> Floats:
        """The pose (4, 4) after so many seconds."""
        return self.pose @ exp_twist(self.velocity * seconds)

    @property
    def spread(self) -> float:
        """How far off predictions are, root mean square of what they moved far points by (a length)."""
        return float(max(np.sqrt(self._square), self._least))

    @property
    def covariance(self) -> Floats:
        """(6, 6) of one prediction, as a twist (w, v) about the sensor."""
        return np.asarray(self.spread**2 * np.diag([1 / self._reach**2] * 3 + [1.0] * 3) / 3)

    def off(self, pose: Floats, guess: Floats) -> tuple[float, float]:
        """By how much a guess is off a pose: a turn (rad), and a shift (a length)."""
        turn = np.sqrt(max(0.0, (3 - float((pose[:3, :3] * guess[:3, :3]).sum())))) # 2 sin(angle / 2)
        return float(turn), float(np.sqrt(((pose[:3, 3] - guess[:3, 3]) ** 2).sum()))

    def follow(self, pose: Floats, guess: Floats, seconds: float) -> None:
        """The next pose is known, and how far off the guess was."""
        turn, shift = self.off(pose, guess)
        self._seen += self._seen < _REMEMBERED
        self._square += ((turn * self._reach + shift) ** 2 - self._square) / self._seen
        self.velocity = self.between(pose, seconds)
        self.pose = pose

    def coast(self, guess: Floats) -> None:
        """Nothing is known of the next pose but the guess."""
        self.pose = guess

    def between(self, pose: Floats, seconds: float) -> Floats:
        """The velocity (6,) that leads to a pose (4, 4) in so many seconds."""
        return log_motion(inverse(self.pose) @ pose) / seconds
