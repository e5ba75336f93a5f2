"""The distance field of a point cloud (paper Sec. IV-A): the distance to its nearest point, exactly."""

from __future__ import annotations

import copy

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from ..arguments import MAX_NEIGHBOURS, as_count
from ..clouds.checks import Checked, checked_points
from ..lazy import lazy
from ..threads import resolve_threads
from .protocol import FieldSample, Floats, Planes, as_places


class PointField:
    """The unsigned distance field of points (N, 3); immutable.

    points: (N, 3), any unit, finite, at least 3 of them distinct. float64 coordinates lose nothing, at UTM size either.
    neighbours: k; the field's value is the root of the mean squared distance to the k nearest points. 1 is the distance
        field itself (paper Sec. IV-A), 5 the paper's feature against noise (Sec. V-G.2); at most 64.
    normal_neighbours: how many points a normal's plane is laid through; 3 to 64.
    bounds, centre: the corners (2, 3) of the points' bounding box, and their mean (3,).
    threads: for building and sampling; None means all cores. No result depends on it.

    Raises ArgumentError for points of another shape, NaN or infinity, or fewer than 3 distinct points.
    """

    signed = False

    def __init__(
        self, points: ArrayLike | Checked, neighbours: int = 1, normal_neighbours: int = 10, threads: int | None = None
    ) -> None:
        self._choose(neighbours, normal_neighbours, threads)
        checked = points if isinstance(points, Checked) else checked_points(points, "points", self.threads)
        self.points, self.bounds, self.centre = checked.points, checked.bounds, checked.mean

    @lazy
    def tree(self) -> _core.PointTree:
        """The search tree, built when first asked for: who only thins the points needs none."""
        return _core.PointTree(self.points, self.threads)

    def __len__(self) -> int:
        return len(self.points)

    def using(self, neighbours: int, normal_neighbours: int, threads: int | None) -> PointField:
        """The same points under other settings; the tree is shared."""
        _ = self.tree  # built before it is copied, so that both share it
        other = copy.copy(self)
        other._choose(neighbours, normal_neighbours, threads)
        return other

    def _choose(self, neighbours: int, normal_neighbours: int, threads: int | None) -> None:
        self.neighbours = as_count(neighbours, "neighbours", 1, MAX_NEIGHBOURS)
        self.normal_neighbours = as_count(normal_neighbours, "normal_neighbours", 3, MAX_NEIGHBOURS)
        self.threads = resolve_threads(threads)

    def sample(self, x: ArrayLike, guess: NDArray[np.uint32] | None = None) -> FieldSample:
        """The field at the places x (L, 3): value, gradient, foot and normal.

        guess: (L,), `place` of an earlier sample of points nearby; it halves the time and changes nothing else.
        """
        value, gradient, foot, place = self.tree.sample(
            as_places(x), self.neighbours, guess, self.threads
        )
        return FieldSample(value, gradient, foot, lambda: self.normals(foot), place)

    def nearest(self, x: ArrayLike, neighbours: int = 1) -> tuple[Floats, NDArray[np.int64]]:
        """Distances (L, k) and rows (L, k) of the k nearest points to the places x (L, 3), nearest first."""
        return self.tree.nearest(as_places(x), as_count(neighbours, "neighbours", 1, MAX_NEIGHBOURS), self.threads)

    def normals(self, x: ArrayLike) -> Floats:
        """Unit normals (L, 3) of the planes through the nearest points to the places x (L, 3); sign free."""
        return self.surfels(x, self.normal_neighbours)[1]

    def surfels(self, x: ArrayLike, neighbours: int) -> tuple[Floats, Floats, Floats]:
        """The planes through the nearest points to the places x (L, 3): means and unit normals (L, 3), sign free, and
        standard deviations (L, 2) across the plane and along its shorter axis."""
        return self.tree.surfels(np.ascontiguousarray(x, float), neighbours, self.threads)

    def planes(self, x: Floats, neighbours: int, last: Planes | None = None) -> Planes:
        """The planes through the points next to the feet of the places x (L, 3)."""
        *_, foot, place = self.tree.sample(x, 1, None if last is None else last.place, self.threads)
        if last is None or last.place is None:
            return Planes(*self._planes_through(foot, neighbours), place)
        changed = place != last.place
        parts = last.mean.copy(), last.normal.copy(), last.thickness.copy(), last.width.copy()
        for part, new in zip(parts, self._planes_through(foot[changed], neighbours), strict=True):
            part[changed] = new
        return Planes(*parts, place)

    def _planes_through(self, foot: Floats, neighbours: int) -> tuple[Floats, Floats, Floats, Floats]:
        """Mean, normal, thickness and width of the planes at places on the surface."""
        mean, normal, spread = self.surfels(foot, neighbours)
        thickness, width = np.ascontiguousarray(spread.T)
        return mean, normal, thickness, width

    def spread(self, count: int) -> Floats:
        """Some `count` points of the cloud (m, 3), evenly along the tree's curve, and so over the surface."""
        stride = max(1, len(self) // count)
        rows = self.tree.rows(np.arange(stride // 2, len(self), stride, dtype=np.uint32))
        return np.ascontiguousarray(self.points[rows], float)

    def drawn(self, count: int, rng: np.random.Generator) -> Floats:
        """Points (count, 3) drawn with replacement, in the order of the tree's curve: neighbours follow each other, and
        each finds the tree's nodes still in the cache."""
        places = np.sort(rng.integers(0, len(self), count, dtype=np.uint32))
        return np.asarray(self.points[self.tree.rows(places)], float)

    def spacing(self, x: ArrayLike) -> Floats:
        """For points x (L, 3) of the cloud, the distance (L,) to the next point that is not the same place."""
        apart = self.nearest(x, 2)[0][:, -1]
        same = np.flatnonzero(apart == 0)
        if len(same):  # duplicated points: look further
            further = self.nearest(np.asarray(x)[same], 16)[0]
            apart[same] = np.where(further > 0, further, np.inf).min(axis=1)
        return np.where(np.isfinite(apart), apart, 0.0)

    def keypoints(self, gamma: float = 0.5, min_neighbours: int = 10) -> NDArray[np.uint32]:
        """Rows of the ISS keypoints, ascending.

        Intrinsic shape signatures (Zhong, ICCV Workshops 2009): salient within 6, largest within 4 times the mean
        distance between neighbouring points; eigenvalue ratios below `gamma`; at least `min_neighbours` in both.
        """
        stride = max(1, len(self) // 4096)
        resolution = float(self.spacing(self.points[::stride]).mean())
        return self.tree.keypoints(6 * resolution, 4 * resolution, gamma, gamma, min_neighbours, self.threads)
