"""Reading and writing clouds: one table of suffixes, and the checks that all formats share."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..errors import CloudFileError, MissingExtraError, printable
from ..whole_file import replacing
from .cloud import PointCloud, as_points
from .formats import e57, kitti, las, mesh, numpy, pcd, ply, text

logger = logging.getLogger("fieldalign")
# What the libraries have to say is in our exceptions; without a handler, Python would print it.
for library in ("trimesh", "laspy"):
    logging.getLogger(library).addHandler(logging.NullHandler())

PathLike = str | os.PathLike[str]


class Format(NamedTuple):
    """How a suffix is read and written; `read` of a format with parts takes the name of one, or None."""

    read: Callable[..., PointCloud]
    write: Callable[[Path, PointCloud], list[str]] | None
    has_parts: bool = False
    read_all: Callable[[Path], Iterator[PointCloud]] | None = None


FORMATS = {
    ".ply": Format(ply.read, ply.write),
    ".pcd": Format(pcd.read, pcd.write),
    ".xyz": Format(text.read, text.write),
    ".txt": Format(text.read, text.write),
    ".csv": Format(text.read, text.write),
    ".npy": Format(numpy.read_npy, numpy.write_npy),
    ".npz": Format(numpy.read_npz, numpy.write_npz, has_parts=True),
    ".bin": Format(kitti.read, kitti.write),
    ".las": Format(las.read, las.write),
    ".laz": Format(las.read, las.write),
    ".e57": Format(e57.read, e57.write, has_parts=True, read_all=e57.read_scans),
    ".obj": Format(mesh.read_obj, None),
    ".stl": Format(mesh.read_stl, None),
}


def read_cloud(path: PathLike) -> PointCloud:
    """The cloud in a file; its format is told by the suffix.

    .ply, .pcd, .xyz, .txt, .csv, .npy, .npz, .bin (KITTI), .las, .laz, .e57; the vertices of .obj and .stl.
    'FILE.npz#NAME' takes one array of several as points, 'FILE.e57#3' one scan of several.
    Points stay float32 where the file stores float32. Columns whose meaning is not known become attributes.

    Raises CloudFileError where the file is missing, truncated, foreign, promises what it does not hold, or
    holds several clouds and none is named; MissingExtraError where .las, .laz or .e57 need an absent extra.
    """
    file, part = split_part(path)
    with errors_naming(file, "read"):
        check_existing(file, FORMATS)
        form = FORMATS[file.suffix.lower()]
        return form.read(file, part) if form.has_parts else form.read(file)


def read_clouds(path: PathLike) -> Iterator[PointCloud]:
    """All clouds in a file: the scans of an .e57, each read when its turn comes; of other files the only one.

    Raises as read_cloud does; what the check of the whole file shows, at once.
    """
    file, part = split_part(path)
    with errors_naming(file, "read"):
        check_existing(file, FORMATS)
    form = FORMATS[file.suffix.lower()]
    if form.read_all is None or part is not None:
        return iter([read_cloud(path)])
    return _named_scans(file, form.read_all)


def write_cloud(path: PathLike, cloud: PointCloud | ArrayLike) -> None:
    """Writes a cloud, or (N, 3) points, in the format that the suffix names, whole or not at all.

    An older file of that name is replaced only when the new one is complete. What the format has no place for
    is left out and named in a warning to the logger "fieldalign".

    Raises CloudFileError where the suffix is not one that can be written, or the file cannot be, and ArgumentError for
    what is no cloud.
    """
    cloud = cloud if isinstance(cloud, PointCloud) else PointCloud(as_points(cloud, "cloud"))
    file = Path(path)
    write = writer_of(path)
    with errors_naming(file, "written"), replacing(file) as temporary:
        left_out = write(temporary, cloud)
    if left_out:
        logger.warning("%s: %s files have no place for %s", file, file.suffix, ", ".join(left_out))


def writer_of(path: PathLike) -> Callable[[Path, PointCloud], list[str]]:
    """What writes a file of this suffix; raises CloudFileError where nothing does, or where the folder is missing."""
    file = Path(path)
    form = FORMATS.get(file.suffix.lower())
    if form is None or form.write is None:
        writable = ", ".join(suffix for suffix, form in FORMATS.items() if form.write)
        raise CloudFileError(f"{file} cannot be written: its suffix must be one of {writable}")
    if not file.absolute().parent.is_dir():
        raise CloudFileError(f"{file} cannot be written: there is no folder {file.parent}")
    return form.write


def split_part(path: PathLike) -> tuple[Path, str | None]:
    """The file, and what '#' names in a format that has parts; a file that has this very name comes first."""
    stem, sign, part = os.fspath(path).rpartition("#")
    form = FORMATS.get(Path(stem).suffix.lower())
    if sign and form is not None and form.has_parts and not Path(path).exists():
        return Path(stem), part
    return Path(path), None


def check_existing(file: Path, suffixes: Collection[str]) -> None:
    """Raises CloudFileError where there is no file with anything in it, or its suffix is none of these."""
    if not file.exists():
        raise CloudFileError("does not exist")
    if not file.is_file():
        raise CloudFileError("is a folder, not a file" if file.is_dir() else "is not a regular file")
    if file.suffix.lower() not in suffixes:
        raise CloudFileError(f"has the suffix {file.suffix!r}, but clouds are read from {', '.join(suffixes)}")
    if file.stat().st_size == 0:
        raise CloudFileError("is empty (0 bytes)")


def _named_scans(file: Path, read_all: Callable[[Path], Iterator[PointCloud]]) -> Iterator[PointCloud]:
    scans = read_all(file)
    while True:
        with errors_naming(file, "read"):
            scan = next(scans, None)
        if scan is None:
            return
        yield scan


@contextmanager
def errors_naming(file: Path, verb: str) -> Iterator[None]:
    """Gives a CloudFileError the name of its file, and makes one of whatever else is raised; what the file itself says
    in it does nothing to a terminal. Numbers that are none are no reason: a file may hold any."""
    try:
        with np.errstate(all="ignore"):
            yield
    except MissingExtraError:
        raise
    except CloudFileError as error:
        raise CloudFileError(f"{file} {printable(str(error))}") from error
    except Exception as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        first_line = (reason.strip() or type(error).__name__).splitlines()[0]
        raise CloudFileError(f"{file} cannot be {verb} as {file.suffix}: {printable(first_line)}") from error
