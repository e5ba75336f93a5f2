"""What the experiments that are pictures share: figures as wide as a column or a page of print, and their files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ..fields import PointField
from ..fields.protocol import Floats
from ..reports import figure_file
from ..reports.painting import Image, Window
from ..reports.shading import Layer, paint_surfaces
from ..reports.views import sphere
from ..whole_file import write_figure
from .request import Report, Request
from .results import head, write_json

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Item = TypeVar("Item")

COLUMN = 3.5  # inches, of the journal that the paper appeared in
SMALL, LARGE = 6.0, 7.5  # points: the smallest and the largest letters
INK = "0.2"
SCAN, CLOSED = 0.6, 1.6  # how much of a panel points cover: those of a scan; those of a surface without holes
_DPI = 400
_BALL = 120  # points that a ball is painted with
_FINER = 1.5  # pixels painted for each one shown


def example(items: Sequence[Item]) -> Item:
    """The third of a data set's items: of the part of 3DMatch in ../shared/data the first that is not thinned."""
    return items[min(2, len(items) - 1)]


def new_figure(width: float, height: float) -> Figure:
    """An empty figure; raises MissingExtraError without matplotlib."""
    return figure_file.new_figure(width, height, _DPI)


def layer(points: Floats, colors: Floats | Sequence[float], covered: float = SCAN) -> Layer:
    """A cloud to be painted, in one color or in one for each point."""
    normals = PointField(points).normals(points)
    return Layer(points, normals, np.broadcast_to(np.asarray(colors, float), points.shape), covered)


def balls(places: Floats, color: Sequence[float], radius: float) -> Layer:
    """Little balls at places (L, 3): they hide what is behind them, as dots in a plane would not."""
    ball = sphere(_BALL)
    points = (places[:, None] + radius * ball).reshape(-1, 3)
    return Layer(points, np.tile(ball, (len(places), 1)), np.broadcast_to(np.asarray(color, float), points.shape))


def show_layers(axes: Axes, layers: Sequence[Layer], view: Floats, window: Window, inches: float) -> None:
    """Clouds painted into a panel so many inches wide."""
    show(axes, paint_surfaces(layers, view, window, round(inches * _DPI * _FINER)), window)


def framed(points: Floats, view: Floats, shape: float) -> Window:
    """The window that holds all but a few strays of the points, in the shape (height over width) of a panel."""
    seen = points @ view[:2].T
    low, high = np.percentile(seen, (0.1, 99.9), axis=0)
    width = 1.04 * max(high[0] - low[0], (high[1] - low[1]) / shape)
    return Window((low + high) / 2, float(width), float(width * shape))


def show(axes: Axes, image: Image, window: Window) -> None:
    """An image in a panel without ticks, in the coordinates of its window."""
    (x, y), half_width, half_height = window.middle, window.width / 2, window.height / 2
    axes.imshow(image, extent=(x - half_width, x + half_width, y - half_height, y + half_height), aspect="equal",
                interpolation="antialiased")
    bare(axes)


def bare(axes: Axes) -> None:
    """A panel without ticks, with a pale frame."""
    axes.set(xticks=[], yticks=[])
    axes.spines[:].set(color="0.75", linewidth=0.5)


def name_panel(axes: Axes, letter: str, text: str) -> None:
    """The line below a panel, as in print: (a) text."""
    axes.set_xlabel(f"({letter}) {text}", fontsize=LARGE, color=INK, labelpad=3)


def scale_bar(axes: Axes, length: float, text: str, color: str = INK) -> None:
    """A bar of so many of the panel's units in its lower left corner, with its length above."""
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    x, y = left + 0.05 * (right - left), low + 0.05 * (right - left)
    axes.plot([x, x + length], [y, y], color=color, linewidth=1.6, solid_capstyle="butt")
    axes.text(x + length / 2, y + 0.03 * (high - low), text, color=color, fontsize=SMALL, ha="center", va="bottom",
              bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 0.6})
    axes.set(xlim=(left, right), ylim=(low, high))


def colormap(name: str) -> Any:
    """A colour map of matplotlib: numbers (n,) in 0..1 to RGBA (n, 4)."""
    from matplotlib import colormaps

    return colormaps[name]


def color_bar(axes: Axes, colored: Any, unit: str, open_ended: bool = False) -> None:
    """A narrow bar on the right of a panel that says what its colours mean; open_ended: the last one, all above."""
    inset = axes.inset_axes((1.02, 0.0, 0.025, 1.0))
    bar = axes.figure.colorbar(colored, cax=inset, extend="max" if open_ended else "neither", extendfrac=0.04)
    bar.outline.set(linewidth=0.4, color="0.75")
    inset.tick_params(labelsize=SMALL, length=1.5, width=0.4, pad=1, colors=INK)
    inset.set_title(unit, fontsize=SMALL, color=INK, pad=2)


def write_picture(
    request: Request, name: str, title: str, protocol: Sequence[str], figure: Figure, shown: dict[str, Any]
) -> Report:
    """NAME.png, NAME.pdf, and NAME.json with what is shown; each whole or not at all."""
    path = request.output / name
    for suffix in (".png", ".pdf"):
        write_figure(figure, path.with_suffix(suffix))
    said = head(name, title, protocol, request.data, request.seed) | {"shown": shown}
    files = [path.with_suffix(".png"), path.with_suffix(".pdf"), write_json(said, path.with_suffix(".json"))]
    return Report("\n".join([title, *protocol]), files)
