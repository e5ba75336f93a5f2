"""Relative pose error (RPE): how far motions over so many frames, or so much of the path, are from the truth's."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arguments import MAX_PLACES, as_count, check_one_of, check_positive
from ..motions import Matrix, inverse
from .pose_error import PoseErrors

Rows = NDArray[np.int64]

UNITS = ("frames", "metres")
_TOLERANCE = 0.1  # share of delta that the path of a pair may differ by, where all pairs are taken: evo's


def relative_errors(
    truth: Matrix, poses: Matrix, delta: float = 1, unit: str = "frames", all_pairs: bool = False
) -> PoseErrors:
    """The errors of the motions between pairs of poses (n, 4, 4) that are delta apart (Sturm et al., IROS 2012).

    unit: "frames", or "metres" along the path of the poses. all_pairs: from every pose on (in metres: to the one whose
    path is nearest to delta, within 10 % of it); else one pair begins where the last ended. As evo takes them.
    """
    first, last = pairs_apart(poses, delta, unit, all_pairs)
    return PoseErrors.between(inverse(poses[first]) @ poses[last], inverse(truth[first]) @ truth[last])


def pairs_apart(poses: Matrix, delta: float, unit: str, all_pairs: bool) -> tuple[Rows, Rows]:
    """The rows of poses that are delta apart: of the first and of the last of each pair."""
    check_one_of("unit", unit, UNITS)
    if unit == "frames":
        step = as_count(delta, "delta", 1, MAX_PLACES)
        rows = np.arange(0, len(poses), 1 if all_pairs else step)
        return (rows[:-step], rows[step:]) if all_pairs else (rows[:-1], rows[1:])
    check_positive("delta", delta)
    steps = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
    return _all_by_path(steps, delta) if all_pairs else _successive_by_path(steps, delta)


def _successive_by_path(steps: Matrix, delta: float) -> tuple[Rows, Rows]:
    rows, gone = [0], 0.0
    for row, step in enumerate(steps, 1):
        gone += step
        if gone >= delta:
            rows.append(row)
            gone = 0.0
    return np.array(rows[:-1], np.int64), np.array(rows[1:], np.int64)


def _all_by_path(steps: Matrix, delta: float) -> tuple[Rows, Rows]:
    distances = np.concatenate([[0.0], np.cumsum(steps)])
    first = np.arange(len(steps))
    # The distances grow, so the nearest to delta is one of the two about it; the first of those that are equally near.
    after = np.searchsorted(distances, distances[:-1] + delta).clip(first + 1, len(steps))
    before = (after - 1).clip(first + 1)
    off = np.abs(distances[np.stack([before, after])] - distances[:-1] - delta)
    nearest = np.where(off[0] <= off[1], before, after)
    nearest = np.maximum(np.searchsorted(distances, distances[nearest]), first + 1)
    near = off.min(axis=0) <= _TOLERANCE * delta
    return first[near], nearest[near]
