"""Open3D: fast global registration on FPFH features, then its ICP, point to plane.

Settings of its tutorial, with decrease_mu switched on: without it, nearly half of the indoor pairs that it can find are
lost.
"""

from __future__ import annotations

import numpy as np
import open3d as o3d

from . import open3d_icp
from .open3d_features import prepare

registration = o3d.pipelines.registration


def align(source, target, voxel, threads, init=None) -> np.ndarray:
    (a, a_features), (b, b_features) = prepare(source, voxel), prepare(target, voxel)
    option = registration.FastGlobalRegistrationOption(maximum_correspondence_distance=0.5 * voxel, decrease_mu=True)
    found = registration.registration_fgr_based_on_feature_matching(a, b, a_features, b_features, option)
    return open3d_icp.refine(source, target, voxel, found.transformation)
