"""One cloud of many scans: thinned, with normals, and each point's scan."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..clouds.cloud import PointCloud
from ..fields import PointField
from ..fields.protocol import Floats
from ..motions import apply
from .scan import ThinScan

Part: TypeAlias = tuple[Floats, NDArray[np.int32]]

_AT_ONCE = 4_000_000  # points that wait to be thinned
_NEIGHBOURS = 12


def fused(
    scans: Iterable[int], read: Callable[[int], ThinScan], poses: Sequence[Floats], voxel: float, threads: int
) -> PointCloud:
    """The scans of one component, moved by their poses (4, 4) and thinned by a voxel, a piece at a time."""
    waiting: list[Part] = []
    size = 0
    for scan in scans:
        moved = apply(poses[scan], read(scan).points)
        waiting.append((moved, np.full(len(moved), scan, np.int32)))
        size += len(moved)
        if size > _AT_ONCE:
            waiting, size = [_thinned(waiting, voxel, threads)], 0
    points, origins = _thinned(waiting, voxel, threads)
    normals = PointField(points, threads=threads).surfels(points, _NEIGHBOURS)[1]
    return PointCloud(points, normals=normals, attributes={"scan": origins})


def _thinned(parts: list[Part], voxel: float, threads: int) -> Part:
    """The first point of each voxel, as it was, and the scan that it came from."""
    points, origins = np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])
    bounds, _ = _core.survey(points, threads)
    rows = _core.thin(points, bounds, voxel, threads)[1]
    return np.ascontiguousarray(points[rows]), origins[rows]
