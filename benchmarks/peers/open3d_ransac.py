"""Open3D: RANSAC on FPFH features, settings of its tutorial; refined by small_gicp."""

from __future__ import annotations

import numpy as np
import open3d as o3d

from . import gicp
from .open3d_features import prepare

registration = o3d.pipelines.registration


def align(source, target, voxel, threads, init=None) -> np.ndarray:
    (a, a_features), (b, b_features) = prepare(source, voxel), prepare(target, voxel)
    reach = 1.5 * voxel
    found = registration.registration_ransac_based_on_feature_matching(
        a,
        b,
        a_features,
        b_features,
        mutual_filter=True,
        max_correspondence_distance=reach,
        estimation_method=registration.TransformationEstimationPointToPoint(False),
        ransac_n=3,
        checkers=[
            registration.CorrespondenceCheckerBasedOnEdgeLength(0.9),
            registration.CorrespondenceCheckerBasedOnDistance(reach),
        ],
        criteria=registration.RANSACConvergenceCriteria(100_000, 0.999),
    )
    return gicp.refine(source, target, voxel, threads, found.transformation)
