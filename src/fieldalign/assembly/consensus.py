"""Which edges to believe: wrong ones contradict the others around the cycles that they close."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..fields.protocol import Floats
from ..motions import inverse
from .pose_graph import Edge

_TREES = 40            # that are tried
_LOOSE, _PER_STEP = 2.0, 0.3  # voxels that an edge may be off around a cycle, and for each edge of the cycle


@dataclass(frozen=True, eq=False)
class Consensus:
    """poses: (n, 4, 4), each in the frame of its component's root. believed: (m,), the edges that agree with them."""

    poses: Floats
    believed: NDArray[np.bool_]


def consensus(count: int, edges: Sequence[Edge], voxels: Floats, extents: Floats, seed: int) -> Consensus:
    """The poses along the spanning trees with which most edges agree, weighed by their strength.

    voxels, extents: (m,) of the pairs, lengths: an edge agrees where it moves no place of the overlap further than some
    voxels, more around longer cycles. Trees prefer strong edges, and are drawn by a seeded generator.
    """
    rng = np.random.default_rng(seed)
    strength = np.array([edge.strength for edge in edges]) * (1 + _support(edges, voxels, extents)) ** 2
    best, best_score = None, -np.inf
    for trial in range(_TREES):
        # The first tree is that of the strongest edges; the others are drawn, strong edges first as a rule.
        weight = strength if trial == 0 else strength ** rng.uniform(0, 1) * rng.exponential(size=len(edges))
        poses, before = _along_tree(count, edges, weight)
        agrees = _agrees(edges, poses, _depth(before), voxels, extents)
        score = float((np.minimum(strength, 3 * np.median(strength)) * agrees).sum())
        if score > best_score + 1e-9:
            best, best_score = Consensus(poses, agrees), score
        if agrees.all():  # as on a graph without cycles
            break
    assert best is not None
    return best


def _support(edges: Sequence[Edge], voxels: Floats, extents: Floats) -> Floats:
    """How many triangles each edge closes (m,) that return to where they began: a wrong edge closes hardly any."""
    between = {frozenset((edge.i, edge.j)): k for k, edge in enumerate(edges)}
    partners: dict[int, set[int]] = {}
    for edge in edges:
        partners.setdefault(edge.i, set()).add(edge.j)
        partners.setdefault(edge.j, set()).add(edge.i)
    support = np.zeros(len(edges))
    for k, edge in enumerate(edges):
        for third in partners[edge.i] & partners[edge.j]:
            first, second = between[frozenset((edge.i, third))], between[frozenset((third, edge.j))]
            path = _from_to(edges[first], edge.i) @ _from_to(edges[second], third)
            error = edge.error_of(path)
            support[k] += _size(error[None], extents[k : k + 1])[0] <= (_LOOSE + 2 * _PER_STEP) * voxels[k]
    return support


def _from_to(edge: Edge, scan: int) -> Floats:
    """The other scan's pose in the frame of `scan`."""
    return edge.T_ij if edge.i == scan else inverse(edge.T_ij)


def _size(errors: Floats, extents: Floats) -> Floats:
    """How far errors (m, 6) move the places of an overlap, at most (m,)."""
    return np.asarray(np.linalg.norm(errors[:, 3:], axis=1) + np.linalg.norm(errors[:, :3], axis=1) * extents / 4)


def _along_tree(count: int, edges: Sequence[Edge], weight: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """Poses (n, 4, 4) along the spanning tree of the greatest weights, and the scan that each is from, -1 of a root."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree

    i, j = (np.array([getattr(edge, end) for edge in edges], int) for end in ("i", "j"))
    between = {(min(a, b), max(a, b)): k for k, (a, b) in enumerate(zip(i, j, strict=True))}
    tree = minimum_spanning_tree(csr_matrix((1 / weight, (i, j)), shape=(count, count)))
    _, component = connected_components(tree, directed=False)
    poses, above = np.tile(np.eye(4), (count, 1, 1)), np.full(count, -1)
    for root in np.unique(component, return_index=True)[1]:
        order, before = breadth_first_order(tree, root, directed=False)
        for scan in order[1:]:
            last = before[scan]
            poses[scan] = poses[last] @ _from_to(edges[between[min(last, scan), max(last, scan)]], last)
            above[scan] = last
    return poses, above


def _depth(before: NDArray[np.int64]) -> NDArray[np.int64]:
    """How many edges lead from each scan to its root."""
    depth, at = np.zeros(len(before), int), np.arange(len(before))
    while (moving := before[at] >= 0).any():
        depth += moving
        at = np.where(moving, before[at], at)
    return depth


def _agrees(
    edges: Sequence[Edge], poses: Floats, depth: NDArray[np.int64], voxels: Floats, extents: Floats
) -> NDArray[np.bool_]:
    errors = np.stack([edge.error(poses) for edge in edges])
    off = _size(errors, extents)
    length = np.array([depth[edge.i] + depth[edge.j] for edge in edges])
    return np.asarray(off <= voxels * (_LOOSE + _PER_STEP * length))
