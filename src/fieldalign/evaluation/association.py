"""Which pose of a trajectory belongs to which of the truth: the nearest in time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arguments import is_number
from ..errors import ArgumentError
from ..motions import Matrix
from ..odometry.trajectory import Trajectory

Rows = NDArray[np.int64]


def associated(truth: Trajectory, other: Trajectory, max_difference: float = 0.01) -> tuple[Trajectory, Trajectory]:
    """The poses of both that belong together, in order: for each of the trajectory with fewer poses the nearest in time
    of the other one, if it lies within max_difference (seconds).

    As evo pairs them, to the last row: of two equally near ones the earlier; of two that are of one length, `other`
    looks up its poses in `truth`. Where neither has times, the frames' numbers are compared.

    Raises ArgumentError where none belong together, where only one of both has times, and for a max_difference that is
    no time.
    """
    if not is_number(max_difference) or not max_difference >= 0:
        raise ArgumentError(f"max_difference must be seconds, 0 or more, but is {max_difference!r}")
    if truth.has_times != other.has_times:
        names = ("the truth", "the trajectory")[:: 1 if truth.has_times else -1]
        raise ArgumentError(f"{names[0]} has times, but {names[1]} has none (files in KITTI's format hold none): they "
                            "can be compared row for row only")
    if len(other) > len(truth):
        rows, other_rows = _matches(truth.times, other.times, max_difference)
    else:
        other_rows, rows = _matches(other.times, truth.times, max_difference)
    if not len(rows):
        raise ArgumentError(f"no pose lies within {max_difference} s of one of the truth: {_span(other)}, "
                            f"{_span(truth)} of the truth")
    return truth[rows], other[other_rows]


def _matches(times: Matrix, others: Matrix, max_difference: float) -> tuple[Rows, Rows]:
    """Of which times one of the others is near enough, and which."""
    if not len(others):
        return np.empty(0, np.int64), np.empty(0, np.int64)
    nearest = _nearest(times, others)
    near = np.flatnonzero(np.abs(others[nearest] - times) <= max_difference)
    return near, nearest[near]


def _nearest(times: Matrix, others: Matrix) -> Rows:
    if (np.diff(others) < 0).any():  # a clock that jumped back
        return np.array([np.argmin(np.abs(others - time)) for time in times], np.int64)
    after = np.searchsorted(others, times, side="right").clip(0, len(others) - 1)
    before = (after - 1).clip(0)
    return np.where(times - others[before] <= others[after] - times, before, after)


def _span(trajectory: Trajectory) -> str:
    if not len(trajectory):
        return "there are no times"
    return f"its times go from {trajectory.times.min():.17g} to {trajectory.times.max():.17g}"
