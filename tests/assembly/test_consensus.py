"""Whom to believe: right edges agree around their cycles, wrong ones do not, and nothing contradicts a bridge."""

from dataclasses import replace
from itertools import combinations, pairwise, product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fieldalign.assembly.consensus import consensus
from fieldalign.assembly.pose_graph import Edge
from fieldalign.motions import exp_twist, inverse

VOXEL, EXTENT = 0.05, 4.0


def random_poses(rng, count):
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = Rotation.random(count, random_state=rng).as_matrix()
    poses[:, :3, 3] = rng.uniform(-5, 5, (count, 3))
    return poses


def right(poses, i, j, strength=5.0, noise=None):
    T = inverse(poses[i]) @ poses[j]
    if noise is not None:
        T = exp_twist(2e-3 * noise.normal(size=6)) @ T
    return Edge(i, j, T, np.eye(6), np.zeros(3), strength)


def wrong(rng, i, j, strength=5.0):
    return replace(right(random_poses(rng, 2), 0, 1), i=i, j=j, strength=strength)


def asked(count, edges, seed=0):
    return consensus(count, edges, np.full(len(edges), VOXEL), np.full(len(edges), EXTENT), seed)


def relative(poses, members):
    return inverse(poses[members[0]]) @ poses[members]


def meshed(rng, sides):
    """All pairs of five scans, or all between two sides of three, where no three close a triangle; the fourth is wrong
    and the strongest."""
    truth = random_poses(rng, 6)
    pairs = combinations(range(5), 2) if sides == 1 else product(range(3), range(3, 6))
    edges = [right(truth, *pair) for pair in pairs]
    edges[3] = wrong(rng, edges[3].i, edges[3].j, 8.0)
    return edges


def ring(poses, chords):
    count = len(poses)
    return [right(poses, k, (k + 1) % count) for k in range(count)] + [
        right(poses, k, (k + step) % count) for step in chords for k in range(count)
    ]


# ------------------------------------------------------------------------------------------------------------ all right


def test_edges_that_are_right_are_all_believed(rng):
    truth = random_poses(rng, 10)
    edges = [right(truth, i, j, noise=rng) for i, j in combinations(range(10), 2)]
    found = asked(10, edges)
    assert found.believed.all()
    assert np.allclose(relative(found.poses, range(10)), relative(truth, range(10)), atol=0.2)


def test_either_end_of_an_edge_may_be_the_first(rng):
    truth = random_poses(rng, 6)
    edges = [right(truth, *((i, j) if (i + j) % 2 else (j, i))) for i, j in combinations(range(6), 2)]
    found = asked(6, edges)
    assert found.believed.all()
    assert np.allclose(relative(found.poses, range(6)), relative(truth, range(6)))


def test_each_component_has_a_root_of_its_own(rng):
    truth = random_poses(rng, 7)
    edges = [right(truth, i, j) for i, j in [(1, 2), (2, 5), (5, 1), (3, 6), (6, 0), (0, 3)]]
    found = asked(7, edges)
    assert found.believed.all()
    for members in ([1, 2, 5], [0, 3, 6]):
        assert np.allclose(relative(found.poses, members), relative(truth, members))
    assert np.array_equal(found.poses[4], np.eye(4))


# ----------------------------------------------------------------------------------------------------------- wrong ones


@pytest.mark.parametrize("strength", [1.0, 20.0])
def test_wrong_edges_are_not_believed_however_strong(rng, strength):
    truth = random_poses(rng, 12)
    edges = ring(truth, (2, 3))
    false = [wrong(rng, i, j, strength) for i, j in [(0, 6), (1, 7), (3, 10)]]
    found = asked(12, edges + false)
    assert found.believed.tolist() == [True] * len(edges) + [False] * 3
    assert np.allclose(relative(found.poses, range(12)), relative(truth, range(12)))


def test_an_edge_that_is_off_by_a_few_voxels_is_wrong(rng):
    truth = random_poses(rng, 8)
    edges = ring(truth, (2, 3))
    near, far = (right(truth, 0, 4) for _ in range(2))
    near = replace(near, T_ij=exp_twist(np.array([0, 0, 0, 0.5 * VOXEL, 0, 0])) @ near.T_ij)
    far = replace(far, T_ij=exp_twist(np.array([0, 0, 0, 12 * VOXEL, 0, 0])) @ far.T_ij)
    assert asked(8, [*edges, near]).believed.all()
    assert asked(8, [*edges, far]).believed.tolist() == [True] * len(edges) + [False]


def test_the_unit_of_length_is_nothing(rng):
    truth = random_poses(rng, 8)
    edges = [*ring(truth, (2,)), wrong(rng, 0, 4)]
    grown = []
    for edge in edges:
        T = edge.T_ij.copy()
        T[:3, 3] *= 1000
        grown.append(replace(edge, T_ij=T))
    sizes = np.full(len(edges), 1000 * VOXEL), np.full(len(edges), 1000 * EXTENT)
    assert np.array_equal(consensus(8, grown, *sizes, 0).believed, asked(8, edges).believed)


def test_a_bridge_is_believed(rng):
    """Nothing contradicts the only edge between two groups, right or not."""
    truth = random_poses(rng, 8)
    groups = [right(truth, *pair) for half in (range(4), range(4, 8)) for pair in combinations(half, 2)]
    found = asked(8, [*groups, right(truth, 2, 5)])
    assert found.believed.all()
    assert np.allclose(relative(found.poses, range(8)), relative(truth, range(8)))


def test_a_chain_is_believed_whole(rng):
    truth = random_poses(rng, 9)
    assert asked(9, [right(truth, i, j) for i, j in pairwise(range(9))]).believed.all()


def test_the_same_seed_gives_the_same_bits(rng):
    truth = random_poses(rng, 12)
    edges = [right(truth, e.i, e.j, noise=rng) for e in ring(truth, (2, 3))]
    edges += [wrong(rng, i, j, 20.0) for i, j in [(0, 6), (1, 7), (3, 10), (2, 8)]]
    one, other = asked(12, edges, 3), asked(12, edges, 3)
    assert one.poses.tobytes() == other.poses.tobytes()
    assert np.array_equal(one.believed, other.believed)


@pytest.mark.parametrize("sides", [1, 2])
def test_a_wrong_edge_is_found_by_triangles_and_without(rng, sides):
    """All pairs of five scans, or of three with three others."""
    edges = meshed(rng, sides)
    assert asked(6, edges).believed.tolist() == [k != 3 for k in range(len(edges))]


@pytest.mark.parametrize("sides", [
    1, 2,
])
def test_scans_without_edges_do_not_make_others_credulous(rng, sides):
    """What else there is does not matter."""
    edges = meshed(rng, sides)
    assert asked(30, edges).believed.tolist() == [k != 3 for k in range(len(edges))]
