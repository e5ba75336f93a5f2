"""The lengths of a drive, read from its first scan."""

import numpy as np
import pytest

from fieldalign.odometry.measure import measure_of, natural_voxel, range_of


def test_lengths_go_with_the_unit(drive):
    points, _ = drive.scan(0)
    one, other = measure_of(points, None), measure_of(1000 * points.astype(float), None)
    assert other.voxel == pytest.approx(1000 * one.voxel, rel=0.05)
    assert other.range == pytest.approx(1000 * one.range)
    assert 0.2 < one.voxel < 1.5


def test_a_voxel_that_is_given_is_taken(drive):
    assert measure_of(drive.scan(0)[0], 0.7).voxel == 0.7


def test_far_outliers_and_missing_returns_do_not_count(drive):
    points, _ = drive.scan(0)
    worse = np.vstack([points, np.full((3000, 3), np.nan), np.zeros((3000, 3)), [[1e12, 0, 0]]])
    assert measure_of(worse, None).range == pytest.approx(range_of(points), rel=0.1)
    assert measure_of(worse, None).voxel == pytest.approx(natural_voxel(points, range_of(points)), rel=0.1)


def test_noise_makes_voxels_larger(drive, rng):
    points, _ = drive.scan(0)
    assert natural_voxel(points + rng.normal(0, 0.05, points.shape), 30.0) > natural_voxel(points, 30.0)


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.ones((500, 3)), np.full((500, 3), np.nan), np.eye(3)])
def test_too_little_tells_nothing(points):
    assert measure_of(points, None) is None
