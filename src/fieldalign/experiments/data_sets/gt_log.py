"""The truth of a scene as 3DMatch's benchmark has it: gt.log, gt.info, and Predator's gt_overlap.log.

Of a pair (i, j), the pose in gt.log maps fragment j into fragment i's frame, so i is the target. gt.info is the sum of
G^T G over corresponding points q in fragment i's frame, G = [I, -[q]_x]: translation first (getGtInfoLog.m of
github.com/andyzeng/3dmatch-toolbox; the format is Redwood's, redwood-data.org/indoor/fileformat.html).
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import DataSetError
from ...motions import Matrix, as_rigid
from .files import number_blocks

Pair = tuple[int, int]


class Truth(NamedTuple):
    """What is known of a scene's pairs (i, j): poses T_i_j (4, 4), information (6, 6), share of i that overlaps j."""

    poses: dict[Pair, Matrix]
    information: dict[Pair, Matrix]
    overlaps: dict[Pair, float]


def read_truth(folder: Path) -> Truth:
    """What a scene's folder says; gt.info and gt_overlap.log may be missing.

    Raises DataSetError where a file is not what it should be, ArgumentError for a pose that is not rigid.
    """
    log = folder / "gt.log"
    poses = _by_pair(log, 19, "pairs i, j, count and their poses (4 x 4)", 3)
    information = _by_pair(folder / "gt.info", 39, "pairs i, j, count and matrices (6 x 6)", 3)
    overlaps = _by_pair(folder / "gt_overlap.log", 3, "rows i, j, overlap", 2)
    if not poses:
        raise DataSetError(f"{folder} holds no gt.log")
    return Truth(
        {pair: as_rigid(pose.reshape(4, 4), f"the pose of pair {pair} in {log}") for pair, pose in poses.items()},
        {pair: matrix.reshape(6, 6) for pair, matrix in information.items()},
        {pair: float(overlap[0]) for pair, overlap in overlaps.items()},
    )


def _by_pair(file: Path, length: int, kind: str, head: int) -> dict[Pair, Matrix]:
    """What stands after the first `head` numbers of each block, by the pair that its first two are."""
    blocks = number_blocks(file, length, kind) if file.is_file() else np.empty((0, length))
    return {(int(block[0]), int(block[1])): block[head:] for block in blocks}
