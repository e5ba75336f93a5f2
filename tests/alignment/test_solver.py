"""The loop of every alignment: as many steps as the stage wants, until it is still."""

import numpy as np
import pytest

from fieldalign.alignment import Step, descend


class Shrinking:
    """Halves what is left to the goal, for many poses; still when the first one's step is small."""

    def __init__(self, iterations, small=0.0):
        self.iterations, self.small, self.asked = iterations, small, 0

    def step(self, poses):
        self.asked += 1
        moved = poses.copy()
        moved[:, 0, 3] /= 2
        return moved, Step(np.r_[0, 0, 0, moved[0, 0, 3], 0, 0], cost=float(self.asked), kept=7)

    def is_still(self, step):
        return abs(step.increment[3]) < self.small


def poses(*shifts):
    stack = np.tile(np.eye(4), (len(shifts), 1, 1))
    stack[:, 0, 3] = shifts
    return stack


@pytest.mark.parametrize("iterations", [0, 1, 5])
def test_it_takes_as_many_steps_as_are_wanted(iterations):
    found, steps = descend(Shrinking(iterations), poses(8.0, 16.0))
    assert np.allclose(found[:, 0, 3], np.array([8, 16]) / 2**iterations)
    assert [step.cost for step in steps] == list(range(1, iterations + 1))


def test_it_ends_with_the_first_step_that_is_still():
    """That step is taken."""
    stage = Shrinking(100, small=0.3)
    found, steps = descend(stage, poses(8.0))
    assert len(steps) == stage.asked == 5  # 4, 2, 1, 0.5, 0.25
    assert found[0, 0, 3] == 0.25


def test_the_start_is_left_as_it_was():
    start = poses(8.0, 2.0)
    descend(Shrinking(3), start)
    assert np.array_equal(start, poses(8.0, 2.0))
