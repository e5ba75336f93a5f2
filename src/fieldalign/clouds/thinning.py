"""Thinning: one point for each occupied voxel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from ..arguments import check_positive
from ..errors import ArgumentError
from ..threads import resolve_threads
from .checks import warn_of_lost_precision, without_missing
from .cloud import PointCloud, as_points


def thin(cloud: PointCloud | ArrayLike, voxel: float, *, threads: int | None = None) -> PointCloud:
    """A cloud with one point for each occupied voxel: the mean of the voxel's points, float64.

    cloud: a PointCloud or points (N, 3); NaN rows are left out. voxel: edge length, in the cloud's unit. The lattice
    begins at the cloud's own lower corner, so a shifted cloud is thinned alike. Normals, times, intensity, colors and
    attributes are those of each voxel's first point.

    Raises ArgumentError for a voxel that is not positive or below 1 / 2097152 of the extent, and for infinite points.
    """
    check_positive("voxel", voxel)
    given = cloud if isinstance(cloud, PointCloud) else PointCloud(as_points(cloud, "cloud"))
    cores = resolve_threads(threads)
    points = without_missing(given.points, "cloud", cores)
    if not len(points):
        return given[:0]
    if len(points) < len(given):
        given = given[~np.isnan(given.points).any(axis=1)]
    bounds, _ = _core.survey(points, cores)
    warn_of_lost_precision(points, bounds, "cloud")
    try:
        means, first, _ = _core.thin(points, bounds, float(voxel), cores)
    except ValueError as error:
        raise ArgumentError(f"voxel is too small: {error}") from error
    return replace(given[first], points=means)
