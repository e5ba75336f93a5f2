"""The lengths of a drive, read from its scans: nobody is asked for one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..scale import scale_of

FEWEST = 5         # points of a plane
FLATNESS = 0.2     # of its variance along the shorter axis: what is thicker across is no plane
WIDTH = 0.15       # voxels, of its deviation along that axis: what is narrower is the trace of a beam, no plane
THINNING = 0.4     # voxels: points for the map lie no closer
_CELLS = 1500      # that a scan's surface fills
_TRIED = 2.0 ** np.arange(-1, 1.6, 0.25)  # of the voxel that it does so with
_WIDER = 2         # steps of these, to the voxel whose planes tell the thickness
_ENOUGH = 0.75     # of the largest share of planes: at smaller voxels, most hold the trace of a single beam
_SMOOTH = 40.0     # voxels to the planes' thickness, at least: the noise of a beam tilts planes that are short
_FEWEST_POINTS = 100
_RANGES = 1000     # points that the range is read from
_FAR = 1.5         # of the range of nearly all points: what lies farther is no surface that will be seen again


@dataclass(frozen=True)
class Measure:
    """The edge of a voxel, and the range beyond which nothing is used, both in the scans' unit."""

    voxel: float
    range: float


def measure_of(points: NDArray[Any], voxel: float | None) -> Measure | None:
    """The lengths that a first scan (N, 3) tells; None where it has too few points to tell any."""
    seen = points[np.isfinite(points).all(axis=1) & (points != 0).any(axis=1)]
    if len(seen) < _FEWEST_POINTS or not np.ptp(seen, axis=0).any():
        return None
    seen = np.ascontiguousarray(seen)
    return Measure(voxel or natural_voxel(seen), range_of(seen))


def natural_voxel(points: NDArray[Any]) -> float:
    """The edge (length) of voxels for the planes of a scan (N, 3): no smaller than where its surface fills some number
    of cells, where most of the planes show that ever do, and some multiple of these planes' thickness."""
    usual = scale_of(points, 1, _CELLS).voxel
    planes = [_planes(points, float(voxel)) for voxel in usual * _TRIED]
    shares = np.array([share for share, _ in planes[:-_WIDER]])
    k = max(int(np.argmax(shares >= _ENOUGH * shares.max())), int(np.argmax(_TRIED == 1)))
    return float(max(usual * _TRIED[k], _SMOOTH * planes[k + _WIDER][1]))


def _planes(points: NDArray[Any], voxel: float) -> tuple[float, float]:
    """How many planes there are, as a share of the occupied voxels, and how thick they are (a length)."""
    voxels = _core.VoxelMap(voxel)
    voxels.add(_core.thin_scan(points, None, 0.0, 1, THINNING * voxel, 0.0, np.inf), np.eye(4), np.inf)
    least, middle = voxels.planes(FEWEST)[3].T
    flat = (least < FLATNESS * middle) & (middle > (WIDTH * voxel) ** 2)
    return float(flat.sum() / max(len(voxels), 1)), float(np.sqrt(np.median(least[flat]))) if flat.any() else 0.0


def range_of(points: NDArray[Any]) -> float:
    """The range (length) within which nearly all points (N, 3) lie, and half as much again; 0 where there are none."""
    sample = np.asarray(points[:: max(1, len(points) // _RANGES)], float)
    ranges = np.sqrt((sample**2).sum(axis=1))
    ranges = ranges[np.isfinite(ranges) & (ranges > 0)]
    return float(_FAR * np.quantile(ranges, 0.99)) if len(ranges) else 0.0
