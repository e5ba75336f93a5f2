"""A picture of trajectories: from above, their height, and how far they are off the truth."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from itertools import cycle
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ArgumentError
from ..evaluation.pose_error import PoseErrors
from ..odometry.trajectory import Trajectory
from ..whole_file import write_figure
from .figure_file import checked_path, new_figure
from .painting import SOURCE_COLOR, TARGET_COLOR

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH, _ABOVE, _BELOW = 8.0, 6.0, 1.8  # inches: of all, and the heights of the view from above and of each curve
_DPI = 160
_SMALLEST = 0.7  # times the usual size of letters: those of 10 points become 7, which a column of print asks for
_LOWEST = 0.9  # inches of a curve
# Of Okabe and Ito, as the first and the truth's: told apart by every kind of colour vision.
_COLORS = SOURCE_COLOR, (0.0, 0.62, 0.451), (0.8, 0.475, 0.655), (0.9, 0.624, 0.0)


def trajectory_picture(
    trajectory: Trajectory, path: str | os.PathLike[str], truth: Trajectory | None = None, title: str | None = None
) -> Path:
    """Draw a trajectory from above (x, y), and its height (z) along the way; returns the path.

    truth: row for row of the same poses and in the same world, as `Evaluation.truth` is beside
    `Evaluation.trajectory`; with it, the errors of translation and of rotation are drawn along the way, too.
    path: its suffix picks PNG, SVG or PDF; it is replaced whole or not at all. title: one line.

    Raises MissingExtraError without matplotlib, and ArgumentError for a path that cannot be, for a trajectory without
    poses and for a truth of another length.
    """
    return trajectories_picture({"trajectory": trajectory}, path, truth, title)


def trajectories_picture(
    trajectories: Mapping[str, Trajectory],
    path: str | os.PathLike[str],
    truth: Trajectory | None = None,
    title: str | None = None,
    *,
    width: float = _WIDTH,
    dpi: float | None = None,
) -> Path:
    """Draw several trajectories in one picture, which calls them by their names; the rest as of trajectory_picture.

    width: in inches; in narrow figures, lines and letters are smaller, and no smaller than can be read. dpi: pixels in
    one inch.
    """
    path = checked_path(path)
    for trajectory in trajectories.values():
        _check(trajectory, truth)
    figure, panels = _panels(1 if truth is None else 3, width, dpi or _DPI)
    _draw_ways(panels[0], panels[1], trajectories, truth)
    if truth is not None:
        _draw_errors(panels[2], panels[3], trajectories, truth)
    panels[-1].set_xlabel("path (m)", color="0.3")
    first = next(iter(trajectories.values()))
    title = title or f"{len(first)} poses over {first.distances[-1]:.4g} m"
    panels[0].set_title(title, fontsize=11, color="0.3", pad=10)
    if width < _WIDTH:
        _shrink(panels, max(width / _WIDTH, _SMALLEST))
    return write_figure(figure, path)


def _check(trajectory: Trajectory, truth: Trajectory | None) -> None:
    if not len(trajectory):
        raise ArgumentError("trajectory must have poses to draw, but has none")
    if truth is not None and len(truth) != len(trajectory):
        raise ArgumentError(f"truth must have the {len(trajectory)} poses of the trajectory, row for row, but has "
                            f"{len(truth)}")


def _panels(curves: int, width: float, dpi: float) -> tuple[Figure, list[Axes]]:
    """A figure with a large panel over so many low ones."""
    heights = [_ABOVE * width / _WIDTH] + [max(_BELOW * width / _WIDTH, _LOWEST)] * curves
    figure = new_figure(width, sum(heights), dpi, layout="constrained")
    panels = list(figure.subplots(len(heights), 1, gridspec_kw={"height_ratios": heights}))
    for axes in panels:
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(color="0.92", linewidth=0.8)
        axes.set_axisbelow(True)
    return figure, panels


def _shrink(panels: Sequence[Axes], scale: float) -> None:
    """Letters and lines so many times as large."""
    axes: Any
    for axes in panels:
        legend = axes.get_legend()
        texts = [axes.title, axes.xaxis.label, axes.yaxis.label, *axes.get_xticklabels(), *axes.get_yticklabels()]
        for text in texts + ([] if legend is None else legend.get_texts()):
            text.set_fontsize(scale * text.get_fontsize())
        axes.tick_params(labelsize=scale * 10, length=scale * 3.5, width=scale * 0.8)
        for line in axes.get_lines():
            line.set(linewidth=scale * line.get_linewidth(), markersize=scale * line.get_markersize())


def _draw_ways(above: Axes, height: Axes, trajectories: Mapping[str, Trajectory], truth: Trajectory | None) -> None:
    """The truth lies below, wider and paler: where both are one, both are seen."""
    if truth is not None:
        wide: dict[str, Any] = {"color": TARGET_COLOR, "linewidth": 4, "alpha": 0.45, "label": "truth"}
        above.plot(*truth.positions.T[:2], **wide)
        height.plot(truth.distances, truth.positions[:, 2], **wide)
    for (name, trajectory), color in zip(trajectories.items(), cycle(_COLORS)):
        thin: dict[str, Any] = {"color": color, "linewidth": 1.2, "label": name}
        along = (trajectory if truth is None else truth).distances
        above.plot(*trajectory.positions.T[:2], **thin)
        height.plot(along, trajectory.positions[:, 2], **thin)
    start = next(iter(trajectories.values())).positions[0, :2]
    above.plot(*start, "o", color="0.3", markersize=6, label="start")
    above.set_aspect("equal", adjustable="datalim")
    above.set_xlabel("x (m)", color="0.3")
    above.set_ylabel("y (m)", color="0.3")
    above.legend(frameon=False, fontsize=9)
    height.set_ylabel("z (m)", color="0.3")


def _draw_errors(move: Axes, turn: Axes, trajectories: Mapping[str, Trajectory], truth: Trajectory) -> None:
    errors = {name: PoseErrors.between(trajectory.poses, truth.poses) for name, trajectory in trajectories.items()}
    for axes, kind, label in ((move, "translation", "error (m)"), (turn, "rotation", "error (deg)")):
        curves = {name: getattr(found, kind) for name, found in errors.items()}
        for values, color in zip(curves.values(), cycle(_COLORS)):
            axes.plot(truth.distances, values, color=color, linewidth=1.2)
        axes.set_ylim(0, max(1.1 * float(np.max(list(curves.values()))), 1e-12))
        axes.set_ylabel(label, color="0.3")
