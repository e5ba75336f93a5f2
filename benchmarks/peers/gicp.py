"""small_gicp: multi-scale GICP from a guess; also the refinement of the peers that search.

As it comes, but for the lengths, which go with the voxel: its tolerance of 1 mm would stop early on an object of 15 cm.
Tighter tolerances and point-to-plane were tried and give nothing. A last level at voxel / 4 with 20 neighbours instead
of voxel / 2 with 10 ("fine") is a tenth to a third more accurate and takes twice the time or more: both stand in the
benchmark.

"plain" is G-ICP as papers have it for a baseline (Segal et al. 2009): all points, one level, 20 neighbours to a
covariance, a reach of 20 voxels, at most 20 iterations; 100 give the same. Successive LiDAR scans and shapes it finds
as the three levels do; a room turned by up to 45 degrees it mostly does not.
"""

from __future__ import annotations

import numpy as np
import small_gicp

COARSE, MIDDLE, LAST = (2.0, 20.0, 10), (1.0, 3.0, 10), (0.5, 1.2, 10)  # sampling and reach of a pair in voxels,
FINE = (0.25, 0.4, 20)  # neighbours of a covariance
PLAIN_REACH, PLAIN_NEIGHBOURS, PLAIN_ITERATIONS = 20.0, 20, 20


def align(source, target, voxel, threads, init=None, fine=False, plain=False) -> np.ndarray:
    """Three levels from init, or from the centroids laid on each other; plain: a single one, of all points."""
    if init is None:
        init = np.eye(4)
        init[:3, 3] = target.mean(axis=0) - source.mean(axis=0)
    if plain:
        return _plain(source, target, voxel, threads, init)
    return _levels((COARSE, MIDDLE, FINE if fine else LAST), source, target, voxel, threads, init)


def refine(source, target, voxel, threads, init, fine=False) -> np.ndarray:
    """Two levels from the pose that a search has found."""
    return _levels((MIDDLE, FINE if fine else LAST), source, target, voxel, threads, init)


def _plain(source, target, voxel, threads, init) -> np.ndarray:
    clouds = [small_gicp.PointCloud(points) for points in (target, source)]
    trees = [small_gicp.KdTree(cloud, num_threads=threads) for cloud in clouds]
    for cloud, tree in zip(clouds, trees, strict=True):
        small_gicp.estimate_covariances(cloud, tree, num_neighbors=PLAIN_NEIGHBOURS, num_threads=threads)
    return small_gicp.align(
        *clouds,
        trees[0],
        init,
        registration_type="GICP",
        max_correspondence_distance=PLAIN_REACH * voxel,
        translation_epsilon=min(1e-3, 0.02 * voxel),
        max_iterations=PLAIN_ITERATIONS,
        num_threads=threads,
    ).T_target_source


def _levels(levels, source, target, voxel, threads, T) -> np.ndarray:
    for level in levels:
        T = aligned(level, source, target, voxel, threads, T)[0].T_target_source
    return T


def aligned(level, source, target, voxel, threads, T) -> tuple:
    """small_gicp's result on one level, and how many source points it had."""
    sampling, reach, neighbours = level
    (moving, _), (fixed, tree) = (
        small_gicp.preprocess_points(cloud, sampling * voxel, num_neighbors=neighbours, num_threads=threads)
        for cloud in (source, target)
    )
    found = small_gicp.align(
        fixed,
        moving,
        tree,
        T,
        registration_type="GICP",
        max_correspondence_distance=reach * voxel,
        translation_epsilon=min(1e-3, 0.02 * voxel),
        max_iterations=50,
        num_threads=threads,
    )
    return found, moving.size()
