"""A picture of a trajectory: from above, its height, and how far it is off the truth."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ArgumentError, missing_extra
from ..evaluation.pose_error import PoseErrors
from ..odometry.trajectory import Trajectory
from ..whole_file import replacing
from .painting import SOURCE_COLOR, TARGET_COLOR
from .picture import checked_path

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH, _ABOVE, _BELOW = 8.0, 6.0, 1.8  # inches: of all, and the heights of the view from above and of each curve
_DPI = 160


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
    path = checked_path(path)
    if not len(trajectory):
        raise ArgumentError("trajectory must have poses to draw, but has none")
    if truth is not None and len(truth) != len(trajectory):
        raise ArgumentError(f"truth must have the {len(trajectory)} poses of the trajectory, row for row, but has "
                            f"{len(truth)}")
    figure, panels = _panels(1 if truth is None else 3)
    _draw_ways(panels[0], panels[1], trajectory, truth)
    if truth is not None:
        _draw_errors(panels[2], panels[3], trajectory, truth)
    panels[-1].set_xlabel("path (m)", color="0.3")
    panels[0].set_title(title or f"{len(trajectory)} poses over {trajectory.distances[-1]:.4g} m", fontsize=11,
                        color="0.3", pad=10)
    with replacing(path) as unfinished:
        figure.savefig(unfinished, format=path.suffix[1:].lower())
    return path


def _panels(curves: int) -> tuple[Figure, list[Axes]]:
    """A figure with a large panel over so many low ones."""
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise missing_extra("viz", "drawing a picture") from error
    heights = [_ABOVE] + [_BELOW] * curves
    figure = Figure(figsize=(_WIDTH, sum(heights)), dpi=_DPI, layout="constrained")
    panels = list(figure.subplots(len(heights), 1, gridspec_kw={"height_ratios": heights}))
    for axes in panels:
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(color="0.92", linewidth=0.8)
        axes.set_axisbelow(True)
    return figure, panels


def _draw_ways(above: Axes, height: Axes, trajectory: Trajectory, truth: Trajectory | None) -> None:
    """The truth lies below, wider and paler: where both are one, both are seen."""
    along = (trajectory if truth is None else truth).distances
    if truth is not None:
        wide: dict[str, Any] = {"color": TARGET_COLOR, "linewidth": 4, "alpha": 0.45, "label": "truth"}
        above.plot(*truth.positions.T[:2], **wide)
        height.plot(along, truth.positions[:, 2], **wide)
    thin: dict[str, Any] = {"color": SOURCE_COLOR, "linewidth": 1.2, "label": "trajectory"}
    above.plot(*trajectory.positions.T[:2], **thin)
    height.plot(along, trajectory.positions[:, 2], **thin)
    above.plot(*trajectory.positions[0, :2], "o", color="0.3", markersize=6, label="start")
    above.set_aspect("equal", adjustable="datalim")
    above.set_xlabel("x (m)", color="0.3")
    above.set_ylabel("y (m)", color="0.3")
    above.legend(frameon=False, fontsize=9)
    height.set_ylabel("z (m)", color="0.3")


def _draw_errors(move: Axes, turn: Axes, trajectory: Trajectory, truth: Trajectory) -> None:
    errors = PoseErrors.between(trajectory.poses, truth.poses)
    for axes, values, name in ((move, errors.translation, "error (m)"), (turn, errors.rotation, "error (deg)")):
        axes.plot(truth.distances, values, color=SOURCE_COLOR, linewidth=1.2)
        axes.set_ylim(0, max(1.1 * float(np.max(values)), 1e-12))
        axes.set_ylabel(name, color="0.3")
