"""What a sensor looked through: where the other cloud has a surface there, the pose is wrong, or the scene changed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..alignment.residual import row_dot
from ..fields.protocol import Floats

_RETURNS = 4             # in a cell of directions, on average, if they were spread over the whole sphere
_FEWEST, _MOST = 8, 256  # cells along a quarter of a circle
_EDGE_ON = 0.2           # cosine between a surface's normal and the ray: a cell of directions is a degree or two wide
_SHORT = 3.0, 0.05       # voxels, and of the range: by more than both a place is short of what was seen behind it


class Sight:
    """How far a sensor that stood at `eye` (3,) saw in each direction; points: (N, 3), what it saw."""

    def __init__(self, points: Floats, eye: Floats) -> None:
        cells = int(np.clip(np.sqrt(len(points) / (6 * _RETURNS)), _FEWEST, _MOST))
        self._view, self._eye = _core.Sight(points, eye, cells), eye

    def looked_through(self, places: Floats, voxel: float, normals: Floats | None = None) -> NDArray[np.bool_]:
        """Which places (n, 3) the sensor looked through to something behind them, by some voxels (a length).

        normals: (n, 3), of the surface there, where it is known: one that it would see edge-on, as a wall from its own
        doorway, it looks past rather than through.
        """
        away = places - self._eye
        seen_to, distance = self._view.ranges(places), np.sqrt(row_dot(away, away))
        margin, share = _SHORT
        through = seen_to - distance > np.maximum(margin * voxel, share * seen_to)
        if normals is not None:
            through &= np.abs(row_dot(away, normals)) > _EDGE_ON * distance
        return np.asarray(through)
