"""Of all steps the trajectory is kept, of the latest ones all that is known."""

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.odometry import record as module


@pytest.fixture
def short(monkeypatch):
    monkeypatch.setattr(module, "_KEPT", 7)


def run(drive, scans):
    odometry = fa.Odometry()
    for k in range(scans):
        odometry.step(*drive.scan(k))
    return odometry


@pytest.mark.parametrize("scans", [0, 1, 7, 8, 24, 28])
def test_the_trajectory_is_that_of_all_steps(drive, scans, monkeypatch):
    whole = run(drive, scans).trajectory
    monkeypatch.setattr(module, "_KEPT", 7)
    short = run(drive, scans)
    assert len(short.trajectory) == scans
    for name in ("times", "poses", "covariances"):
        assert np.array_equal(getattr(short.trajectory, name), getattr(whole, name))


def test_the_latest_results_are_kept(drive, short):
    odometry = run(drive, 10)
    assert len(odometry.results) == 7
    assert odometry.results[-1] is odometry.last
    assert np.array_equal([r.pose for r in odometry.results], odometry.trajectory.poses[-7:])
