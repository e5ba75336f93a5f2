"""A map that is known beforehand: as voxels that scans are tracked on, and as tiles that one is searched in."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..clouds.cloud import PointCloud
from ..fields.protocol import Floats
from ..motions import translation
from ..prepare import prepare_named
from ..prepared import PreparedCloud
from .local_map import COARSER, LocalMap
from .measure import THINNING, Measure

_SAMPLE = 2000   # points that the spacing is read from
_SPARSE = 0.3    # voxels: points that lie farther apart make no planes by themselves
_FEW = 4.0       # spacings to a voxel, so that there are enough points in it
_ROOM = 1.2      # spacings to a voxel, where each point stands for a plane
_DISC = 0.45     # spacings: the radius of the disc that such a point becomes
_AROUND = 8      # points of its rim
_REACH = 1.25    # of the distance between tiles: how far each reaches
_SHARE = 0.2     # of the usual number of points: parts with fewer are seen from those beside them


class KnownMap(LocalMap):
    """A map that never changes, for scans of some measure."""

    def __init__(self, cloud: PointCloud, measure: Measure) -> None:
        points = np.asarray(cloud.points, float)
        spacing, normals = spacing_of(points), cloud.normals
        if spacing < _SPARSE * measure.voxel or normals is None:
            voxel = max(measure.voxel, _FEW * spacing)
        else:
            voxel = max(measure.voxel, _ROOM * spacing)
            points = _discs(points, np.asarray(normals, float), _DISC * spacing)
        super().__init__(Measure(voxel, measure.range))
        middle = points.mean(axis=0)
        rows = np.zeros((len(points), 4), np.float32)  # from the middle, as they are float32
        rows[:, :3] = points - middle
        self.fine.add(rows, translation(middle), np.inf)
        self.coarse.add(_core.thin_scan(rows[:, :3].copy(), None, 0.0, 1, THINNING * COARSER * voxel, 0.0, np.inf),
                        translation(middle), np.inf)

    def add(self, points: NDArray[np.float32], sparse: NDArray[np.float32], pose: Floats) -> None:
        """Nothing: it stays as it is."""


def spacing_of(points: Floats) -> float:
    """The median distance (a length) from a point (N, 3) to the nearest other one."""
    from scipy.spatial import cKDTree

    sample = points[:: max(1, len(points) // _SAMPLE)]
    distances = np.asarray(cKDTree(points).query(sample, k=2)[0])
    return float(np.median(distances[:, 1]))


def _discs(points: Floats, normals: Floats, radius: float) -> Floats:
    """Each point (N, 3) and some around it on its plane."""
    aside = np.eye(3)[np.abs(normals).argmin(axis=1)]
    one = np.cross(normals, aside)
    one /= np.linalg.norm(one, axis=1, keepdims=True)
    other = np.cross(normals, one)
    angles = 2 * np.pi * np.arange(_AROUND) / _AROUND
    rim = np.cos(angles)[:, None, None] * one + np.sin(angles)[:, None, None] * other
    return np.concatenate([points[None], points + radius * rim]).reshape(-1, 3)


def tiles_of(cloud: PointCloud, reach: float, threads: int | None) -> list[PreparedCloud]:
    """The map in overlapping parts, each about as large as what a scan of this reach (a length) shows."""
    points = np.asarray(cloud.points, float)
    _, cell_of, counts = np.unique(
        np.floor((points - points.min(axis=0)) / reach).astype(int), axis=0, return_inverse=True, return_counts=True
    )
    tiles = []
    for cell in np.flatnonzero(counts >= _SHARE * np.median(counts)):
        middle = points[cell_of.ravel() == cell].mean(axis=0)
        near = ((points - middle) ** 2).sum(axis=1) < (_REACH * reach) ** 2
        tiles.append(prepare_named(points[near], "map", threads, True))
    return [tile for tile in tiles if isinstance(tile, PreparedCloud)]
