"""The report of one pair: both clouds in a viewer, the verdict and what it rests on, the pose to copy."""

from __future__ import annotations

import os
from html import escape
from pathlib import Path

import numpy as np

from ..fields.protocol import Floats
from ..motions import angles_between, apply, growth, reach_of, size_of
from ..prepare import CloudLike, prepare_pair
from ..result import RegistrationResult
from ..threads import resolve_threads
from .charts import curve, histogram, share_bar
from .evidence_table import certainty_table, evidence_table
from .page import Page, checked_page_path, facts, foot, head, write_page
from .pose_forms import in_space, pose_forms
from .scene import Scene, scene_of, viewer_data
from .viewer import PAIR_SCRIPTS, pair_viewer

_SCALED = (4, 7)  # rows of the information of a similarity, in the plane and in space
_OTHERS = 4  # alternatives that can be looked at


def write_report(
    result: RegistrationResult,
    source: CloudLike,
    target: CloudLike,
    path: str | os.PathLike[str],
    title: str | None = None,
) -> Path:
    """Writes a result as one HTML page that needs no server, no network and no other file; returns the path.

    The page shows both clouds in 3D, before and after and anywhere between, coloured by cloud, agreement or signed
    distance; the verdict and its evidence; convergence, residuals and times; the pose to copy.

    result: of `fa.register` or `fa.verify` for just these clouds. source, target: as they were handed in there;
        prepared ones (`fa.prepare`) are not worked on twice. Of large clouds 100,000 points are drawn, the same ones
        each time.
    path: ends in .html; it is replaced whole or not at all. title: one line; without it, "source onto target".

    The same result gives the same bytes. Raises ArgumentError for a path that cannot be written, and for clouds as
    `fa.register` does.
    """
    path = checked_page_path(path)
    pair = prepare_pair(source, target, resolve_threads(None), True, len(result.information) in _SCALED)
    scene = scene_of(result.T_target_source, *pair, result=result)
    name = title or "Source onto target"
    others = {f"alternative {k}": other.T_target_source for k, other in enumerate(result.alternatives[:_OTHERS], 1)}
    data = {"scenes": [viewer_data(scene, others)]}
    return write_page(Page(name, _body(name, result, scene), (*PAIR_SCRIPTS, "page.js"), data), path)


def _body(title: str, result: RegistrationResult, scene: Scene) -> str:
    mark, word = ("good", "Accepted") if result.accepted else ("bad", "Not accepted")
    why = str(result.reason).split(": ", 1)[-1]
    return f"""{head(title, "registration report", "verdict")}
<main>
<section id="verdict" class="verdict {mark}" aria-labelledby="conclusion">
<h2 id="conclusion"><span class="mark">{word}</span> {escape(why[:1].upper() + why[1:])}</h2>
<p>{escape(_evidence_sentence(result))}</p>
{_facts(result, scene)}
</section>
{pair_viewer()}
<section class="columns">
{evidence_table(result)}
{certainty_table(result)}
</section>
<section class="columns three">
{_residuals(scene)}
{_convergence(result, scene)}
{_times(result)}
</section>
{_poses(result)}
</main>
{foot()}"""


def _evidence_sentence(result: RegistrationResult) -> str:
    """The numbers behind the reason, without the reason itself."""
    rest = result.verdict.removeprefix(str(result.reason)).strip()
    return rest or "The method knows no other pose to compare with: what it says rests on the residuals alone."


def _facts(result: RegistrationResult, scene: Scene) -> str:
    """What one asks first, in large numbers."""
    middle = np.median(scene.places[0], axis=0)
    shift = float(np.linalg.norm(apply(scene.T, middle[None])[0] - middle))
    return facts({
        "turned by": f"{_turn(scene.T):.1f}°",
        "moved by": f"{shift:.3g}",
        **({"grown by": f"{size_of(scene.T):.4g}×"} if len(result.information) in _SCALED else {}),
        "overlap of the source": f"{result.overlap:.0%}",
        "overlap of the target": f"{result.overlap_target:.0%}",
        "residual, rms": f"{result.rmse:.2g}",
        "time": f"{sum(result.seconds.values()) * 1e3:.0f} ms",
    })


def _turn(T: Floats) -> float:
    """By how many degrees a similarity (4, 4) turns."""
    return float(np.degrees(angles_between(T @ growth(1 / size_of(T)), np.eye(4))))


def _residuals(scene: Scene) -> str:
    near = scene.near[0]
    met = near.distance[near.meets]
    if len(met):
        drawing = histogram(met, scene.limit, near.signed, "distance of the source to the target")
        said = f"Half of these points keep to {np.median(np.abs(met)):.2g}. {near.side.capitalize()}."
    else:
        drawing, said = "", "No point of the source comes near the target."
    alone = 1 - len(met) / len(near.distance)
    return _figure(
        "Residuals", drawing,
        f"{said} {alone:.0%} of the source’s points are left out: nothing of the target is within {scene.voxel:.2g}.",
    )


def _convergence(result: RegistrationResult, scene: Scene) -> str:
    moved = [reach_of(step.increment, scene.target.extent) for step in result.history]
    if not moved:
        return _figure("Convergence", "", "No iteration was needed.")
    last = f"How far each step moved the cloud, at most; the last one by {moved[-1]:.2g}."
    return _figure("Convergence", curve(moved, "size of the step", "iterations"), last)


def _times(result: RegistrationResult) -> str:
    whole = max(sum(result.seconds.values()), 1e-12)
    rows = "".join(
        f"<tr><th scope=row>{escape(stage)}</th><td>{share_bar(seconds / whole)}</td>"
        f"<td>{seconds * 1e3:.1f} ms</td></tr>"
        for stage, seconds in result.seconds.items()
    )
    table = f'<table class="times"><tbody>{rows}</tbody></table>'
    return _figure("Time by stage", table, "Reading files is not counted.")


def _figure(name: str, drawing: str, caption: str) -> str:
    return f"<figure><h3>{name}</h3>{drawing}<figcaption>{escape(caption)}</figcaption></figure>"


def _poses(result: RegistrationResult) -> str:
    """The pose in each form behind a tab, and the alternatives."""
    forms = pose_forms(result.T_target_source)
    tabs = "".join(
        f'<button type="button" role="tab" id="tab{k}" aria-controls="form{k}" '
        f'aria-selected="{"false" if k else "true"}"{" tabindex=-1" if k else ""}>{form.name}</button>'
        for k, form in enumerate(forms)
    )
    panels = "".join(
        f'<div role="tabpanel" id="form{k}" aria-labelledby="tab{k}"{" hidden" if k else ""}>'
        f'<pre tabindex="0">{escape(form.text)}</pre>'
        f'<p><button type="button" class="copy" data-of="form{k}">Copy</button> '
        f"<span>{escape(form.note)}</span></p></div>"
        for k, form in enumerate(forms)
    )
    return f"""<section aria-labelledby="poses"><h3 id="poses">The pose, T<sub>target←source</sub></h3>
<div role="tablist" aria-labelledby="poses">{tabs}</div>{panels}<p id="told" role="status"></p>
{_alternatives(result)}</section>"""


def _alternatives(result: RegistrationResult) -> str:
    if not result.alternatives:
        return ""
    T = in_space(result.T_target_source)
    rows = []
    for k, other in enumerate(result.alternatives, 1):
        apart = in_space(other.T_target_source) @ np.linalg.inv(T)
        rows.append(
            f"<tr><th scope=row>{k}</th><td>{_turn(apart):.1f}°</td><td>{other.overlap:.0%}</td>"
            f"<td>{other.rmse:.2g}</td></tr>"
        )
    return f"""<h3>Other poses that agree about as well</h3>
<table class="plain"><thead><tr><th scope=col>alternative</th>
<th scope=col>turned from the result by</th><th scope=col>overlap</th><th scope=col>residual</th></tr></thead>
<tbody>{"".join(rows)}</tbody></table>"""
