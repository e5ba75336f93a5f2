"""The scale of a cloud, read from the cloud itself: nobody is asked for a length."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _core

_SAMPLE = 16_384  # points that a scale is read from
_CELLS = 3000     # occupied cells at the natural voxel: enough to know the shape, few enough to be quick
_MOST_CELLS = 30_000  # of the larger cloud of a pair


@dataclass(frozen=True)
class Scale:
    """Two lengths of a cloud, in its unit, and where it is.

    voxel: the edge at which its surface fills some three thousand cells.
    finest: the edge at which half of its points are alone in their cells; surfels need cells of twice that.
    core: (2, 3), the corners of a generous box around it; what lies outside are far outliers.
    """

    voxel: float
    finest: float
    core: NDArray[np.float64]

    def scaled(self, factor: float) -> Scale:
        """That of the cloud with all lengths times `factor`."""
        return Scale(factor * self.voxel, factor * self.finest, factor * self.core)


def scale_of(points: NDArray[Any], threads: int, cells: int = _CELLS) -> Scale:
    """The scale of points (N, 3), at which their surface fills so many cells. Cells count that hold two points or more,
    so that scattered outliers count little."""
    core, edge, shared, company = _core.occupancy(points, _SAMPLE, threads)
    sizes = np.array([edge * 0.5**k for k in range(len(shared))])
    peak = int(np.argmax(shared))
    voxel = _crossing(shared[: peak + 1], sizes, min(cells, 0.8 * shared[peak]))
    finest = _crossing(1 - company, sizes, 0.5)
    # A sample of a surface lies sparser than the points themselves, by the root of its share.
    return Scale(voxel, finest * float(np.sqrt(min(1.0, _SAMPLE / len(points)))), core)


def common_voxel(one: Scale, other: Scale) -> float:
    """The voxel for a pair: that of the smaller cloud, but no finer than both can fill."""
    small, large = sorted((one.voxel, other.voxel))
    return max(small, large * float(np.sqrt(_CELLS / _MOST_CELLS)), 2 * one.finest, 2 * other.finest)


def within(core: NDArray[np.float64], points: NDArray[Any], bounds: NDArray[np.float64]) -> NDArray[Any]:
    """The points (N, 3) inside a core (2, 3); the same array where their bounds (2, 3) are, or hardly any is inside."""
    if (bounds[0] >= core[0]).all() and (bounds[1] <= core[1]).all():
        return points
    inside = ((points >= core[0]) & (points <= core[1])).all(axis=1)
    return np.ascontiguousarray(points[inside]) if inside.sum() >= 3 else points


def _crossing(series: NDArray[np.float64], sizes: NDArray[np.float64], level: float) -> float:
    """The largest size at which a series reaches a level; between two halvings, by its share of the step."""
    k = int(np.argmax(series >= level))
    if k == 0:
        return float(sizes[0 if series[0] >= level else -1])
    share = (level - series[k - 1]) / (series[k] - series[k - 1])
    return float(sizes[k - 1] * 0.5**share)
