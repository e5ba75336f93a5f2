"""The map around the sensor: planes in voxels, once fine, and once coarse for when little is known of the motion."""

from __future__ import annotations

from .. import _core
from ..clouds.cloud import PointCloud
from ..fields.protocol import Floats
from .measure import FEWEST, Measure
from .scan import Rows

COARSER = 3.0  # times the voxel
_MOST = 100    # points of a voxel: then it stays as it is
_SWEPT = 10    # scans from one sweeping to the next


class LocalMap:
    """What was seen around the sensor: `fine` and `coarse`, each a VoxelMap, in the frame of the world."""

    def __init__(self, measure: Measure) -> None:
        self.voxel, self.reach = measure.voxel, measure.range
        self.fine = _core.VoxelMap(measure.voxel)
        self.coarse = _core.VoxelMap(COARSER * measure.voxel)
        self._added = 0

    def add(self, points: Rows, sparse: Rows, pose: Floats) -> None:
        """Points (M, 4) and fewer (K, 4) for the coarse map, seen from a pose (4, 4); what lies beyond the reach is
        left behind now and then."""
        self.fine.add(points, pose, _MOST)
        self.coarse.add(sparse, pose, _MOST)
        self._added += 1
        if self._added % _SWEPT == 0:
            for voxels in (self.fine, self.coarse):
                voxels.keep_within(pose[:3, 3].copy(), self.reach)

    def cloud(self) -> PointCloud:
        """One point with its normal for each voxel that has a plane, and how many points it stands for."""
        means, normals, counts, _ = self.fine.planes(FEWEST)
        return PointCloud(means, normals=normals, attributes={"count": counts})
