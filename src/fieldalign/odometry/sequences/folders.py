"""A folder of clouds in any format, one file a frame."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from collections.abc import Sequence as Rows
from functools import partial
from pathlib import Path

from ...clouds.cloud import PointCloud
from ...clouds.files import FORMATS, read_cloud
from ...errors import CloudFileError
from .point_times import with_seconds
from .sequence import Frame, Sequence, frame_of
from .stamps import read_stamps

_TIMES = ("times.txt", "timestamps.txt")
_NO_FRAMES = {*_TIMES, "calib.txt", "poses.txt", "readme.txt"}


def read_folder(folder: Path) -> Sequence:
    """The clouds of a folder in natural order, with the stamps of its times.txt or timestamps.txt where there is one.

    Of several formats, the one that most files have; where some names hold a number, those without are no frames.
    """
    files = cloud_files(folder)
    if not files:
        raise CloudFileError(f"{folder} is no sequence: it holds no clouds, which are files that end in "
                             f"{', '.join(FORMATS)}, nor is it a bag or one of KITTI's drives")
    stamps = stamps_beside(folder, len(files))
    return Sequence(folder.name, "a folder of clouds", len(files), partial(frames_of, files, stamps))


def cloud_files(folder: Path) -> list[Path]:
    """The files that are frames, in natural order."""
    named = (file for file in folder.iterdir() if file.suffix.lower() in FORMATS and not file.name.startswith("."))
    files = [file for file in named if file.name.lower() not in _NO_FRAMES]
    if not files:
        return []
    suffix = Counter(sorted(file.suffix.lower() for file in files)).most_common(1)[0][0]
    files = sorted((file for file in files if file.suffix.lower() == suffix), key=natural_order)
    numbered = [file for file in files if re.search(r"\d", file.stem)]
    return numbered or files


def natural_order(file: Path) -> tuple[object, ...]:
    """Sorts names by the numbers in them: 2 before 10; equal numbers by their digits."""
    words = re.split(r"(\d+)", file.stem.lower())
    return tuple((int(word), "") if word.isdigit() else (-1, word) for word in words), file.name


def stamps_beside(folder: Path, count: int) -> list[float] | None:
    """The stamps of so many frames; None without a file of them. Raises CloudFileError where they are not as many."""
    for name in _TIMES:
        if (folder / name).is_file():
            stamps = read_stamps(folder / name)
            if len(stamps) != count:
                raise CloudFileError(f"{folder / name} holds {len(stamps)} times, but there are {count} frames")
            return stamps
    return None


def frames_of(files: Rows[Path], stamps: Rows[float] | None) -> Iterator[Frame]:
    """A frame for each file; one that is not there is a frame without a cloud."""
    for index, file in enumerate(files):
        stamp = None if stamps is None else stamps[index]
        yield frame_of(index, stamp, partial(_read, file, stamp))


def _read(file: Path, stamp: float | None) -> PointCloud:
    return with_seconds(read_cloud(file), stamp)
