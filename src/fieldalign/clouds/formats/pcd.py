"""PCD: ascii, binary and binary_compressed, through pypcd4."""

from __future__ import annotations

import struct
from os import SEEK_CUR
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ...errors import CloudFileError
from ..cloud import Array, PointCloud
from . import require_bytes, table_of
from .columns import COLORS, MOST_COLUMNS, NORMALS, cloud_from_columns, columns_of
from .viewpoints import pose_from_quaternion, quaternion_of

LONGEST_HEADER = 100  # lines
LZF_AT_BEST = 88  # bytes from one byte: 264 from 3
PADDING = "#$%&~~"  # what pypcd4 calls the fields named _
NOT_SET = [0, 0, 0, 1, 0, 0, 0]  # the VIEWPOINT that every tool writes that knows none


def read(path: Path) -> PointCloud:
    """All fields and rows, NaN or not; a VIEWPOINT that is the identity means 'not known'."""
    with path.open("rb") as file:
        header = _read_header(file)
        _check_size(header, file, path.stat().st_size - file.tell())
        # Not pypcd4's from_path: it looks for the data elsewhere where a header has more lines than usual, believes
        # what it finds there, and takes exactly one blank between the values of an ascii row.
        dtype = header.build_dtype()
        if header.data == "ascii" or not header.points:
            rows = table_of(file, dtype, header.points)
        else:
            rows = (_read_binary if header.data == "binary" else _read_compressed)(file, dtype, header.points)
    columns = {name: rows[name] for name in rows.dtype.names or () if not name.startswith(PADDING)}
    known = list(header.viewpoint) != NOT_SET
    viewpoint = pose_from_quaternion(header.viewpoint[:3], header.viewpoint[3:]) if known else None
    return cloud_from_columns(_with_unpacked_colors(columns), viewpoint)


def write(path: Path, cloud: PointCloud) -> list[str]:
    """As binary, in the cloud's own precision and under PCL's names."""
    import pypcd4

    columns, left_out = columns_of(cloud)
    columns = dict(zip(map(_pcl_name, columns), columns.values(), strict=True))
    columns = _with_packed_colors(columns)
    pcd = pypcd4.PointCloud.from_points(list(columns.values()), list(columns), [c.dtype for c in columns.values()])
    if cloud.viewpoint is not None:
        pcd.metadata.viewpoint = (*cloud.viewpoint[:3, 3].tolist(), *quaternion_of(cloud.viewpoint).tolist())
    pcd.save(path, pypcd4.Encoding.BINARY)
    return left_out


def _read_header(file: BinaryIO) -> Any:
    """The header as pypcd4's MetaData; leaves the file at its data."""
    import pypcd4

    lines: list[str] = []
    for _ in range(LONGEST_HEADER):
        lines.append(file.readline(10_000).decode("ascii", "replace").strip())
        if lines[-1].startswith("DATA"):
            return pypcd4.MetaData.parse_header(lines)
    raise CloudFileError("is not a whole PCD file: its header has no line DATA")


def _check_size(header: Any, file: BinaryIO, present: int) -> None:
    """Raises where the data cannot be as long as the header says; leaves the file where it was."""
    values = sum(header.count)
    if header.width * header.height != header.points or values > MOST_COLUMNS:
        raise CloudFileError(
            f"has a PCD header that cannot be: WIDTH {header.width} x HEIGHT {header.height}, "
            f"POINTS {header.points}, {values} values a point"
        )
    needed = header.points * sum(size * count for size, count in zip(header.size, header.count, strict=True))
    promise = f"{header.points} points"
    if header.data == "ascii":
        require_bytes(2 * values * header.points - 1 if header.points else 0, present, promise)
    elif header.data == "binary":
        require_bytes(needed, present, promise)
    elif header.points:
        require_bytes(8, present, promise)
        compressed, uncompressed = struct.unpack("<II", file.read(8))
        file.seek(-8, SEEK_CUR)
        require_bytes(compressed, present - 8, promise)
        if uncompressed != needed or needed > LZF_AT_BEST * compressed:
            raise CloudFileError(f"promises {promise}, {needed} bytes, but its compressed data cannot hold them")


def _read_binary(file: BinaryIO, dtype: np.dtype[Any], points: int) -> Array:
    return np.frombuffer(file.read(points * dtype.itemsize), dtype)


def _read_compressed(file: BinaryIO, dtype: np.dtype[Any], points: int) -> Array:
    """The columns stand one after the other."""
    import lzf

    rows, at = np.empty(points, dtype), 0
    if not points:
        return rows
    compressed, uncompressed = struct.unpack("<II", file.read(8))
    data = lzf.decompress(file.read(compressed), uncompressed)
    if data is None or len(data) != uncompressed:
        raise CloudFileError(f"is damaged: its compressed data are no {uncompressed} bytes")
    for name in dtype.names or ():
        rows[name] = np.frombuffer(data, dtype[name], points, at)
        at += points * dtype[name].itemsize
    return rows


def _pcl_name(name: str) -> str:
    return dict(zip(NORMALS[0], NORMALS[1], strict=True)).get(name, name)


def _with_unpacked_colors(columns: dict[str, Array]) -> dict[str, Array]:
    """PCL packs a color into the 32 bits 0xAARRGGBB of `rgb` (mostly called a float) or `rgba`."""
    for name, shifts in (("rgb", (16, 8, 0)), ("rgba", (16, 8, 0, 24))):
        if name in columns:
            packed = np.ascontiguousarray(columns.pop(name))
            with np.errstate(invalid="ignore"):  # numbers that are no colors
                bits = packed.view(np.uint32) if packed.dtype == np.float32 else packed.astype(np.uint32)
            columns |= {part: (bits >> s).astype(np.uint8) for part, s in zip(COLORS[0], shifts, strict=False)}
    return columns


def _with_packed_colors(columns: dict[str, Array]) -> dict[str, Array]:
    if "red" not in columns:
        return columns
    red, green, blue = (columns.pop(name).astype(np.uint32) for name in COLORS[1])
    packed = red << 16 | green << 8 | blue
    if "alpha" in columns:
        return columns | {"rgba": packed | columns.pop("alpha").astype(np.uint32) << 24}
    return columns | {"rgb": packed.view(np.float32)}
