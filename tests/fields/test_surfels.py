"""Planes through the neighbours of a place, against NumPy: means, normals, and how the points scatter."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fieldalign.fields import PointField


def by_numpy(points, place, k):
    """Mean, normal, and the two smaller standard deviations of the k nearest points."""
    near = points[cKDTree(points).query(place, k)[1]]
    values, vectors = np.linalg.eigh(np.cov(near.T, bias=True))
    return near.mean(axis=0), vectors[:, 0], np.sqrt(np.maximum(values[:2], 0))


def clouds():
    rng = np.random.default_rng(3)
    ball = rng.normal(size=(3000, 3))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    sheet = np.c_[rng.random((3000, 2)), np.zeros(3000)]
    return {
        "volume": rng.random((3000, 3)),
        "sphere": ball / np.linalg.norm(ball, axis=1)[:, None],
        "sheet": sheet @ turn,
        "noisy sheet": (sheet + 1e-3 * rng.normal(size=(3000, 3))) @ turn,
        "stretched": (rng.random((3000, 3)) * [100, 1, 0.01]) @ turn,
        "far": rng.random((3000, 3)) + [5e6, 4e5, 100],
        "tiny": 1e-7 * rng.random((3000, 3)),
    }


@pytest.mark.parametrize("name", clouds())
@pytest.mark.parametrize("k", [5, 10, 20])
def test_they_are_those_of_numpy(rng, name, k):
    points = clouds()[name]
    offset = points.mean(axis=0)
    size = np.ptp(points, axis=0).max()
    places = points[rng.integers(0, len(points), 100)]
    means, normals, spread = PointField(points).surfels(places, k)
    assert np.allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-12)
    for place, mean, normal, (across, along) in zip(places, means, normals, spread, strict=True):
        expected_mean, expected, (least, middle) = by_numpy(points - offset, place - offset, k)
        assert np.allclose(mean - offset, expected_mean, rtol=0, atol=1e-9 * size + 1e-9)
        assert (across, along) == pytest.approx((least, middle), rel=1e-4, abs=1e-7 * size)
        if middle > 2 * least:  # else another axis is nearly as thin
            assert abs(normal @ expected) == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("turned", [False, True])
def test_a_line_has_a_normal_across_it_and_no_width(rng, turned):
    line = np.c_[np.linspace(0, 1, 200), np.zeros((200, 2))]
    along = np.array([1.0, 0, 0])
    if turned:
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        line, along = line @ turn, along @ turn
    _, normals, spread = PointField(line).surfels(line[::10], 10)
    assert np.abs(normals @ along).max() < 1e-6
    assert np.allclose(np.linalg.norm(normals, axis=1), 1)
    assert spread.max() < 1e-7


def test_points_that_scatter_alike_in_all_directions_have_some_normal():
    """The corners of an octahedron about the place: no axis is thinner than another."""
    corners = np.vstack([np.eye(3), -np.eye(3)])
    _, normals, spread = PointField(np.vstack([corners, 100 + corners])).surfels(np.zeros((1, 3)), 6)
    assert np.linalg.norm(normals[0]) == pytest.approx(1)
    assert np.allclose(spread[0], np.sqrt(1 / 3))


def test_equal_points_have_some_normal_and_no_spread():
    points = np.vstack([np.tile([1.0, 2, 3], (30, 1)), np.eye(3) + 50])
    means, normals, spread = PointField(points).surfels(points[:1], 10)
    assert np.allclose(means, [[1, 2, 3]])
    assert np.linalg.norm(normals[0]) == pytest.approx(1)
    assert not spread.any()


def test_more_neighbours_than_points_are_all_of_them():
    points = np.vstack([np.zeros((1, 3)), np.eye(3)[:2]])
    means, normals, _ = PointField(points).surfels(points, 64)
    assert np.allclose(means, [[1 / 3, 1 / 3, 0]])
    assert np.allclose(np.abs(normals), [[0, 0, 1]])


def test_no_bit_depends_on_the_threads(rng):
    points = rng.random((20_000, 3))
    one, eight = (PointField(points, threads=n).surfels(points, 10) for n in (1, 8))
    assert all(np.array_equal(a, b) for a, b in zip(one, eight, strict=True))


# -------------------------------------------------------------------------------------------------------- as planes


def test_planes_are_those_at_the_feet(corner, rng):
    x = corner[rng.integers(0, 6000, 300)] + rng.normal(0, 0.05, (300, 3))
    field = PointField(corner)
    planes = field.planes(x, 12)
    foot = corner[cKDTree(corner).query(x)[1]]
    mean, normal, spread = field.surfels(foot, 12)
    assert np.array_equal(planes.mean, mean)
    assert np.array_equal(planes.normal, normal)
    assert np.array_equal(planes.thickness, spread[:, 0])


def test_the_last_answer_changes_nothing_but_the_time(corner, rng):
    x = corner[rng.integers(0, 6000, 300)] + rng.normal(0, 0.05, (300, 3))
    field = PointField(corner)
    last = field.planes(x + 0.02 * rng.normal(size=(300, 3)), 12)
    kept = [part.copy() for part in (last.mean, last.normal, last.thickness)]
    fresh, again = field.planes(x, 12), field.planes(x, 12, last)
    assert (fresh.place != last.place).any()
    assert (fresh.place == last.place).any()
    for name in ("mean", "normal", "thickness", "place"):
        assert np.array_equal(getattr(fresh, name), getattr(again, name))
    assert all(np.array_equal(a, b) for a, b in zip(kept, (last.mean, last.normal, last.thickness), strict=True))


def test_planes_about_another_origin_and_some_of_them(corner):
    planes = PointField(corner).planes(corner[:50], 10)
    moved = planes.about(np.array([1.0, 2, 3]))
    assert np.allclose(moved.mean, planes.mean - [1, 2, 3])
    assert np.array_equal(moved.normal, planes.normal)
    some = moved[::5]
    assert len(some.mean) == len(some.normal) == len(some.thickness) == 10
    assert np.array_equal(some.mean, moved.mean[::5])


def test_spread_points_cover_the_cloud(corner):
    field = PointField(corner)
    few = field.spread(500)
    assert 450 < len(few) < 600
    assert cKDTree(corner).query(few)[0].max() == 0
    assert len(np.unique(few, axis=0)) == len(few)
    assert cKDTree(few).query(corner)[0].max() < 0.6
    assert np.quantile(cKDTree(few).query(corner)[0], 0.9) < 0.25
    assert len(field.spread(10**6)) == len(corner)
