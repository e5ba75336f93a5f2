"""Pairs of KITTI's scans, by the protocols in use. What lies on the disk: kitti_sequences.py."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ...arguments import as_count, check_positive
from ...motions import Matrix, as_rigid, inverse
from .files import PathLike, arrays_in, as_folder, nothing_of
from .kitti_sequences import LAYOUTS, TEST, KittiSequence, ScanPair, published_in, sequence, sequences_in

__all__ = ["KittiSequence", "ScanPair", "metres_apart", "nearby", "sequence", "submaps", "successive"]

_HORIZON = 100  # frames after i among which its partner is looked for
_BAD = ("08", 15, 58)  # left out by the 10 m protocol: its pose is wrong


def successive(folder: PathLike, sequences: Sequence[str] | None = None) -> list[ScanPair]:
    """The pairs of each scan and the next one.

    sequences: None: those of 08, 09 and 10 that are there, or where none is, those of this project's part. Raises
    DataSetError where one that is asked for, or all, are missing.
    """
    drives = sequences_in(folder, sequences)
    return [drive.pair(row, row + 1) for drive in drives for row in range(len(drive) - 1)]


def nearby(
    folder: PathLike, sequences: Sequence[str] | None = None, every: int = 30, distance: float = 5.0
) -> list[ScanPair]:
    """Each `every`-th scan with all later ones until the first that is `distance` (m) off, that one not included.

    The protocol of DeepVCP and DeepCLR (github.com/mhorn11/deepclr, deepclr/data/datasets/kitti.py and
    scripts/converter/kitti_pairs.py), which the paper follows in Table III: every second point of each scan is kept,
    the scans are aligned by the poses, then a motion of twists.drawn_for_kitti is laid on. sequences: as above.
    """
    step = as_count(every, "every", 1)
    check_positive("distance", distance)
    return [pair for drive in sequences_in(folder, sequences) for pair in _nearby(drive, step, distance)]


def metres_apart(folder: PathLike, sequences: Sequence[str] | None = None, distance: float = 10.0) -> list[ScanPair]:
    """The usual pairs 10 m apart: a scan i, and the last before the first one that is more than `distance` (m) off
    within 100 scans; the next i follows that one, or i where there is none.

    The protocol of 3DFeat-Net, as FCGF, Deep Global Registration and Predator have it (dataloader/kitti_loader.py of
    github.com/chrischoy/DeepGlobalRegistration), without its pair (15, 58) of sequence 08. They refine the poses by
    point-to-point ICP within 0.2 m; these here are as KITTI gives them. sequences: as of successive(); None where there
    is no KITTI: kitti_10m_pairs, which are thinned at 0.3 m.
    """
    check_positive("distance", distance)
    place = as_folder(folder)
    ready = _ready_pairs(place / "kitti_10m_pairs") if sequences is None else []
    drives = published_in(place, TEST) if sequences is None else sequences_in(place, sequences)
    if not drives and not ready:
        raise nothing_of("KITTI's odometry sequences", place, LAYOUTS)
    return [pair for drive in drives for pair in _apart(drive, distance)] or ready


def submaps(folder: PathLike) -> list[ScanPair]:
    """All pairs of the part's five submaps of sequence 07, 3 to 12 m apart."""
    place = as_folder(folder)
    files = sorted((place / "kitti07_submaps").glob("*.npz"))
    if not files:
        raise nothing_of("the submaps of KITTI's sequence 07", place, ("kitti07_submaps/*.npz",))
    world_from = [as_rigid(arrays_in(file, "world_from_submap")[0], f"world_from_submap of {file}") for file in files]
    return [
        ScanPair("kitti07_submaps", i, j, f"{files[j]}#xyz", f"{files[i]}#xyz", inverse(world_from[i]) @ world_from[j],
                 "the poses in the files")
        for i in range(len(files)) for j in range(i + 1, len(files))
    ]


def _nearby(drive: KittiSequence, every: int, distance: float) -> Iterator[ScanPair]:
    for row in range(0, len(drive), every):
        far = _far(drive.world_from_lidar[:, :3, 3], row, len(drive)) >= distance
        end = int(np.argmax(far)) if far.any() else len(far)
        yield from (drive.pair(row, row + k) for k in range(1, end))


def _apart(drive: KittiSequence, distance: float) -> Iterator[ScanPair]:
    row = 0
    while row < len(drive):
        beyond = np.flatnonzero(_far(drive.positions, row, _HORIZON) > distance)
        if not len(beyond):
            row += 1
            continue
        later = row + max(int(beyond[0]) - 1, 1)
        if (drive.name, drive.frames[row], drive.frames[later]) != _BAD:
            yield drive.pair(row, later)
        row = later + 1


def _far(positions: Matrix, row: int, horizon: int) -> Matrix:
    """How far the scans from this one on are from it, (n,)."""
    return np.asarray(np.linalg.norm(positions[row : row + horizon] - positions[row], axis=1))


def _ready_pairs(folder: Path) -> list[ScanPair]:
    found: list[ScanPair] = []
    for file in sorted(folder.glob("*.npz")):
        T = as_rigid(arrays_in(file, "target_from_source")[0], f"target_from_source of {file}")
        i = int(file.stem) if file.stem.isdigit() else len(found)
        found.append(ScanPair("kitti_10m_pairs", i, i, f"{file}#source", f"{file}#target", T, "the pose in the file"))
    return found
