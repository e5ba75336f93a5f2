"""Pictures of successes: against the error that is allowed, and against what makes a registration hard."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..motions import Matrix
from ..whole_file import write_figure
from . import figures
from .measures import share_interval
from .results import Results

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PANEL, _LINE = 1.9, 0.13  # inches: the heights of a panel and of a legend's line
_STEPS = 200
_BANDS = 4  # of the methods, the first, which are this project's, are drawn with their intervals: more hide each other
_SMALLEST = 1e-8  # degrees, and of a length a hundredth: below lies the rounding of numbers
# Of Okabe and Ito: told apart by every kind of colour vision; the first are this project's.
_COLORS = ("#D55E00", "#0072B2", "#009E73", "#CC79A7", "#000000", "#E69F00", "#56B4E9", "#8C6D00")
_DASHES = ("-", (0, (4, 1.5)), (0, (1, 1.2)))


def draw_success(results: Results, path: Path) -> None:
    """The share of registrations within an error of rotation, and within one of translation, by every method; the axis
    of the error is logarithmic."""
    figure, panels = new_panels(2, len(results.titles))
    kinds = (("rre_deg", "error of rotation allowed (deg)", _SMALLEST),
             ("rte", "error of translation allowed", _SMALLEST / 100))
    for axes, (key, name, smallest) in zip(panels, kinds, strict=True):
        errors = {method: results.values(key, method) for method in results.titles}
        allowed = _allowed(np.concatenate(list(errors.values())), smallest)
        for number, (method, title) in enumerate(results.titles.items()):
            shares = np.searchsorted(np.sort(errors[method]), allowed, side="right") / len(errors[method])
            draw_line(axes, number, title, allowed, shares, share_interval(shares, len(errors[method])))
        axes.set(xscale="log", xlabel=name, ylabel="share of registrations", ylim=(-0.02, 1.02))
    save(figure, panels, path)


def draw_levels(
    results: Results, path: Path, axis: str, thresholds: Sequence[tuple[float, float]], log: bool = False
) -> None:
    """The share of successes of every method in every group, whose names are the numbers on the axis; a panel for each
    pair of thresholds (degrees, length)."""
    figure, panels = new_panels(len(thresholds), len(results.titles))
    levels = np.array([float(group) for group in results.groups])
    for axes, within in zip(panels, thresholds, strict=True):
        for number, (method, title) in enumerate(results.titles.items()):
            hits = [results.successes(method, group, results.modulo, within) for group in results.groups]
            shares, counts = np.array([h.mean() for h in hits]), np.array([len(h) for h in hits])
            draw_line(axes, number, title, levels, shares, share_interval(shares, counts), marker="o")
        axes.set(xlabel=axis, ylabel="share of successes", ylim=(-0.02, 1.02))
        axes.set_title(f"within {within[0]:g} deg and {within[1]:g}", fontsize=figures.LARGE,
                       color=figures.INK, pad=3)
        if log:
            axes.set_xscale("log")
    save(figure, panels, path)


def new_panels(count: int, lines: int) -> tuple[Figure, list[Axes]]:
    """So many panels below each other, as wide as a column of print, with room for a legend of so many lines."""
    figure = figures.new_figure(figures.COLUMN, count * _PANEL + (lines + 1) * _LINE)
    figure.set_layout_engine("constrained")
    panels = list(figure.subplots(count, 1, squeeze=False)[:, 0])
    for axes in panels:
        axes.spines[["top", "right"]].set_visible(False)
        axes.spines[["left", "bottom"]].set(color="0.6", linewidth=0.6)
        axes.grid(color="0.92", linewidth=0.5)
        axes.set_axisbelow(True)
        axes.tick_params(which="both", labelsize=figures.SMALL, colors=figures.INK, width=0.5, length=2)
        axes.xaxis.label.set(size=figures.LARGE, color=figures.INK)
        axes.yaxis.label.set(size=figures.LARGE, color=figures.INK)
    return figure, panels


def draw_line(
    axes: Axes, number: int, title: str, x: Matrix, y: Matrix, band: tuple[Matrix, Matrix] | None = None,
    **how: Any,
) -> None:
    """One method's line; number: which color and dashes it has. band: its interval."""
    color, dashes = _COLORS[number % len(_COLORS)], _DASHES[number % len(_DASHES)]  # where two are one, both are seen
    axes.plot(x, y, color=color, linestyle=dashes, linewidth=1.0, label=title, markersize=2.0, **how)
    if band is not None and number < _BANDS:
        axes.fill_between(x, *band, color=color, alpha=0.08, linewidth=0)


def save(figure: Figure, panels: list[Axes], path: Path) -> None:
    """Writes the figure with one legend below all panels, whole or not at all."""
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=1, frameon=False, fontsize=figures.SMALL,
                  labelcolor=figures.INK, handlelength=3.0, labelspacing=0.2, borderaxespad=0.2)
    write_figure(figure, path)


def _allowed(errors: Matrix, smallest: float) -> Matrix:
    """Errors to draw the shares at, up to just above what was seen."""
    largest = float(errors[np.isfinite(errors)].max(initial=smallest))
    return np.geomspace(smallest, 10 * largest, _STEPS)
