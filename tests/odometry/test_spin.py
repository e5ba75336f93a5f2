"""Scans without times: whether the sensor saw them on the way, and which way it spins, is told by the scans alone."""

import numpy as np
import pytest

import fieldalign as fa
from fieldalign import _core
from fieldalign.odometry.spin import Spin

PERIOD = 0.1
LASTS = 30  # scans in which a race is decided


def run(scans, **kwargs):
    odometry = fa.Odometry(**kwargs)
    for points in scans:
        odometry.step(points)
    return odometry


@pytest.fixture(scope="module")
def bent(drive):
    """Scans of a sensor that turns clockwise while it moves; no times."""
    return [drive.scan(k)[0] for k in range(LASTS)]


@pytest.fixture(scope="module")
def straight(drive):
    """The same scans, each as seen from one place."""
    velocity = _core.relative_twist(drive.pose(0), drive.pose(1)) / PERIOD

    def at_once(k):
        points, times = drive.scan(k)
        rows = np.column_stack([points, times - PERIOD * (k + 0.5)]).astype(np.float32)
        return _core.deskew(rows, velocity)[:, :3].copy()

    return [at_once(k) for k in range(LASTS)]


def test_the_share_of_a_sweep_that_is_over():
    points = np.array([[1.0, 0, 0], [0, 1, 0], [0, -1, 0], [2, 2, 9]])
    assert Spin(-1, np.pi).share(points) == pytest.approx([0.5, 0.25, 0.75, 0.375])
    assert Spin(1, np.pi).share(points) == pytest.approx([0.5, 0.75, 0.25, 0.625])
    assert Spin(1, 0.0).share(points) == pytest.approx([0.0, 0.25, 0.75, 0.125])


def test_the_share_is_that_of_the_times(drive):
    points, times = drive.scan(3)
    off = Spin(-1, np.pi).share(points) - (times - 3 * PERIOD) / PERIOD
    assert np.abs(off - np.round(off)).max() < 1e-5  # a sweep begins where it ends


@pytest.mark.parametrize("turns", [-1, 1])
def test_the_way_that_the_sensor_spins_is_found(bent, turns):
    mirror = np.array([1, -turns, 1], np.float32)  # a mirrored world, in which it spins the other way
    assert run(scan * mirror for scan in bent).spin.turns == turns


def test_scans_seen_at_once_are_taken_as_they_are(straight):
    odometry = run(straight)
    assert odometry.spin is None
    assert np.array_equal(odometry.trajectory.poses, run(straight, deskew=False).trajectory.poses)


def test_scans_are_taken_as_they_are_where_that_is_asked_for(bent):
    assert run(bent, deskew=False).spin is None


def test_a_sensor_that_stands_tells_nothing(bent):
    odometry = run([bent[0]] * LASTS)
    assert odometry.spin is None
    assert all(result.seconds["spin"] < 0.5 * result.seconds["align"] for result in odometry.results[2:])


def test_one_scan_that_is_missing_is_noticed_without_a_clock(drive, off):
    scans = [k for k in range(45) if k != 35]
    odometry = run(drive.scan(k)[0] for k in scans)
    assert odometry.spin is not None
    assert off(odometry.last.pose, drive.pose(44))[0] < 0.05
