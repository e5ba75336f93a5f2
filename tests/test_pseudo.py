"""The third set: where pseudo points lie, and that a seed says which."""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.stats import kstest, norm

from fieldalign.errors import ArgumentError
from fieldalign.fields import PointField
from fieldalign.pseudo import draw_pseudo_points, draw_surface
from fieldalign.settings import Settings

CENTRE = np.array([10.0, -20.0, 30.0])
ONCE_IN_A_MILLION = 1e-6  # the seeds are fixed: what passes once passes always


class Sphere:
    """The signed field of a sphere."""

    signed = True

    def __init__(self, centre=CENTRE, radius=1.5):
        self.centre, self.radius = np.asarray(centre, float), radius

    @property
    def bounds(self):
        return np.array([self.centre - self.radius, self.centre + self.radius])

    def sample(self, x):
        away = x - self.centre
        length = np.linalg.norm(away, axis=1)
        normal = away / length[:, None]
        return length - self.radius, normal, self.centre + self.radius * normal, normal


def plane(rng, n=3000):
    return np.c_[rng.uniform(0, 2, (n, 2)), np.zeros(n)]


def is_uniform(values, low, high):
    return kstest(values, "uniform", (low, high - low)).pvalue > ONCE_IN_A_MILLION


def is_normal(values, sigma):
    has_the_spread = abs(values.std() / sigma - 1) < 4.9 / np.sqrt(2 * len(values))
    return has_the_spread and kstest(values, norm(0, sigma).cdf).pvalue > ONCE_IN_A_MILLION


def test_uniform_fills_a_cube_about_the_centre(corner):
    settings = Settings("uniform", half_width=0.7, pseudo_count=5000)
    drawn = draw_pseudo_points(PointField(corner), CENTRE, settings, 0)
    assert drawn.shape == (5000, 3)
    off = drawn - CENTRE
    assert np.abs(off).max() <= 0.7
    assert all(is_uniform(off[:, axis], -0.7, 0.7) for axis in range(3))
    assert np.abs(np.corrcoef(off.T) - np.eye(3)).max() < 0.07


def test_neighbourhood_leaves_a_plane_along_its_normal_only(rng):
    points = plane(rng)
    settings = Settings(half_width=1.0, sigma=0.3, pseudo_count=4000)
    drawn = draw_pseudo_points(PointField(points), CENTRE, settings, 3)
    distances, _ = cKDTree(points[:, :2]).query(drawn[:, :2])
    assert distances.max() < 1e-12  # above or below one of the points
    assert is_normal(drawn[:, 2], 0.3)
    assert not is_normal(drawn[:, 2], 0.27)  # such a sample can tell


def test_neighbourhood_has_by_default_a_fifth_of_the_half_width(rng):
    drawn = draw_pseudo_points(PointField(plane(rng)), CENTRE, Settings(half_width=2.0, pseudo_count=4000), 3)
    assert is_normal(drawn[:, 2], 0.4)


def test_neighbourhood_draws_the_whole_surface_alike(rng):
    drawn = draw_pseudo_points(PointField(plane(rng, 20000)), CENTRE, Settings(pseudo_count=4000), 1)
    assert is_uniform(drawn[:, 0], 0, 2)
    assert is_uniform(drawn[:, 1], 0, 2)


@pytest.mark.parametrize("sigma", [0.05, 0.2])
def test_keypoints_are_left_in_all_directions(corner, sigma):
    field = PointField(corner)
    keypoints = corner[field.keypoints()]
    drawn = draw_pseudo_points(field, CENTRE, Settings("keypoints", sigma=sigma, pseudo_count=4000), 5)
    # The nearest keypoint is no further than the one that was left, and that is a Gaussian's distance away.
    distances, _ = cKDTree(keypoints).query(drawn)
    assert np.quantile(distances, 0.99) <= sigma * 3.6  # chi with three freedoms: 3.37 at 99 %
    # About its mean the whole set spreads as the keypoints do, plus sigma^2 in each direction.
    assert np.allclose(drawn.mean(axis=0), keypoints.mean(axis=0), atol=0.1)
    assert np.allclose(np.cov(drawn.T) - np.cov(keypoints.T), sigma**2 * np.eye(3), atol=0.09)


def test_around_one_keypoint_the_spread_is_isotropic(monkeypatch):
    field = PointField(np.eye(3))
    monkeypatch.setattr(PointField, "keypoints", lambda self: np.array([1], np.uint32))
    drawn = draw_pseudo_points(field, CENTRE, Settings("keypoints", sigma=0.2, pseudo_count=5000), 2)
    off = drawn - [0, 1, 0]
    assert all(is_normal(off[:, axis], 0.2) for axis in range(3))
    assert np.abs(np.corrcoef(off.T) - np.eye(3)).max() < 0.07


def test_a_cloud_without_keypoints_is_one_clear_error(rng):
    with pytest.raises(ArgumentError, match=r"found no ISS keypoint.*neighbourhood"):
        draw_pseudo_points(PointField(np.eye(3)), CENTRE, Settings("keypoints"), 0)


@pytest.mark.parametrize("pseudo_set", ["uniform", "neighbourhood", "keypoints"])
def test_the_seed_decides(corner, pseudo_set):
    settings = Settings(pseudo_set)
    first, again, other = (draw_pseudo_points(PointField(corner), CENTRE, settings, seed) for seed in (4, 4, 5))
    assert np.array_equal(first, again)
    assert np.abs(first - other).max() > 0.01


@pytest.mark.parametrize("pseudo_set", ["neighbourhood", "keypoints"])
def test_threads_change_no_bit(corner, pseudo_set):
    one, two = (draw_pseudo_points(PointField(corner, threads=n), CENTRE, Settings(pseudo_set), 4) for n in (1, 2))
    assert np.array_equal(one, two)


def test_handed_in_points_are_used_as_they_are(corner, rng):
    handed = rng.normal(size=(40, 3))
    for pseudo_set in ("uniform", "neighbourhood", "keypoints"):
        settings = Settings(pseudo_set, pseudo_points=handed)
        assert np.array_equal(draw_pseudo_points(PointField(corner), CENTRE, settings, 9), handed)


def test_any_field_can_have_a_cube():
    drawn = draw_pseudo_points(Sphere(), CENTRE, Settings("uniform", half_width=2.0), 0)
    assert np.abs(drawn - CENTRE).max() <= 2


def test_any_field_can_have_a_neighbourhood():
    drawn = draw_pseudo_points(Sphere(), CENTRE, Settings(sigma=0.1, pseudo_count=4000), 0)
    assert is_normal(Sphere().sample(drawn)[0], 0.1)
    assert np.linalg.norm(drawn.mean(axis=0) - CENTRE) < 0.1  # on all sides


def test_keypoints_of_another_field_are_one_clear_error():
    with pytest.raises(ArgumentError, match=r"'keypoints' needs a target of points.*neighbourhood"):
        draw_pseudo_points(Sphere(), CENTRE, Settings("keypoints"), 0)


def test_places_lie_on_the_surface(corner):
    on_cloud, _ = draw_surface(PointField(corner), 500, np.random.default_rng(0))
    distances, rows = cKDTree(corner).query(on_cloud)
    assert distances.max() == 0
    assert len(np.unique(rows)) > 400  # of 500 drawn from 6000
    on_sphere, _ = draw_surface(Sphere(), 500, np.random.default_rng(0))
    assert np.allclose(np.linalg.norm(on_sphere - CENTRE, axis=1), 1.5, atol=1e-12)


def test_surface_normals_have_unit_length_and_stand_on_the_surface(rng):
    points, normals = draw_surface(PointField(plane(rng)), 300, rng)
    assert np.allclose(np.abs(normals), [0, 0, 1], atol=1e-9)
    assert np.array_equal(points[:, 2], np.zeros(300))
    places, normals = draw_surface(Sphere(), 300, rng)
    assert np.allclose(normals, (places - CENTRE) / 1.5, atol=1e-12)
