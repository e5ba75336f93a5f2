"""A cloud at one scale: where its surfels are, which way they face, and what is left out."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fieldalign.clouds.simulated import simulate_pair
from fieldalign.motions import apply, inverse, rotate
from fieldalign.surface import Surface, main_axes

VOXEL = 0.1


def ball(n, rng, radius=1.0):
    away = rng.normal(size=(n, 3))
    return radius * away / np.linalg.norm(away, axis=1)[:, None]


def floor_and_wall(n, rng):
    u, v = rng.uniform(0, 4, (2, n))
    half = n // 2
    return np.vstack([np.c_[u, v, 0 * u][:half], np.c_[u, 0 * u, v][half:]])


@pytest.fixture(scope="module")
def room():
    return simulate_pair(3, 30_000).source.points


def test_there_is_about_one_surfel_for_each_voxel(rng):
    for points in (ball(30_000, rng), floor_and_wall(30_000, rng)):
        surface = Surface(points, VOXEL, 1)
        cells = len(np.unique(np.floor((points - points.min(axis=0)) / VOXEL), axis=0))
        assert len(surface) <= cells
        assert len(surface) > 0.9 * cells  # cells that are hardly cut hold a single point


def test_surfels_lie_on_a_sphere_and_face_outward_or_inward(rng):
    centre = np.array([30.0, -20, 5])
    surface = Surface(ball(60_000, rng) + centre, VOXEL, 1)
    away = surface.places + surface.origin - centre
    length = np.linalg.norm(away, axis=1)
    assert np.abs(length - 1).max() < 0.02  # a plane through ten of them bends inward by voxel^2 / 2 or so
    cosine = np.abs((surface.normals * away).sum(axis=1) / length)
    assert np.degrees(np.arccos(cosine.min())) < 12
    assert np.degrees(np.arccos(np.median(cosine))) < 3
    assert np.allclose(np.linalg.norm(surface.normals, axis=1), 1)


def test_surfels_face_the_eye_where_it_is_known(rng):
    for eye in (np.array([3.0, 4, 5]), np.array([1.0, 1, -2])):
        surface = Surface(floor_and_wall(20_000, rng), VOXEL, 1, eye)
        assert ((eye - surface.origin - surface.places) * surface.normals).sum(axis=1).min() > 0
        assert surface.faces(surface)
        assert not surface.faces(Surface(floor_and_wall(20_000, rng), VOXEL, 1))


def test_surfels_of_noisy_planes_lie_in_them(rng):
    points = floor_and_wall(60_000, rng) + 0.005 * rng.normal(size=(60_000, 3))
    surface = Surface(points, VOXEL, 1)
    places = surface.places + surface.origin
    for axis, other in ((1, 2), (2, 1)):
        away = places[places[:, other] > 0.4]
        assert np.abs(away[:, axis]).mean() < 0.002
        facing = np.abs(surface.normals[places[:, other] > 0.4][:, axis])
        assert np.degrees(np.arccos(np.quantile(facing, 0.02))) < 5


@pytest.mark.parametrize("far", [1e2, 1e3, 1e4])
def test_far_outliers_make_no_surfel(rng, far):
    """Nor do far patches, of which a grid would have to reach so far."""
    points = ball(20_000, rng)
    patch = np.c_[rng.uniform(0, 0.5, (300, 2)), np.zeros(300)]
    away = np.vstack([np.repeat(ball(40, rng, far), 2, axis=0), patch + [far, 0, 0], patch + [0, -far, far]])
    clean, spoilt = Surface(points, VOXEL, 1), Surface(np.vstack([points, away]), VOXEL, 1)
    assert np.abs(spoilt.places + spoilt.origin).max() < 1.1
    assert abs(len(spoilt) - len(clean)) < 0.1 * len(clean)  # their corner moves the lattice
    assert spoilt.coarse_grid is not None


def test_single_points_off_a_dense_surface_are_left_out(rng):
    points = ball(60_000, rng)
    surface = Surface(np.vstack([points, rng.uniform(-2, 2, (300, 3))]), VOXEL, 1)
    away = np.abs(np.linalg.norm(surface.places + surface.origin, axis=1) - 1)
    assert (away > 0.1).mean() < 0.005


def test_a_sparse_cloud_keeps_single_points(rng):
    """Nearly every voxel holds one point only: they are the surface."""
    points = ball(800, rng)
    surface = Surface(points, VOXEL, 1)
    assert len(surface) > 600


@pytest.mark.parametrize(("surface", "outliers"), [(4000, 4000), (4000, 8000), (8000, 16_000)])
def test_among_many_outliers_the_flat_ones_are_kept(rng, surface, outliers):
    """Sparse scans, where hardly a voxel holds two points: by number, a quarter of the voxels would be surface."""
    found = Surface(np.vstack([floor_and_wall(surface, rng), rng.uniform(0, 4, (outliers, 3))]), VOXEL, 1)
    places = found.places + found.origin
    on = np.minimum(np.abs(places[:, 1]), np.abs(places[:, 2])) < VOXEL
    assert on.mean() > 0.5
    assert on.sum() > 1000


def test_a_shifted_cloud_has_the_same_surfels(room):
    here, there = Surface(room, VOXEL, 1), Surface(room + [16.0, -8, 4], VOXEL, 1)
    assert len(here) == len(there)
    assert np.allclose(there.origin - here.origin, [16, -8, 4])
    assert np.abs(here.places - there.places).max() < 1e-9


def test_no_bit_depends_on_the_threads(room):
    one, eight = Surface(room, VOXEL, 1), Surface(room, VOXEL, 8)
    assert np.array_equal(one.places, eight.places)
    assert np.array_equal(one.normals, eight.normals)
    assert np.array_equal(one.sparse, eight.sparse)
    assert len(one.pairs) == len(eight.pairs)


def test_lookups_are_made_once(room):
    surface = Surface(room, VOXEL, 1)
    for name in ("coarse_grid", "fine_grid", "pairs", "sparse", "extent"):
        assert getattr(surface, name) is getattr(surface, name)


def test_sparse_surfels_are_few_and_everywhere(room):
    surface = Surface(room, 0.05, 1)
    rows = surface.sparse
    assert 300 < len(rows) <= 1000
    assert len(np.unique(rows)) == len(rows)
    distance = cKDTree(surface.places[rows]).query(surface.places)[0]
    assert np.quantile(distance, 0.99) < 0.15 * surface.extent
    for voxel in (0.2, 0.4):
        thin = Surface(room, voxel, 1)
        assert 1 / 15 < len(thin.sparse) / len(thin) < 1 / 6  # a surface fills nine voxels of a cell of three


@pytest.mark.parametrize(
    "points",
    [
        np.eye(3),
        np.vstack([np.zeros((1, 3)), np.eye(3)]),
        np.c_[np.linspace(0, 1, 500), np.zeros((500, 2))],
        np.random.default_rng(0).random((10, 3)),
        np.repeat(np.eye(3), 50, axis=0),
    ],
    ids=["three", "four", "line", "ten", "three places"],
)
def test_any_cloud_has_some_surfel(points):
    for voxel in (0.01, 0.3, 5.0):
        surface = Surface(points, voxel, 1)
        assert len(surface) > 0
        assert np.isfinite(surface.places).all()
        assert np.allclose(np.linalg.norm(surface.normals, axis=1), 1)
        assert len(surface.pairs) == 0 or len(points) > 3


# ---------------------------------------------------------------------------------------------------------- main axes


def test_one_of_the_main_axes_is_the_way_back(rng, any_motion):
    """A shell of three different widths, moved: one of the four motions between the axes undoes it."""
    points = ball(30_000, rng) * [3, 2, 1]
    T = any_motion(rng, 10.0)
    held, moving = Surface(points, 0.2, 1), Surface(apply(T, points), 0.2, 1)
    best = np.inf
    for G in main_axes(held, moving):
        assert np.allclose(G[:3, :3] @ G[:3, :3].T, np.eye(3), atol=1e-12)
        assert np.linalg.det(G[:3, :3]) == pytest.approx(1)
        assert np.allclose(apply(G, moving.places).mean(axis=0), held.places.mean(axis=0))
        turned = rotate(G[:3, :3], np.eye(3)) - rotate(inverse(T)[:3, :3], np.eye(3))
        best = min(best, np.abs(turned).max())
    assert best < 0.05


# ------------------------------------------------------------------------------------------------------------ weights


def test_all_surfels_of_one_plane_count_alike(rng):
    sheet = Surface(np.c_[rng.uniform(0, 4, (20_000, 2)), np.zeros(20_000)], VOXEL, 1)
    assert np.allclose(sheet.weights, 1 / len(sheet))


def test_a_surfel_counts_less_where_more_of_the_surface_lies_in_its_plane(rng):
    """A large floor, a small wall, and a ball, of which hardly anything lies in one plane."""
    floor = np.c_[rng.uniform(0, 6, (36_000, 2)), np.zeros(36_000)]
    wall = np.c_[np.zeros(4_000), rng.uniform(0, 2, (4_000, 2))] + [0, 0, 0.5]
    surface = Surface(np.vstack([floor, wall, ball(3_000, rng, 0.5) + [3, 3, 1.5]]), VOXEL, 1)
    places = surface.places + surface.origin
    on_floor, on_wall = places[:, 2] < 0.1, np.abs(places[:, 0]) < 0.05
    of_floor, of_wall, of_ball = (surface.weights[rows].mean() for rows in (on_floor, on_wall, ~(on_floor | on_wall)))
    assert of_floor < of_wall < of_ball
    assert surface.weights.sum() == pytest.approx(1)
    assert surface.weights.min() > 0


def test_the_weights_have_the_same_bits_at_any_number_of_threads(room):
    one = Surface(room, VOXEL, 1).weights
    for threads in (2, 8):
        assert np.array_equal(Surface(room, VOXEL, threads).weights, one)
