"""Open3D's multiway registration, after its reconstruction system, of scans in any order and pose.

All pairs are registered, by FPFH and RANSAC or by KISS-Matcher, refined by ICP, point to plane, on two levels, and kept
where 0.3 of the smaller cloud corresponds, which is Open3D's own rule for pairs that are not successive. The graph
starts along the tree of the edges with most correspondences; all edges are uncertain, so that the line process may
prune any. With the tree's edges certain, as odometry is in its tutorial, no wrong one could be taken back.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np
import open3d as o3d
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree

from .kiss import VOXEL
from .open3d_features import prepare

registration = o3d.pipelines.registration
REACH, COARSE = 1.4, 3.0  # voxels, of the two levels of ICP and of the information, as there
LEAST = 0.3
PRUNE = 0.25


def assemble(clouds: list[np.ndarray], voxel: float, find: str) -> tuple[list, list[list[int]], int]:
    """world_from_cloud (4, 4) of each cloud, or None; the components; and the number of pairs. find: ransac or kiss."""
    prepared = [(*prepare(cloud, voxel), cloud) for cloud in clouds]
    pair = {"ransac": _by_ransac, "kiss": _by_kiss}[find]
    pairs = list(combinations(range(len(clouds)), 2))
    edges = {ij: edge for ij in pairs if (edge := _edge(*(prepared[k] for k in ij), voxel, pair)) is not None}
    poses, components = _optimised(len(clouds), edges, voxel) if edges else ([None] * len(clouds), [])
    return poses, components, len(pairs)


def _edge(target: tuple, source: tuple, voxel: float, find: Callable) -> tuple[np.ndarray, np.ndarray] | None:
    """T_target_source and its information (6, 6), or None where too little corresponds."""
    T = find(source, target, voxel)
    estimation = registration.TransformationEstimationPointToPlane()
    for reach in (COARSE, REACH):
        T = registration.registration_icp(source[0], target[0], reach * voxel, T, estimation).transformation
    information = registration.get_information_matrix_from_point_clouds(source[0], target[0], REACH * voxel, T)
    share = information[5, 5] / min(len(source[0].points), len(target[0].points))
    return (np.array(T), information) if share >= LEAST else None


def _by_ransac(source: tuple, target: tuple, voxel: float) -> np.ndarray:
    """As in open3d_ransac.py, but each cloud's features are computed once for all of its pairs."""
    reach = 1.5 * voxel
    found = registration.registration_ransac_based_on_feature_matching(
        source[0],
        target[0],
        source[1],
        target[1],
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
    return found.transformation


def _by_kiss(source: tuple, target: tuple, voxel: float) -> np.ndarray:
    """As in kiss.py, without small_gicp."""
    import kiss_matcher

    matcher = kiss_matcher.KISSMatcher(kiss_matcher.KISSMatcherConfig(VOXEL))
    found = matcher.estimate(*((VOXEL / voxel * cloud).astype(np.float32) for *_, cloud in (source, target)))
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = found.rotation, np.asarray(found.translation) * (voxel / VOXEL)
    return T


# ------------------------------------------------------------------------------------------------ graph


def _optimised(count: int, edges: dict, voxel: float) -> tuple[list, list[list[int]]]:
    """Poses and components after Open3D's global optimisation, which prunes edges."""
    graph = registration.PoseGraph()
    for T in _along_tree(count, edges):
        graph.nodes.append(registration.PoseGraphNode(T))
    for (i, j), (T, information) in edges.items():  # an edge maps its first node into the frame of its second
        graph.edges.append(registration.PoseGraphEdge(j, i, T, information, uncertain=True))
    registration.global_optimization(
        graph,
        registration.GlobalOptimizationLevenbergMarquardt(),
        registration.GlobalOptimizationConvergenceCriteria(),
        registration.GlobalOptimizationOption(REACH * voxel, PRUNE, 1.0, 0),
    )
    kept = {(e.target_node_id, e.source_node_id): 1.0 for e in graph.edges}
    _, label = connected_components(_matrix(count, kept), directed=False)
    components = [np.flatnonzero(label == c).tolist() for c in range(label.max() + 1)]
    components = sorted((c for c in components if len(c) > 1), key=len, reverse=True)
    joined = {k for members in components for k in members}
    return [np.array(node.pose) if k in joined else None for k, node in enumerate(graph.nodes)], components


def _along_tree(count: int, edges: dict) -> np.ndarray:
    """Poses (n, 4, 4) along the tree of the edges with most correspondences, from a root in each component."""
    tree = minimum_spanning_tree(_matrix(count, {ij: 1 / information[5, 5] for ij, (_, information) in edges.items()}))
    poses, seen = np.tile(np.eye(4), (count, 1, 1)), set()
    for root in range(count):
        if root not in seen:
            order, before = breadth_first_order(tree, root, directed=False)
            seen |= {int(k) for k in order}
            for k in map(int, order[1:]):
                i = int(before[k])
                T = edges[i, k][0] if (i, k) in edges else np.linalg.inv(edges[k, i][0])
                poses[k] = poses[i] @ T
    return poses


def _matrix(count: int, weights: dict):
    ends = np.array(list(weights), int).reshape(-1, 2).T
    return coo_array((np.array(list(weights.values()), float), tuple(ends)), shape=(count, count)).tocsr()
