"""The lengths of a drive, read from its scans: nobody is asked for one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..errors import ArgumentError
from ..scale import scale_of

FEWEST = 5         # points of a plane
FLATNESS = 0.2     # of its variance along the shorter axis: what is thicker across is no plane
WIDTH = 0.15       # voxels, of its deviation along that axis: what is narrower is the trace of a beam, no plane
THINNING = 0.4     # voxels: points for the map lie no closer
_CELLS = 1500      # that a scan's surface fills in the middle of the voxels that are tried
_TRIED = 2.0 ** np.arange(-1, 1.6, 0.25)  # of that
_WIDER = 2         # steps of these, to the voxel whose planes tell the thickness
_PLANES = 650      # of a scan: so many are enough, and larger voxels are faster
_ENOUGH = 0.75     # of the largest share of planes: at smaller voxels, most hold the trace of a single beam
_SMOOTH = 40.0     # voxels to the planes' thickness, at least: the noise of a beam tilts planes that are short
_FEWEST_POINTS = 100
_RANGES = 1000     # points that the range is read from
_AWAY = 100        # extents: no sensor looks at so little of its surroundings
_FAR = 1.5         # of the range of nearly all points: what lies farther is no surface that will be seen again


@dataclass(frozen=True)
class Measure:
    """The edge of a voxel, and the range beyond which nothing is used, both in the scans' unit."""

    voxel: float
    range: float


def measure_of(points: NDArray[Any], voxel: float | None) -> Measure | None:
    """The lengths that a first scan (N, 3) tells; None where it has too few points to tell any.

    Raises ArgumentError for one that is in the coordinates of a map.
    """
    seen = points[np.isfinite(points).all(axis=1) & (points != 0).any(axis=1)]
    if len(seen) < _FEWEST_POINTS or not np.ptp(seen, axis=0).any():
        return None
    seen = np.ascontiguousarray(seen)
    _check_frame(seen)
    reach = range_of(seen)
    return Measure(voxel or natural_voxel(seen, reach), reach)


def _check_frame(seen: NDArray[Any]) -> None:
    bounds, middle = _core.survey(seen, 1)
    away, extent = float(np.linalg.norm(middle)), float(np.linalg.norm(np.ptp(bounds, axis=0)))
    if away > _AWAY * extent:
        raise ArgumentError(f"cloud must be in the frame of its sensor, but lies {away:.3g} from its origin, over an "
                            f"extent of {extent:.3g}")


def natural_voxel(points: NDArray[Any], reach: float) -> float:
    """The edge (length) of voxels for the planes of a scan (N, 3) within a range: no smaller than where it shows some
    number of them, where most of the planes show that ever do, and some multiple of these planes' thickness."""
    tried = scale_of(points, 1, _CELLS).voxel * _TRIED
    planes, cells, thickness = np.array([_planes(points, reach, float(voxel)) for voxel in tried]).T
    shares = (planes / np.maximum(cells, 1))[:-_WIDER]
    k = int(np.argmax(shares >= _ENOUGH * shares.max()))
    return float(max(_crossing(tried, planes), tried[k], _SMOOTH * thickness[k + _WIDER]))


def _crossing(tried: NDArray[np.float64], planes: NDArray[np.float64]) -> float:
    """The largest voxel with enough planes, between two that were tried by its share of the step; 0 for none."""
    enough = np.flatnonzero(planes >= _PLANES)
    if not len(enough):
        return 0.0
    k = int(enough[-1])
    if k + 1 == len(tried):
        return float(tried[k])
    share = np.log(planes[k] / _PLANES) / np.log(planes[k] / max(planes[k + 1], 1.0))
    return float(tried[k] * (tried[k + 1] / tried[k]) ** share)


def _planes(points: NDArray[Any], reach: float, voxel: float) -> tuple[int, int, float]:
    """How many planes there are, how many occupied voxels, and how thick the planes are (a length)."""
    voxels = _core.VoxelMap(voxel)
    voxels.add(_core.thin_scan(points, None, 0.0, 1, THINNING * voxel, 0.0, reach), np.eye(4), np.inf)
    least, middle = voxels.planes(FEWEST)[3].T
    flat = (least < FLATNESS * middle) & (middle > (WIDTH * voxel) ** 2)
    return int(flat.sum()), len(voxels), float(np.sqrt(np.median(least[flat]))) if flat.any() else 0.0


def range_of(points: NDArray[Any]) -> float:
    """The range (length) within which nearly all points (N, 3) lie, and half as much again; 0 where there are none."""
    sample = np.asarray(points[:: max(1, len(points) // _RANGES)], float)
    ranges = np.sqrt((sample**2).sum(axis=1))
    ranges = ranges[np.isfinite(ranges) & (ranges > 0)]
    return float(_FAR * np.quantile(ranges, 0.99)) if len(ranges) else 0.0
