"""LAS and LAZ, through laspy (the extra `las`)."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from contextlib import closing, contextmanager
from os import SEEK_END
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ...errors import CloudFileError, missing_extra
from ..cloud import Array, PointCloud
from . import require_bytes, require_unpacked
from .columns import cloud_from_columns, columns_of

CHUNK = 1_000_000  # points
VLR_BYTES = 54
RAW = ("X", "Y", "Z")  # the coordinates as stored
LAYERS = {6: 9, 7: 10, 8: 11, 9: 10, 10: 12}  # of LAZ by point format, without those of extra bytes
LARGEST = 1e9  # of the stored int32 coordinates, with a factor of 2 to spare for round offsets
INTENSITY = "scalar_Intensity"  # LAS holds only whole numbers below 2^16: others go into an extra column
NORMALS = {"nx": "NormalX", "ny": "NormalY", "nz": "NormalZ"}  # CloudCompare's names


def read(path: Path) -> PointCloud:
    """Points as float64; a column of the LAS record that is zero throughout is taken as not recorded."""
    laspy = _laspy()
    with path.open("rb") as file:
        _check_header(file, path.stat().st_size)
        # Extended records may claim any length, and nothing here needs them. Not LazrsParallel: it allocates
        # chunks of whatever size the file claims, and ends the process where it cannot.
        reader = laspy.open(file, closefd=False, read_evlrs=False, laz_backend=laspy.LazBackend.Lazrs)
        with closing(reader), _panics_told():
            _check_points(reader.header, file, path.stat().st_size)
            chunks = list(reader.chunk_iterator(CHUNK))
            return _cloud(reader.header, chunks)


def write(path: Path, cloud: PointCloud) -> list[str]:
    """As LAS 1.4 in steps of at most 1e-8 of the extent; rows that are not finite are left out."""
    laspy = _laspy()
    finite = np.isfinite(cloud.points).all(axis=1)
    kept = cloud if finite.all() else cloud[finite]
    columns, left_out = columns_of(kept)
    header = laspy.LasHeader(version="1.4", point_format=6 if cloud.colors is None else 7)
    header.offsets, header.scales = _grid(np.stack([columns.pop(axis) for axis in "xyz"], axis=1).astype(float))
    las = laspy.LasData(header, laspy.ScaleAwarePointRecord.zeros(len(kept), header=header))
    las.x, las.y, las.z = kept.points.T.astype(float)
    for name, values in _las_columns(columns).items():
        if not _set(las, name, values):
            left_out.append(f"the attribute {name!r}")
    with path.open("wb") as file:
        las.write(file, do_compress=path.suffix.lower() == ".laz")
    left_out += [f"{(~finite).sum()} points that are not finite"] if len(kept) < len(cloud) else []
    return left_out + (["the viewpoint"] if cloud.viewpoint is not None else [])


def _set(las: Any, name: str, values: Array) -> bool:
    """Whether the column could be set: LAS's own columns are too small for some values, and laspy wraps or raises."""
    import laspy

    if name in RAW:
        return False
    if name not in las.point_format.dimension_names:
        las.add_extra_dim(laspy.ExtraBytesParams(name, values.dtype))
        las[name] = values
        return True
    try:
        las[name] = values
    except OverflowError:
        return False
    fits = np.array_equal(np.asarray(las[name]), values, equal_nan=True)
    if not fits:
        las[name] = np.zeros_like(values)
    return fits


def _laspy() -> Any:
    try:
        import laspy
        import lazrs  # noqa: F401
    except ImportError as error:
        raise missing_extra("las", "reading and writing .las and .laz") from error
    return laspy


@contextmanager
def _panics_told() -> Iterator[None]:
    """Makes a CloudFileError of a panic in lazrs, which Python sees as what is no Exception."""
    try:
        yield
    except BaseException as error:
        if type(error).__name__ != "PanicException":
            raise
        raise CloudFileError(f"is damaged: its compressed points cannot be unpacked ({error})") from error


def _check_header(file: BinaryIO, size: int) -> None:
    """Raises where this is no LAS file, or where more records are promised than fit before its points."""
    head = file.read(104)
    file.seek(0)
    if head[:4] != b"LASF" or len(head) < 104:
        raise CloudFileError("is not a whole LAS file: it lacks the header that begins with 'LASF'")
    header_bytes, data_start, records = struct.unpack("<HII", head[94:104])
    require_bytes(data_start, size, "points")
    require_bytes(records * VLR_BYTES, data_start - header_bytes, f"{records} variable length records")


def _check_points(header: Any, file: BinaryIO, size: int) -> None:
    present = size - header.offset_to_point_data
    promise = f"{header.point_count} points"
    if not header.are_points_compressed:
        require_bytes(header.point_count * header.point_format.size, present, promise)
    elif header.point_count:
        require_unpacked(header.point_count * header.point_format.size, size, promise)
        held = _laz_capacity(header, file, present)
        if header.point_count > held:
            raise CloudFileError(f"promises {promise}, but its compressed chunks hold at most {held}")


def _laz_capacity(header: Any, file: BinaryIO, present: int) -> int:
    """How many points the chunks of a LAZ file hold; the file is left where it was."""
    import lazrs

    start = file.tell()
    _check_chunk_count(header, file, present)
    file.seek(header.offset_to_point_data)
    record = lazrs.LazVlr(header.vlrs.get("LasZipVlr")[0].record_data)
    if record.item_size() != header.point_format.size:
        raise CloudFileError(f"has compressed points of {record.item_size()} bytes, not {header.point_format.size}")
    table = lazrs.read_chunk_table(file, record)
    require_bytes(sum(length for _, length in table), present, f"{len(table)} compressed chunks")
    if header.point_format.id in LAYERS:
        _check_layers(header, file, [length for _, length in table])
    file.seek(start)
    return sum(points for points, _ in table)


def _check_chunk_count(header: Any, file: BinaryIO, present: int) -> None:
    file.seek(header.offset_to_point_data)
    (table_start,) = struct.unpack("<q", file.read(8))
    if table_start == -1:  # written to a stream: then it stands at the end
        file.seek(-8, SEEK_END)
        (table_start,) = struct.unpack("<q", file.read(8))
    file.seek(table_start)
    _, chunks = struct.unpack("<II", file.read(8))
    require_bytes(chunks, present, f"{chunks} compressed chunks")


def _check_layers(header: Any, file: BinaryIO, lengths: list[int]) -> None:
    """A chunk: its first point, a count, the sizes of its layers, the layers; lazrs allocates what it reads."""
    layers = LAYERS[header.point_format.id] + header.point_format.num_extra_bytes
    start = header.offset_to_point_data + 8
    for length in lengths:
        file.seek(start + header.point_format.size + 4)
        sizes = struct.unpack(f"<{layers}I", file.read(4 * layers))
        require_bytes(sum(sizes), length, "the layers of a compressed chunk")
        start += length


def _cloud(header: Any, chunks: list[Any]) -> PointCloud:
    def column(name: str) -> Array:
        return np.concatenate([np.asarray(chunk[name]) for chunk in chunks]) if chunks else np.empty(0)

    names = [name for name in header.point_format.dimension_names if name not in RAW]
    optional = set(header.point_format.standard_dimension_names)
    columns = {name: column(name) for name in names}
    columns = {name: values for name, values in columns.items() if values.any() or name not in optional}
    if INTENSITY in columns:
        columns.pop("intensity", None)
    if "gps_time" in columns:
        columns["time"] = columns.pop("gps_time")
    return cloud_from_columns({axis: column(axis) for axis in "xyz"} | columns)


def _grid(points: Array) -> tuple[Array, Array]:
    """Offsets, and scales (powers of ten) with which the coordinates fit into int32."""
    if not len(points):
        return np.zeros(3), np.full(3, 1e-3)
    low, high = points.min(axis=0), points.max(axis=0)
    extent = max((high - low).max(), 1e-9 * np.abs(points).max(), 1e-30)
    round_to = 10.0 ** np.floor(np.log10(extent))
    return np.floor(low / round_to) * round_to, np.full(3, 10.0 ** np.ceil(np.log10(extent / LARGEST)))


def _las_columns(columns: dict[str, Array]) -> dict[str, Array]:
    """Under LAS's names, and in its types."""
    columns = {NORMALS.get(name, name): values for name, values in columns.items()}
    if "time" in columns:
        columns["gps_time"] = columns.pop("time")
    if "intensity" in columns and not _fits(columns["intensity"], np.uint16):
        columns[INTENSITY] = columns.pop("intensity")
    for name in {"red", "green", "blue"} & columns.keys():
        columns[name] = columns[name] * np.uint16(257)
    return columns


def _fits(values: Array, dtype: type[np.unsignedinteger[Any]]) -> bool:
    info = np.iinfo(dtype)
    return bool(((values >= info.min) & (values <= info.max) & (values == np.rint(values))).all())
