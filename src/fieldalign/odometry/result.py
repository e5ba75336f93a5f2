"""What a step of odometry answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..fields.protocol import Floats
from ..verdict import Certainty, Freedom, freedoms
from .hold import Hold
from .reason import Tracking


@dataclass(frozen=True, eq=False)
class OdometryResult:
    """Where the sensor was, and how that is known.

    pose: (4, 4) world_from_sensor. stamp: of the pose, seconds, on a clock that never jumps; where no times were given,
        scans count as 1.
    reason: Tracking, what the step came to. tracked: whether the whole pose is the scan's, not the prediction's.
    points: how many pseudo points were aligned. agreement: share of them, of those on known surface, that lie on it.
    iterations: how many. seconds: time by stage. hold: the sums behind the covariance; None where nothing was aligned.
    prediction: (6, 6), covariance of the predictions since all was held.
    """

    pose: Floats
    stamp: float
    reason: Tracking
    points: int
    agreement: float
    iterations: int
    seconds: Mapping[str, float]
    hold: Hold | None
    prediction: Floats

    @property
    def tracked(self) -> bool:
        """Whether the scan itself tells the whole pose."""
        return self.reason.is_tracked

    @property
    def _known(self) -> Certainty | None:
        return None if self.hold is None else self.hold.certainty

    @cached_property
    def covariance(self) -> Floats:
        """(6, 6), twist order (w, v), a left perturbation in the world's axes about the sensor's place: of the pose
        against the map. Along what is not held it is that of the predictions since it last was."""
        if self._known is None:
            return self.prediction
        if not self._known.unobservable.shape[1]:
            return self._known.covariance
        lever = self._known.lever
        basis = np.linalg.qr(self._known.unobservable / lever)[0]
        onto_open = (lever * basis) @ (basis / lever).T
        return np.asarray(self._known.covariance + onto_open @ self.prediction @ onto_open.T)

    @property
    def unobservable(self) -> Floats:
        """(6, k), basis of the twists that nothing holds: along them the pose is the prediction's."""
        if self._known is None:
            return np.zeros((6, 0)) if self.reason is Tracking.FIRST else np.eye(6)
        return self._known.unobservable

    @property
    def freedoms(self) -> tuple[Freedom, ...]:
        """The same as axes: where the scan may slide, and about which lines it may turn."""
        return () if self._known is None else freedoms(self._known)
