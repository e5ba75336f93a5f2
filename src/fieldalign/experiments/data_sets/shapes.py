"""A shape of ModelNet40 or ShapeNet: its stored points, or points drawn from its surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...arguments import as_count
from ...clouds.files import check_existing, errors_naming
from ...clouds.formats.triangles import Triangles
from ...errors import DataSetError
from ...fields.files import MESHES
from ...motions import Matrix


class Stored(NamedTuple):
    """Points (n, 3) as a file has them, and the triangles (F, 3) between them; of a cloud, None."""

    points: Matrix
    triangles: Triangles | None = None


@dataclass(frozen=True)
class Shape:
    """One shape of a data set, read anew when its points are asked for.

    category: as the data set calls it. name: unlike any other's in its set. read: gives what is stored.

    Points come on the unit cube, as PointNetLK has them: divided by the longest edge of the bounding box of what is
    stored, then shifted so that the mean of what is stored lies at 0.
    """

    category: str
    name: str
    read: Callable[[], Stored]

    def vertices(self) -> Matrix:
        """All stored points (n, 3): the mesh's vertices, or the cloud. Raises DataSetError where they make no shape."""
        return self._on_unit_cube().points

    def sample(self, count: int, seed: int) -> Matrix:
        """Points (count, 3), the same for a seed: drawn uniformly by area from a mesh; of a cloud, a random part.

        Raises ArgumentError for a count below 1, DataSetError where a cloud has fewer points, or a mesh no area.
        """
        points, triangles = self._on_unit_cube()
        as_count(count, "count", 1)
        rng = np.random.default_rng(seed)
        if triangles is not None and len(triangles):
            return self._on_surface(points[triangles], count, rng)
        if count > len(points):
            raise DataSetError(f"{self.name} has {len(points)} points, from which {count} cannot be drawn")
        return points[rng.choice(len(points), count, replace=False)]

    def _on_unit_cube(self) -> Stored:
        """PointNetLK's OnUnitCube (github.com/hmgoforth/PointNetLK, ptlk/data/transforms.py), PointNetLK-Revisited's
        too, and that of the clouds on which the paper's program was run."""
        points, triangles = self.read()
        extent = float(np.ptp(points, axis=0).max(initial=0)) if len(points) else 0.0
        if not (np.isfinite(points).all() and 0 < extent < np.inf):
            raise DataSetError(f"{self.name} must have points that are finite and differ, but has none, or NaN")
        if triangles is not None and len(triangles) and not (0 <= triangles.min() <= triangles.max() < len(points)):
            raise DataSetError(f"{self.name} has {len(points)} vertices, but faces of others")
        scaled = points / extent
        return Stored(scaled - scaled.mean(axis=0), triangles)

    def _on_surface(self, corners: Matrix, count: int, rng: np.random.Generator) -> Matrix:
        A, B, C = np.moveaxis(corners, 1, 0)
        areas = np.cumsum(np.linalg.norm(np.cross(B - A, C - A), axis=1))
        if not areas[-1] > 0:
            raise DataSetError(f"{self.name} has no triangle with an area, so nothing can be drawn from its surface")
        face = np.searchsorted(areas, rng.uniform(0, areas[-1], count), side="right")
        a, b = rng.uniform(size=(2, count, 1))
        a, b = np.where(a + b > 1, (1 - a, 1 - b), (a, b))  # of the parallelogram, the half that is the triangle
        return np.asarray(A[face] + a * (B - A)[face] + b * (C - A)[face])


def mesh_in(file: Path) -> Stored:
    """The vertices and triangles of a mesh file; raises CloudFileError where it is none."""
    with errors_naming(file, "read"):
        check_existing(file, MESHES)
        cloud, triangles = MESHES[file.suffix.lower()](file)
    return Stored(np.asarray(cloud.points, float), triangles)
