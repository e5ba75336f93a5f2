"""Copies of one cloud meet to the last digit, and what is no copy does not."""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from fieldalign.alignment.copies import meet
from fieldalign.evaluation import rotation_error
from fieldalign.fields import PointField
from fieldalign.motions import apply, exp_twist, inverse, translation


@pytest.fixture
def copy(corner, any_motion, rng):
    """A field, points of a moved copy, and the motion that lays them on the field's."""
    G = any_motion(rng, 5.0)
    return PointField(corner), apply(inverse(G), corner[::3]), G


@pytest.mark.parametrize("degrees", [0, 1e-6, 0.01, 0.3])
def test_from_nearby_they_meet_to_the_last_digit(copy, rng, degrees):
    field, places, G = copy
    w = rng.normal(size=3)
    near = exp_twist(np.r_[np.radians(degrees) * w / np.linalg.norm(w), 0, 0, 0])
    met = meet(field, places, near @ G)
    assert rotation_error(met, G) < 1e-11
    assert np.abs(apply(met, places) - apply(G, places)).max() < 1e-13
    assert np.allclose(met[:3, :3] @ met[:3, :3].T, np.eye(3), atol=1e-14)


def test_the_step_is_kabschs(copy, rng):
    """Where the partners are given, one closed form; against SciPy."""
    field, places, G = copy
    turn, _ = Rotation.align_vectors(
        apply(G, places) - apply(G, places).mean(axis=0), places - places.mean(axis=0)
    )
    assert np.allclose(meet(field, places, G)[:3, :3], turn.as_matrix(), atol=1e-12)


@pytest.mark.parametrize("unit", [1e-6, 1e3, 1e6])
def test_in_any_unit_and_far_away(corner, any_motion, rng, unit):
    far = translation(unit * np.array([50, -70, 90.0]))
    G = far @ any_motion(rng, unit)
    places = apply(inverse(G), unit * corner[::3] + far[:3, 3])
    near = G @ exp_twist(np.r_[1e-4, 0, 0, 0, 1e-3 * unit, 0])
    met = meet(PointField(unit * corner + far[:3, 3]), places, near)
    assert np.abs(apply(met, places) - apply(G, places)).max() < 1e-11 * unit


def test_some_places_without_a_partner_do_not_matter(copy, rng):
    field, places, G = copy
    places = places.copy()
    places[::10] += rng.normal(size=(len(places[::10]), 3))
    met = meet(field, places, exp_twist([1e-3, 0, 0, 0, 1e-3, 0]) @ G)
    assert rotation_error(met, G) < 1e-10


def test_another_sample_of_the_surface_does_not_meet(corner, any_motion, rng):
    G = any_motion(rng, 5.0)
    assert meet(PointField(corner[::2]), apply(inverse(G), corner[1::2]), G) is None


def test_a_noisy_copy_does_not_meet(corner, rng):
    spacing = np.median(cKDTree(corner).query(corner, 2)[0][:, 1])
    noise = 0.05 * spacing * rng.normal(size=corner.shape)
    assert meet(PointField(corner), corner + noise, np.eye(4)) is None


def test_from_far_off_it_says_nothing_wrong(copy, rng):
    field, places, G = copy
    for _ in range(5):
        met = meet(field, places, exp_twist(np.r_[2 * rng.normal(size=3), 0, 0, 0]) @ G)
        assert met is None or rotation_error(met, G) < 1e-10
