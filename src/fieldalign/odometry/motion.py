"""Constant velocity: where the sensor should be by now, and how far off that has been of late."""

from __future__ import annotations

from math import sqrt

import numpy as np

from .. import _core
from ..fields.protocol import Floats
from ..motions import exp_twist

_REMEMBERED = 30  # steps, of how far off predictions were
_UNKNOWN = 2.0    # voxels: how far off they may be at first
_RUN = 6.0        # residuals that err together, as those of a beam do: so many count as one beside the prediction
_KNOWN = 10       # steps, after which it is known how far predictions are off
_LEAST = 0.1      # voxels: how far off they may be at any time
ARM = 10.0        # voxels: at that range a turn counts by what it moves


class SteadyMotion:
    """Pose (4, 4) world_from_sensor in the middle of the last sweep, and the sensor's velocity, a twist (6,) a second
    in its own frame."""

    def __init__(self, voxel: float) -> None:
        self.pose: Floats = np.eye(4)
        self.velocity: Floats = np.zeros(6)
        self._arm, self._least = ARM * voxel, _LEAST * voxel
        self._square, self._seen = (_UNKNOWN * voxel) ** 2, 0

    def predicted(self, seconds: float) -> Floats:
        """The pose (4, 4) after so many seconds."""
        return self.pose @ exp_twist(self.velocity * seconds)

    def between(self, pose: Floats, seconds: float) -> Floats:
        """The velocity (6,) that leads to a pose (4, 4) in so many seconds."""
        return _core.relative_twist(self.pose, pose) / seconds

    def size(self, twist: Floats) -> float:
        """By how much a twist (6,) moves what is near the sensor (a length)."""
        w, v = twist[:3], twist[3:]
        return sqrt(w @ w) * self._arm + sqrt(v @ v)

    def surprise(self, pose: Floats, seconds: float) -> float:
        """How far a pose (4, 4) is off the one predicted for then (a length)."""
        return self.size((self.between(pose, seconds) - self.velocity) * seconds)

    @property
    def spread(self) -> float:
        """How far off predictions are, root mean square (a length)."""
        return max(sqrt(self._square), self._least)

    @property
    def trust(self) -> float:
        """How much a prediction weighs beside residuals of unit variance (1 / length squared); none at first."""
        return _RUN / self.spread**2 if self._seen >= _KNOWN else 0.0

    @property
    def covariance(self) -> Floats:
        """(6, 6) of one prediction, as a twist (w, v) about the sensor."""
        return np.asarray(self.spread**2 / 3 * np.diag([1 / self._arm**2] * 3 + [1.0] * 3))

    def follow(self, pose: Floats, seconds: float | None) -> None:
        """The next pose (4, 4), so many seconds after the last; None: it is but the prediction."""
        if seconds is not None:
            velocity = self.between(pose, seconds)
            self._seen += self._seen < _REMEMBERED
            off = self.size((velocity - self.velocity) * seconds)
            self._square += (off**2 - self._square) / self._seen
            self.velocity = velocity
        self.pose = pose
