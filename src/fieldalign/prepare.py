"""The front door for a cloud: whatever it comes as, made ready for registration."""

from __future__ import annotations

import os
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from .clouds.checks import checked_points
from .clouds.cloud import PointCloud
from .errors import ArgumentError
from .fields import DistanceField, PointField
from .fields.protocol import Floats
from .flat import FlatCloud, is_flat, standing
from .prepared import PreparedCloud
from .threads import resolve_threads

CloudLike: TypeAlias = ArrayLike | PointCloud | DistanceField | str | os.PathLike[str] | PreparedCloud | FlatCloud


def prepare(
    cloud: CloudLike, *, threads: int | None = None, drop_nonfinite: bool = True
) -> PreparedCloud | FlatCloud:
    """A cloud made ready for registration; accepted wherever a cloud is, and worth it where one serves many times.

    cloud: points (N, 3), or (N, 2) in the plane, a PointCloud, a path, a DistanceField, or a prepared cloud, which is
        returned as it is. A file that holds triangles or a volume becomes that field, any other one its points.
    threads: None means all cores. drop_nonfinite: NaN rows are missing returns, dropped and counted; infinity raises.

    Raises ArgumentError for points of a wrong shape, with infinity, or fewer than 3 distinct ones, CloudFileError for a
    file that cannot be read, and FieldError for a field in which something is wrong.
    """
    return prepare_named(cloud, "cloud", threads, drop_nonfinite)


def are_flat(source: CloudLike, target: CloudLike) -> bool:
    """Whether both are clouds in the plane; raises ArgumentError where only one is."""
    flat = {"source": is_flat(source), "target": is_flat(target)}
    if flat["source"] != flat["target"]:
        name, other = sorted(flat, key=lambda cloud: not flat[cloud])
        raise ArgumentError(f"{name} must have shape (N, 3), as {other} is no cloud in the plane, but has shape (N, 2)")
    return flat["source"]


def prepare_pair(
    source: CloudLike, target: CloudLike, threads: int, drop_nonfinite: bool, scaled: bool = False
) -> tuple[PreparedCloud, PreparedCloud]:
    """Both clouds of a pair; those in the plane as walls. scaled: whether their units may differ."""
    one = prepare_named(source, "source", threads, drop_nonfinite)
    other = prepare_named(target, "target", threads, drop_nonfinite)
    if isinstance(one, PreparedCloud) and isinstance(other, PreparedCloud):
        return one, other
    assert isinstance(one, FlatCloud)
    assert isinstance(other, FlatCloud)
    return standing(one, other, scaled)


def prepare_named(
    cloud: CloudLike, name: str, threads: int | None, drop_nonfinite: bool
) -> PreparedCloud | FlatCloud:
    """prepare(), with the argument's own name in its errors."""
    if isinstance(cloud, PreparedCloud | FlatCloud):
        return cloud
    if isinstance(cloud, str | os.PathLike):
        from .fields.files import read_shape  # the libraries behind it load only where a file is read

        cloud = read_shape(cloud)
    if isinstance(cloud, DistanceField):
        return PreparedCloud(cloud, threads=threads)
    if is_flat(cloud):
        return FlatCloud(cloud, name, resolve_threads(threads), drop_nonfinite)
    points, eye = _parts_of(cloud)
    checked = checked_points(points, name, resolve_threads(threads), drop_nonfinite)
    return PreparedCloud(PointField(checked, threads=threads), checked.dropped, threads, eye)


def _parts_of(cloud: Any) -> tuple[Any, Floats | None]:
    """The points, and the place (3,) of the sensor where the cloud knows it."""
    if not isinstance(cloud, PointCloud):
        return cloud, None
    return cloud.points, None if cloud.viewpoint is None else np.ascontiguousarray(cloud.viewpoint[:3, 3])
