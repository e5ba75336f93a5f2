"""A point cloud: points, and whatever its file or sensor said about each of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import as_array, as_numbers
from ..errors import ArgumentError
from ..motions import as_similar, size_of

Array = NDArray[Any]


@dataclass(frozen=True, eq=False)
class PointCloud:
    """Points (N, 3) with optional per-point data; immutable, and nothing is changed or dropped on the way in.

    points: (N, 3), any unit of length; float32 stays float32, every other number type becomes float64. Rows with NaN
        are missing returns: they are kept here and left out by registration.
    normals: (N, 3), unit length, sign free.
    times: (N,), seconds.
    intensity: (N,).
    colors: (N, 3) or (N, 4), uint8.
    attributes: further values by name, each of length N.
    viewpoint: (4, 4), the sensor's pose in the cloud's frame (its last column is the sensor's position).

    Raises ArgumentError where a shape or a length does not fit.
    """

    points: Array
    normals: Array | None = None
    times: Array | None = None
    intensity: Array | None = None
    colors: Array | None = None
    attributes: Mapping[str, Array] = field(default_factory=dict)
    viewpoint: Array | None = None

    def __post_init__(self) -> None:
        points = as_points(self.points, "points")
        n = len(points)
        checked: dict[str, Any] = {"points": points}
        for name, widths in (("normals", (3,)), ("times", ()), ("intensity", ()), ("colors", (3, 4))):
            if getattr(self, name) is not None:
                checked[name] = _per_point(getattr(self, name), name, n, widths)
        checked["attributes"] = {
            str(key): _per_point(value, f"attributes[{key!r}]", n, None)
            for key, value in (self.attributes or {}).items()
        }
        if self.viewpoint is not None:
            checked["viewpoint"] = as_numbers(self.viewpoint, "viewpoint", "a (4, 4) pose")
            if checked["viewpoint"].shape != (4, 4):
                raise ArgumentError(f"viewpoint must be a (4, 4) pose, but has shape {checked['viewpoint'].shape}")
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        return len(self.points)

    def __getitem__(self, rows: Any) -> PointCloud:
        """The points of an index array, slice or mask, with all that belongs to them."""
        taken: dict[str, Any] = {}
        for f in fields(self):
            value = getattr(self, f.name)
            if f.name == "attributes":
                taken[f.name] = {key: array[rows] for key, array in value.items()}
            else:
                taken[f.name] = value if value is None or f.name == "viewpoint" else value[rows]
        return PointCloud(**taken)

    def transformed(self, T: ArrayLike) -> PointCloud:
        """The cloud moved by T (4, 4), a rigid motion or a similarity: points, normals and viewpoint; points become
        float64. Raises ArgumentError where T is neither."""
        as_similar(T, "T")
        T = as_numbers(T, "T")
        with np.errstate(over="ignore", invalid="ignore"):  # rows that are not finite are missing returns
            moved = np.asarray(self.points, float) @ T[:3, :3].T + T[:3, 3]
        turn = np.eye(4)
        turn[:3, :3] = T[:3, :3] / size_of(T)
        normals = None if self.normals is None else self.normals @ turn[:3, :3].T
        viewpoint = None
        if self.viewpoint is not None:
            viewpoint = turn @ self.viewpoint
            viewpoint[:3, 3] = T[:3, :3] @ self.viewpoint[:3, 3] + T[:3, 3]
        return replace(self, points=moved, normals=normals, viewpoint=viewpoint)


def as_points(values: ArrayLike, name: str) -> Array:
    """An (N, 3) C-contiguous float32 or float64 array of `values`; raises ArgumentError that names the argument."""
    array = as_array(values, name, "an (N, 3) array of numbers")
    if array.dtype.kind not in "fiu":
        raise ArgumentError(f"{name} must be an (N, 3) array of real numbers, but has dtype {array.dtype}")
    if array.ndim != 2 or array.shape[1] != 3:
        raise ArgumentError(f"{name} must have shape (N, 3), but has shape {array.shape}")
    with np.errstate(over="ignore"):  # of extended precision: it becomes infinite
        return np.ascontiguousarray(array, np.float32 if array.dtype.newbyteorder("=") == np.float32 else np.float64)


def _per_point(values: ArrayLike, name: str, n: int, widths: tuple[int, ...] | None) -> Array:
    """An array of n rows; `widths` are the allowed second dimensions, () means one value per point, None anything."""
    array = as_array(values, name, f"an array of {n} rows")
    allowed = {(n, w) for w in widths} if widths else {(n,)}
    fits = array.shape in allowed if widths is not None else array.shape[:1] == (n,)
    if not fits:
        expected = f"({n}, ...)" if widths is None else " or ".join(map(str, sorted(allowed)))
        raise ArgumentError(f"{name} must have shape {expected} to go with {n} points, but has shape {array.shape}")
    return array
