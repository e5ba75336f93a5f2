"""The triangles of meshes: STL and OBJ; those of PLY are read in ply_faces.py, of OFF in off.py. All four are written.

A reader returns the vertices as a cloud and the triangles (F, 3) as rows of it. Only STL is read by trimesh: it takes
a truncated OBJ or OFF for a shorter one, and an OBJ's corner 0 for its last.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import CloudFileError
from ..cloud import PointCloud
from . import BLANKS
from .mesh import check_whole_stl, lines_after, read_obj

Triangles = NDArray[np.int64]

_LARGEST = 2**53  # up to where float64 holds every whole number
_BESIDE_CORNERS = re.compile(rb"(?m)^\s*f(?=\s)|(?<=\d)/[\d/]*(?=\s)|#.*$")  # of an OBJ's face: all but the vertices


def fans(counts: ArrayLike, corners: ArrayLike) -> Triangles:
    """The triangles (F, 3) of polygons (n,) of so many corners each, which follow each other in `corners`.

    Each is split as a fan from its first corner: a polygon that is not convex is not filled as it should be, but its
    edges stay shared with its neighbours. Those of less than 3 corners have no triangle.
    """
    n, rows = np.asarray(counts, np.int64), np.asarray(corners, np.int64)
    pieces = np.maximum(n - 2, 0)
    first = np.repeat(np.cumsum(n) - n, pieces)
    second = first + 1 + np.arange(len(first)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    return np.stack([rows[first], rows[second], rows[second + 1]], axis=1)


def fans_of(polygons: Sequence[Sequence[int]]) -> Triangles:
    """As fans(), of polygons one by one."""
    return fans([len(p) for p in polygons], np.fromiter(chain.from_iterable(polygons), np.int64))


def read_stl(path: Path) -> tuple[PointCloud, Triangles]:
    """The triangles with their own corners each, float32."""
    import trimesh

    check_whole_stl(path)
    mesh = trimesh.load_mesh(path, process=False)
    if not len(mesh.vertices):
        raise CloudFileError("is no STL mesh with triangles")
    return PointCloud(np.asarray(mesh.vertices)), np.asarray(mesh.faces, np.int64)


def read_obj_faces(path: Path) -> tuple[PointCloud, Triangles]:
    """The vertices in the order of the file, and the triangles of its faces, if it has any."""
    vertices = read_obj(path)
    table = _obj_table(lines_after(path, b"f"))
    if table is not None:
        return vertices, fans(np.full(len(table), table.shape[1]), table.ravel() - 1)
    with path.open("rb") as file:
        return vertices, fans_of(list(_obj_polygons(file)))


def whole_numbers(rows: list[bytes], columns: Sequence[int] | None = None) -> Triangles | None:
    """A table of whole numbers, at once; None where rows differ in length, or hold anything else."""
    try:
        table = np.loadtxt(rows, usecols=columns, ndmin=2)  # float64: what is no whole number must be seen
    except ValueError:
        return None
    is_whole = np.array_equal(table, np.rint(table)) and np.abs(table).max() < _LARGEST
    return table.astype(np.int64) if is_whole and len(table) == len(rows) else None


def _obj_table(lines: list[bytes]) -> Triangles | None:
    """The corners (F, k) of faces that all have k of them, counted from 1; None where they have not."""
    rows = _BESIDE_CORNERS.sub(b"", b"".join(lines)).splitlines()
    table = whole_numbers(rows) if rows and rows[0].strip(BLANKS) else None
    return table if table is not None and table.shape[1] >= 3 and table.min() > 0 else None


def _obj_polygons(lines: Iterable[bytes]) -> Iterator[list[int]]:
    """Rows of vertices. In the file they count from 1, or back from the last one that stands before the face."""
    seen = 0
    for line in lines:
        words = line.partition(b"#")[0].split()
        if words[:1] == [b"v"]:
            seen += 1
        elif words[:1] == [b"f"]:
            numbers = [int(word.partition(b"/")[0]) for word in words[1:]]
            if len(numbers) < 3 or 0 in numbers:
                raise CloudFileError(f"has a face that is none: {line.decode('ascii', 'replace').strip()[:60]!r}")
            yield [n - 1 if n > 0 else seen + n for n in numbers]


def write(path: Path, vertices: NDArray[np.float64], faces: Triangles) -> None:
    """In the format of the suffix; trimesh would write a PLY as float32."""
    import trimesh

    if path.suffix.lower() == ".ply":
        _write_ply(path, vertices, faces)
    else:
        content: Any = trimesh.Trimesh(vertices, faces, process=False).export(file_type=path.suffix[1:].lower())
        path.write_bytes(content.encode() if isinstance(content, str) else content)


def _write_ply(path: Path, vertices: NDArray[np.float64], faces: Triangles) -> None:
    rows = np.empty(len(faces), [("count", "u1"), ("corners", "<i4", (3,))])
    rows["count"], rows["corners"] = 3, faces
    axes = [f"property double {axis}" for axis in "xyz"]
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}", *axes]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", ""]
    with path.open("wb") as file:
        file.write("\n".join(lines).encode())
        file.write(vertices.astype("<f8").tobytes())
        file.write(rows.tobytes())
