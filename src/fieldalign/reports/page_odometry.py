"""The report of a drive: the trajectory over the map, where it was not tracked, and how far it is off the truth."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from itertools import groupby
from pathlib import Path

import numpy as np

from ..clouds.cloud import PointCloud
from ..errors import ArgumentError
from ..evaluation import Evaluation
from ..fields.protocol import Floats
from ..motions import inverse
from ..odometry.reason import Tracking
from ..odometry.trajectory import Trajectory
from .charts import profile
from .model_scene import Way, drive_model
from .page import Page, checked_page_path, facts, foot, head, write_page
from .plan import Plan, path_of
from .viewer import MODEL_SCRIPTS, model_viewer

_BACKDROP = 12_000  # points of the map
_TOLD = 200         # stretches in the table


@dataclass(frozen=True)
class Stretch:
    """Frames first to last, of which all came to the same reason, and none was tracked."""

    first: int
    last: int
    reason: Tracking

    def of(self, places: Floats) -> Floats:
        """The part of the places (n, ...) of all frames from the frame before it to the one after."""
        return places[max(self.first - 1, 0) : self.last + 2]

    def __str__(self) -> str:
        return f"frame {self.first}" if self.first == self.last else f"frames {self.first} to {self.last}"


def write_odometry_report(
    trajectory: Trajectory,
    path: str | os.PathLike[str],
    *,
    reasons: Sequence[Tracking | str] | None = None,
    world: PointCloud | None = None,
    evaluation: Evaluation | None = None,
    title: str | None = None,
) -> Path:
    """Writes a drive as one HTML page; returns the path.

    The page shows the trajectory over the map in 3D and from above, the stretches that were not tracked (degenerate,
    lost, missing), and along the way height, standard deviation and, with the truth, the errors.

    trajectory: one pose a frame. reasons: what each step came to (`fa.Odometry.last.reason`), as many; None: not known.
    world: the map, in the trajectory's world. evaluation: of `fa.evaluate` for this trajectory. path: ends in .html; it
    is replaced whole or not at all. title: one line.

    Raises ArgumentError for a path that cannot be written, a trajectory without poses and reasons of another number.
    """
    path = checked_page_path(path)
    if not len(trajectory):
        raise ArgumentError("trajectory must have poses to report, but has none")
    if reasons is not None and len(reasons) != len(trajectory):
        raise ArgumentError(f"reasons must be one for each of the {len(trajectory)} poses, but are {len(reasons)}")
    stretches = _stretches([Tracking(reason) for reason in reasons or []])
    name = title or "A drive"
    ways = _ways(trajectory, stretches, _truth_here(evaluation))
    body = f"""{head(name, "odometry report", "results")}
<main id="results">
{facts(_figures(trajectory, stretches, reasons is not None, evaluation))}
{model_viewer("The drive in 3D", {"height": "height", "plain": "nothing"}, ways)}
{_way(trajectory, world, stretches, evaluation)}
<section class="columns three" aria-label="Along the way">{_profiles(trajectory, stretches, evaluation)}</section>
{_table(trajectory, stretches) if reasons is not None else ""}
</main>
{foot()}"""
    data = {"models": [drive_model(world, ways)]}
    return write_page(Page(name, body, (*MODEL_SCRIPTS, "page.js"), data), path)


def _stretches(reasons: Sequence[Tracking]) -> list[Stretch]:
    runs, frame = [], 0
    for reason, group in groupby(reasons):
        count = len(list(group))
        if not reason.is_tracked:
            runs.append(Stretch(frame, frame + count - 1, reason))
        frame += count
    return runs


def _figures(
    trajectory: Trajectory, stretches: Sequence[Stretch], known: bool, evaluation: Evaluation | None
) -> dict[str, str]:
    figures = {"frames": str(len(trajectory)), "path": f"{trajectory.distances[-1]:.4g} m"}
    if known:
        off = sum(stretch.last - stretch.first + 1 for stretch in stretches)
        figures["tracked"] = f"{len(trajectory) - off} of {len(trajectory)}"
    if evaluation is not None:
        errors = evaluation.absolute.translation
        figures |= {"error, rms": f"{np.sqrt(np.mean(errors**2)):.3g} m", "largest": f"{errors.max():.3g} m"}
        if len(evaluation.segments):
            figures["drift"] = f"{evaluation.segments.translation_percent:.3g} %"
    return figures


def _truth_here(evaluation: Evaluation | None) -> Floats | None:
    """Where the sensor truly was (n, 3), in the trajectory's world."""
    return None if evaluation is None else (
        evaluation.truth.in_world(inverse(evaluation.T_truth_trajectory)).positions
    )


def _ways(trajectory: Trajectory, stretches: Sequence[Stretch], truth: Floats | None) -> dict[str, Way]:
    """The lines in 3D; of those in one place the first is seen."""
    places = trajectory.positions
    ways = {"start": Way([places[:1]], "pseudo", "start", 12.0)}
    if stretches:
        ways["lost"] = Way([s.of(places) for s in stretches], "contradicts", "not tracked", 8.0)
    ways["way"] = Way([places], "source", "trajectory", 6.0)
    return ways if truth is None else ways | {"truth": Way([truth], "target", "truth", 3.0)}


def _way(
    trajectory: Trajectory, world: PointCloud | None, stretches: Sequence[Stretch], evaluation: Evaluation | None
) -> str:
    """The trajectory over the map from above; the truth beneath it, wider."""
    ground = np.empty((0, 3)) if world is None else np.asarray(world.points, float)
    plan = Plan(ground, trajectory.positions, _BACKDROP)
    truth, told = "", ""
    if (truth_here := _truth_here(evaluation)) is not None:
        truth = f'<path class="truth" d="{path_of(plan.at(truth_here))}"/>'
        told = '<li><i class="swatch target"></i>truth</li>'
    places = plan.at(trajectory.positions)
    marks = "".join(_mark(stretch, places) for stretch in stretches)
    (x, y), length = places[0], trajectory.distances[-1]
    story = f"{len(trajectory)} poses over {length:.4g} m from above; {len(stretches)} stretches were not tracked"
    start = f'<circle class="start" cx="{x:.1f}" cy="{y:.1f}" r="5"/>'
    drawing = f'{truth}<path class="way" d="{path_of(places)}"/>{marks}{start}'
    lost = '<li><i class="swatch contradicts"></i>not tracked</li>' if stretches else ""
    return f"""<section id="way"><figure><h3>From above</h3>{plan.svg(story, drawing)}
<figcaption><ul class="legend"><li><i class="swatch source"></i>trajectory, its start ringed</li>{told}{lost}</ul>
</figcaption></figure></section>"""


def _mark(stretch: Stretch, places: Floats) -> str:
    return (
        f'<path class="off" d="{path_of(stretch.of(places))}"><title>{stretch}: {escape(str(stretch.reason))}'
        "</title></path>"
    )


def _profiles(trajectory: Trajectory, stretches: Sequence[Stretch], evaluation: Evaluation | None) -> str:
    along = trajectory.distances
    spans = [(float(along[max(s.first - 1, 0)]), float(along[s.last])) for s in stretches]
    drawn = [_figure("Height", profile(along, trajectory.positions[:, 2], spans, "height (m)", "path (m)"))]
    if trajectory.covariances is not None:
        sigma = np.sqrt(np.trace(trajectory.covariances[:, 3:, 3:], axis1=1, axis2=2))
        drawn.append(_figure(
            "Standard deviation of the place, against the map",
            profile(along, sigma, spans, "standard deviation (m)", "path (m)"),
        ))
    if evaluation is not None:
        way, errors = evaluation.truth.distances, evaluation.absolute
        drawn.append(_figure("Error of the place", profile(way, errors.translation, [], "error (m)", "path (m)")))
        drawn.append(_figure("Error of the turn", profile(way, errors.rotation, [], "error (deg)", "path (m)")))
    return "".join(drawn)


def _figure(name: str, drawing: str) -> str:
    return f"<figure><h3>{name}</h3>{drawing}</figure>"


def _table(trajectory: Trajectory, stretches: Sequence[Stretch]) -> str:
    """The stretches, the longest first."""
    if not stretches:
        return "<section><h3>Not tracked</h3><p>Every frame was tracked.</p></section>"
    along = trajectory.distances
    longest = sorted(stretches, key=lambda s: (s.first - s.last, s.first))
    rows = "".join(
        f"<tr><th scope=row>{s}</th><td>{s.last - s.first + 1}</td>"
        f"<td>{along[s.last] - along[max(s.first - 1, 0)]:.3g} m</td>"
        f'<td class="wraps">{escape(str(s.reason))}</td></tr>'
        for s in longest[:_TOLD]
    )
    more = f"<figcaption>The {_TOLD} longest of {len(stretches)}.</figcaption>" if len(stretches) > _TOLD else ""
    return f"""<section><figure><h3>Not tracked</h3><div class="scroll"><table class="plain"><thead><tr>
<th scope=col>where</th><th scope=col>frames</th><th scope=col>path</th><th scope=col>why</th></tr></thead>
<tbody>{rows}</tbody></table></div>{more}</figure></section>"""
