"""A cloud at one scale: its surfels, and what the search and the coarse alignment look up."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _core
from .fields.protocol import Floats
from .lazy import lazy

_NEIGHBOURS = 10       # thinned points in a surfel's plane
_FLAT, _CLUTTER = 0.5, 0.45  # thickness over width; share of such surfels that furnished rooms, woods and streets have
_SIEVINGS = 3          # at most
_CROWD = 4.0           # points in a point's voxel, on average, from which on single ones are taken for outliers
_FAR = 500.0           # voxels from the middle: what lies further is left out, so that no outlier makes a grid huge
_PLANAR = 0.05, 3.0    # voxels, along a surfel's shorter axis: neither a line nor scattered points
_SPARSE = 3.0          # voxels between the surfels that pairs are made of
_MEMBERS = 1000        # of them at most
_WITNESSES = 256       # surfels that stand for all where planes are counted
_COPLANAR = 2.0, 0.9   # voxels from a plane, cosine between normals, of surfels that lie in it
_LEAST_FLAT = 0.02     # of a surfel as thick as it is wide
_PAIR_BAND = 6.0, 45.0  # voxels between the two surfels of a pair


class Surface:
    """Surfels, about one for each occupied voxel.

    places, normals: (n, 3), about `origin`; a normal's sign means nothing, unless the eye (3,), where the sensor stood,
    is known: then normals point towards it. flatness: (n,), 0 to 1.
    voxel: the edge, in the cloud's unit. origin: (3,), a place in the cloud's frame.
    """

    def __init__(self, points: NDArray[Any], voxel: float, threads: int, eye: Floats | None = None) -> None:
        self.voxel, self.faces_sensor = voxel, eye is not None
        self._threads = threads
        bounds, _ = _core.survey(points, threads)
        self.origin = bounds.mean(axis=0)
        means, _, counts = _core.thin(points, bounds, voxel, threads)
        thinned = means - self.origin
        near = np.abs(thinned - np.median(thinned, axis=0)).max(axis=1) < _FAR * voxel
        thinned = _where(near & (counts >= _least_count(counts)), thinned)
        for _ in range(_SIEVINGS):
            places, normals, spread = _core.PointTree(thinned, threads).surfels(thinned, _NEIGHBOURS, threads)
            thickness, width = spread.T
            is_flat = thickness < _FLAT * width
            if is_flat.mean() > _CLUTTER:
                break
            thinned = _where(is_flat, thinned)  # mostly outliers: what is flat among them shows the surface
        thinnest, widest = _PLANAR
        planar = (width > thinnest * voxel) & (width < widest * voxel)
        self.places, self.normals = _where(planar, places), _where(planar, normals)
        if eye is not None:
            away = np.einsum("ni,ni->n", self.normals, self.places + self.origin - eye) > 0
            self.normals = np.where(away[:, None], -self.normals, self.normals)
        self.flatness = np.clip(1 - _where(planar, thickness / np.maximum(width, 1e-300)) ** 2, _LEAST_FLAT, 1)

    def scaled(self, factor: float) -> Surface:
        """The same surfels with all lengths times `factor`."""
        other = copy.copy(self)
        for name in ("extent", "coarse_grid", "fine_grid", "pairs", "middle"):  # lazy ones that have a length
            other.__dict__.pop(name, None)
        other.voxel, other.origin, other.places = factor * self.voxel, factor * self.origin, factor * self.places
        return other

    def __len__(self) -> int:
        return len(self.places)

    def faces(self, other: Surface) -> bool:
        """Whether normals of both point towards their sensors, so that the two sides of a wall are told apart."""
        return self.faces_sensor and other.faces_sensor

    @lazy
    def extent(self) -> float:
        """The diagonal of the surfels' bounds."""
        return float(np.linalg.norm(np.ptp(self.places, axis=0)))

    @property
    def size(self) -> float:
        """How far the surfels lie from their middle, as a root mean square."""
        away = self.places - np.median(self.places, axis=0)
        return float(np.sqrt(np.einsum("ni,ni->", away, away) / len(self)))

    @lazy
    def middle(self) -> Floats:
        """The surfels' mean (3,)."""
        return np.asarray(self.places.mean(axis=0))

    @lazy
    def sparse(self) -> NDArray[np.uint32]:
        """Rows of some surfels, spread evenly, at most a thousand."""
        bounds = np.stack([self.places.min(axis=0), self.places.max(axis=0)])
        edge = _SPARSE * self.voxel
        while True:
            rows = _core.thin(self.places, bounds, edge, self._threads)[1]
            if len(rows) <= _MEMBERS:
                return rows
            edge *= 1.05 * float(np.sqrt(len(rows) / _MEMBERS))

    @lazy
    def weights(self) -> Floats:
        """What each surfel counts for (n,), 1 in all: less where more of the surface lies in its plane, since a wall
        agrees with any other wall, and less where it is no plane but a clump of scattered points."""
        rows = np.random.default_rng(0).integers(0, len(self), _WITNESSES)
        near, cosine = _COPLANAR
        company = _core.coplanar(
            self.places, self.normals, self.places[rows], self.normals[rows], near * self.voxel, cosine, self._threads
        )
        weights = self.flatness / (1.0 + company)
        return np.asarray(weights / weights.sum())

    @lazy
    def coarse_grid(self) -> _core.ClosestGrid:
        """The nearest surfel up to six voxels off, in cells of two voxels."""
        return _core.ClosestGrid(self.places, self.normals, 2 * self.voxel, 6 * self.voxel)

    @lazy
    def fine_grid(self) -> _core.ClosestGrid:
        """The nearest surfel up to three voxels off, in cells of a voxel."""
        return _core.ClosestGrid(self.places, self.normals, self.voxel, 3 * self.voxel)

    @lazy
    def pairs(self) -> _core.PairTable:
        """Pairs of the sparse surfels, to be looked up by what no motion changes."""
        shortest, longest = (self.voxel * length for length in _PAIR_BAND)
        rows = self.sparse
        return _core.PairTable(self.places[rows], self.normals[rows], shortest, longest, self._threads)


def main_axes(held: Surface, moving: Surface) -> list[Floats]:
    """The four motions (4, 4) that lay the main axes of one surface on those of the other, middle on middle."""
    (middle, axes), (onto_middle, onto_axes) = (_axes(surface) for surface in (moving, held))
    motions = []
    for signs in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)):
        T = np.eye(4)
        T[:3, :3] = (onto_axes * signs) @ axes.T
        T[:3, 3] = onto_middle - T[:3, :3] @ middle
        motions.append(T)
    return motions


def _axes(surface: Surface) -> tuple[Floats, Floats]:
    """Middle (3,) and main axes (3, 3), right-handed, in columns."""
    away = surface.places - surface.middle
    axes = np.linalg.eigh(np.einsum("ni,nj->ij", away, away))[1]  # no BLAS, whose sums may change with its threads
    axes[:, 0] *= np.linalg.det(axes)
    return surface.middle, axes


def _least_count(counts: NDArray[np.uint32]) -> int:
    """How many points a voxel of the surface holds at least: where most points have many neighbours, one that has none
    is an outlier; else it may be a surface far away."""
    crowd = float((counts.astype(float) ** 2).sum() / counts.sum())  # in the voxel of a point, on average
    return 2 if crowd > _CROWD else 1


def _where(chosen: NDArray[np.bool_], rows: Floats) -> Floats:
    """The chosen rows; all of them where hardly any is: a cloud without a surface is judged later, not here."""
    return rows if chosen.all() or chosen.sum() < 10 else np.ascontiguousarray(rows[chosen])
