"""Clouds in a figure for print: any number of them, from chosen sides, as wide as a column."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..inspection import diverging_colors
from ..whole_file import write_figure
from . import views
from .figure_file import checked_path, new_figure
from .painting import FADE, SOURCE_COLOR, TARGET_COLOR, Array, Window, paint_points, window_of
from .picture import comparable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

VIEWS = {
    "above": views.from_above, "front": views.from_front, "side": views.from_side, "oblique": views.obliquely,
}
# Of Okabe and Ito, as the source's and the target's: told apart by every kind of colour vision.
COLORS = (
    SOURCE_COLOR, TARGET_COLOR, (0.0, 0.62, 0.451), (0.8, 0.475, 0.655), (0.9, 0.624, 0.0), (0.337, 0.706, 0.914),
)
_INK = "0.2"
_FINER = 2  # pixels painted for each one shown
_NAMED = 8  # clouds that a legend still tells apart
_GAP, _BAR = 0.05, 0.45  # inches: between panels; of a colour bar with its numbers


class Layer(NamedTuple):
    """A cloud to be drawn: points (N, 3), finite, and colors (N, 3), 0..1; one color where it has a name in legends."""

    name: str
    points: Array
    colors: Array


class Frame(NamedTuple):
    """From where clouds are seen: up and ahead, both (3,), of length one and perpendicular."""

    up: Array
    ahead: Array


@dataclass(frozen=True)
class Style:
    """How a figure is made. width: in inches. dpi: pixels in one. point_size: the diameter of a point, in points of
    print (1/72 inch); None: by how many there are. title: one line, or none. limit: the distance at the end of the
    colour bar; None: there is none. signed: whether distances have a side."""

    width: float = 3.35
    dpi: float = 300
    point_size: float | None = None
    title: str = ""
    limit: float | None = None
    signed: bool = False

    @property
    def font(self) -> float:
        """The size of letters in points: what a column of 8.5 cm asks for, and a little more in wide figures."""
        return float(np.clip(2.2 * self.width, 7.0, 10.0))

    @property
    def line(self) -> float:
        """The height of a line of letters in inches."""
        return 1.7 * self.font / 72


def clouds_picture(
    columns: Mapping[str, Sequence[Layer]], path: str | os.PathLike[str], frame: Frame, sides: Sequence[str],
    style: Style | None = None,
) -> Path:
    """Draw clouds side by side (columns, by their headings), each seen from all sides (rows, of VIEWS).

    path: its suffix picks PNG, SVG or PDF (with the points as images); it is replaced whole or not at all.

    A ceiling is left out, so that one looks into the room. Raises MissingExtraError without matplotlib, and
    ArgumentError for a path that cannot be, or cannot be written.
    """
    path, style = checked_path(path), style or Style()
    windows = windows_of(columns, frame, sides)
    figure, grid, panel = _panels(columns, sides, [row[0].height / row[0].width for row in windows], style)
    radius = None if style.point_size is None else style.point_size / 144 * style.dpi * _FINER
    fade = FADE if style.limit is None else 0.0  # colours that mean numbers stay what they are
    for row, side, in_view in zip(grid, sides, windows, strict=True):
        for axes, layers, window in zip(row, columns.values(), in_view, strict=True):
            points, colors = joined(layers)
            pixels = max(1, round(panel * style.dpi * _FINER))
            image = paint_points(points, colors, VIEWS[side](*frame), window, pixels, radius, fade)
            axes.imshow(image, aspect="auto", interpolation="antialiased")
            axes.set(xticks=[], yticks=[])
            axes.spines[:].set(color="0.75", linewidth=0.5)
    _name(figure, grid, columns, sides, style)
    return write_figure(figure, path)


def frame_of(points: Array, up: Array | None, eye: Array) -> Frame:
    """From where points (N, 3) are seen: levelled, about `up` (3,) or what they tell of it themselves, and as from the
    sensor at `eye` (3,)."""
    vertical = views.upright(points) if up is None else views.level(points, up)
    return Frame(vertical, views.ahead(eye, points, vertical))


def without_ceiling(columns: Mapping[str, Sequence[Layer]], up: Array) -> dict[str, list[Layer]]:
    """The layers without a ceiling of those in the last column, which all columns hold in the same order."""
    last = list(columns.values())[-1]
    heights = [layer.points @ up for layer in last]
    top = views.ceiling(np.concatenate(heights))
    return {
        name: [Layer(layer.name, layer.points[height < top], layer.colors[height < top])
               for layer, height in zip(layers, heights, strict=True)]
        for name, layers in columns.items()
    }


def windows_of(columns: Mapping[str, Sequence[Layer]], frame: Frame, sides: Sequence[str]) -> list[list[Window]]:
    """What each panel shows, by rows; in one shape and, where no cloud would be lost, in one scale."""
    return [
        comparable([window_of((joined(layers)[0],), VIEWS[side](*frame)) for layers in columns.values()])
        for side in sides
    ]


def joined(layers: Sequence[Layer]) -> tuple[Array, Array]:
    """All points (N, 3) and colors (N, 3)."""
    return np.concatenate([layer.points for layer in layers]), np.concatenate([layer.colors for layer in layers])


def distance_colors(values: Array, limit: float) -> Array:
    """Colors (N, 3), 0..1, of distances (N,), full at the limit."""
    return np.asarray(diverging_colors(values, limit) / 255)


def _panels(
    columns: Mapping[str, Sequence[Layer]], sides: Sequence[str], shapes: Sequence[float], style: Style
) -> tuple[Figure, NDArray[np.object_], float]:
    """A figure with empty panels of these shapes (height over width), by rows, and the width of one in inches."""
    left = style.line if len(sides) > 1 else 0.02
    right = _BAR if style.limit is not None else 0.02
    top = 0.02 + style.line * ((len(columns) > 1) + bool(style.title))
    bottom = 0.02 + style.line * ((_named(columns) is not None) + 0.5 * (style.limit is not None))
    panel = (style.width - left - right - _GAP * (len(columns) - 1)) / len(columns)
    heights = [panel * shape for shape in shapes]
    high = top + sum(heights) + _GAP * (len(heights) - 1) + bottom
    figure = new_figure(style.width, high, style.dpi)
    spacing = {
        "left": left / style.width, "right": 1 - right / style.width, "top": 1 - top / high, "bottom": bottom / high,
        "wspace": _GAP / panel, "hspace": _GAP / (sum(heights) / len(heights)), "height_ratios": heights,
    }
    return figure, figure.subplots(len(heights), len(columns), squeeze=False, gridspec_kw=spacing), panel


def _name(
    figure: Figure, grid: NDArray[np.object_], columns: Mapping[str, Sequence[Layer]], sides: Sequence[str],
    style: Style,
) -> None:
    """Headings, the names of the rows, the title, a legend and a colour bar, where there is something to tell."""
    if len(columns) > 1:
        for axes, name in zip(grid[0], columns, strict=True):
            axes.set_title(name, fontsize=style.font, color=_INK, pad=0.3 * style.font)
    if len(sides) > 1:
        for axes, name in zip(grid[:, 0], sides, strict=True):
            axes.set_ylabel(name, fontsize=style.font, color=_INK, labelpad=0.3 * style.font)
    if style.title:
        figure.suptitle(style.title, fontsize=style.font, color=_INK, y=1 - 0.02 / figure.get_figheight(), va="top")
    layers = _named(columns)
    if layers is not None:
        from matplotlib.lines import Line2D

        handles = [Line2D([], [], marker="o", linestyle="none", markersize=0.6 * style.font, color=layer.colors[0],
                          label=layer.name) for layer in layers]
        figure.legend(handles=handles, loc="lower center", ncols=len(handles), frameon=False, fontsize=style.font,
                      labelcolor=_INK, handletextpad=0.1, columnspacing=0.9, borderaxespad=0.1, borderpad=0.1)
    if style.limit is not None:
        _add_bar(grid[-1, -1], style)


def _named(columns: Mapping[str, Sequence[Layer]]) -> list[Layer] | None:
    """The layers that a legend names: several, each of one color."""
    first = next(iter(columns.values()))
    layers = [layer for layer in first if len(layer.points) and not np.ptp(layer.colors, axis=0).any()]
    return layers if 1 < len(layers) <= _NAMED else None


def _add_bar(axes: Axes, style: Style) -> None:
    """What the colours of distances mean."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize
    from matplotlib.ticker import MaxNLocator

    assert style.limit is not None
    low = -style.limit if style.signed else 0.0
    colors = distance_colors(np.linspace(low, style.limit, 128), style.limit)
    inset = axes.inset_axes((1.02, 0.0, 0.03, 1.0))
    bar = axes.figure.colorbar(ScalarMappable(Normalize(low, style.limit), ListedColormap(colors)), cax=inset,
                               extend="both" if style.signed else "max", extendfrac=0.04)
    bar.outline.set(linewidth=0.4, color="0.75")
    bar.locator = MaxNLocator(4)
    inset.tick_params(labelsize=style.font - 1, length=1.5, width=0.4, pad=1, colors=_INK)
