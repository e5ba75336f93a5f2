"""What the map holds of a scan's pose, and how well it is known."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..fields.protocol import Floats
from ..verdict import Certainty, split
from .track import Matched

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
        """(6, 6), its columns are the twists that are held, or zero."""
        values, vectors = self._parts
        return np.ascontiguousarray(vectors * (values >= MIN_HOLD * max(values[-1], 1e-300)) * self._lever)

    def certainty(self) -> Certainty:
        """The covariance on what is held, and what is open."""
        return split(
            self.curvature, _MODESTY * self.scatter, self.hold, self.position, self.length, MIN_HOLD
        )


def hold_of(found: Matched) -> Hold:
    """What holds a scan where it was found."""
    H = found.H.ravel()[::7]
    turn, shift = float(H[:3].sum()), float(H[3:].sum())
    length = np.sqrt(turn / shift) if turn > 0 and shift > 0 else 1.0
    return Hold(found.hold, found.scatter, found.H / found.stretch, float(length), found.pose[:3, 3])
