"""A static picture of one registration: both clouds before and after it, from above and at an angle."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..clouds.cloud import PointCloud, as_points
from ..errors import ArgumentError
from ..motions import angles_between
from ..whole_file import write_figure
from . import views
from .figure_file import checked_path, new_figure
from .painting import SOURCE_COLOR, TARGET_COLOR, Clouds, Window, paint, window_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
Cloud = PointCloud | ArrayLike

_MOST_POINTS = 60_000  # of each cloud: more would hide one behind the other
_DPI = 160
_FINER = 2  # pixels painted for each one shown: their mean is smooth
# Inches: the width of a panel, the space between two, and the margins for row names, headings and legend.
_PANEL, _GAP, _LEFT, _TOP, _BOTTOM = 5.2, 0.12, 0.5, 0.85, 0.6


def before_and_after(
    source: Cloud,
    target: Cloud,
    T_target_source: ArrayLike,
    path: str | os.PathLike[str],
    title: str | None = None,
    up: ArrayLike | None = None,
) -> Path:
    """Draw both clouds as they came, and again with the source moved by T_target_source; returns the path.

    source, target: (N, 3) arrays or PointClouds in one unit; rows with NaN are left out.
    T_target_source: (4, 4), maps source points into the target frame.
    path: its suffix picks PNG, SVG or PDF (with the points as images); it is replaced whole or not at all.
    title: one line; without it, how far the source was turned and moved.
    up: (3,), roughly upward in the target frame; the views are levelled on a floor, street or ceiling. None: z, or what
        the target tells where a camera has seen it (y down, z ahead).

    A ceiling is left out, so that one looks into the room. Raises MissingExtraError without matplotlib, and
    ArgumentError for a path, cloud, pose or direction that cannot be.
    """
    path = checked_path(path)
    T = _checked(T_target_source, (4, 4), "T_target_source")
    upward = None if up is None else _checked(up, (3,), "up")
    if upward is not None and not upward.any():
        raise ArgumentError("up must be a direction, but is the zero vector")
    before, fixed = thinned(source, "source"), thinned(target, "target")
    after = before @ T[:3, :3].T + T[:3, 3]

    vertical = views.upright(fixed) if upward is None else views.level(fixed, upward)
    ahead = views.ahead(viewpoint(target), fixed, vertical)
    rows = {
        "from above": views.from_above(vertical, ahead),
        "at an angle": views.obliquely(vertical, ahead),
    }
    below, fixed_below = below_ceiling(after @ vertical, fixed @ vertical)
    columns = {
        "before": (before[below], fixed[fixed_below]),
        "after": (after[below], fixed[fixed_below]),
    }
    return write_figure(_figure(columns, rows, title or _motion(T, before, after)), path)


def _checked(values: ArrayLike, shape: tuple[int, ...], name: str) -> Array:
    array = np.asarray(values, float)
    if array.shape != shape or not np.isfinite(array).all():
        raise ArgumentError(f"{name} must be finite numbers of shape {shape}, but is {array.tolist()}")
    return array


def thinned(cloud: Cloud, name: str) -> Array:
    """At most _MOST_POINTS of the cloud's finite points, (N, 3), the same ones each time."""
    points = np.asarray(as_points(cloud.points if isinstance(cloud, PointCloud) else cloud, name), float)
    points = np.asarray(points[np.isfinite(points).all(axis=1)])
    if not len(points):
        raise ArgumentError(f"{name} must have finite points to draw, but has none")
    if len(points) > _MOST_POINTS:
        kept = np.random.default_rng(0).choice(len(points), _MOST_POINTS, replace=False, shuffle=False)
        points = points[kept]
    return points


def viewpoint(cloud: Cloud) -> Array:
    """Where the sensor was, in the cloud's frame: its origin, if nothing else is known."""
    pose = cloud.viewpoint if isinstance(cloud, PointCloud) else None
    return np.zeros(3) if pose is None else np.asarray(pose[:3, 3])


def below_ceiling(source_heights: Array, target_heights: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which points of each cloud, by their heights after the registration, to draw before and after it."""
    top = views.ceiling(np.concatenate([source_heights, target_heights]))
    return np.asarray(source_heights < top), np.asarray(target_heights < top)


def _motion(T: Array, before: Array, after: Array) -> str:
    """The motion in words; the shift is that of the source's middle, which no far-off origin inflates."""
    angle = np.degrees(angles_between(T, np.eye(4)))
    shift = np.linalg.norm(after.mean(axis=0) - before.mean(axis=0))
    return f"source turned by {angle:.1f}° and moved by {shift:.3g}"


def _figure(columns: dict[str, Clouds], rows: dict[str, Array], title: str) -> Figure:
    """A panel for each view (rows) of each pair of clouds (columns), with headings and a legend."""
    windows = [comparable([window_of(clouds, view) for clouds in columns.values()]) for view in rows.values()]
    heights = [_PANEL * row[0].height / row[0].width for row in windows]
    figure, grid = _panels(heights, len(columns))
    for panels, view, in_view in zip(grid, rows.values(), windows, strict=True):
        for axes, clouds, window in zip(panels, columns.values(), in_view, strict=True):
            image = paint(clouds, view, window, round(_PANEL * _DPI * _FINER))
            axes.imshow(image, aspect="auto", interpolation="antialiased")
            axes.set(xticks=[], yticks=[])
            axes.spines[:].set_color("0.8")
    for axes, name in zip(grid[0], columns, strict=True):
        axes.set_title(name, fontsize=18, pad=8)
    for axes, name in zip(grid[:, 0], rows, strict=True):
        axes.set_ylabel(name, fontsize=14, color="0.3", labelpad=8)
    figure.suptitle(title, fontsize=14, color="0.3", y=1 - 0.1 / figure.get_figheight(), va="top")
    _add_legend(figure)
    return figure


def comparable(windows: list[Window]) -> list[Window]:
    """The windows in one shape, and in one scale unless a cloud would be lost in it (a far-off start)."""
    tallest, widest = max(w.height for w in windows), max(w.width for w in windows)
    shape = float(np.clip(tallest / widest, 0.45, 1.2))
    widths = [max(w.width, w.height / shape) for w in windows]
    if min(widths) > 0.4 * max(widths):
        widths = [max(widths)] * len(widths)
    return [Window(w.middle, width, width * shape) for w, width in zip(windows, widths, strict=True)]


def _panels(heights: list[float], columns: int) -> tuple[Figure, NDArray[np.object_]]:
    """A figure with a grid of empty panels of these heights in inches."""
    wide = _LEFT + (_PANEL + _GAP) * columns
    high = _TOP + sum(heights) + _GAP * (len(heights) - 1) + _BOTTOM
    spacing = {
        "left": _LEFT / wide,
        "right": 1 - _GAP / wide,
        "top": 1 - _TOP / high,
        "bottom": _BOTTOM / high,
        "wspace": _GAP / _PANEL,
        "hspace": _GAP / (sum(heights) / len(heights)),
        "height_ratios": heights,
    }
    figure = new_figure(wide, high, _DPI)
    return figure, figure.subplots(len(heights), columns, squeeze=False, gridspec_kw=spacing)


def _add_legend(figure: Figure) -> None:
    """Name the two colours below the panels."""
    from matplotlib.lines import Line2D

    colors = {"source (moves)": SOURCE_COLOR, "target (stays)": TARGET_COLOR}
    handles = [
        Line2D([], [], marker="o", linestyle="none", markersize=10, color=color, label=name)
        for name, color in colors.items()
    ]
    figure.legend(handles=handles, loc="lower center", ncols=2, frameon=False, fontsize=14)
