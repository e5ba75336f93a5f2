"""PLY: ascii, binary little and big endian.

Not trimesh's: it refuses binary files whose faces differ in their number of corners, knows x y z in lower
case only, believes what a header promises, and writes vertices as float32.
"""

from __future__ import annotations

from itertools import islice
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np

from ...errors import CloudFileError
from ..cloud import Array, PointCloud
from . import require_bytes, table_of, write_rows
from .columns import cloud_from_columns, columns_of

ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
TYPES = {
    "char": "i1",
    "uchar": "u1",
    "short": "i2",
    "ushort": "u2",
    "int": "i4",
    "uint": "u4",
    "float": "f4",
    "double": "f8",
}
TYPES |= {"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"}
TYPES |= {"float32": "f4", "float64": "f8", "int64": "i8", "uint64": "u8"}
NAMES = {TYPES[name]: name for name in ("char", "uchar", "short", "ushort", "int", "uint", "float", "double")}


class Property(NamedTuple):
    """A column of an element, or a column of lists."""

    name: str
    dtype: str
    length: str | None  # the type of a list's length


class Element(NamedTuple):
    """Rows of one kind: vertices, faces, or whatever a program needs."""

    name: str
    rows: int
    properties: list[Property]

    @property
    def has_lists(self) -> bool:
        """Whether rows may differ in their length."""
        return any(p.length for p in self.properties)

    def dtype(self, order: str) -> np.dtype[np.void]:
        """Of a row without lists."""
        return np.dtype([(p.name, order + p.dtype) for p in self.properties])

    def least_bytes(self, order: str) -> int:
        """Of all rows: a list may be empty, and an ascii value takes a digit and a space or line end."""
        if not order:
            return self.rows * 2 * len(self.properties)
        return self.rows * sum(np.dtype(p.length or p.dtype).itemsize for p in self.properties)


class Header(NamedTuple):
    """What a file says of itself; `order` is "" where it is text, else that of the bytes."""

    order: str
    elements: list[Element]
    viewpoint: Array | None


def read(path: Path) -> PointCloud:
    """The vertices of a PLY file."""
    with path.open("rb") as file:
        return read_to_vertices(path, file)[1]


def read_to_vertices(path: Path, file: BinaryIO) -> tuple[Header, PointCloud]:
    """The header and the vertices of a file that is open at its beginning, and stands behind the vertices then."""
    header = _read_header(file)
    present = path.stat().st_size - file.tell()
    for element in header.elements:
        needed = element.least_bytes(header.order)
        needed -= not header.order and element.rows > 0  # the last line may lack its end
        require_bytes(needed, present, f"{element.rows} rows of the element {element.name!r}")
    vertices = _read_vertices(file, header, present)
    columns = {name: vertices[name] for name in vertices.dtype.names or ()}
    return header, cloud_from_columns(columns, header.viewpoint)


def write(path: Path, cloud: PointCloud) -> list[str]:
    """As binary little endian, in the cloud's own precision; the viewpoint stands in a comment."""
    columns, left_out = columns_of(cloud)
    columns = {name: _narrowed(values) for name, values in columns.items()}
    rows = np.empty(len(cloud), [(name, values.dtype.newbyteorder("<")) for name, values in columns.items()])
    for name, values in columns.items():
        rows[name] = values
    lines = ["ply", "format binary_little_endian 1.0"]
    if cloud.viewpoint is not None:
        lines.append("comment viewpoint " + " ".join(map(repr, cloud.viewpoint.ravel().tolist())))
    lines.append(f"element vertex {len(cloud)}")
    lines += [f"property {NAMES[values.dtype.str[1:]]} {name}" for name, values in columns.items()]
    with path.open("wb") as file:
        file.write("\n".join([*lines, "end_header", ""]).encode())
        write_rows(file, rows)
    return left_out


def _read_header(file: BinaryIO) -> Header:
    if file.readline(8).strip() != b"ply":
        raise CloudFileError("is not a PLY file: its first line is not 'ply'")
    order, viewpoint, elements = None, None, list[Element]()
    while line := file.readline(10_000):
        match line.decode("ascii", "replace").split():
            case ["format", encoding, *_] if encoding in ORDERS:
                order = ORDERS[encoding]
            case ["element", name, count]:
                elements.append(Element(name, int(count), []))
            case ["property", kind, name] if elements and kind in TYPES:
                elements[-1].properties.append(Property(name, TYPES[kind], None))
            case ["property", "list", length, kind, name] if elements and {length, kind} <= TYPES.keys():
                elements[-1].properties.append(Property(name, TYPES[kind], TYPES[length]))
            case ["comment", "viewpoint", *numbers] if len(numbers) == 16:
                viewpoint = np.array(numbers, float).reshape(4, 4)
            case ["end_header"] if order is not None:
                return Header(order, elements, viewpoint)
            case [] | ["comment" | "obj_info", *_]:
                pass
            case words:
                raise CloudFileError(f"has a line that no PLY header may have: {' '.join(words)[:60]!r}")
    raise CloudFileError("is truncated: it ends within its PLY header")


def _read_vertices(file: BinaryIO, header: Header, present: int) -> Array:
    for element in header.elements:
        if element.name == "vertex":
            if element.has_lists:
                raise CloudFileError("has lists within its vertices, which fieldalign cannot read")
            return (_read_binary if header.order else _read_ascii)(file, element, header.order, present)
        present -= skip(file, element, header.order, "vertices")
    raise CloudFileError("has no element 'vertex'")


def skip(file: BinaryIO, element: Element, order: str, wanted: str) -> int:
    """Skips an element before what is wanted; the number of bytes it takes."""
    start = file.tell()
    if not order:
        for _ in islice(file, element.rows):
            pass
    elif element.has_lists:
        raise CloudFileError(f"has lists before its {wanted} (element {element.name!r}), which fieldalign cannot read")
    else:
        file.seek(element.least_bytes(order), 1)
    return file.tell() - start


def _read_binary(file: BinaryIO, element: Element, order: str, present: int) -> Array:
    dtype = element.dtype(order)
    require_bytes(element.rows * dtype.itemsize, present, f"{element.rows} vertices")
    return np.fromfile(file, dtype, element.rows).astype(dtype.newbyteorder("="), copy=False)


def _read_ascii(file: BinaryIO, element: Element, order: str, present: int) -> Array:
    return table_of(file, element.dtype(order), element.rows)


def _narrowed(values: Array) -> Array:
    """PLY has no integers of 64 bits: as 32 bits where they fit, else as double (exact up to 2^53)."""
    if values.dtype.kind not in "iu" or values.dtype.itemsize < 8:
        return values
    fits = len(values) == 0 or (values.min() >= -(2**31) and values.max() < 2**31)
    return values.astype(np.int32 if fits else np.float64)
