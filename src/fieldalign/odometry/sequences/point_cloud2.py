"""ROS's sensor_msgs/PointCloud2, of either version: bytes whose layout the message itself describes."""

from __future__ import annotations

from collections.abc import Sequence as Rows
from typing import Protocol

import numpy as np

from ...clouds.cloud import Array, PointCloud
from ...clouds.formats import require_bytes
from ...clouds.formats.columns import TIMES, cloud_from_columns
from ...errors import CloudFileError
from .point_times import seconds_of

_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}  # PointField's numbers


class Field(Protocol):
    """sensor_msgs/PointField."""

    name: str
    offset: int
    datatype: int
    count: int


class Message(Protocol):
    """sensor_msgs/PointCloud2, without its header."""

    height: int
    width: int
    fields: Rows[Field]
    is_bigendian: bool
    point_step: int
    row_step: int
    data: Array


def cloud_of(message: Message, stamp: float | None) -> PointCloud:
    """All points and fields, the times on the stamp's clock. Points at exactly 0, 0, 0, as Ouster writes its missing
    returns, become NaN.

    Raises CloudFileError with a predicate where the message is not what it says it is.
    """
    with np.errstate(all="ignore"):  # whatever the bytes are as numbers
        return _cloud(message, stamp)


def _cloud(message: Message, stamp: float | None) -> PointCloud:
    rows = _rows(message)
    columns = {name: rows[name].astype(rows[name].dtype.newbyteorder("=")) for name in rows.dtype.names or ()}
    timed = [name for name in columns if name.lower() in TIMES and columns[name].ndim == 1]
    times = next((found for name in timed if (found := seconds_of(columns[name], stamp)) is not None), None)
    cloud = cloud_from_columns({name: values for name, values in columns.items() if name not in timed})
    points = cloud.points
    missing = ~points.any(axis=1)
    if missing.any():
        points = points.copy()
        points[missing] = np.nan
    return PointCloud(points, normals=cloud.normals, times=times, intensity=cloud.intensity, colors=cloud.colors,
                      attributes=cloud.attributes)


def _rows(message: Message) -> Array:
    """The points as a structured array (N,), a view of the message's bytes."""
    dtype = _dtype(message)
    height, width = message.height, message.width
    row_step = message.row_step if height > 1 else message.point_step * width
    if row_step < message.point_step * width:
        raise CloudFileError(f"has rows of {row_step} bytes, but {width} points of {message.point_step} bytes in each")
    data = np.ascontiguousarray(message.data).view(np.uint8)
    needed = row_step * (height - 1) + message.point_step * width if height * width else 0
    require_bytes(max(needed, height * width), len(data), f"{height * width} points")  # of a byte at least
    return np.ndarray((height, width), dtype, data, 0, (row_step, message.point_step)).ravel()


def _dtype(message: Message) -> np.dtype[np.void]:
    order = ">" if message.is_bigendian else "<"
    layout: dict[str, tuple[str, int]] = {}
    for field in message.fields:
        if field.datatype not in _TYPES:
            raise CloudFileError(f"has a field {field.name!r} of type {field.datatype}, which is none of 1 to 8")
        shape = f"({field.count},)" if field.count > 1 else ""
        if field.name:
            layout.setdefault(field.name, (shape + order + _TYPES[field.datatype], field.offset))
    formats, offsets = zip(*layout.values(), strict=True) if layout else ((), ())
    try:
        return np.dtype({"names": list(layout), "formats": list(formats), "offsets": list(offsets),
                         "itemsize": message.point_step})
    except (ValueError, TypeError) as error:
        raise CloudFileError(f"has fields that do not fit into its {message.point_step} bytes a point") from error
