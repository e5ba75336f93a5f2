"""What is kept of the steps of a drive: all that is known of the latest ones, of all of them the trajectory."""

from __future__ import annotations

from collections import deque

import numpy as np

from ..fields.protocol import Floats
from .result import OdometryResult
from .trajectory import Trajectory

_KEPT = 1000   # steps, of which all is kept
_NUMBERS = 1 + 16 + 36  # of a step in the trajectory: stamp, pose, covariance


class Record:
    """latest: the results of the latest steps. len(): how many steps there were.

    A result holds the sums behind its covariance, some kilobytes; of a step long ago its row of the trajectory is left.
    """

    def __init__(self) -> None:
        self.latest: deque[OdometryResult] = deque(maxlen=_KEPT)
        self._blocks: list[Floats] = []  # of as many rows each
        self._settled = 0

    def __len__(self) -> int:
        return self._settled + len(self.latest)

    def add(self, result: OdometryResult) -> None:
        """The result of the next step."""
        if len(self.latest) == _KEPT:
            if self._settled % _KEPT == 0:
                self._blocks.append(np.empty((_KEPT, _NUMBERS)))
            self._blocks[-1][self._settled % _KEPT] = _row(self.latest[0])
            self._settled += 1
        self.latest.append(result)

    @property
    def trajectory(self) -> Trajectory:
        """The stamps, poses and covariances of all steps; those of the latest are worked out here."""
        latest = np.reshape([_row(result) for result in self.latest], (-1, _NUMBERS))
        rows = np.concatenate([np.concatenate([*self._blocks, latest[:0]])[: self._settled], latest])
        return Trajectory(rows[:, 0], rows[:, 1:17].reshape(-1, 4, 4), rows[:, 17:].reshape(-1, 6, 6))


def _row(result: OdometryResult) -> Floats:
    return np.concatenate([[result.stamp], result.pose.ravel(), result.covariance.ravel()])
