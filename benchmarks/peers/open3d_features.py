"""What Open3D's two feature-based methods share: thinned clouds with normals, and their FPFH features."""

from __future__ import annotations

import open3d as o3d

o3d.utility.set_verbosity_level(o3d.utility.VerbosityLevel.Error)


def prepare(points, voxel):
    """The thinned cloud with normals and its features; radii as in Open3D's tutorial on global registration."""
    within = o3d.geometry.KDTreeSearchParamHybrid
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points)).voxel_down_sample(voxel)
    cloud.estimate_normals(within(2 * voxel, 30))
    return cloud, o3d.pipelines.registration.compute_fpfh_feature(cloud, within(5 * voxel, 100))
