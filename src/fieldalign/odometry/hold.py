"""What the map holds of a scan's pose, and how well it is known."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..fields.protocol import Floats
from ..verdict import Certainty, split
from .track import Matched

MIN_HOLD = 1e-3  # of the best held direction's: less is what noise gives
_MODESTY = 4.0   # on the variance: what runs of residuals do not show; errors of beams, and of the map itself


@dataclass(frozen=True, eq=False)
class Hold:
    """What holds a scan where it was found, about the sensor, in the world's axes."""

    found: Matched

    @property
    def is_whole(self) -> bool:
        """Whether every direction is held."""
        return self.found.least_hold >= MIN_HOLD

    @property
    def held(self) -> Floats:
        """(6, 6), its columns are the twists that are held, or zero."""
        lever = np.array([1, 1, 1, self.found.lever, self.found.lever, self.found.lever])[:, None]
        values, vectors = np.linalg.eigh(self.found.hold * (lever * lever.T))
        return np.ascontiguousarray(vectors * (values >= MIN_HOLD * max(values[-1], 1e-300)) * lever)

    @cached_property
    def certainty(self) -> Certainty:
        """The covariance on what is held, and what is open."""
        found = self.found
        curvature = found.H / found.stretch
        return split(curvature, _MODESTY * found.scatter, found.hold, found.pose[:3, 3], found.lever, MIN_HOLD)
