"""The lengths that a cloud itself suggests: that they follow its size, and nothing else much."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fieldalign import _core
from fieldalign.scale import Scale, common_voxel, scale_of, within


def sphere(n, rng, radius=1.0):
    away = rng.normal(size=(n, 3))
    return radius * away / np.linalg.norm(away, axis=1)[:, None]


def room(n, rng):
    """Walls and floor of a room of 6 x 4 x 2.5."""
    points = rng.random((n, 3))
    axis = rng.integers(0, 3, n)
    points[np.arange(n), axis] = rng.integers(0, 2, n)
    return points * [6, 4, 2.5]


@settings(max_examples=30, deadline=None)
@given(factor=st.floats(1e-6, 1e6))
def test_it_goes_with_the_unit(factor):
    points = room(10_000, np.random.default_rng(0))
    one, other = scale_of(points, 1), scale_of(factor * points, 1)
    assert other.voxel == pytest.approx(factor * one.voxel, rel=0.01)
    assert other.finest == pytest.approx(factor * one.finest, rel=0.01)
    assert np.allclose(other.core, factor * one.core, rtol=1e-9, atol=1e-9 * factor)


def test_a_power_of_two_changes_no_digit(rng):
    points = room(10_000, rng)
    one, other = scale_of(points, 1), scale_of(256 * points, 1)
    assert (other.voxel, other.finest) == (256 * one.voxel, 256 * one.finest)


def test_it_does_not_depend_on_the_place_or_the_threads(rng):
    points = room(20_000, rng)
    here, there = scale_of(points, 1), scale_of(points + [5e6, 4e5, 100], 8)
    assert there.voxel == pytest.approx(here.voxel, rel=1e-3)
    assert there.finest == pytest.approx(here.finest, rel=1e-3)
    assert np.allclose(there.core - [5e6, 4e5, 100], here.core, atol=1e-6)
    again = scale_of(points, 8)
    assert (again.voxel, again.finest) == (here.voxel, here.finest)


def test_the_surface_fills_some_three_thousand_cells(rng):
    """As many as an independent count finds; of a sample, cells with two points or more."""
    for points in (room(100_000, rng), sphere(100_000, rng)):
        scale = scale_of(points, 1)
        cells = len(np.unique(np.floor((points - points.min(axis=0)) / scale.voxel), axis=0))
        assert 2000 < cells < 5000


@pytest.mark.parametrize("n", [20_000, 100_000, 400_000])
def test_more_points_on_the_same_surface_change_the_voxel_little(rng, n):
    few = scale_of(room(10_000, rng), 1)
    many = scale_of(room(n, rng), 1)
    assert many.voxel == pytest.approx(few.voxel, rel=0.25)
    assert many.finest < few.finest


def test_the_finest_voxel_goes_with_the_spacing(rng):
    """Four times the points have half the spacing; beyond the sample too."""
    finest = [scale_of(room(n, rng), 1).finest for n in (4000, 16_000, 64_000, 256_000)]
    for coarse, fine in pairwise(finest):
        assert coarse / fine == pytest.approx(2, rel=0.15)
    points = room(4000, rng)
    alone = np.floor((points - points.min(axis=0)) / scale_of(points, 1).finest)
    _, inverse, counts = np.unique(alone, axis=0, return_inverse=True, return_counts=True)
    assert (counts[inverse.ravel()] == 1).mean() == pytest.approx(0.5, abs=0.15)


@pytest.mark.parametrize("share", [0.1, 0.3, 0.5])
def test_scattered_outliers_count_little(rng, share):
    points = room(40_000, rng)
    n = int(share * 40_000)
    littered = points.copy()
    littered[:n] = rng.uniform(-0.1, 1.1, (n, 3)) * [6, 4, 2.5]
    clean, dirty = scale_of(points, 1), scale_of(littered, 1)
    assert 0.6 < dirty.voxel / clean.voxel < 2


@pytest.mark.parametrize("away", [1e2, 1e4, 1e8, 1e15])
def test_far_outliers_count_nothing(rng, away):
    points = room(20_000, rng)
    spoilt = points.copy()
    spoilt[::100] = sphere(200, rng, away)
    clean, dirty = scale_of(points, 1), scale_of(spoilt, 1)
    assert dirty.voxel == pytest.approx(clean.voxel, rel=0.1)
    assert (np.abs(dirty.core) < 100).all()
    kept = within(dirty.core, spoilt, np.stack([spoilt.min(axis=0), spoilt.max(axis=0)]))
    assert len(kept) == 20_000 - 200
    assert np.abs(kept).max() < 10


def test_a_spinning_sensor_has_the_scale_of_its_surroundings(rng):
    """Ground seen from 1.7 m height: density falls with the cube of the range; half of the points within 4 m, but
    the scene reaches to 60 m."""
    down = rng.uniform(np.arctan(1.7 / 60), np.pi / 3, 60_000)
    far, around = 1.7 / np.tan(down), rng.uniform(0, 2 * np.pi, 60_000)
    ground = np.c_[far * np.cos(around), far * np.sin(around), 0.02 * rng.normal(size=60_000)]
    scale = scale_of(ground, 1)
    assert 0.15 < scale.voxel < 1.5
    assert np.abs(scale.core[:, :2]).max() > 60  # what is seen far away is no outlier


@pytest.mark.parametrize(
    "points",
    [
        np.eye(3),
        np.vstack([np.zeros((1, 3)), np.eye(3)]),
        np.c_[np.linspace(0, 1, 1000), np.zeros((1000, 2))],
        np.repeat(np.eye(3), 1000, axis=0),
        1e-9 * np.eye(3),
        np.vstack([np.zeros((100, 3)), np.eye(3)]),
        np.random.default_rng(0).random((10, 3)),
    ],
    ids=["three", "four", "line", "three places", "tiny", "hundred of one place", "ten"],
)
def test_of_any_cloud_it_is_positive_and_finite(points):
    scale = scale_of(points, 2)
    size = np.ptp(points, axis=0).max()
    assert 0 < scale.voxel <= size
    assert 0 < scale.finest <= size
    assert not np.isnan(scale.core).any()


def test_occupancy_counts_what_shares_a_cell(rng):
    """Against NumPy's count, for every halving that still has points together."""
    points = rng.random((3000, 3)) ** 2
    core, edge, shared, company = _core.occupancy(points, 16_384, 1)
    assert edge == np.ptp(points, axis=0).max()
    assert (core[0] < points.min(axis=0)).all()
    assert (core[1] > points.max(axis=0)).all()
    for k in range(9):
        cells = np.floor((points - points.min(axis=0)) / edge * (2**20 - 1)).astype(np.int64) >> (20 - k)
        _, counts = np.unique(cells, axis=0, return_counts=True)
        assert shared[k] == (counts > 1).sum()
        assert company[k] == pytest.approx(counts[counts > 1].sum() / 3000)


# -------------------------------------------------------------------------------------------------------- of a pair


def scale(voxel, finest):
    return Scale(voxel, finest, np.zeros((2, 3)))


def test_a_pair_takes_the_voxel_of_the_smaller_cloud():
    assert common_voxel(scale(0.1, 0.001), scale(0.15, 0.001)) == 0.1
    assert common_voxel(scale(0.15, 0.001), scale(0.1, 0.001)) == 0.1


@pytest.mark.parametrize("swapped", [False, True])
def test_but_none_that_fills_too_many_cells_of_the_larger(swapped):
    """A detail of a hundredth in a whole: ten times as many cells as usual, on a surface, and no more."""
    pair = scale(0.01, 1e-4), scale(1.0, 1e-4)
    assert common_voxel(*(reversed(pair) if swapped else pair)) == pytest.approx(np.sqrt(1 / 10))


def test_nor_one_that_a_sparse_cloud_cannot_fill():
    assert common_voxel(scale(0.1, 0.01), scale(0.12, 0.09)) == pytest.approx(0.18)
    assert common_voxel(scale(0.1, 0.09), scale(0.12, 0.01)) == pytest.approx(0.18)


def test_within_keeps_the_same_array_where_nothing_is_outside(rng):
    points = rng.random((50, 3))
    bounds = np.stack([points.min(axis=0), points.max(axis=0)])
    assert within(np.array([[-1.0] * 3, [2.0] * 3]), points, bounds) is points
    assert within(np.array([[5.0] * 3, [6.0] * 3]), points, bounds) is points  # hardly any inside: judged later
    some = within(np.array([[0.0] * 3, [0.5, 1, 1]]), points, bounds)
    assert np.array_equal(some, points[points[:, 0] <= 0.5])
