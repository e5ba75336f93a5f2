"""The frame of a component: its first scan's, or that of poses that were given."""

import numpy as np
import pytest

from fieldalign.assembly import world as of
from fieldalign.assembly.pose_graph import Anchors
from fieldalign.assembly.world import Given
from fieldalign.dof import as_dof
from fieldalign.motions import exp_twist, inverse

ROUGH = np.pi, 0.5  # GPS: places alone


@pytest.fixture
def poses(rng, any_motion):
    """Of scans 1, 3, 4, 6, 7 of eight, in a frame of their own."""
    return np.stack([any_motion(rng, 4.0) for _ in range(5)])


MEMBERS = [1, 3, 4, 6, 7]


def given(known, sigma=None, fixed=(), count=8):
    return Given([known.get(k) for k in range(count)], sigma, fixed)


def anchored(*args):
    """The poses and what holds them, in the world."""
    world, poses, anchors = of.anchored(*args)
    priors = {row: (world @ pose, information) for row, (pose, information) in anchors.priors.items()}
    return world @ poses, Anchors(anchors.fixed, priors, anchors.allowed)


def same_shape(a, b):
    return np.allclose(inverse(a[0]) @ a, inverse(b[0]) @ b, atol=1e-9)


def test_without_poses_the_world_is_the_first_scan(poses):
    before = poses.copy()
    placed, anchors = anchored(poses, MEMBERS, given({}), None)
    assert np.allclose(placed[0], np.eye(4))
    assert same_shape(placed, poses)
    assert (list(anchors.fixed), anchors.priors, anchors.allowed) == ([0], {}, None)
    assert np.array_equal(poses, before)


def test_poses_of_others_say_nothing(poses, rng, any_motion):
    placed, anchors = anchored(poses, MEMBERS, given({0: any_motion(rng, 3.0)}, (0.1, 0.1)), None)
    assert np.allclose(placed[0], np.eye(4))
    assert (list(anchors.fixed), anchors.priors) == ([0], {})


def test_a_guess_is_where_its_scan_lies(poses, rng, any_motion):
    there = any_motion(rng, 9.0)
    placed, anchors = anchored(poses, MEMBERS, given({4: there}), None)
    assert np.allclose(placed[2], there)
    assert same_shape(placed, poses)
    assert (list(anchors.fixed), anchors.priors) == ([2], {})


def test_fixed_scans_lie_where_they_are_told(poses, rng, any_motion):
    known = {k: any_motion(rng, 9.0) for k in (3, 6, 7)}
    placed, anchors = anchored(poses, MEMBERS, given(known, fixed=(7, 3)), None)
    assert np.allclose(placed[[1, 4]], np.stack([known[3], known[7]]), rtol=0, atol=1e-12)
    assert set(anchors.fixed) == {1, 4}
    assert same_shape(placed[[4, 0, 2]], poses[[4, 0, 2]])


def test_poses_with_sigma_pull_and_do_not_hold(poses, rng, any_motion):
    world = any_motion(rng, 9.0)
    known = {k: world @ T for k, T in zip(MEMBERS, poses, strict=True) if k != 4}
    placed, anchors = anchored(poses, MEMBERS, given(known, (0.1, 0.5), fixed=(6,)), None)
    assert np.allclose(placed, world @ poses)
    assert list(anchors.fixed) == [3]
    assert sorted(anchors.priors) == [0, 1, 4]
    for row, (pose, information) in anchors.priors.items():
        assert np.allclose(pose, known[MEMBERS[row]], rtol=0, atol=1e-12)
        assert np.allclose(information, np.diag([100.0] * 3 + [4.0] * 3))


def test_places_alone_say_where_the_world_is(poses, rng, any_motion):
    """Three places or more; what the rotations that come with them say is not asked."""
    world, known = any_motion(rng, 9.0), {}
    for k, T in zip(MEMBERS, poses, strict=True):
        known[k] = any_motion(rng, 1.0)
        known[k][:3, 3] = (world @ T)[:3, 3]
    placed, anchors = anchored(poses, MEMBERS, given(known, ROUGH), None)
    assert np.allclose(placed, world @ poses)
    assert list(anchors.fixed) == []
    assert sorted(anchors.priors) == [0, 1, 2, 3, 4]


def test_places_that_are_off_are_met_in_the_mean(poses, rng):
    known = {}
    for k, T in zip(MEMBERS, poses, strict=True):
        known[k] = T.copy()
        known[k][:3, 3] += 0.2 * rng.normal(size=3)
    placed, _ = anchored(poses, MEMBERS, given(known, ROUGH), None)
    there = np.stack([known[k][:3, 3] for k in MEMBERS])
    assert same_shape(placed, poses)
    assert np.allclose(placed[:, :3, 3].mean(axis=0), there.mean(axis=0))
    assert np.linalg.norm(placed[:, :3, 3] - there) <= np.linalg.norm(poses[:, :3, 3] - there)


def test_a_dof_is_kept(poses):
    assert anchored(poses, MEMBERS, given({}), as_dof("levelled"))[1].allowed is not None


def test_a_levelled_world_is_upright_whatever_tilt_the_poses_have(rng):
    up = as_dof("levelled")
    poses = np.stack([exp_twist(np.r_[0, 0, rng.normal(size=4)]) for _ in MEMBERS])
    tilted = {k: T @ exp_twist(np.r_[0.01 * rng.normal(size=3), 0, 0, 0]) for k, T in zip(MEMBERS, poses, strict=True)}
    assert np.allclose(anchored(poses, MEMBERS, given(tilted, (0.1, 0.5)), up)[0][:, 2, :3], [0, 0, 1], atol=1e-12)
    assert np.allclose(anchored(poses, MEMBERS, given(tilted, fixed=(4,)), up)[0][2], tilted[4], rtol=0, atol=1e-12)


# ----------------------------------------------------------------------------------------------- what is known of pairs


def test_a_guess_of_a_pair(rng, any_motion):
    a, b = any_motion(rng, 2.0), any_motion(rng, 2.0)
    for sigma in (None, (0.1, 1.0)):
        assert np.allclose(given({0: a, 2: b}, sigma).between(0, 2), inverse(a) @ b)
    assert given({0: a, 2: b}, ROUGH).between(0, 2) is None
    assert given({0: a, 2: b}).between(0, 1) is None


def test_poses_of_most_scans_tell_neighbours():
    assert not given({k: np.eye(4) for k in range(4)}).is_useful
    assert given({k: np.eye(4) for k in range(5)}).is_useful
