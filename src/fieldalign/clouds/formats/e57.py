"""E57, through pye57 (the extra `e57`).

Its libe57, not its class E57: that one knows neither times nor normals and writes coordinates as float32.
"""

from __future__ import annotations

import uuid
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ...errors import CloudFileError, missing_extra
from ..cloud import Array, PointCloud
from . import require_bytes, require_unpacked
from .columns import cloud_from_columns, columns_of, parts_beyond
from .viewpoints import pose_from_quaternion, quaternion_of

CHUNK = 1_000_000  # points
PAGE, CHECKSUM = 1024, 4  # bytes: each page ends in its checksum
UTF8_MARK = b"\xef\xbb\xbf"
INTEGER = np.longlong  # not int64: pye57 takes the type code "l" for 32 bits everywhere
NAMES = {"cartesianX": "x", "cartesianY": "y", "cartesianZ": "z", "timeStamp": "time"}
NAMES |= {"colorRed": "red", "colorGreen": "green", "colorBlue": "blue"}
NAMES |= {"nor:normalX": "nx", "nor:normalY": "ny", "nor:normalZ": "nz"}
NORMALS_URI = "http://www.libe57.org/E57_NOR_surface_normals.txt"
INVALID = ("cartesianInvalidState", "sphericalInvalidState")


def read(path: Path, index: str | None = None) -> PointCloud:
    """Scan number `index` of the file, or its only scan; as read_scans gives it."""
    with _opened(path) as (image, size):
        scans = image.root()["data3D"]
        return _read_scan(image, scans[_chosen(index, len(scans))], size)


def read_scans(path: Path) -> Iterator[PointCloud]:
    """Scan by scan: points in the frame of the file, the pose as viewpoint, invalid points as rows of NaN."""
    with _opened(path) as (image, size):
        scans = image.root()["data3D"]
        for index in range(len(scans)):
            yield _read_scan(image, scans[index], size)


def write(path: Path, cloud: PointCloud) -> list[str]:
    """One scan in the cloud's own precision, in the frame of the sensor where the viewpoint is known."""
    pye57 = _pye57()
    local = cloud if cloud.viewpoint is None else cloud.transformed(np.linalg.inv(cloud.viewpoint))
    columns, _ = columns_of(local)
    unnamed = {attribute for attribute in columns if attribute not in (*NAMES.values(), "intensity")}
    columns = {name: values for name, values in columns.items() if name not in unnamed}
    file = pye57.E57(str(path), "w")
    try:
        _write_scan(file, _as_stored(columns), cloud.viewpoint)
    finally:
        # Taken from it, or its end would close the image again, and tell on stderr what is raised here.
        vars(file).pop("image_file").close()
    alpha = ["alpha of the colors"] if "alpha" in unnamed else []
    return alpha + parts_beyond(cloud, "normals", "times", "intensity", "colors", "viewpoint")


def _pye57() -> Any:
    try:
        import pye57
    except ImportError as error:
        raise missing_extra("e57", "reading and writing .e57") from error
    return pye57


@contextmanager
def _opened(path: Path) -> Iterator[tuple[Any, int]]:
    pye57 = _pye57()
    size = path.stat().st_size
    with path.open("rb") as file:
        _check_length(file, size)
        _check_text(file, size)
    image = pye57.libe57.ImageFile(str(path), "r")
    try:
        yield image, size
    finally:
        image.close()


def _check_length(file: BinaryIO, size: int) -> None:
    if file.read(8) != b"ASTM-E57":
        raise CloudFileError("is not an E57 file: it does not begin with 'ASTM-E57'")
    file.seek(16)
    require_bytes(int.from_bytes(file.read(8), "little"), size, "the length in its header")


def _check_text(file: BinaryIO, size: int) -> None:
    """Raises where the XML of the file declares entities, which its parser would write out until it takes all memory,
    or read from other files."""
    start, length = (int.from_bytes(file.read(8), "little") for _ in range(2))
    require_bytes(start + length, size, "its XML")
    first = start % PAGE
    file.seek(start - first)
    pages = file.read(first + length + CHECKSUM * (length // (PAGE - CHECKSUM) + 2))
    text = b"".join(pages[at : at + PAGE - CHECKSUM] for at in range(0, len(pages), PAGE))[first:][:length]
    if b"<!DOCTYPE" in text or text.removeprefix(UTF8_MARK)[:1] != b"<" or b"\0" in text[:8]:
        raise CloudFileError("is no E57 file: its XML has a document type, or is no text in UTF-8")


def _chosen(index: str | None, count: int) -> int:
    if index is None and count == 1:
        return 0
    if index is not None and index.isdecimal() and int(index) < count:
        return int(index)
    if index is None and count:
        raise CloudFileError(f"holds {count} scans; take them one by one with read_clouds, or one as in 'FILE.e57#0'")
    raise CloudFileError(f"has no scan {index or 0!r}: it holds {count}")


def _read_scan(image: Any, scan: Any, size: int) -> PointCloud:
    columns = _read_columns(image, scan["points"], size)
    columns = {NAMES.get(name, name): values for name, values in columns.items()}
    if "x" not in columns and "sphericalRange" in columns:
        columns |= _cartesian(*(columns.pop(f"spherical{part}") for part in ("Range", "Azimuth", "Elevation")))
    for invalid in [columns.pop(name).astype(bool) for name in INVALID if name in columns]:
        for axis in "xyz":
            columns[axis] = np.where(invalid, np.nan, columns[axis])
    cloud = cloud_from_columns(columns)
    pose = _read_pose(scan)
    return cloud if pose is None else _posed(cloud, pose)


def _posed(cloud: PointCloud, pose: Array) -> PointCloud:
    moved = cloud if np.array_equal(pose, np.eye(4)) else cloud.transformed(pose)
    return PointCloud(**{**vars(moved), "viewpoint": pose})


def _read_columns(image: Any, points: Any, size: int) -> dict[str, Array]:
    """All numeric columns, read in pieces, so that a count that lies takes no memory."""
    libe57 = _pye57().libe57
    count = points.childCount()
    require_bytes(count // 8, size, f"{count} points")
    fields = _numeric_fields(libe57, points)
    require_unpacked(8 * count * len(fields), size, f"{count} points")
    piece = {name: np.empty(min(count, CHUNK), dtype) for name, dtype in fields.items()}
    pieces = {name: [values[:0]] for name, values in piece.items()}
    if count:
        with closing(points.reader(_buffers(image, piece))) as reader:
            while read := reader.read():
                for name, values in piece.items():
                    pieces[name].append(values[:read].copy())
    columns = {name: np.concatenate(parts) for name, parts in pieces.items()}
    if any(len(values) != count for values in columns.values()):
        raise CloudFileError(f"promises {count} points, but holds fewer")
    return columns


def _numeric_fields(libe57: Any, points: Any) -> dict[str, type[np.generic]]:
    prototype = libe57.StructureNode(points.prototype())
    names = [prototype.get(i).elementName() for i in range(prototype.childCount())]
    return {
        name: _dtype(libe57, prototype[name]) for name in names if not isinstance(prototype[name], libe57.StringNode)
    }


def _dtype(libe57: Any, field: Any) -> type[np.generic]:
    if isinstance(field, libe57.IntegerNode):
        return INTEGER
    is_single = isinstance(field, libe57.FloatNode) and field.precision() == libe57.FloatPrecision.E57_SINGLE
    return np.float32 if is_single else np.float64


def _buffers(image: Any, columns: dict[str, Array]) -> Any:
    libe57 = _pye57().libe57
    buffers = libe57.VectorSourceDestBuffer()
    for name, values in columns.items():
        buffers.append(libe57.SourceDestBuffer(image, name, values, len(values), True, True))
    return buffers


def _cartesian(distance: Array, azimuth: Array, elevation: Array) -> dict[str, Array]:
    across = distance * np.cos(elevation)
    return {"x": across * np.cos(azimuth), "y": across * np.sin(azimuth), "z": distance * np.sin(elevation)}


def _read_pose(scan: Any) -> Array | None:
    if not scan.isDefined("pose"):
        return None
    pose = scan["pose"]
    q = [pose["rotation"][part].value() for part in "wxyz"] if pose.isDefined("rotation") else [1, 0, 0, 0]
    t = [pose["translation"][part].value() for part in "xyz"] if pose.isDefined("translation") else [0, 0, 0]
    return pose_from_quaternion(t, q)


def _as_stored(columns: dict[str, Array]) -> dict[str, Array]:
    """Under E57's names; missing returns get the coordinates 0 and the standard's mark for 'invalid'."""
    stored = {name: columns[column] for name, column in NAMES.items() if column in columns}
    stored |= {"intensity": columns["intensity"]} if "intensity" in columns else {}
    finite = np.isfinite([columns[axis] for axis in "xyz"]).all(axis=0)
    if not finite.all():
        stored |= {name: np.where(finite, values, 0) for name, values in stored.items() if name.startswith("cartesian")}
        stored[INVALID[0]] = np.where(finite, 0, 2)
    return {name: _storable(values) for name, values in stored.items()}


def _storable(values: Array) -> Array:
    kind = INTEGER if values.dtype.kind in "iu" else np.float32 if values.dtype == np.float32 else np.float64
    return values.astype(kind, order="C")


def _write_scan(file: Any, columns: dict[str, Array], pose: Array | None) -> None:
    libe57, image = _pye57().libe57, file.image_file
    scan = libe57.StructureNode(image)
    scan.set("guid", libe57.StringNode(image, f"{{{uuid.uuid4()}}}"))
    if pose is not None:
        scan.set("pose", _pose_node(image, pose))
    if "nor:normalX" in columns:
        image.extensionsAdd("nor", NORMALS_URI)
    prototype = libe57.StructureNode(image)
    for name, values in columns.items():
        prototype.set(name, _prototype(image, values))
    points = libe57.CompressedVectorNode(image, prototype, libe57.VectorNode(image, True))
    scan.set("points", points)
    file.data3d.append(scan)
    count = len(columns["cartesianX"])
    if count:
        with closing(points.writer(_buffers(image, columns))) as writer:
            writer.write(count)


def _prototype(image: Any, values: Array) -> Any:
    libe57 = _pye57().libe57
    if values.dtype.kind == "i":
        low, high = int(values.min(initial=0)), int(values.max(initial=0))
        return libe57.IntegerNode(image, low, low, high)
    precision = libe57.FloatPrecision
    return libe57.FloatNode(image, 0.0, precision.E57_SINGLE if values.dtype == np.float32 else precision.E57_DOUBLE)


def _pose_node(image: Any, pose: Array) -> Any:
    libe57 = _pye57().libe57
    node = libe57.StructureNode(image)
    parts = {
        "rotation": zip("wxyz", quaternion_of(pose), strict=True),
        "translation": zip("xyz", pose[:3, 3], strict=True),
    }
    for name, values in parts.items():
        part = libe57.StructureNode(image)
        for axis, value in values:
            part.set(axis, libe57.FloatNode(image, value))
        node.set(name, part)
    return node
