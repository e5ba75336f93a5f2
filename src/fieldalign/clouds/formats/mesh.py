"""The vertices of OBJ and STL meshes; read only.

OBJ is not read by trimesh: it drops the vertices that no face uses and doubles those on texture seams.
"""

from __future__ import annotations

from os import SEEK_END
from pathlib import Path

import numpy as np

from ...errors import CloudFileError
from ..cloud import Array, PointCloud

STL_TRIANGLE_BYTES = 50


def read_obj(path: Path) -> PointCloud:
    """The vertices in the order of the file, whether faces use them or not."""
    vertices = _numbers_after(path, b"v")
    if not len(vertices):
        raise CloudFileError("is not an OBJ mesh with vertices: it has no line 'v X Y Z'")
    return PointCloud(vertices)


def read_stl(path: Path) -> PointCloud:
    """The corners of the triangles, each place once."""
    import trimesh

    check_whole_stl(path)
    corners = np.asarray(trimesh.load_mesh(path, process=False).vertices)
    if not len(corners):
        raise CloudFileError("is no STL mesh with triangles")
    return PointCloud(np.unique(corners, axis=0))


def check_whole_stl(path: Path) -> None:
    """Raises for a truncated file: trimesh takes an ascii one for empty, and a binary one may claim any size."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(84)
        if len(head) == 84 and size == 84 + STL_TRIANGLE_BYTES * int.from_bytes(head[80:], "little"):
            return
        file.seek(-min(size, 1000), SEEK_END)
        last_line = file.read().strip().rpartition(b"\n")[2].strip()
    if not (head.lstrip().startswith(b"solid") and last_line.startswith(b"endsolid")):
        raise CloudFileError("is truncated or no STL: neither ascii up to endsolid nor binary of the size it says")


def _numbers_after(path: Path, keyword: bytes) -> Array:
    """The three numbers after the keyword, of each line that begins with it."""
    lines = lines_after(path, keyword)
    if any(len(line.split(None, 4)) < 4 for line in lines):
        raise CloudFileError(f"has a line '{keyword.decode()}' with less than three numbers")
    return np.loadtxt(lines, usecols=(1, 2, 3), ndmin=2) if lines else np.empty((0, 3))


def lines_after(path: Path, keyword: bytes) -> list[bytes]:
    """The lines that begin with a word, and this."""
    starts = tuple(keyword + blank for blank in (b" ", b"\t", b"\r", b"\n"))
    with path.open("rb") as file:
        return [line for line in file if line.startswith(starts) or line.split(None, 1)[:1] == [keyword]]
