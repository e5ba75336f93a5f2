"""What the readers share: a folder, the numbers and arrays in a file, and the error for a folder that holds nothing."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...clouds.files import read_cloud
from ...clouds.formats.numpy import checked_members, load_npy
from ...errors import DataSetError
from ...motions import Matrix

PathLike = str | os.PathLike[str]
T = TypeVar("T")


def as_folder(folder: PathLike) -> Path:
    """The folder; raises DataSetError where there is none."""
    place = Path(folder)
    if not place.is_dir():
        raise DataSetError(f"{place} is no folder, so it holds no data set")
    return place


def inside(place: Path, *names: str) -> list[Path]:
    """The folder itself, and those folders of these names that it holds."""
    return [place, *(place / name for name in names if (place / name).is_dir())]


def first_of(read: Callable[..., list[T]], places: Iterable[Path], *args: object) -> list[T]:
    """What is found in the first place that holds anything."""
    return next((found for place in places if (found := read(place, *args))), [])


def is_part(folder: PathLike) -> bool:
    """Whether this is the folder of this project's part of the data sets, ../shared/data."""
    return Path(folder, "paper_pairs").is_dir()


def nothing_of(data_set: str, place: Path, layouts: Iterable[str]) -> DataSetError:
    """The error for a folder that holds nothing of a data set: it names what was looked for."""
    return DataSetError(f"{place} holds nothing of {data_set}; looked for " + ", or ".join(layouts))


def points_of(file: str) -> Matrix:
    """The points (N, 3) of a cloud file, float64, without missing ones."""
    points = np.asarray(read_cloud(file).points, float)
    kept: Matrix = points[~np.isnan(points).any(axis=1)]
    if not len(kept) or np.isinf(kept).any():
        raise DataSetError(f"{file} must hold finite points, but holds {'infinity' if len(kept) else 'none'}")
    return kept


def names_in(file: Path) -> list[str]:
    """The lines of a text file that say anything."""
    try:
        lines = file.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise DataSetError(f"{file} cannot be read as a list of names: {error}") from error
    return [line.strip() for line in lines if line.strip()]


def number_blocks(file: Path, length: int, kind: str) -> Matrix:
    """The numbers (n, length) of a text file, apart by blanks, commas or line ends; lines after # are comments.

    Raises DataSetError where something else stands there, or a block is not whole.
    """
    try:
        lines = (line.partition("#")[0] for line in file.read_text(encoding="utf-8-sig").splitlines())
        values = np.array(" ".join(lines).replace(",", " ").split(), float)
    except (OSError, ValueError) as error:
        raise DataSetError(f"{file} cannot be read as {kind}: {error}") from error
    if not len(values) or len(values) % length or not np.isfinite(values).all():
        held = f"{len(values)} numbers" if np.isfinite(values).all() else "numbers that are not finite"
        raise DataSetError(f"{file} must hold {kind}, {length} finite numbers each, but holds {held}")
    return values.reshape(-1, length)


def array_in(file: Path) -> NDArray[Any]:
    """The array in an .npy; raises DataSetError where the file is none, or promises more than it holds."""
    try:
        return load_npy(file)
    except (OSError, ValueError) as error:
        raise DataSetError(f"{file} cannot be read as .npy: {error}") from error


def arrays_in(file: Path, *names: str) -> list[NDArray[Any]]:
    """The arrays of these names in an .npz; raises DataSetError where one is missing or the file is none."""
    try:
        checked_members(file)
        with np.load(file, allow_pickle=False) as arrays:
            return [arrays[name] for name in names]
    except KeyError as error:
        raise DataSetError(f"{file} must hold the arrays {', '.join(names)}, but has no {error.args[0]}") from error
    except Exception as error:
        raise DataSetError(f"{file} cannot be read as .npz: {error}") from error
