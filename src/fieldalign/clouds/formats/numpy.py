"""NumPy's .npy (a table or a structured array) and .npz (arrays by name); objects are never unpickled."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Mapping
from dataclasses import replace
from os import SEEK_CUR
from pathlib import Path
from tokenize import TokenError
from types import SimpleNamespace
from typing import IO, Any, NamedTuple, cast

import numpy as np

from ...errors import CloudFileError
from ..cloud import Array, PointCloud
from . import require_bytes, require_unpacked
from .columns import COLORS, MOST_COLUMNS, NORMALS, cloud_from_columns, cloud_from_table, parts_beyond

DEFLATE_AT_BEST = 1032  # bytes from one byte
ATTRIBUTES = "attributes/"
PARTS = ("normals", "times", "intensity", "colors", "viewpoint")


class _ArrayHeader(NamedTuple):
    shape: tuple[int, ...]
    dtype: np.dtype[Any]


def read_npy(path: Path) -> PointCloud:
    """An (N, 3) array, an (N, k) table as in text files, or a structured array with named columns."""
    array = load_npy(path)
    if array.dtype.names:
        return cloud_from_columns({name: array[name] for name in array.dtype.names})
    if array.shape == (4, 4) and np.array_equal(array[3], [0, 0, 0, 1]):
        raise CloudFileError("holds a (4, 4) pose, not a cloud")
    return cloud_from_table(array)


def load_npy(path: Path) -> Array:
    """The array of an .npy that holds what it promises; raises CloudFileError or ValueError where it does not."""
    with path.open("rb") as file:
        _check_array(file, path.stat().st_size)
        file.seek(0)
        return np.asarray(np.load(file, allow_pickle=False))


def write_npy(path: Path, cloud: PointCloud) -> list[str]:
    """The points only, as (N, 3)."""
    with path.open("wb") as file:
        np.save(cast(IO[bytes], SimpleNamespace(write=file.write)), cloud.points)  # see write_rows()
    return parts_beyond(cloud)


def read_npz(path: Path, name: str | None = None) -> PointCloud:
    """`points`, `xyz` or the only (N, 3) array, and all that belongs to it; or the array `name` alone."""
    headers = checked_members(path)
    with np.load(path, allow_pickle=False) as arrays:
        if name is not None:
            return PointCloud(arrays[_selected(headers, name)])
        key = _points_key(headers)
        rows = headers[key].shape[:1]
        columns = {k: arrays[k] for k, (shape, _) in headers.items() if shape[:1] == rows and len(shape) <= 2}
        viewpoint = arrays["viewpoint"] if "viewpoint" in headers else None
    return _cloud_of_arrays(columns | {"points": columns[key]}, key, viewpoint)


def write_npz(path: Path, cloud: PointCloud) -> list[str]:
    """Everything but Python objects, under the names of PointCloud's fields and attributes/NAME."""
    arrays = {part: getattr(cloud, part) for part in PARTS if getattr(cloud, part) is not None}
    arrays |= {ATTRIBUTES + name: values for name, values in cloud.attributes.items() if not values.dtype.hasobject}
    with path.open("wb") as file:
        np.savez(file, points=cloud.points, **arrays)
    return [f"the attribute {name!r}" for name, values in cloud.attributes.items() if values.dtype.hasobject]


def _cloud_of_arrays(columns: dict[str, Array], key: str, viewpoint: Array | None) -> PointCloud:
    attributes = {name: columns.pop(name) for name in list(columns) if name.startswith(ATTRIBUTES)}
    for name in {key, "viewpoint"} - {"points"}:
        columns.pop(name, None)
    cloud = cloud_from_columns(columns, viewpoint)
    named = {name.removeprefix(ATTRIBUTES): values for name, values in attributes.items()}
    return replace(cloud, attributes={**cloud.attributes, **named})


def checked_members(path: Path) -> dict[str, _ArrayHeader]:
    """The headers of all arrays, none of which claims more than its bytes in the file can be, nor all of them."""
    size = path.stat().st_size
    headers = {}
    with zipfile.ZipFile(path) as archive:
        unpacked = sum(member.file_size for member in archive.infolist())  # members may share their compressed bytes
        require_unpacked(unpacked, size, f"{len(archive.infolist())} members")
        for member in archive.infolist():
            best = {zipfile.ZIP_STORED: 1, zipfile.ZIP_DEFLATED: DEFLATE_AT_BEST}[member.compress_type]
            require_bytes(member.file_size, best * min(member.compress_size, size), f"a member {member.filename!r}")
            if member.filename.endswith(".npy"):
                with archive.open(member) as file:
                    headers[member.filename.removesuffix(".npy")] = _check_array(file, member.file_size)
    return headers


def _check_array(file: IO[bytes], size: int) -> _ArrayHeader:
    version = np.lib.format.read_magic(file)
    length = file.read(2 if version == (1, 0) else 4)
    claimed = int.from_bytes(length, "little")
    require_bytes(claimed, size - file.tell(), "a header")  # for which NumPy makes room
    if b"\\" in file.read(claimed):
        raise CloudFileError("has a header with escapes, of which Python warns")
    file.seek(-len(length) - claimed, SEEK_CUR)
    read_header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    try:
        shape, _, dtype = read_header(file)
    except (SyntaxError, TokenError) as error:  # where NumPy looks for what Python 2 wrote
        raise CloudFileError("has a header that says nothing") from error
    if dtype.hasobject:
        raise CloudFileError("holds pickled Python objects, which are never loaded")
    present = size - file.tell()
    if max(shape, default=0) > max(present, MOST_COLUMNS):  # no bytes at all may hold any number of empty rows
        raise CloudFileError(f"promises an array of shape {shape}, but holds only {present} bytes of data")
    require_bytes(math.prod(shape) * dtype.itemsize, present, f"an array of shape {shape}")
    return _ArrayHeader(shape, dtype)


def _points_key(headers: Mapping[str, _ArrayHeader]) -> str:
    for known in ("points", "xyz"):
        for name in headers:
            if name.lower() == known:
                return _checked_points(name, headers[name])
    candidates = _candidates(headers)
    if len(candidates) == 1:
        return candidates[0]
    if candidates:
        raise CloudFileError(
            f"holds several clouds: {', '.join(candidates)}; name one as in 'FILE.npz#{candidates[0]}'"
        )
    shapes = ", ".join(f"{name} {header.shape}" for name, header in headers.items())
    raise CloudFileError(f"holds no (N, 3) array of points; its arrays are: {shapes or 'none'}")


def _checked_points(name: str, header: _ArrayHeader) -> str:
    if header.shape[1:] != (3,):
        raise CloudFileError(f"has an array {name!r} of shape {header.shape}, but points must have shape (N, 3)")
    return name


def _candidates(headers: Mapping[str, _ArrayHeader]) -> list[str]:
    return [
        name
        for name, (shape, dtype) in headers.items()
        if shape[1:] == (3,) and dtype.kind in "fiu" and (name.lower(),) not in NORMALS + COLORS
    ]


def _selected(headers: Mapping[str, _ArrayHeader], name: str) -> str:
    if name not in headers:
        raise CloudFileError(
            f"has no array {name!r}; its (N, 3) arrays are: {', '.join(_candidates(headers)) or 'none'}"
        )
    return _checked_points(name, headers[name])
