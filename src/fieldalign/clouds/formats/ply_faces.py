"""The faces of PLY files, as triangles."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import BinaryIO, Literal

import numpy as np

from ...errors import CloudFileError
from ..cloud import PointCloud
from .ply import Element, Property, read_to_vertices, skip
from .triangles import Triangles, fans, fans_of

_CORNERS = ("vertex_indices", "vertex_index")
_ORDERS: dict[str, Literal["little", "big"]] = {"<": "little", ">": "big"}


def read_ply_faces(path: Path) -> tuple[PointCloud, Triangles]:
    """The vertices as ply.read() reads them, and the triangles of the faces, if there are any."""
    with path.open("rb") as file:
        header, cloud = read_to_vertices(path, file)
        names = [element.name for element in header.elements]
        if "face" not in names:
            return cloud, fans_of([])
        for element in header.elements[names.index("vertex") + 1 : names.index("face")]:
            skip(file, element, header.order, "faces")
        return cloud, _read_faces(file, header.elements[names.index("face")], header.order)


def _read_faces(file: BinaryIO, element: Element, order: str) -> Triangles:
    if not element.rows or not any(_is_corners(p) for p in element.properties):
        return fans_of([])
    if not order:
        return fans_of(list(_from_text(file, element)))
    data = file.read()
    alike = _all_alike(data, element, order)
    return _one_by_one(data, element, order) if alike is None else alike


def _is_corners(p: Property) -> bool:
    return p.name in _CORNERS and p.length is not None


def _from_text(file: BinaryIO, element: Element) -> Iterator[list[int]]:
    """The corners of each face; a face is a line."""
    left = element.rows
    for line in islice(file, element.rows):
        words, left = line.split(), left - 1
        for p in element.properties:
            count = 1 + int(words[0]) if p.length and words else 1
            if not 1 <= count <= len(words):
                raise CloudFileError(f"has a face that is none: {line.decode('ascii', 'replace').strip()[:60]!r}")
            if _is_corners(p):
                yield [int(word) for word in words[1:count]]
            words = words[count:]
    if left:
        raise CloudFileError(f"promises {element.rows} faces, but holds {element.rows - left}")


def _columns(data: bytes, at: int, element: Element, order: str) -> Iterator[tuple[Property, int, int, int]]:
    """The columns of the face that begins at a byte, each with how many numbers it has, where they begin, and end."""
    for p in element.properties:
        start, count = at, 1
        if p.length:
            start = at + int(p.length[1])
            count = int.from_bytes(data[at:start], _ORDERS[order])
        at = start + count * int(p.dtype[1])
        if at > len(data):
            raise CloudFileError(f"is truncated within its {element.rows} faces")
        yield p, count, start, at


def _all_alike(data: bytes, element: Element, order: str) -> Triangles | None:
    """The triangles of faces whose lists are all as long as those of the first one, at once; else None."""
    columns: list[tuple[str, str, tuple[int]]] = []
    for p, count, *_ in _columns(data, 0, element, order):
        columns += [(f"length of {p.name}", order + p.length, (1,))] if p.length else []
        columns += [(p.name, order + p.dtype, (count,))]
    dtype = np.dtype(columns)
    if len(data) < element.rows * dtype.itemsize:
        return None
    rows = np.frombuffer(data, dtype, element.rows)
    lists = [p for p in element.properties if p.length]
    if any((rows[f"length of {p.name}"] != rows[p.name].shape[1]).any() for p in lists):
        return None
    corners = rows[next(p.name for p in lists if _is_corners(p))]
    return fans(np.full(len(rows), corners.shape[1]), corners.ravel())


def _one_by_one(data: bytes, element: Element, order: str) -> Triangles:
    """The triangles of faces of any number of corners."""
    at, counts, corners, kind = 0, [], [], ""
    for _ in range(element.rows):
        for p, count, start, end in _columns(data, at, element, order):
            if _is_corners(p):
                counts.append(count)
                corners.append(data[start:end])
                kind = order + p.dtype
            at = end
    return fans(counts, np.frombuffer(b"".join(corners), kind))
