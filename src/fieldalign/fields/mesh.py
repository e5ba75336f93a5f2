"""The distance field of a triangle mesh: the distance to its nearest triangle, exactly."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import as_array, as_count
from ..errors import FieldError, missing_extra
from ..lazy import lazy
from .protocol import FieldSample, Floats, Planes, as_places, exact_planes, unit

Rows = NDArray[np.int64]

_ROUNDING = 1e-15  # of coordinates
_LARGEST = 1e150  # of a coordinate
_FLAT = 1e-14     # of the extent's square: a triangle of less area has no normal
_ON_EDGE = 1e-9   # of a triangle's area: what a corner's share of a foot on the opposite edge may be
_NEXT = 0.7548776662466927, 0.5698402909980532  # steps of an even sequence in the square (Roberts' R2)


class MeshField:
    """The distance field of triangles; immutable.

    vertices: (V, 3), any unit, finite. faces: (F, 3), rows of vertices; triangles without an area are left out.
    signed: whether values are negative inside; None: where the mesh is watertight (corners at one place are one
        corner, every edge has one triangle on either side, and these wind the same way).
    bounds: the corners (2, 3) of the bounding box.

    The nearest triangle is found by libigl's tree of boxes in float64 (extra "mesh"). The side of a place is that of
    the angle-weighted normal of the face, edge or corner that is nearest (Bærentzen & Aanæs, IEEE TVCG 2005).

    Raises FieldError for arrays of a wrong shape or dtype, NaN or infinity, rows that are not there, a mesh without an
    area, and an open mesh asked for a sign; MissingExtraError where libigl is absent.
    """

    def __init__(self, vertices: ArrayLike, faces: ArrayLike, *, signed: bool | None = None) -> None:
        if signed not in (True, False, None):
            raise FieldError(f"signed of a MeshField must be True, False or None, but is {signed!r}")
        self.vertices, everything = _checked(vertices, faces)
        self.faces = _with_an_area(self.vertices, everything)
        self.bounds = np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])
        self.centre = self.bounds.mean(axis=0)
        self._about = self.vertices - self.centre  # coordinates of UTM size lose nothing
        self._resolution = _ROUNDING * float(np.abs(self.bounds).max())
        self._tree = _new_tree()
        self._tree.init(self._about, self.faces)
        open_edges = 0 if signed is False else _open_edges(self._places[everything])
        if signed and open_edges:
            raise FieldError(
                f"MeshField was asked for a sign, but its mesh is not watertight: {open_edges} edges do not have "
                "one triangle on either side, winding alike; give signed=False, or close the mesh"
            )
        self.signed = signed is not False and not open_edges

    def __len__(self) -> int:
        return len(self.faces)

    def sample(self, x: ArrayLike) -> FieldSample:
        """value (L,), gradient (L, 3), foot (L, 3) and normal (L, 3) at the places x (L, 3); the normal is that of the
        nearest triangle. On the surface itself a signed field's gradient is the normal, and an unsigned one's zero."""
        places = as_places(x) - self.centre
        face, foot = self._nearest(places)
        away = places - foot
        value = np.sqrt(np.einsum("li,li->l", away, away))
        normal = self.normals[face]
        gradient = unit(away)
        is_on = value <= self._resolution  # what is left there is rounding, which has no direction
        if not self.signed:
            gradient[is_on] = 0
            return FieldSample(value, gradient, foot + self.centre, normal)
        outward = self._orientation * self._side(face, foot)
        side = np.where(np.einsum("li,li->l", away, outward) < 0, -1.0, 1.0)
        normal = self._orientation * normal
        gradient = np.where(is_on[:, None], normal, side[:, None] * gradient)
        return FieldSample(side * value, gradient, foot + self.centre, normal)

    def planes(self, x: Floats, neighbours: int, last: Planes | None = None) -> Planes:
        """The planes of the triangles nearest to the places x (L, 3)."""
        face, foot = self._nearest(x - self.centre)
        return exact_planes(foot + self.centre, self.normals[face])

    def _nearest(self, places: Floats) -> tuple[Rows, Floats]:
        """The nearest triangles (L,) and the feet on them (L, 3), about the centre."""
        if not np.abs(places).max(initial=0) < _LARGEST:  # of which libigl would make rows that are not there
            raise FieldError("MeshField was asked at a place that is NaN or infinite, or whose square is")
        _, face, foot = self._tree.squared_distance(self._about, self.faces, places)
        return np.atleast_1d(face), np.reshape(foot, places.shape)

    def spread(self, count: int) -> Floats:
        """`count` places (count, 3) on the triangles, evenly by area."""
        share = (np.arange(as_count(count, "count", 1)) + 0.5) / count
        total = np.cumsum(np.linalg.norm(self._doubled_areas, axis=1))
        face = np.searchsorted(total, share * total[-1])
        a, b = np.modf(np.outer(np.arange(1, count + 1), _NEXT))[0].T
        a, b = np.where(a + b > 1, (1 - a, 1 - b), (a, b))
        A, B, C = (self._about[self.faces[face, k]] for k in range(3))
        return np.asarray(A + a[:, None] * (B - A) + b[:, None] * (C - A) + self.centre)

    @lazy
    def normals(self) -> Floats:
        """Unit normals of the triangles (F, 3), as they wind."""
        return unit(self._doubled_areas)

    @lazy
    def _doubled_areas(self) -> Floats:
        """Vectors (F, 3) along the normals, as long as twice the areas."""
        return _doubled_areas(self._about, self.faces)

    @lazy
    def _places(self) -> Rows:
        """For each vertex (V,) the row of its place: an STL writes each corner anew."""
        return np.unique(self.vertices, axis=0, return_inverse=True)[1].reshape(-1)

    @lazy
    def _orientation(self) -> float:
        """1 where the triangles wind counter-clockwise seen from outside, else -1: the sign of the volume."""
        return float(np.sign((self._about[self.faces[:, 0]] * self._doubled_areas).sum()) or 1.0)

    @lazy
    def _pseudonormals(self) -> tuple[Floats, Floats]:
        """Sums of the normals at the edge opposite to each corner (F, 3, 3), and, weighted by angle, at the corner."""
        corners = self._places[self.faces]
        name, row = np.unique(_edges(corners)[0], return_inverse=True)
        at_edge = _sums(row.reshape(-1), np.repeat(self.normals, 3, axis=0), len(name))[row.reshape(-1)]
        P = self.vertices[self.faces]
        ahead, back = unit(np.roll(P, -1, axis=1) - P), unit(np.roll(P, 1, axis=1) - P)
        angle = np.arccos(np.clip(np.einsum("fki,fki->fk", ahead, back), -1, 1))
        at_corner = _sums(corners.ravel(), (angle[..., None] * self.normals[:, None]).reshape(-1, 3), corners.max() + 1)
        return at_edge.reshape(-1, 3, 3), at_corner[corners]

    def _side(self, face: Rows, foot: Floats) -> Floats:
        """Vectors (L, 3) that point to the outer side at feet (L, 3) on triangles (L,), if these wind that way."""
        A, B, C = (self._about[self.faces[face, k]] for k in range(3))
        doubled = self._doubled_areas[face]
        opposite = np.stack([np.cross(C - B, foot - B), np.cross(A - C, foot - C), np.cross(B - A, foot - A)], axis=1)
        share = np.einsum("lki,li->lk", opposite, doubled) / np.einsum("li,li->l", doubled, doubled)[:, None]
        touches = share < _ON_EDGE  # the edges, named by the corner opposite, that the foot lies on
        at_edge, at_corner = self._pseudonormals
        side = self.normals[face]
        for k in range(3):
            on_edge = touches[:, k]
            side[on_edge] = at_edge[face[on_edge], k]
        for k in range(3):
            at = touches[:, (k + 1) % 3] & touches[:, (k + 2) % 3]
            side[at] = at_corner[face[at], k]
        return side


def _new_tree() -> Any:
    try:
        import igl
    except ImportError as error:
        raise missing_extra("mesh", "the distance field of a mesh") from error
    return igl.AABB()


def _edges(corners: Rows) -> tuple[Rows, Rows]:
    """For the edge opposite to each corner of triangles (F, 3), row by row (3 F,): its two ends in ascending order as
    one number, and 1 or -1 for the way in which it is passed."""
    start, end = corners[:, [1, 2, 0]].ravel(), corners[:, [2, 0, 1]].ravel()
    return np.minimum(start, end) * (int(corners.max()) + 1) + np.maximum(start, end), np.where(start < end, 1, -1)


def _open_edges(corners: Rows) -> int:
    """How many edges do not have one triangle on either side, passed once in each way."""
    name, way = _edges(corners)
    _, row, count = np.unique(name, return_inverse=True, return_counts=True)
    return int(((count != 2) | (np.bincount(row.reshape(-1), way) != 0)).sum())


def _sums(rows: Rows, vectors: Floats, count: int) -> Floats:
    """Sums (count, 3) of the vectors (n, 3) with the same row."""
    return np.stack([np.bincount(rows, part, count) for part in vectors.T], axis=1)


def _checked(vertices: ArrayLike, faces: ArrayLike) -> tuple[Floats, Rows]:
    """Vertices (V, 3) and faces (F, 3), copied; raises FieldError where they are none."""
    V, F = (as_array(array, f"{name} of a MeshField", "(n, 3)", FieldError) for name, array in
            (("vertices", vertices), ("faces", faces)))
    for name, array, kinds in (("vertices", V, "fiu"), ("faces", F, "iu")):
        wanted = "numbers" if kinds == "fiu" else "whole numbers"
        if array.dtype.kind not in kinds or array.ndim != 2 or array.shape[1] != 3:
            raise FieldError(
                f"{name} of a MeshField must be (n, 3) {wanted}, but have shape {array.shape} and dtype {array.dtype}"
            )
    if not len(V) or not len(F):
        raise FieldError(f"MeshField needs at least one triangle, but has {len(F)} faces on {len(V)} vertices")
    if F.min() < 0 or F.max() >= len(V):
        raise FieldError(f"faces of a MeshField must be rows of its {len(V)} vertices, but are {F.min()} to {F.max()}")
    bad = ~np.isfinite(V[F]).all(axis=(1, 2)) if V.dtype.kind == "f" else np.zeros(len(F), bool)
    if bad.any():
        raise FieldError(f"vertices of a MeshField must be finite, but {int(bad.sum())} faces have NaN or infinity")
    used = np.unique(F)
    return V[used].astype(float), np.searchsorted(used, F).astype(np.int64)


def _with_an_area(vertices: Floats, faces: Rows) -> Rows:
    """The faces that have one; raises FieldError where none has."""
    area = np.linalg.norm(_doubled_areas(vertices, faces), axis=1)
    kept = area > _FLAT * np.ptp(vertices, axis=0).max() ** 2
    if not kept.any():
        raise FieldError(f"MeshField needs triangles with an area, but none of its {len(faces)} has one")
    return np.asarray(faces[kept])


def _doubled_areas(vertices: Floats, faces: Rows) -> Floats:
    A, B, C = (vertices[faces[:, k]] for k in range(3))
    return np.cross(B - A, C - A)
