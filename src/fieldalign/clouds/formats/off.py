"""OFF as text: vertices and triangles; colours, normals and texture places are left out."""

from __future__ import annotations

import re
from itertools import islice
from pathlib import Path

import numpy as np

from ...errors import CloudFileError
from ..cloud import PointCloud
from . import BLANKS
from .triangles import Triangles, fans, fans_of, whole_numbers

_HEAD = re.compile(rb"(?:ST)?C?N?OFF(\d*)")  # ModelNet40 has files that begin with "OFF490 518 0"


def read_off(path: Path) -> tuple[PointCloud, Triangles]:
    """The vertices, and the triangles of the faces."""
    with path.open("rb") as file:
        rows = (line for line in file if (line.partition(b"#")[0] if b"#" in line else line).strip(BLANKS))
        words = next(rows, b"").partition(b"#")[0].split()
        head = _HEAD.fullmatch(words[0]) if words else None
        if head is None:
            raise CloudFileError("is not an OFF file: it does not begin with 'OFF'")
        counts = [*filter(None, head.groups()), *words[1:]] or next(rows, b"").partition(b"#")[0].split()
        vertices, faces = _counts(counts)
        places, polygons = list(islice(rows, vertices)), list(islice(rows, faces))
    if len(places) != vertices or len(polygons) != faces:
        raise CloudFileError(
            f"promises {vertices} vertices and {faces} faces, but holds {len(places)} and {len(polygons)}"
        )
    return PointCloud(np.loadtxt(places, usecols=(0, 1, 2), ndmin=2)), _triangles(polygons)


def _triangles(rows: list[bytes]) -> Triangles:
    """Of faces that are written as their numbers of corners, these, and perhaps a colour."""
    table = _as_table(rows)
    if table is None:
        return fans_of([_polygon(row.partition(b"#")[0].split()) for row in rows])
    return fans(table[:, 0], table[:, 1:].ravel())


def _as_table(rows: list[bytes]) -> Triangles | None:
    """The numbers (F, 1 + k) of faces that all have k corners, at once; None where they have not, or some are none."""
    first = rows[0].split() if rows else []
    count = int(first[0]) if first and first[0].isdigit() else 0
    table = whole_numbers(rows, range(1 + count)) if 0 < count < len(first) else None
    return table if table is not None and (table[:, 0] == count).all() else None


def _counts(words: list[bytes]) -> tuple[int, int]:
    try:
        vertices, faces = map(int, words[:2])
    except ValueError as error:
        raise CloudFileError("must say how many vertices and faces it has, as text, after 'OFF'") from error
    if vertices < 1 or faces < 0:
        raise CloudFileError(f"must have vertices, but says that it has {vertices} and {faces} faces")
    return vertices, faces


def _polygon(row: list[bytes]) -> list[int]:
    count = int(row[0])
    if not 0 <= count < len(row):
        raise CloudFileError(f"has a face of {count} corners with {len(row) - 1} of them")
    return [int(word) for word in row[1 : 1 + count]]
