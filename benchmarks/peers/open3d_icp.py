"""Open3D: multi-scale ICP, point to plane, from a guess; also the refinement after FGR.

A loop over registration_icp, not t.pipelines.registration.multi_scale_icp: on the same levels that was two to ten times
as slow (it wants normals of the full cloud) and no more accurate. Tukey's loss on the middle level and a short reach on
the last one, 0.4 voxels as in Open3D's tutorial, halve the error; on the coarse level Tukey's loss loses pairs.
"""

from __future__ import annotations

import numpy as np
import open3d as o3d

registration = o3d.pipelines.registration
COARSE, MIDDLE, LAST = (2.0, 20.0, False), (1.0, 3.0, True), (0.25, 0.4, False)  # sampling, reach in voxels; robust


def align(source, target, voxel, threads, init=None) -> np.ndarray:
    """Three levels from init, or from the centroids laid on each other."""
    if init is None:
        init = np.eye(4)
        init[:3, 3] = target.mean(axis=0) - source.mean(axis=0)
    return _levels((COARSE, MIDDLE, LAST), source, target, voxel, init)


def refine(source, target, voxel, init) -> np.ndarray:
    """Two levels from the pose that a search has found."""
    return _levels((MIDDLE, LAST), source, target, voxel, init)


def _levels(levels, source, target, voxel, T) -> np.ndarray:
    criteria = registration.ICPConvergenceCriteria(1e-6, 1e-6, 30)  # Open3D's own
    clouds = [o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points)) for points in (source, target)]
    for sampling, reach, robust in levels:
        moving, fixed = (cloud.voxel_down_sample(sampling * voxel) for cloud in clouds)
        fixed.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(max(1.0, 2 * sampling) * voxel, 30))
        loss = [registration.TukeyLoss(0.5 * voxel)] if robust else []
        estimation = registration.TransformationEstimationPointToPlane(*loss)
        T = registration.registration_icp(moving, fixed, reach * voxel, T, estimation, criteria).transformation
    return T
