"""Trajectories in files: TUM's format and KITTI's, with all digits of each number.

TUM: `time x y z qx qy qz qw`, seconds. KITTI: the upper 3 x 4 part of each pose, row by row; it has no place for times,
so what is read back has the frames' numbers instead. Lines that begin with # are comments.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..arguments import check_one_of
from ..errors import ArgumentError
from ..motions import Matrix, quaternions_of, rotations_of
from ..whole_file import write_text
from .line_file import LineFile
from .trajectory import Trajectory

COLUMNS = {"tum": 8, "kitti": 12}
FORMATS = tuple(COLUMNS)


def read_trajectory(path: str | os.PathLike[str], format: str = "auto") -> Trajectory:
    """The trajectory in a file. format: "tum", "kitti", or "auto": told by the number of columns.

    Raises ArgumentError that names the file, and the line, where it is no such trajectory.
    """
    check_one_of("format", format, ("auto", *FORMATS))
    try:
        with open(path, encoding="utf-8-sig") as file:
            rows = _rows(file, path, COLUMNS.get(format))
    except ArgumentError:
        raise
    except UnicodeDecodeError as error:
        raise ArgumentError(f"{path} cannot be read as a trajectory: it is no text") from error
    except (OSError, ValueError) as error:  # ValueError: what can be no path
        reason = getattr(error, "strerror", None) or error
        raise ArgumentError(f"{path} cannot be read as a trajectory: {reason}") from error
    has_times = rows.shape[1] == COLUMNS["tum"]
    times, poses = _from_tum(rows, path) if has_times else _from_kitti(rows)
    try:
        return Trajectory(times, poses, has_times=has_times)
    except ArgumentError as error:
        raise ArgumentError(f"{path} is no trajectory: {error}") from error


def write_trajectory(path: str | os.PathLike[str], trajectory: Trajectory, format: str = "tum") -> None:
    """Writes a trajectory, whole or not at all; format: "tum" or "kitti", which drops the times.

    Raises ArgumentError where the format is neither or the file cannot be written.
    """
    check_one_of("format", format, FORMATS)
    lines = (_line(format, *at) + "\n" for at in zip(trajectory.times, trajectory.poses, strict=True))
    write_text("".join(lines), path)


class TrajectoryWriter:
    """Writes a trajectory while it comes to be; the file is a valid one after each pose. Close it, or use `with`.

    format: "tum" or "kitti". Raises as LineFile does.
    """

    def __init__(self, path: str | os.PathLike[str], format: str = "tum") -> None:
        check_one_of("format", format, FORMATS)
        self._format, self._lines = format, LineFile(path)

    def add(self, time: float, pose: Matrix) -> None:
        """Adds the pose (4, 4) of a time in seconds."""
        self._lines.add(_line(self._format, time, pose))

    def close(self) -> None:
        """Forces everything onto the disk."""
        self._lines.close()

    def __enter__(self) -> TrajectoryWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _line(format: str, time: float, pose: Matrix) -> str:
    if format == "kitti":
        return _joined(pose[:3].ravel())
    w, x, y, z = quaternions_of(pose[None, :3, :3])[0]
    return _joined([time, *pose[:3, 3], x, y, z, w])


def _joined(values: Matrix | list[float]) -> str:
    return " ".join(repr(float(value)) for value in values)  # repr: the fewest digits that give the value back


def _rows(lines: Iterator[str], path: str | os.PathLike[str], width: int | None) -> Matrix:
    """The numbers (n, k) of all lines; k as asked, or as the first line has it."""
    rows: list[list[float]] = []
    for number, line in enumerate(lines, 1):
        words = line.replace(",", " ").split()
        if not words or words[0].startswith("#"):
            continue
        width = width or len(words)
        if len(words) != width or width not in COLUMNS.values():
            raise ArgumentError(f"{Path(path)} line {number} has {len(words)} values, but a trajectory has 8 (TUM) or "
                                "12 (KITTI) in each line")
        try:
            rows.append([float(word) for word in words])
        except ValueError as error:
            raise ArgumentError(f"{Path(path)} line {number} is no row of numbers: {line.strip()[:60]!r}") from error
    if not rows:
        raise ArgumentError(f"{Path(path)} holds no pose")
    return np.array(rows)


def _from_tum(rows: Matrix, path: str | os.PathLike[str]) -> tuple[Matrix, Matrix]:
    length = np.linalg.norm(rows[:, 4:], axis=1, keepdims=True)
    bad = ~(np.abs(length[:, 0] - 1) < 0.01)
    if bad.any():
        row = int(np.flatnonzero(bad)[0])
        raise ArgumentError(f"{Path(path)} is no trajectory: the quaternion of pose {row} has length {length[row, 0]}")
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    poses[:, :3, :3] = rotations_of((rows[:, 4:] / length)[:, [3, 0, 1, 2]])
    poses[:, :3, 3] = rows[:, 1:4]
    return rows[:, 0], poses


def _from_kitti(rows: Matrix) -> tuple[Matrix, Matrix]:
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    poses[:, :3] = rows.reshape(-1, 3, 4)
    return np.arange(len(rows), dtype=float), poses
