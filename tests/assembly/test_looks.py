"""What pairs show of each other where they are laid is kept for that place alone."""

import numpy as np
import pytest

from fieldalign.assembly.looks import Laid, Look, Looks
from fieldalign.motions import exp_twist, inverse

UNIT, REACH = 0.05, 5.0


def looks_of(places):
    return Looks(np.asarray(places, float), np.full(len(places), REACH), UNIT)


def shift(*offset):
    T = np.eye(4)
    T[:3, 3] = offset
    return T


def test_a_look_holds_where_the_pair_was_seen():
    looks = looks_of(np.zeros((2, 3)))
    looks.add(Laid(0, 1, shift(1, 0, 0)), Look(0.5, 0.0))
    assert looks.find(Laid(0, 1, shift(1, 0.004, 0))) == Look(0.5, 0.0)
    assert looks.find(Laid(0, 1, shift(1, 0.006, 0))) is None
    assert looks.find(Laid(0, 1, exp_twist(np.array([0, 0, 0.002, 0, 0, 0])) @ shift(1, 0, 0))) is None
    looks.add(Laid(0, 1, shift(3, 0, 0)), Look(0.1, 0.2))
    assert looks.find(Laid(0, 1, shift(3, 0, 0))) == Look(0.1, 0.2)


def test_the_frames_of_the_scans_do_not_matter(rng, any_motion):
    """How far a pair is off, and what lies near, is the same in frames whose origin is far from the scan."""
    poses = np.stack([shift(*x) for x in ((0, 0, 0), (2, 0, 0), (4.5, 0, 0), (9, 0, 0))])
    frames = np.stack([any_motion(rng, 50.0) for _ in poses])  # frame from scan
    here, there = looks_of(np.zeros((4, 3))), looks_of(frames[:, :3, 3])
    moved = poses @ inverse(frames)
    pairs = [[(at.i, at.j) for at in looks.near(p, np.arange(4), 20)] for looks, p in ((here, poses), (there, moved))]
    assert pairs[0] == pairs[1] == [(0, 1), (0, 2), (1, 2), (2, 3)]
    laid, other = Laid(0, 1, inverse(moved[0]) @ moved[1]), inverse(moved[0]) @ shift(0, 0.1, 0) @ moved[1]
    assert there.off(laid, other) == pytest.approx(2.0)
    assert there.apart(laid) == pytest.approx(2.0)


def test_only_the_nearest_few_are_near():
    looks = looks_of(np.zeros((4, 3)))
    poses = np.stack([shift(x, 0, 0) for x in (0.0, 1.0, 2.5, 4.5)])
    assert [(at.i, at.j) for at in looks.near(poses, np.arange(4), 1)] == [(0, 1), (1, 2), (2, 3)]


def test_what_lies_around_a_pose_comes_nearest_first():
    looks = looks_of(np.zeros((4, 3)))
    poses = np.stack([shift(x, 0, 0) for x in (0.0, 1.0, 2.5, 9.0)])
    found = looks.around(1, shift(2.4, 0, 0), poses, np.arange(4))
    assert [(at.i, at.j) for at in found] == [(1, 2), (0, 1)]
    assert np.allclose(found[0].T_ij[:3, 3], [0.1, 0, 0])
    assert np.allclose(found[1].T_ij[:3, 3], [2.4, 0, 0])
