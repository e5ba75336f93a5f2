"""Registration recall of 3DMatch by the definitions that are in use.

| name | right is | share of | source |
| --- | --- | --- | --- |
| by scenes | e^T info e / info[0, 0] <= 0.2^2 | pairs with j > i + 1, mean over scenes | 3DMatch's toolbox; Predator |
| by pairs | the same | pairs with j > i + 1, all alike | github.com/rabbityl/lepard/issues/6, and others |
| by thresholds | RRE <= 15 deg and RTE <= 0.3 m | all pairs alike | Choy et al., Deep Global Registration, CVPR 2020 |

e is the shift and the vector part of the unit quaternion of inverse(T_gt) T, info from gt.info (data_sets/gt_log.py).
That is meant for the mean square distance of true correspondences after registration. Where there is no gt.info, it is
this itself: of the source's points that have a target's point within 3 cm at the truth.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ... import _core
from ...motions import Matrix, apply, inverse
from .. import measures
from ..case import Case
from ..data_sets.three_d_match import FragmentPair
from ..results import Results, Row
from .laid import Laid

LARGEST = 0.2  # m, of correspondences, root mean square
THRESHOLDS = 15.0, 0.3  # degrees, metres
_NEAR = 0.03  # m, of true correspondences


def information_error(T: Matrix, T_true: Matrix, information: Matrix) -> float:
    """The benchmark's error (m) of a pose, by the information (6, 6) of gt.info."""
    off = inverse(T_true) @ T
    quaternion = Rotation.from_matrix(off[:3, :3]).as_quat(canonical=True)
    e = np.r_[off[:3, 3], quaternion[:3]]
    return float(np.sqrt(e @ information @ e / information[0, 0]))


def correspondence_error(T: Matrix, T_true: Matrix, moment: Matrix) -> float:
    """Root mean square (m) of how far T lays points from where T_true does; moment: (4, 4), mean of (x, 1)(x, 1)^T."""
    off = T - T_true
    return float(np.sqrt(np.trace(off @ moment @ off.T)))


def pair_error(pair: FragmentPair, T: Matrix) -> float:
    """The error (m) of a pose (4, 4) of a pair by what is known of the pair."""
    if pair.information is not None:
        return information_error(T, pair.T_target_source, pair.information)
    return correspondence_error(T, pair.T_target_source, _moment(pair))


def recalls(results: Results, method: str, group: str | None) -> dict[str, Any]:
    """The recall of a method by each definition, of cases whose groups are their scenes; None where no pair counts."""
    counted = [(case, row) for case, row in results.column(method, group) if not _are_neighbours(_pair_of(case))]
    right = np.array([_error(case, row) <= LARGEST for case, row in counted], bool)
    scenes = np.array([case.group for case, _ in counted])
    by_scene = [float(right[scenes == scene].mean()) for scene in np.unique(scenes)]
    return {
        "recall_by_scenes": float(np.mean(by_scene)) if by_scene else None,
        "recall_by_pairs": measures.share(right),
        "recall_by_thresholds": measures.share(results.successes(method, group, within=THRESHOLDS)),
    }


def _error(case: Case, row: Row) -> float:
    if "T" not in row:
        return np.inf
    assert isinstance(case.clouds, Laid)
    T = np.vstack([np.reshape(row["T"], (3, 4)), [0, 0, 0, 1]])
    return pair_error(_pair_of(case), case.clouds.of_pair(T))


def _pair_of(case: Case) -> FragmentPair:
    assert isinstance(case.clouds, Laid)
    assert isinstance(case.clouds.pair, FragmentPair)
    return case.clouds.pair


def _are_neighbours(pair: FragmentPair) -> bool:
    return pair.i is not None and pair.j == pair.i + 1


@cache
def _moment(pair: FragmentPair) -> Matrix:
    """Of the source's points that have a target's point near at the truth: the mean of (x, 1)(x, 1)^T, (4, 4)."""
    source, target = pair.clouds()
    away, _ = _core.PointTree(target, 1).nearest(apply(pair.T_target_source, source), 1, 1)
    points = np.insert(source[away.ravel() <= _NEAR], 3, 1, axis=1)
    return np.asarray(points.T @ points / max(len(points), 1))
