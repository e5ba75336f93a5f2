"""The pull of two fields at their relative pose: none at the truth, and towards it elsewhere, whichever is held."""

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.alignment import descend
from fieldalign.assembly.joint import pull
from fieldalign.methods.pair import Pair
from fieldalign.methods.refined import last_level
from fieldalign.motions import apply, exp_twist, inverse, log_motion, translation
from fieldalign.scale import common_voxel


@pytest.fixture(scope="module")
def scans(corner, any_motion):
    """The corner, another sample of it with noise, and a cut of that, each in a frame of its own, far from its points;
    and world_from_scan of each."""
    rng = np.random.default_rng(4)
    one, other = corner[::2], corner[1::2] + 0.003 * rng.normal(size=(3000, 3))
    clouds = {"whole": one, "other": other, "cut": other[np.linalg.norm(other - [1.5, 1.5, 0.2], axis=1) < 0.9]}
    made = {}
    for name, cloud in clouds.items():
        T = any_motion(rng, 20.0)
        made[name] = fa.prepare(apply(inverse(T), cloud)), T
    return made


PAIRS = [("whole", "other", False), ("other", "whole", False), ("whole", "cut", True), ("cut", "whole", False)]


def stepped(found, T_ij):
    """The pose after the step that the pull asks for."""
    about = translation(found.reference)
    return about @ exp_twist(-np.linalg.solve(found.H, found.g)) @ inverse(about) @ T_ij


def disturbed(truth, place, twist):
    """The truth after a twist about a place of scan i."""
    about = translation(place)
    return about @ exp_twist(twist) @ inverse(about) @ truth


def off(T, truth, place):
    """How far T moves the places around one of scan i that the truth does not."""
    E = T @ inverse(truth)
    around = place + np.vstack([np.eye(3), -np.eye(3)])
    return np.linalg.norm(apply(E, around) - around, axis=1).max()


@pytest.mark.parametrize(("i", "j", "holds_target"), PAIRS)
def test_which_is_held_is_what_the_cases_say(scans, i, j, holds_target):
    (one, _), (two, _) = scans[i], scans[j]
    assert Pair(two, one, common_voxel(two.scale, one.scale)).is_swapped == holds_target


@pytest.mark.parametrize(("i", "j", "_"), PAIRS)
def test_at_the_truth_a_step_is_small(scans, i, j, _):
    (one, world_i), (two, world_j) = scans[i], scans[j]
    truth = inverse(world_i) @ world_j
    found = pull(one, two, truth)
    assert off(stepped(found, truth), truth, found.reference) < 0.004
    assert found.kept > 100


@pytest.mark.parametrize(("i", "j", "_"), PAIRS)
def test_elsewhere_steps_lead_to_the_truth(scans, i, j, _, rng):
    (one, world_i), (two, world_j) = scans[i], scans[j]
    truth = inverse(world_i) @ world_j
    place = pull(one, two, truth).reference
    for _ in range(3):
        T = disturbed(truth, place, 0.015 * rng.normal(size=6))
        first = stepped(pull(one, two, T), T)
        assert off(first, truth, place) < 0.85 * off(T, truth, place)
        for _ in range(7):
            first = stepped(pull(one, two, first), first)
        assert off(first, truth, place) < 0.005


@pytest.mark.parametrize(("i", "j", "_"), PAIRS)
def test_the_step_of_one_pair_is_that_of_its_registration(scans, i, j, _, rng):
    (one, world_i), (two, world_j) = scans[i], scans[j]
    truth = inverse(world_i) @ world_j
    T = disturbed(truth, pull(one, two, truth).reference, 0.01 * rng.normal(size=6))
    pair = Pair(two, one, common_voxel(two.scale, one.scale))
    (G,), _ = descend(last_level(pair), pair.pose(T)[None])
    assert np.allclose(stepped(pull(one, two, T), T), pair.motion(G), rtol=0, atol=1e-10)


@pytest.mark.parametrize(("i", "j"), [("whole", "other"), ("whole", "cut")])
def test_both_orders_ask_for_the_same_motion(scans, i, j):
    """A step of T_ij and one of its inverse, seen from scan i."""
    (one, world_i), (two, world_j) = scans[i], scans[j]
    truth = inverse(world_i) @ world_j
    place = pull(one, two, truth).reference
    T = disturbed(truth, place, np.array([0.01, -0.01, 0.01, 0.02, 0.01, -0.02]))
    there, back = stepped(pull(one, two, T), T), inverse(stepped(pull(two, one, inverse(T)), inverse(T)))
    assert off(there, back, place) < 0.3 * off(T, truth, place)


@pytest.mark.parametrize(("i", "j", "_"), PAIRS)
def test_what_is_known_is_about_a_place_of_the_overlap(scans, i, j, _):
    (one, world_i), (two, world_j) = scans[i], scans[j]
    truth = inverse(world_i) @ world_j
    found = pull(one, two, truth)
    assert np.linalg.norm(one.fine.points - found.reference, axis=1).min() < 1
    assert np.linalg.eigvalsh(found.information).min() > 0
    edge = found.as_edge(3, 1, truth, 2.0)
    assert (edge.i, edge.j, edge.strength) == (3, 1, 2.0)
    assert edge.information is found.information
    deviation = np.sqrt(np.diag(np.linalg.inv(found.information)))
    assert deviation.max() < 0.02
    assert np.linalg.norm(log_motion(truth @ inverse(edge.T_ij))) < 1e-12
