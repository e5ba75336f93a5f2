"""How a sensor that spins sees its points one after the other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Spin:
    """A sensor turns about its z axis once in a sweep.

    turns: 1 counterclockwise, -1 clockwise, seen from above. begins: azimuth (rad) at which a sweep begins and ends.
    """

    turns: int
    begins: float

    def share(self, points: NDArray[Any]) -> NDArray[Any]:
        """How much of the sweep was over when each point (n, 3 or more) was seen, (n,), 0 to 1."""
        azimuth = np.arctan2(points[:, 1], points[:, 0])
        return np.asarray(np.mod(self.turns * (azimuth - self.begins) / (2 * np.pi), 1.0))
