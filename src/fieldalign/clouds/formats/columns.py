"""What columns are called in files, and which part of a cloud each of them is: one table for all formats."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

import numpy as np

from ...errors import CloudFileError
from ..cloud import Array, PointCloud

# In lower case and without the prefix "scalar_" of CloudCompare. The first spelling of each that is there
# whole is taken; every other column becomes an attribute. A single name is a column of all components.
POINTS = (("x", "y", "z"), ("points",), ("xyz",))
NORMALS = (
    ("nx", "ny", "nz"),
    ("normal_x", "normal_y", "normal_z"),
    ("normalx", "normaly", "normalz"),
    ("normals",),
)
COLORS = (
    ("red", "green", "blue", "alpha"),
    ("red", "green", "blue"),
    ("r", "g", "b", "a"),
    ("r", "g", "b"),
    ("diffuse_red", "diffuse_green", "diffuse_blue"),
    ("colors",),
)
INTENSITY = (("intensity",), ("reflectance",), ("reflectivity",), ("remission",), ("i",))
TIMES = ("time", "times", "timestamp", "time_stamp", "stamp", "gps_time", "gpstime", "t", "offset_time")
MOST_COLUMNS = 10_000
SECONDS = ("time", "times")  # what fieldalign itself writes
NANOSECONDS = ("t", "offset_time")  # where uint32: Ouster's and Livox's drivers

Columns = Mapping[str, Array]


def cloud_from_columns(columns: Columns, viewpoint: Array | None = None) -> PointCloud:
    """The cloud whose parts stand in named columns of N values, or (N, k) values, each."""
    left = dict(columns)
    points = _take(left, POINTS)
    if points is None:
        raise CloudFileError(f"has no columns x, y, z; its columns are: {', '.join(columns)[:200] or 'none'}")
    colors = _take(left, COLORS)
    return PointCloud(
        points,
        normals=_take(left, NORMALS),
        times=_take_times(left),
        intensity=_take(left, INTENSITY),
        colors=None if colors is None else colors_as_bytes(colors),
        attributes={name: np.ascontiguousarray(values) for name, values in left.items()},
        viewpoint=viewpoint,
    )


def cloud_from_table(table: Array) -> PointCloud:
    """The cloud of a nameless (N, k) table, k >= 3, by the customs of text files.

    x y z; then intensity, unless k is 6; then, if k is 6 or 7, three columns that are colors where all are
    whole numbers in 0..255, and normals else. Any other column is an attribute, named as in "column_5".
    """
    width = table.shape[1] if table.ndim == 2 else 0
    if not 3 <= width <= MOST_COLUMNS:
        raise CloudFileError(
            f"must hold rows of at least three numbers (and at most {MOST_COLUMNS}), but has shape {table.shape}"
        )
    columns = dict(zip("xyz", table[:, :3].T, strict=True))
    if width != 3 and width != 6:
        columns["intensity"] = table[:, 3]
    if width in (6, 7):
        names = COLORS[1] if _are_bytes(table[:, -3:]) else NORMALS[0]
        columns |= dict(zip(names, table[:, -3:].T, strict=True))
    else:
        columns |= {f"column_{i + 1}": table[:, i] for i in range(4, width)}
    return cloud_from_columns(columns)


def columns_of(cloud: PointCloud) -> tuple[dict[str, Array], list[str]]:
    """The cloud's per-point data as named columns of N numbers each, and what cannot be such a column.

    An attribute of shape (N, k) becomes the columns NAME_0, NAME_1, ...; signs other than letters, digits
    and _ in a name become _.
    """
    columns = dict(zip("xyz", cloud.points.T, strict=True))
    if cloud.normals is not None:
        columns |= dict(zip(NORMALS[0], cloud.normals.T, strict=True))
    if cloud.times is not None:
        columns[SECONDS[0]] = cloud.times.astype(np.result_type(cloud.times, np.float32), copy=False)
    if cloud.intensity is not None:
        columns["intensity"] = cloud.intensity
    if cloud.colors is not None:
        columns |= dict(zip(COLORS[0], colors_as_bytes(cloud.colors).T, strict=False))
    left_out = []
    for name, values in _scalar_attributes(cloud):
        if values.ndim == 1 and values.dtype.kind in "biuf" and name not in columns:
            columns[name] = values
        else:
            left_out.append(f"the attribute {name!r}")
    return {name: _plain_numbers(values) for name, values in columns.items()}, left_out


def parts_beyond(cloud: PointCloud, *held: str) -> list[str]:
    """The parts that the cloud has, but for which a format of points and `held` has no place."""
    parts = ("normals", "times", "intensity", "colors", "attributes", "viewpoint")
    values = {part: getattr(cloud, part) for part in parts if part not in held}
    return [part for part, value in values.items() if value is not None and len(value)]


def colors_as_bytes(colors: Array) -> Array:
    """Colors as uint8: fractions (all <= 1) are of 255, values above 255 are of 65535."""
    if colors.dtype == np.uint8:
        return colors
    colors = np.nan_to_num(colors)
    top = colors.max(initial=0)
    scale = 255 if colors.dtype.kind == "f" and top <= 1 else 1 / 257 if top > 255 else 1
    return np.rint(colors * scale).clip(0, 255).astype(np.uint8)


def _take(left: dict[str, Array], spellings: tuple[tuple[str, ...], ...]) -> Array | None:
    """Moves the first spelling that `left` holds whole out of it; one array, a row per point."""
    originals = {_plain(name): name for name in reversed(left)}
    for names in spellings:
        if all(name in originals for name in names):
            taken = [left.pop(originals[name]) for name in names]
            return np.column_stack(taken) if len(taken) > 1 else np.ascontiguousarray(taken[0])
    return None


def _take_times(left: dict[str, Array]) -> Array | None:
    for name in list(left):
        if _plain(name) in TIMES and (times := _seconds(_plain(name), left[name])) is not None:
            del left[name]
            return times
    return None


def _seconds(name: str, values: Array) -> Array | None:
    """Times in seconds, or None: whole numbers leave the unit open and are not guessed at."""
    if name in NANOSECONDS and values.dtype == np.uint32:
        return values * 1e-9
    if name in SECONDS or (values.dtype.kind == "f" and not _are_whole(values)):
        return np.ascontiguousarray(values)
    return None


def _plain(name: str) -> str:
    return name.lower().removeprefix("scalar_")


def _are_whole(values: Array) -> bool:
    return bool((values == np.rint(values)).all())


def _are_bytes(values: Array) -> bool:
    return _are_whole(values) and bool(((values >= 0) & (values <= 255)).all())


def _scalar_attributes(cloud: PointCloud) -> Iterator[tuple[str, Array]]:
    for name, values in cloud.attributes.items():
        name = re.sub(r"\W+", "_", name)
        if values.ndim == 2:
            yield from ((f"{name}_{i}", column) for i, column in enumerate(values.T))
        else:
            yield name, values


def _plain_numbers(values: Array) -> Array:
    """In a number type that files know: no bool, half or extended precision, in the machine's byte order."""
    kinds = {"?": np.uint8, "e": np.float32, "g": np.float64}
    return values.astype(kinds.get(values.dtype.char, values.dtype.newbyteorder("=")), copy=False)
