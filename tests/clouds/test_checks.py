"""What must hold of points, and the sentence where it does not."""

import warnings

import numpy as np
import pytest

from fieldalign.clouds.checks import LARGEST, checked_points, without_missing
from fieldalign.errors import ArgumentError


def with_value(n, row, value, dtype=float):
    points = np.random.default_rng(0).random((n, 3)).astype(dtype)
    points[row, 1] = value
    return points


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("n", [3, 100, 70_001])
@pytest.mark.parametrize("threads", [1, 2, 5])
def test_corners_and_mean(n, dtype, threads):
    points = np.random.default_rng(1).normal([5, -3, 100], [1, 10, 0.1], (n, 3)).astype(dtype)
    checked = checked_points(points, "source", threads)
    assert checked.points is points
    assert np.array_equal(checked.bounds, [points.min(axis=0), points.max(axis=0)])
    assert np.allclose(checked.mean, points.mean(axis=0, dtype=float), rtol=1e-13)
    assert np.array_equal(checked.mean, checked_points(points, "source", 1).mean)


def test_the_mean_loses_nothing_far_away(rng):
    points = rng.random((100_000, 3))
    offset = np.array([5e6, 4e5, 100])
    exact = (points + offset - offset).mean(axis=0) + offset
    assert np.abs(checked_points(points + offset, "source", 2).mean - exact).max() < 2e-8


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("row", [0, 17, 49_999])
def test_the_first_row_that_is_not_finite_is_named(value, dtype, row):
    points = with_value(50_000, row, value, dtype)
    with pytest.raises(ArgumentError, match=rf"^source must be finite, but 1 rows are not, first row {row}: \["):
        checked_points(points, "source", 2)


def test_both_infinities_in_one_column_are_seen():
    """Their sum is NaN, their mean is no sign of size."""
    points = with_value(10, 3, np.inf)
    points[5, 1] = -np.inf
    with pytest.raises(ArgumentError, match="2 rows are not, first row 3"):
        checked_points(points, "source", 1)


@pytest.mark.parametrize("value", [1.01 * LARGEST, -1e200, 1.7e308])
def test_coordinates_that_float64_cannot_resolve_are_refused(value):
    with pytest.raises(ArgumentError, match=r"^target must have coordinates below 1e\+15, but has "):
        checked_points(with_value(10, 3, value), "target", 1)


def test_values_whose_sum_overflows_are_no_infinity():
    with pytest.raises(ArgumentError, match="coordinates below"):
        checked_points(np.full((10, 3), 1.7e308) * np.linspace(0.9, 1, 10)[:, None], "target", 1)


def test_the_largest_coordinates_pass():
    assert checked_points(with_value(10, 3, LARGEST), "target", 1).bounds.max() == LARGEST


@pytest.mark.parametrize(
    ("points", "distinct"),
    [
        (np.zeros((0, 3)), 0),
        (np.zeros((1, 3)), 1),
        (np.ones((5000, 3)), 1),
        (np.repeat(np.eye(3)[:2], 3000, axis=0), 2),
    ],
)
def test_fewer_than_three_distinct_points_are_counted(points, distinct):
    message = rf"^source must hold at least 3 distinct points, but holds {distinct} among {len(points)} rows"
    with pytest.raises(ArgumentError, match=message):
        checked_points(points, "source", 1)


def test_three_distinct_points_are_enough_wherever_they_stand():
    points = np.zeros((5000, 3))
    points[1500], points[4999] = [0, 0, 1], [0, 1, 0]
    assert len(checked_points(points, "source", 1).points) == 5000
    points[4999] = [0, 0, 1]
    with pytest.raises(ArgumentError, match="holds 2 among"):
        checked_points(points, "source", 1)


@pytest.mark.parametrize(("offset", "extent", "warned"), [(5e6, 50, True), (5e6, 1e5, False), (100, 50, False)])
def test_float32_far_away_warns_of_what_it_lost(rng, offset, extent, warned):
    points = offset + extent * rng.random((100, 3))
    if warned:
        with pytest.warns(UserWarning, match=r"^source is float32.*subtract an offset"):
            checked_points(points.astype(np.float32), "source", 1)
    else:
        checked_points(points.astype(np.float32), "source", 1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checked_points(points, "source", 1)  # float64 has lost nothing


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_rows_with_any_nan_are_missing(rng, dtype):
    points = rng.random((40_000, 3)).astype(dtype)
    gaps = rng.random((40_000, 3)) < 0.01
    points[gaps] = np.nan
    kept = without_missing(points, "source", 2)
    assert np.array_equal(kept, points[~gaps.any(axis=1)])
    assert kept.dtype == dtype
    assert checked_points(points, "source", 2, drop_nan=True).dropped == gaps.any(axis=1).sum()


def test_nothing_missing_is_no_copy(rng):
    points = rng.random((10, 3))
    assert without_missing(points, "source", 1) is points
    assert checked_points(points, "source", 1, drop_nan=True).dropped == 0


def test_nothing_at_all_is_left_to_others():
    empty = np.zeros((0, 3))
    assert without_missing(empty, "source", 1) is empty


def test_missing_where_none_may_be():
    with pytest.raises(ArgumentError, match=r"^source must be finite, but 1 rows are not, first row 4"):
        checked_points(with_value(10, 4, np.nan), "source", 1)


@pytest.mark.parametrize("drop", [True, False])
def test_infinity_is_never_missing(drop):
    points = with_value(10, 4, np.inf)
    points[2] = np.nan
    with pytest.raises(ArgumentError, match=r"^source must be finite"):
        checked_points(points, "source", 1, drop)


@pytest.mark.parametrize("drop", [True, False])
def test_values_whose_sum_overflows_are_not_missing(drop):
    points = np.full((10, 3), 1.7e308)
    points[:3] = np.eye(3)
    with pytest.raises(ArgumentError, match=r"^source must have coordinates below 1e\+15"):
        checked_points(points, "source", 1, drop)
