"""What the map holds of a scan's pose, and how well it is known."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..alignment.steps import stretch_of
from ..fields.protocol import Floats
from ..verdict import Certainty, split
from .local_map import LocalMap
from .track import Matched, certainty_sums

MIN_HOLD = 1e-3  # of the best held direction's: less is what noise gives
_MODESTY = 1.0   # on the variance


@dataclass(frozen=True, eq=False)
class Hold:
    """What held a scan where it came to lie, all about the sensor, in the world's axes.

    hold: (6, 6), free of the normals' noise. scatter: (6, 6), of the gradient. curvature: (6, 6), its derivative.
    length: the lever over which turns and shifts are compared.
    """

    hold: Floats
    scatter: Floats
    curvature: Floats
    length: float
    position: Floats

    @cached_property
    def _parts(self) -> tuple[Floats, Floats]:
        values, vectors = np.linalg.eigh(self.hold * (self._lever * self._lever.T))
        return values, vectors

    @property
    def _lever(self) -> Floats:
        return np.array([1, 1, 1, self.length, self.length, self.length])[:, None]

    @property
    def is_whole(self) -> bool:
        """Whether every direction is held."""
        values = self._parts[0]
        return bool(values[0] >= MIN_HOLD * values[-1] > 0)

    @property
    def held(self) -> Floats:
        """Columns (6, m): the twists that are held."""
        values, vectors = self._parts
        return vectors[:, values >= MIN_HOLD * max(values[-1], 1e-300)] * self._lever

    def certainty(self) -> Certainty:
        """The covariance on what is held, and what is open."""
        return split(
            self.curvature, _MODESTY * self.scatter, self.hold, self.position, self.length, MIN_HOLD
        )


def hold_of(local: LocalMap, found: Matched) -> Hold:
    """What holds a scan where it was found."""
    hold, scatter = certainty_sums(local.fine, found, local.voxel)
    turn, shift = (float(np.trace(found.H[part, part])) for part in (slice(3), slice(3, 6)))
    length = np.sqrt(turn / shift) if turn > 0 and shift > 0 else 1.0
    curvature = found.H / stretch_of(found.totals[None])
    return Hold(hold, scatter, curvature, float(length), found.origin + found.motion[:3, 3])
