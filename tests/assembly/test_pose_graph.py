"""The pose graph: exact where its edges are, honest where they are not, and deaf to one that is wildly wrong."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fieldalign.assembly.pose_graph import Anchors, Edge, doubt, linearised, optimise
from fieldalign.dof import allowed_poses, as_dof
from fieldalign.motions import exp_twist, inverse, log_motion, translation

SIGMA = np.array([2e-3, 3e-3, 1e-3, 0.01, 0.02, 0.03])  # rad, length


def random_poses(rng, count, levelled=False):
    poses = np.tile(np.eye(4), (count, 1, 1))
    turns = rng.uniform(-3, 3, (count, 3)) * ([0, 0, 1] if levelled else 1)
    poses[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix()
    poses[:, :3, 3] = rng.uniform(-5, 5, (count, 3))
    return poses


def edge_of(poses, i, j, rng=None, reference=(1.0, -2.0, 0.5), off=None):
    """The true edge; with rng, off by noise of its information about its reference."""
    information = np.diag(SIGMA**-2.0)
    if rng is not None:
        turn = np.linalg.qr(rng.normal(size=(6, 6)))[0]
        root = np.diag(SIGMA) @ turn @ np.diag(rng.uniform(0.5, 2, 6))
        information = np.linalg.inv(root @ root.T)
        off = root @ rng.normal(size=6)
    T = inverse(poses[i]) @ poses[j]
    if off is not None:
        about = translation(reference)
        T = about @ exp_twist(-np.asarray(off, float)) @ inverse(about) @ T
    return Edge(i, j, T, information, np.array(reference))


def random_graph(rng, count, extra):
    """A spanning tree in any order, its edges either way round, and some edges more."""
    pairs = {(int(rng.integers(k)), k) for k in range(1, count)}
    while len(pairs) < count - 1 + extra:
        i, j = sorted(rng.choice(count, 2, replace=False).tolist())
        pairs.add((i, j))
    return [(i, j) if rng.random() < 0.5 else (j, i) for i, j in sorted(pairs)]


def disturbed(poses, rng, size, rows=None):
    """Poses that are some way off, but for the first."""
    moved = poses.copy()
    for k in range(1, len(poses)) if rows is None else rows:
        moved[k] = poses[k] @ exp_twist(size * rng.normal(size=6))
    return moved


def largest_error(poses, truth):
    return max(np.linalg.norm(log_motion(inverse(T) @ P)) for T, P in zip(truth, poses, strict=True))


# ----------------------------------------------------------------------------------------------------------- one edge


def test_the_error_of_an_edge_is_the_twist_about_its_reference(rng):
    poses, off = random_poses(rng, 2), 0.1 * rng.normal(size=6)
    assert np.allclose(edge_of(poses, 0, 1, off=off).error(poses), off)
    assert np.allclose(edge_of(poses, 0, 1).error(poses), 0, atol=1e-12)


def test_its_derivatives_are_finite_differences(rng):
    poses = random_poses(rng, 2)
    edge, h = edge_of(poses, 0, 1), 1e-6
    for k, J in enumerate(edge.jacobians(poses)):
        for column, x in enumerate(h * np.eye(6)):
            ahead, behind = poses.copy(), poses.copy()
            ahead[k], behind[k] = poses[k] @ exp_twist(x), poses[k] @ exp_twist(-x)
            assert np.allclose((edge.error(ahead) - edge.error(behind)) / (2 * h), J[:, column], atol=1e-7)


# ---------------------------------------------------------------------------------------------------------- all of them


def test_exact_edges_give_exact_poses(rng):
    truth = random_poses(rng, 12)
    edges = [edge_of(truth, i, j, reference=rng.uniform(-3, 3, 3)) for i, j in random_graph(rng, 12, 10)]
    found = optimise(disturbed(truth, rng, 0.02), edges, Anchors([0]))
    assert largest_error(found, truth) < 1e-9
    assert np.allclose(found[0], truth[0], rtol=0, atol=1e-14)


def test_where_the_origin_of_the_world_lies_is_nothing(rng):
    truth = random_poses(rng, 6)
    edges = [edge_of(truth, i, j, rng) for i, j in random_graph(rng, 6, 5)]
    here = optimise(truth, edges, Anchors([0]))
    far = translation([4e5, -2e5, 1e5]) @ random_poses(rng, 1)[0]
    there = optimise(far @ truth, edges, Anchors([0]))
    assert largest_error(inverse(there[0]) @ there, inverse(here[0]) @ here) < 1e-8


def test_covariances_are_what_errors_are(rng):
    """The squared error of a pose by its covariance is 6 on average (NEES)."""
    nees = []
    for _ in range(25):
        truth = random_poses(rng, 12)
        edges = [edge_of(truth, i, j, rng, rng.uniform(-3, 3, 3)) for i, j in random_graph(rng, 12, 12)]
        found = optimise(truth, edges, Anchors([0]))
        covariances = linearised(found, edges, Anchors([0])).covariances()
        assert not covariances[0].any()
        for k in range(1, 12):
            x = log_motion(inverse(found[k]) @ truth[k])
            nees.append(x @ np.linalg.solve(covariances[k], x))
    assert 5 < np.mean(nees) < 6.6


def test_more_edges_make_poses_better_known(rng):
    truth = random_poses(rng, 5)
    pairs = [(0, 1), (1, 2), (2, 3), (3, 4), (4, 0)]
    chain, ring = (
        linearised(truth, [edge_of(truth, i, j) for i, j in some], Anchors([0])).covariances()
        for some in (pairs[:4], pairs)
    )
    assert all(np.linalg.eigvalsh(a - b).min() > -1e-12 for a, b in zip(chain, ring, strict=True))
    assert np.trace(ring[4]) < 0.6 * np.trace(chain[4])


# ------------------------------------------------------------------------------------------------- what holds and pulls


def test_fixed_poses_do_not_move_whatever_edges_say(rng):
    truth = random_poses(rng, 6)
    edges = [edge_of(truth, i, j, rng) for i, j in random_graph(rng, 6, 6)]
    start = disturbed(truth, rng, 0.01, range(6))
    found = optimise(start, edges, Anchors([1, 4]))
    assert np.allclose(found[[1, 4]], start[[1, 4]], rtol=0, atol=1e-13)
    assert all(np.linalg.norm(log_motion(inverse(start[k]) @ found[k])) > 1e-4 for k in (0, 2, 3, 5))
    covariances = linearised(found, edges, Anchors([1, 4])).covariances()
    assert [bool(C.any()) for C in covariances] == [True, False, True, True, False, True]


def test_a_prior_pulls_by_what_it_knows():
    """An edge and a prior of a third of its deviation: their mean, weighed by their variances."""
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[1, 0, 3] = 1
    edge = edge_of(poses, 0, 1, reference=(1, 0, 0))
    place = translation([1 + 1e-4, 0, 0])
    found = optimise(poses, [edge], Anchors([0], {1: (place, 9 * edge.information)}))
    assert np.isclose(found[1, 0, 3] - 1, 0.9e-4, rtol=1e-3)
    known = linearised(found, [edge], Anchors([0], {1: (place, 9 * edge.information)})).covariances()[1]
    assert np.allclose(known, np.linalg.inv(10 * edge.information), rtol=1e-3, atol=1e-9)


def test_priors_alone_say_where_the_world_is(rng):
    truth = random_poses(rng, 5)
    edges = [edge_of(truth, i, j) for i, j in random_graph(rng, 5, 3)]
    priors = {k: (truth[k], np.diag(SIGMA**-2.0)) for k in (1, 3)}
    start = translation([0.1, 0.2, -0.1]) @ truth
    found = optimise(start, edges, Anchors([], priors))
    assert largest_error(found, truth) < 1e-8


@pytest.mark.parametrize("seed", [8, 9, 10])
def test_priors_that_know_places_alone_keep_places(seed):
    """Whatever the turns are that come with the places: where these are right already, they stay."""
    rng = np.random.default_rng(seed)
    truth = random_poses(rng, 5)
    edges = [edge_of(truth, i, j) for i, j in random_graph(rng, 5, 3)]
    information = np.diag([np.pi**-2.0] * 3 + [0.02**-2.0] * 3)
    priors = {k: (translation(truth[k][:3, 3]), information) for k in range(5)}
    found = optimise(truth, edges, Anchors([], priors))
    assert np.linalg.norm(found[:, :3, 3] - truth[:, :3, 3], axis=1).max() < 0.02


@pytest.mark.parametrize("dof", ["levelled", "planar", "translation"])
def test_what_a_dof_holds_is_held_exactly(rng, dof):
    truth = random_poses(rng, 8, levelled=True)
    if dof != "levelled":
        truth[:, 2, 3] *= dof == "translation"
    if dof == "translation":
        truth[:, :3, :3] = np.eye(3)
    allowed = allowed_poses(as_dof(dof), None, np.zeros(3), np.zeros(3), target_is_held=True)
    edges = [edge_of(truth, i, j, rng) for i, j in random_graph(rng, 8, 6)]
    found = optimise(truth, edges, Anchors([0], allowed=allowed))
    assert not found[:, :2, 2].any()
    assert not found[:, 2, :2].any()
    assert np.allclose(found[:, 2, 2], 1, rtol=0, atol=1e-15)
    assert 1e-4 < largest_error(found, truth) < 0.2
    if dof != "levelled":
        assert not found[:, 2, 3].any() or dof == "translation"
    if dof == "translation":
        assert np.array_equal(found[:, :3, :3], truth[:, :3, :3])
    free = {"levelled": 4, "planar": 3, "translation": 3}[dof]
    covariances = linearised(found, edges, Anchors([0], allowed=allowed)).covariances()
    assert [np.linalg.matrix_rank(C, tol=1e-12) for C in covariances] == [0] + 7 * [free]


def test_covariances_of_levelled_poses_are_what_their_errors_are(rng):
    allowed = allowed_poses(as_dof("levelled"), None, np.zeros(3), np.zeros(3), target_is_held=True)
    anchors, nees = Anchors([0], allowed=allowed), []
    for _ in range(15):
        truth = random_poses(rng, 8, levelled=True)
        edges = [edge_of(truth, i, j, rng) for i, j in random_graph(rng, 8, 8)]
        found = optimise(truth, edges, anchors)
        for k, C in enumerate(linearised(found, edges, anchors).covariances()[1:], 1):
            x = log_motion(inverse(found[k]) @ truth[k])
            nees.append(x @ np.linalg.pinv(C, rcond=1e-9, hermitian=True) @ x)
    assert 3 < np.mean(nees) < 4.6


def test_one_wildly_wrong_edge_counts_little(rng):
    truth = random_poses(rng, 8)
    edges = [edge_of(truth, i, j) for i, j in random_graph(rng, 8, 8)]
    wrong = edge_of(truth, 2, 6, off=[1.0, -0.5, 0.3, 2, -3, 1])
    found = optimise(disturbed(truth, rng, 0.01), [*edges, wrong], Anchors([0]))
    assert largest_error(found, truth) < 1e-4


def test_doubt_begins_far_out():
    assert doubt(0) == 1
    assert doubt(6) > 0.9
    assert doubt(1e6) < 1e-6
