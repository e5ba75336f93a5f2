"""A picture of how far the points of a scan lie from a surface: how many, at which distance."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..inspection import Deviation, diverging_colors
from ..whole_file import write_figure
from .figure_file import checked_path, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_BARS = 101
_WIDEST = 3.0  # times what 95 % of the points keep to, or the tolerance: beyond, all stand in the last bar
_SIZE, _DPI = (7.2, 4.2), 160


def deviation_histogram(deviation: Deviation, path: str | os.PathLike[str], title: str | None = None) -> Path:
    """Draw the deviations of a cloud as a histogram, coloured as the cloud is; returns the path.

    path: its suffix picks PNG, SVG or PDF; it is replaced whole or not at all. title: one line; without it, the mean
    and the standard deviation.

    Raises MissingExtraError without matplotlib, and ArgumentError for a path that cannot be.
    """
    path = checked_path(path)
    figure = new_figure(*_SIZE, _DPI, layout="constrained")
    axes = figure.subplots()
    _draw_bars(axes, deviation)
    if deviation.tolerance is not None:
        for side in (-1, 1) if deviation.signed else (1,):
            axes.axvline(side * deviation.tolerance, color="0.3", linestyle="--", linewidth=1)
    s = deviation.statistics
    name = title or f"mean {s.mean:.3g}, standard deviation {s.standard_deviation:.3g}, {s.count} points"
    axes.set_title(name, fontsize=11, color="0.3", pad=10)
    axes.set_xlabel("deviation, negative inside" if deviation.signed else "distance to the surface", color="0.3")
    axes.set_ylabel("points", color="0.3")
    axes.spines[["top", "right"]].set_visible(False)
    return write_figure(figure, path)


def _draw_bars(axes: Axes, deviation: Deviation) -> None:
    """The bars; what lies far out is counted in the outermost one, and does not squeeze all others."""
    s = deviation.statistics
    values = deviation.values[np.isfinite(deviation.values)]
    reach = min(max(abs(s.minimum), abs(s.maximum)), _WIDEST * max(s.percentile_95, deviation.tolerance or 0.0))
    reach = max(reach, 1e-300)
    edges = np.linspace(-reach if deviation.signed else 0.0, reach, _BARS + 1)
    counts, _ = np.histogram(values.clip(edges[0], edges[-1]), edges)
    middles = (edges[1:] + edges[:-1]) / 2
    colors = diverging_colors(middles, deviation.limit) / 255
    axes.bar(middles, counts, width=edges[1] - edges[0], color=colors, edgecolor="0.6", linewidth=0.2)
    axes.margins(x=0)
