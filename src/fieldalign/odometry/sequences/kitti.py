"""KITTI's two layouts: the odometry sequences and the raw drives (Geiger et al., IJRR 2013)."""

from __future__ import annotations

import os
from collections.abc import Sequence as Rows
from functools import partial
from pathlib import Path

import numpy as np

from ...errors import ArgumentError, CloudFileError
from ...motions import Matrix, as_rigid
from .folders import cloud_files, frames_of
from .sequence import Sequence
from .stamps import read_stamps

_SPARSEST = 10  # numbers to a file: of fewer files, the names are no numbers of frames


def is_odometry(folder: Path) -> bool:
    """Whether a folder is an odometry sequence, or holds `sequences`."""
    return (folder / "velodyne").is_dir() or (folder / "sequences").is_dir()


def read_odometry(folder: Path) -> Sequence:
    """velodyne/000000.bin, ... with times.txt. A number that is missing between others is a frame that is missing."""
    if not (folder / "velodyne").is_dir():
        return read_odometry(_only_sequence(folder / "sequences"))
    times = folder / "times.txt"
    stamps = read_stamps(times) if times.is_file() else None
    return _numbered(folder, folder / "velodyne", stamps, "a KITTI odometry sequence")


def is_raw(folder: Path) -> bool:
    """Whether a folder is a raw drive, or its velodyne_points."""
    return _data(folder) is not None


def read_raw(folder: Path) -> Sequence:
    """velodyne_points/data/0000000000.bin, ... with timestamps.txt: when the sensor looked ahead, in mid-sweep."""
    data = _data(folder)
    assert data is not None
    times = data.parent / "timestamps.txt"
    stamps = read_stamps(times) if times.is_file() else None
    return _numbered(folder, data, stamps, "a KITTI raw drive")


def read_calibration(path: str | os.PathLike[str]) -> Matrix:
    """T_camera_lidar (4, 4) of an odometry sequence: `Tr` in its calib.txt. KITTI's poses are the left camera's.

    Raises ArgumentError where the file holds none.
    """
    try:
        lines = Path(path).read_text().splitlines()
        values = next(line.split()[1:] for line in lines if line.split()[:1] in (["Tr:"], ["Tr_velo_to_cam:"]))
        upper = np.array(values, float).reshape(3, 4)
    except (OSError, ValueError, StopIteration) as error:
        raise ArgumentError(f"{path} is no calibration of KITTI: it has no line `Tr:` with 12 numbers") from error
    return as_rigid(np.vstack([upper, [0, 0, 0, 1]]), "Tr")


def _data(folder: Path) -> Path | None:
    for inner in (folder / "velodyne_points" / "data", folder / "data"):
        if inner.is_dir() and (inner.parent.name == "velodyne_points" or (folder / "timestamps.txt").is_file()):
            return inner
    return None


def _only_sequence(folder: Path) -> Path:
    """Of sequences/00, 01, ... the only one."""
    names = sorted(entry.name for entry in folder.iterdir() if (entry / "velodyne").is_dir())
    if len(names) != 1:
        held = f"holds {', '.join(names)}; name one of them" if names else "holds no sequence with a folder velodyne"
        raise CloudFileError(f"{folder} {held}")
    return folder / names[0]


def _numbered(folder: Path, data: Path, stamps: list[float] | None, kind: str) -> Sequence:
    """The frames of files whose names are numbers: from the first number to the last, whether a file is there or not.

    Where there are as many times as files, they belong together in order, and nothing is missing.
    """
    files = {int(file.stem): file for file in cloud_files(data) if file.stem.isdigit()}
    if not files:
        raise CloudFileError(f"{data} holds no clouds whose names are numbers, as in 000000.bin")
    numbers: Rows[int] = range(min(files), max(files) + 1)
    if len(stamps or ()) == len(files) or len(numbers) > _SPARSEST * len(files):
        numbers = sorted(files)
    elif stamps is not None and numbers[-1] >= len(stamps):
        raise CloudFileError(f"{folder} holds {len(stamps)} times, but the last frame is number {numbers[-1]}")
    elif stamps is not None:
        stamps = [stamps[number] for number in numbers]
    like = files[numbers[0]]
    all_files = [files.get(number, data / f"{number:0{len(like.stem)}}{like.suffix}") for number in numbers]
    return Sequence(folder.name, kind, len(all_files), partial(frames_of, all_files, stamps))
