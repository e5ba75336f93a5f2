"""Thinning, against the same lattice in NumPy."""

import numpy as np
import pytest

from fieldalign.clouds.cloud import PointCloud
from fieldalign.clouds.thinning import thin
from fieldalign.errors import ArgumentError


def by_numpy(points, voxel):
    """Mean and first row of each occupied voxel, in any order."""
    points = np.asarray(points, float)
    cells = np.floor((points - points.min(axis=0)) / voxel).astype(np.int64)
    _, first, inverse, counts = np.unique(cells, axis=0, return_index=True, return_inverse=True, return_counts=True)
    offset = points.min(axis=0)
    sums = np.stack([np.bincount(inverse.ravel(), (points - offset)[:, axis]) for axis in range(3)], axis=1)
    return offset + sums / counts[:, None], first


def in_order(points, first):
    return points[np.argsort(first)]


def with_rows(points):
    return PointCloud(points, attributes={"row": np.arange(len(points))})


CLOUDS = {
    "random": lambda rng: rng.random((5000, 3)),
    "many": lambda rng: rng.random((60_000, 3)) * [10, 10, 1],
    "plane": lambda rng: np.c_[rng.random((3000, 2)), np.full(3000, 7.0)],
    "line": lambda rng: np.c_[np.zeros((900, 2)), rng.random(900)],
    "float32": lambda rng: rng.random((4000, 3)).astype(np.float32),
    "below zero": lambda rng: rng.normal(size=(4000, 3)),
    "one point": lambda rng: np.array([[1.0, 2, 3]]),
    "equal points": lambda rng: np.full((500, 3), 0.3),
    "utm": lambda rng: rng.random((4000, 3)) + [5e6, 4e5, 100],
    "huge": lambda rng: 1e12 * rng.random((4000, 3)),
    "tiny": lambda rng: 1e-9 * rng.random((4000, 3)),
}


@pytest.mark.parametrize("name", CLOUDS)
@pytest.mark.parametrize("cells", [0.5, 1, 7.3, 61.7])
def test_means_and_first_rows_are_those_of_the_lattice(rng, name, cells):
    points = CLOUDS[name](rng)
    extent = float(np.ptp(points, axis=0).max()) or 1.0
    thinned = thin(with_rows(points), extent / cells)
    means, first = by_numpy(points, extent / cells)
    rows = thinned.attributes["row"]
    assert np.array_equal(np.sort(rows), np.sort(first))
    assert thinned.points.dtype == np.float64
    tolerance = 1e-13 * extent + 4e-16 * np.abs(points).max()
    assert np.abs(in_order(thinned.points, rows) - in_order(means, first)).max() <= tolerance


def test_a_lattice_that_is_known():
    points = np.array([[0, 0, 0], [0.9, 0.4, 0], [1.0, 0, 0], [1.5, 0.5, 0], [0, 3.2, 0], [0.3, 0, 0]])
    thinned = thin(with_rows(points), 1.0)
    expected = {0: [0.4, 0.4 / 3, 0], 2: [1.25, 0.25, 0], 4: [0, 3.2, 0]}
    assert dict(zip(thinned.attributes["row"].tolist(), thinned.points.round(12).tolist(), strict=True)) == {
        row: np.round(mean, 12).tolist() for row, mean in expected.items()
    }


def test_a_voxel_larger_than_the_cloud_leaves_the_mean(rng):
    points = rng.normal(size=(300, 3))
    assert np.allclose(thin(points, 100).points, [points.mean(axis=0)], atol=1e-14)


def test_a_small_voxel_leaves_every_point(rng):
    points = rng.random((200, 3))
    thinned = thin(with_rows(points), 1e-5)
    assert np.allclose(in_order(thinned.points, thinned.attributes["row"]), points, atol=1e-15)


@pytest.mark.parametrize("shift", [[0.375, -11.0, 1024], [4096.0, 512.0, -64.0]])
def test_a_shifted_cloud_is_thinned_alike(rng, shift):
    points = rng.integers(0, 2**20, (5000, 3)) / 2**20  # so that no shift rounds them
    assert np.array_equal(points + shift - shift, points)
    here, there = thin(with_rows(points), 0.0371), thin(with_rows(points + shift), 0.0371)
    assert np.array_equal(here.attributes["row"], there.attributes["row"])
    assert np.allclose(here.points + shift, there.points, rtol=0, atol=1e-12)


def test_all_that_belongs_to_the_first_point_stays_with_it(rng):
    n = 3000
    points = rng.random((n, 3))
    viewpoint = np.eye(4)
    cloud = PointCloud(
        points,
        normals=rng.normal(size=(n, 3)),
        times=rng.random(n),
        intensity=rng.integers(0, 99, n).astype(np.uint16),
        colors=rng.integers(0, 256, (n, 3)).astype(np.uint8),
        attributes={"row": np.arange(n), "pair": rng.random((n, 2))},
        viewpoint=viewpoint,
    )
    thinned = thin(cloud, 0.2)
    rows = thinned.attributes["row"]
    assert sorted(rows) == sorted(by_numpy(points, 0.2)[1])
    for name in ("normals", "times", "intensity", "colors"):
        assert np.array_equal(getattr(thinned, name), getattr(cloud, name)[rows])
        assert getattr(thinned, name).dtype == getattr(cloud, name).dtype
    assert np.array_equal(thinned.attributes["pair"], cloud.attributes["pair"][rows])
    assert np.array_equal(thinned.viewpoint, viewpoint)


def test_threads_change_no_bit(rng):
    points = rng.normal(size=(100_000, 3))
    one = thin(with_rows(points), 0.05, threads=1)
    for threads in (2, 3, 7, None):
        other = thin(with_rows(points), 0.05, threads=threads)
        assert np.array_equal(other.points, one.points)
        assert np.array_equal(other.attributes["row"], one.attributes["row"])


def test_thinning_again_on_the_same_lattice_keeps_the_number(rng):
    """Means stay in their voxels, and the point in the lower corner holds the lattice."""
    points = np.vstack([np.zeros((1, 3)), 0.5 + rng.random((4000, 3))])
    once = thin(points, 0.1)
    twice = thin(once, 0.1)
    assert len(twice) == len(once)
    assert np.allclose(np.sort(twice.points, axis=0), np.sort(once.points, axis=0))


def test_missing_returns_are_left_out_with_what_belongs_to_them(rng):
    points = rng.random((2000, 3))
    points[::7, 1] = np.nan
    there = np.flatnonzero(~np.isnan(points[:, 1]))
    thinned = thin(with_rows(points), 0.2)
    means, first = by_numpy(points[there], 0.2)
    assert sorted(thinned.attributes["row"]) == sorted(there[first])
    assert np.allclose(in_order(thinned.points, thinned.attributes["row"]), in_order(means, first))


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.full((5, 3), np.nan)])
def test_nothing_is_thinned_to_nothing(points):
    thinned = thin(with_rows(points), 1.0)
    assert thinned.points.shape == (0, 3)
    assert len(thinned.attributes["row"]) == 0


def test_an_array_or_a_list_becomes_a_cloud(rng):
    points = rng.random((50, 3))
    assert isinstance(thin(points, 0.3), PointCloud)
    assert np.array_equal(thin(points.tolist(), 0.3).points, thin(points, 0.3).points)


def test_a_voxel_of_any_number_type(rng):
    points = rng.random((500, 3))
    lengths = [len(thin(points, voxel)) for voxel in (1, np.int32(1), np.float32(1), np.float64(1))]
    assert len(set(lengths)) == 1


@pytest.mark.parametrize("voxel", [0, -1.0, np.nan, np.inf, "1", None, np.ones(1)])
def test_a_voxel_that_is_no_length_is_refused(voxel):
    with pytest.raises(ArgumentError, match=r"^voxel must be a positive number"):
        thin(np.eye(3), voxel)


def test_a_lattice_has_at_most_2097152_voxels_to_an_axis():
    points = np.array([[0, 0, 0], [0, 1, 0], [0, 0, 0.5]])
    assert len(thin(points, 1 / 2097150)) == 3
    for voxel in (1 / 2097152, 1e-9, 5e-324):
        with pytest.raises(ArgumentError, match=r"^voxel is too small: .*2097152"):
            thin(points, voxel)


def test_the_finest_lattice_still_tells_all_three_axes_apart():
    """3 x 21 bits of one number."""
    voxel = 1 / 2097150
    points = np.vstack([np.zeros(3), np.ones(3), 1 - voxel * np.eye(3) * 1.5, voxel * np.eye(3) * 1.5])
    thinned = thin(with_rows(points), voxel)
    assert len(by_numpy(points, voxel)[1]) == 8
    assert sorted(thinned.attributes["row"]) == list(range(8))


@pytest.mark.parametrize("value", [np.inf, -np.inf])
def test_infinity_is_refused(value):
    points = np.eye(3)
    points[1, 2] = value
    with pytest.raises(ArgumentError, match=r"^cloud must be finite"):
        thin(points, 1.0)


def test_what_is_no_cloud_is_refused():
    with pytest.raises(ArgumentError, match=r"^cloud must"):
        thin(np.zeros((4, 2)), 1.0)
    with pytest.raises(ArgumentError, match=r"^threads must"):
        thin(np.eye(3), 1.0, threads=0)


def test_the_cloud_is_left_as_it_was(rng):
    points = rng.random((100, 3))
    before = points.copy()
    thin(points, 0.3)
    assert np.array_equal(points, before)
