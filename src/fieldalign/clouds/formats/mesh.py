"""The vertices of OBJ and STL meshes; read only.

Not trimesh's: it drops the vertices of an OBJ that no face uses, doubles those on texture seams, and takes a
truncated ascii STL for an empty scene.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...errors import CloudFileError
from ..cloud import Array, PointCloud

STL_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("unused", "<u2")])


def read_obj(path: Path) -> PointCloud:
    """The vertices in the order of the file, whether faces use them or not."""
    vertices = _numbers_after(path, b"v")
    if not len(vertices):
        raise CloudFileError("is not an OBJ mesh with vertices: it has no line 'v X Y Z'")
    return PointCloud(vertices)


def read_stl(path: Path) -> PointCloud:
    """The corners of the triangles, each place once."""
    with path.open("rb") as file:
        head = file.read(84)
        count = int.from_bytes(head[80:], "little")
        if len(head) == 84 and path.stat().st_size == 84 + count * STL_TRIANGLE.itemsize:
            corners = np.fromfile(file, STL_TRIANGLE, count)["corners"].reshape(-1, 3)
        elif head.lstrip().startswith(b"solid"):
            corners = _ascii_corners(path)
        else:
            raise CloudFileError(f"is no whole STL mesh: neither ascii nor binary of {count} triangles of 50 bytes")
    return PointCloud(np.unique(corners, axis=0).astype(corners.dtype.newbyteorder("=")))


def _ascii_corners(path: Path) -> Array:
    corners = _numbers_after(path, b"vertex")
    last_line = path.read_bytes()[-1000:].strip().rpartition(b"\n")[2]
    if len(corners) % 3 or not last_line.strip().startswith(b"endsolid"):
        raise CloudFileError("is truncated: an ascii STL ends with 'endsolid'")
    return corners


def _numbers_after(path: Path, keyword: bytes) -> Array:
    """The three numbers after the keyword, of each line that begins with it."""
    with path.open("rb") as file:
        words_of_lines = (line.split(None, 4) for line in file)
        rows = [tuple(map(float, words[1:4])) for words in words_of_lines if words[:1] == [keyword]]
    if any(len(row) != 3 for row in rows):
        raise CloudFileError(f"has a line '{keyword.decode()}' with less than three numbers")
    return np.array(rows, float).reshape(-1, 3)
