"""The paper's Fig. 3: what a distance field is, on a map in the plane and on a slice through a LiDAR scan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...fields import PointField
from ...fields.protocol import Floats
from ...reports import views
from ...reports.painting import Window
from .. import figures
from ..data_sets import kitti
from ..data_sets.files import points_of
from ..request import Report, Request
from .floor_plan import floor_plan

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_ROWS = 420  # of a slice, places
_STREET = Window(np.array([5.0, 0.0]), 60.0, 42.0)  # what is shown of the scan, metres
_HEIGHT = -0.9  # of the slice in the sensor's frame, metres: through cars and walls, 0.8 m above the road
_PLAN_LINES, _STREET_LINES = (0.5, 1.0), (0.5, 1.0, 2.0)  # metres, where lines of equal distance are drawn
_PLAN_TOP, _STREET_TOP = 1.6, 4.0  # metres, from where on all is of one colour


@dataclass(frozen=True, eq=False)
class Slice:
    """A field on a grid in a plane: values (rows, columns), the first row at the lower edge of the window."""

    values: Floats
    window: Window


def slice_of(field: PointField, window: Window, height: float, rows: int = _ROWS) -> Slice:
    """The field's distances on the plane z = height."""
    columns = round(rows * window.width / window.height)
    x = window.middle[0] + window.width * ((np.arange(columns) + 0.5) / columns - 0.5)
    y = window.middle[1] + window.height * ((np.arange(rows) + 0.5) / rows - 0.5)
    places = np.stack([*np.meshgrid(x, y), np.full((rows, columns), height)], axis=-1)
    return Slice(field.sample(places.reshape(-1, 3)).value.reshape(rows, columns), window)


def distance_field(request: Request) -> Report:
    """Draws a simulated map and a scan of KITTI, and beside them their distance fields."""
    plan = floor_plan(request.seed)
    pair = kitti.successive(request.data)[0]
    scan = points_of(pair.target)
    map_slice = slice_of(PointField(np.c_[plan, np.zeros(len(plan))]), _around(plan), 0.0)
    scan_slice = slice_of(PointField(scan), _STREET, _HEIGHT)

    figure = figures.new_figure(figures.COLUMN, 2.95)
    (a, b), (c, d) = figure.subplots(2, 2, gridspec_kw={
        "left": 0.01, "right": 0.93, "top": 0.985, "bottom": 0.07, "wspace": 0.04, "hspace": 0.18,
        "height_ratios": [map_slice.window.height / map_slice.window.width, _STREET.height / _STREET.width]})
    _draw_map(a, plan, map_slice.window)
    _draw_field(b, map_slice, _PLAN_LINES, _PLAN_TOP)
    b.plot(*plan.T, ".", color="black", markersize=0.5, markeredgewidth=0, rasterized=True)
    _draw_scan(c, scan)
    _draw_field(d, scan_slice, _STREET_LINES, _STREET_TOP)
    for axes, length in ((a, 5.0), (c, 10.0)):
        figures.scale_bar(axes, length, f"{length:g} m")
    for axes, letter, text in ((a, "a", "map in the plane"), (b, "b", "its distance field"),
                               (c, "c", "KITTI scan"), (d, "d", "slice of its distance field")):
        figures.name_panel(axes, letter, text)
    return figures.write_picture(
        request, "distance-field", "Distance fields (Fig. 3 of the paper)",
        (f"(a), (b): a simulated map of an office floor, {len(plan)} points, in place of the Intel map of the paper.",
         f"(c), (d): {pair.sequence}, scan {pair.i}, all of its {len(scan)} points; the slice lies {-_HEIGHT} m below "
         "the sensor.",
         "The field is the distance to the nearest point; the paper's is its square."),
        figure,
        {"map_points": len(plan), "scan": pair.target, "scan_points": len(scan), "slice_height_m": _HEIGHT,
         "map_field_max_m": float(map_slice.values.max()), "scan_field_max_m": float(scan_slice.values.max())},
    )


def _around(plan: Floats) -> Window:
    low, high = plan.min(axis=0), plan.max(axis=0)
    width, height = high - low + 2.0
    return Window((low + high) / 2, float(width), float(height))


def _limits(axes: Axes, window: Window) -> None:
    (x, y), w, h = window.middle, window.width / 2, window.height / 2
    axes.set(xlim=(x - w, x + w), ylim=(y - h, y + h), aspect="equal")
    figures.bare(axes)


def _draw_map(axes: Axes, plan: Floats, window: Window) -> None:
    axes.plot(*plan.T, ".", color="0.1", markersize=0.7, markeredgewidth=0, rasterized=True)
    _limits(axes, window)


def _draw_scan(axes: Axes, scan: Floats) -> None:
    """The scan from above, coloured by height."""
    near = scan[(np.abs(scan[:, :2] - _STREET.middle) < [_STREET.width / 2, _STREET.height / 2]).all(axis=1)]
    low, high = np.percentile(near[:, 2], (2, 98))
    colors = figures.colormap("cividis")(np.clip((near[:, 2] - low) / (high - low), 0, 1))[:, :3]
    view = views.from_above(np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0]))
    figures.show_layers(axes, [figures.layer(near, colors)], view, _STREET, figures.COLUMN / 2)


def _draw_field(axes: Axes, found: Slice, lines: tuple[float, ...], top: float) -> None:
    """Distances as colours, with lines of equal distance."""
    (x, y), w, h = found.window.middle, found.window.width / 2, found.window.height / 2
    extent = (x - w, x + w, y - h, y + h)
    image = axes.imshow(found.values, cmap="cividis", vmin=0, vmax=top, extent=extent, origin="lower")
    axes.contour(found.values, lines, colors="white", linewidths=0.35, alpha=0.8,
                 extent=extent)
    _limits(axes, found.window)
    figures.color_bar(axes, image, "m", open_ended=True)
