"""The triangles of meshes: STL, OBJ and OFF; those of PLY are read in ply_faces.py. All four are written.

A reader returns the vertices as a cloud and the triangles (F, 3) as rows of it. Only STL is read by trimesh: it takes
a truncated OBJ or OFF for a shorter one, and an OBJ's corner 0 for its last.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain, islice
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import CloudFileError
from ..cloud import PointCloud
from .mesh import check_whole_stl, read_obj

Triangles = NDArray[np.int64]


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
    with path.open("rb") as file:
        return read_obj(path), fans_of(list(_obj_polygons(file)))


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


def read_off(path: Path) -> tuple[PointCloud, Triangles]:
    """OFF as text, with colours, normals or texture places, which are left out."""
    with path.open("rb") as file:
        rows = (words for line in file if (words := line.partition(b"#")[0].split()))
        head = next(rows, [])
        if not (head and re.fullmatch(b"(ST)?C?N?OFF", head[0])):
            raise CloudFileError("is not an OFF file: it does not begin with 'OFF'")
        vertices, faces = _off_counts(head[1:] or next(rows, []))
        places = [row[:3] for row in islice(rows, vertices)]
        polygons = [_polygon(row) for row in islice(rows, faces)]
    if len(places) != vertices or len(polygons) != faces:
        raise CloudFileError(
            f"promises {vertices} vertices and {faces} faces, but holds {len(places)} and {len(polygons)}"
        )
    return PointCloud(np.array(places, float)), fans_of(polygons)


def write(path: Path, vertices: NDArray[np.float64], faces: Triangles) -> None:
    """In the format of the suffix; trimesh would write a PLY as float32."""
    import trimesh

    if path.suffix.lower() == ".ply":
        _write_ply(path, vertices, faces)
    else:
        trimesh.Trimesh(vertices, faces, process=False).export(path)


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


def _off_counts(words: list[bytes]) -> tuple[int, int]:
    try:
        vertices, faces = map(int, words[:2])
    except ValueError as error:
        raise CloudFileError("must say how many vertices and faces it has, as text, after 'OFF'") from error
    if vertices < 1 or faces < 0:
        raise CloudFileError(f"must have vertices, but says that it has {vertices} and {faces} faces")
    return vertices, faces


def _polygon(row: list[bytes]) -> list[int]:
    """A face that is written as its number of corners, these, and perhaps a colour."""
    count = int(row[0])
    if not 0 <= count < len(row):
        raise CloudFileError(f"has a face of {count} corners with {len(row) - 1} of them")
    return [int(word) for word in row[1 : 1 + count]]
