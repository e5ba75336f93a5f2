"""What the core is never handed by the package, and yet must survive: found by fuzz/core.py under sanitizers."""

import numpy as np
import pytest

from fieldalign import _core

NAN, INF, HUGE = np.nan, np.inf, 1.7e308
NORMAL = np.array([[0.0, 0, 1]])


def row(x):
    return np.array([[x, 0.0, 0.0]])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_nothing_is_thinned_to_nothing(dtype):
    means, first, count = _core.thin(np.zeros((0, 3), dtype), np.zeros((2, 3)), 1.0, 2)
    assert means.shape == (0, 3)
    assert len(first) == len(count) == 0


@pytest.mark.parametrize(
    "bounds", [np.zeros((0, 3)), np.zeros((1, 3)), np.array([[1.0] * 3, [0.0] * 3]), np.full((2, 3), NAN)]
)
def test_bounds_that_are_none(bounds):
    with pytest.raises(ValueError, match=r"bounds|length"):
        _core.thin(np.eye(3), bounds, 1e-3, 1)


def test_points_outside_the_bounds_are_in_the_outermost_voxels():
    means, *_ = _core.thin(np.array([[-9.0, 0, 0], [9, 0, 0], [NAN, 0, 0]]), np.array([[0.0] * 3, [1.0] * 3]), 0.5, 1)
    assert len(means) == 2


@pytest.mark.parametrize("points", [row(NAN), row(INF), np.vstack([row(HUGE), row(-HUGE)])])
def test_a_tree_of_points_that_are_no_places(points):
    with pytest.raises(ValueError, match="must be finite"):
        _core.PointTree(points, 1)


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.full((50, 3), NAN), np.full((50, 3), INF)])
def test_an_occupancy_of_no_places(points):
    with pytest.raises(ValueError, match="finite"):
        _core.occupancy(points, 100, 1)


def test_an_occupancy_leaves_out_what_is_not_finite(rng):
    points = rng.normal(size=(100, 3))
    points[::3, 1] = NAN
    kept = points[np.isfinite(points).all(axis=1)]
    assert all(map(np.array_equal, _core.occupancy(points, 100, 1), _core.occupancy(kept, 100, 1)))


@pytest.mark.parametrize(
    ("means", "cell", "margin"),
    [
        (row(NAN), 0.1, 0.3),
        (row(1e300), 0.1, 0.3),
        (row(5e6), 0.002, 0.006),
        (row(0.0), 0.1, 37.0),
        (row(0.0), NAN, 1),
        (row(0.0), 1, INF),
    ],
)
def test_a_grid_that_cannot_be(means, cell, margin):
    with pytest.raises(ValueError, match=r"finite|origin|margin|positive|cells"):
        _core.ClosestGrid(means, NORMAL, cell, margin)


def test_a_long_line_of_cells_is_met_where_it_is():
    """More cells along it than float32 tells apart."""
    means = np.array([[-4e5, 0.0, 0.0], [4e5, 0, 0]])
    grid = _core.ClosestGrid(means, np.repeat(NORMAL, 2, axis=0), 0.1, 0.3)
    poses = np.eye(4)[None]
    shares = grid.agreement(means, np.repeat(NORMAL, 2, axis=0), np.ones(2), poses, 0.1, 0.5, 1.0, False, 1)
    assert shares[0, 1] == 2


@pytest.mark.parametrize("x", [NAN, INF, -INF, HUGE, -HUGE])
def test_places_that_are_none_meet_nothing(x):
    grid = _core.ClosestGrid(row(0.0), NORMAL, 0.1, 0.3)
    assert grid.agreement(row(x), NORMAL, np.ones(1), np.eye(4)[None], 0.1, 0.5, 1.0, False, 1)[0, 1] == 0
    assert np.isnan(_core.Sight(row(1.0), np.zeros(3), 10).ranges(row(-1.0))).all()
    _core.Sight(row(x), np.zeros(3), 10).ranges(row(x))


@pytest.mark.parametrize("x", [NAN, HUGE, -HUGE, 3e9, -3e9])
def test_a_map_of_voxels_far_away(x):
    """Numbers that no 32 bits hold."""
    voxels, scan, pose = _core.VoxelMap(0.1), np.array([[1, 2, 3, 0]], np.float32), np.eye(4)
    pose[0, 3] = x
    voxels.add(scan, pose, 100.0)
    assert len(voxels) == 1


@pytest.mark.parametrize("band", [(NAN, NAN), (1.0, 1.0), (0.0, INF), (2.0, -1.0)])
def test_pairs_of_any_band(rng, band):
    normals = rng.normal(size=(50, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    table = _core.PairTable(rng.normal(size=(50, 3)), normals, *band, 1)
    assert table.counts().sum() == len(table)


def test_the_scale_is_of_residuals_that_are_numbers(rng):
    x, normals, spreads = rng.normal(size=(99, 3)), np.repeat(NORMAL, 99, axis=0), np.ones(99)
    spreads[::2] = NAN
    scale = _core.robust_sums(x, normals, x + [0, 0, 0.1], normals, spreads, 0.5, 1.0, 3.0, 0.0)[3]
    assert np.isclose(scale, 3 * 1.4826 * 0.1)
