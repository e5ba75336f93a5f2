"""Open3D: plain ICP, point to point or point to plane, as papers have it for a baseline: all points, one scale.

A pair reaches 20 voxels, which loses none of what an unbounded reach finds on shapes, rooms and streets. At most 100
iterations, fewer where nothing changes any more: the 20 that Yuan & Nüchter give all methods on real data leave a room,
turned by up to 45 degrees, 2.5 degrees off in the median, where 100 reach 0.5; shapes are found with 50.
"""

from __future__ import annotations

import numpy as np
import open3d as o3d

registration = o3d.pipelines.registration
REACH = 20.0  # voxels
ITERATIONS, TOLERANCE = 100, 1e-9
NEIGHBOURS = 20  # of a normal


def align(source, target, voxel, threads, init=None, planes=False) -> np.ndarray:
    """From init, or from the centroids laid on each other."""
    if init is None:
        init = np.eye(4)
        init[:3, 3] = target.mean(axis=0) - source.mean(axis=0)
    moving, fixed = (o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points)) for points in (source, target))
    estimation = registration.TransformationEstimationPointToPoint()
    if planes:
        fixed.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(NEIGHBOURS))
        estimation = registration.TransformationEstimationPointToPlane()
    criteria = registration.ICPConvergenceCriteria(TOLERANCE, TOLERANCE, ITERATIONS)
    return registration.registration_icp(moving, fixed, REACH * voxel, init, estimation, criteria).transformation
