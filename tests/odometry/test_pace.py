"""The time between scans, whatever the clock says."""

import numpy as np
import pytest

from fieldalign.odometry import Tracking
from fieldalign.odometry.pace import Pace


def told(stamps, span=0.0):
    pace = Pace()
    return pace, [(*pace.advance(stamp, span), pace.now) for stamp in stamps]


def test_a_steady_clock():
    pace, steps = told(5 + 0.1 * np.arange(20))
    assert [event for _, event, _ in steps] == [Tracking.TRACKED] * 20
    assert np.allclose([elapsed for elapsed, _, _ in steps[1:]], 0.1)
    assert np.allclose([now for _, _, now in steps], 5 + 0.1 * np.arange(20))
    assert pace.interval == pytest.approx(0.1)


def test_no_clock():
    _, steps = told([None] * 4)
    assert [now for _, _, now in steps] == [0, 1, 2, 3]


def test_times_within_each_sweep_alone():
    pace, steps = told([0.05] * 5, span=0.1)
    assert [event for _, event, _ in steps] == [Tracking.TRACKED] * 5
    assert np.allclose(np.diff([now for _, _, now in steps]), 0.1)
    assert pace.interval == 0.1


def test_a_gap_is_said_and_counted():
    _, steps = told([0, 0.1, 0.2, 2.2, 2.3])
    assert steps[3][:2] == (2.0, Tracking.GAP)
    assert steps[4][1] is Tracking.TRACKED
    assert steps[4][0] == pytest.approx(0.1)


@pytest.mark.parametrize("jump", [-50.0, 500.0])
def test_a_jump_is_said_and_not_counted(jump):
    _, steps = told([0, 0.1, 0.2, 0.3 + jump, 0.4 + jump])
    assert steps[3][0] == pytest.approx(0.1)
    assert steps[3][1] is Tracking.CLOCK_JUMPED
    assert steps[4][1] is Tracking.TRACKED
    assert np.allclose([now for _, _, now in steps], [0, 0.1, 0.2, 0.3, 0.4])


def test_a_gap_at_first_does_not_become_the_usual():
    pace, steps = told([0, 2.0, *(2.0 + 0.1 * np.arange(1, 8))])
    assert pace.interval == pytest.approx(0.1)
    assert [event for _, event, _ in steps[2:]] == [Tracking.TRACKED] * 7
