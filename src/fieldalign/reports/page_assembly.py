"""The report of many scans: the graph that they make, the pairs by how badly they fit, and what was left out."""

from __future__ import annotations

import os
from collections.abc import Sequence
from html import escape
from pathlib import Path

import numpy as np

from ..assembly.assembly import Assembly
from ..assembly.pair_result import PairResult
from ..errors import ArgumentError
from ..fields.protocol import Floats
from ..motions import angles_between, apply, inverse
from ..prepare import CloudLike
from .model_scene import component_models
from .page import Page, checked_page_path, facts, foot, head, write_page
from .pair_table import Progress, Row, Shelf, strength, table_beside_view, table_data, table_scripts, worst
from .scan_graph import Edge, scan_graph
from .viewer import MODEL_SCRIPTS, model_viewer

_COLUMNS = ("off by", "turned off", "evidence", "overlap")
_SHOWN = 6     # components that are drawn
_STRONG = 1.5  # times the evidence that is asked for


def write_assembly_report(
    assembly: Assembly,
    clouds: Sequence[CloudLike],
    path: str | os.PathLike[str],
    names: Sequence[str] | None = None,
    title: str | None = None,
    progress: Progress | None = None,
) -> Path:
    """Writes an assembly as one HTML page; returns the path.

    The page shows each component in 3D, and from above with its scans and the pairs between them, a table of the pairs,
    those that are not believed and those that fit the poses of all worst first, each with both scans in 3D a click
    away, how well each scan is placed, and which are left out, and why.

    assembly: of `fa.assemble`. clouds: as they were handed in there; they are read again for the pictures. path: ends
    in .html; it is replaced whole or not at all. names: of the clouds, where they are no paths. title: one line.
    progress: called with how many pictures are made, of how many.

    Raises ArgumentError for a path that cannot be written, and where there are not as many clouds or names as poses.
    """
    path = checked_page_path(path)
    known = _named(clouds) if names is None else list(names)
    for given, kind in ((clouds, "clouds"), (known, "names")):
        if len(given) != len(assembly.poses):
            raise ArgumentError(f"{kind} must be as many as the {len(assembly.poses)} scans, but are {len(given)}")
    pairs = [(i, j, result, True) for i, j, result in assembly.edges]
    pairs += [(i, j, result, False) for i, j, result in assembly.doubted]
    pairs.sort(key=lambda pair: (pair[3], -_off(assembly, pair)[0]))
    shelf = Shelf()
    rows, which = worst([_row(assembly, pair, known, clouds, shelf) for pair in pairs])
    data = table_data(rows, progress) | {"models": component_models(assembly, known, _SHOWN)}
    name = title or f"{len(clouds)} scans"
    table = table_beside_view(rows, _COLUMNS, data, above=which) if rows else ""
    body = _body(name, assembly, known, pairs[: len(rows)], table)
    scripts = (MODEL_SCRIPTS if data["models"] else ()) + (table_scripts(data) if rows else ("page.js",))
    return write_page(Page(name, body, tuple(dict.fromkeys(scripts)), data), path)


Pair = tuple[int, int, PairResult, bool]  # cloud j on cloud i, and whether it is believed


def _named(clouds: Sequence[CloudLike]) -> list[str]:
    return [
        Path(cloud).name if isinstance(cloud, str | os.PathLike) else f"scan {k}" for k, cloud in enumerate(clouds, 1)
    ]


def _off(assembly: Assembly, pair: Pair) -> tuple[float, float]:
    """How far a pair's motion is from that of the poses of all: a length at its overlap's middle, and degrees; nothing
    is known, and it is infinite, where the two scans are in no common frame."""
    i, j, result, _ = pair
    if not any(i in members and j in members for members in assembly.components):
        return np.inf, np.inf
    ours = inverse(np.asarray(assembly.poses[i])) @ np.asarray(assembly.poses[j])
    place: Floats = apply(inverse(result.T_target_source), result.reference_point[None])
    shift = apply(ours, place) - apply(result.T_target_source, place)
    return float(np.linalg.norm(shift)), float(np.degrees(angles_between(ours, result.T_target_source)))


def _row(
    assembly: Assembly, pair: Pair, names: Sequence[str], clouds: Sequence[CloudLike], shelf: Shelf
) -> Row:
    i, j, result, believed = pair
    length, degrees = _off(assembly, pair)
    overlap = max(result.overlap, result.overlap_target)
    numbers = (
        (length, f"{length:.2g}") if np.isfinite(length) else None,
        (degrees, f"{degrees:.2g}°") if np.isfinite(degrees) else None,
        (strength(result), f"{strength(result):.2g}×"), (overlap, f"{overlap:.0%}"),
    )
    said = result.verdict if believed else f"Not believed: other pairs contradict it. {result.verdict}"
    word = "believed" if believed else "not believed"
    return Row(f"{names[j]} onto {names[i]}", word, said, believed, numbers, pose=result.T_target_source,
               picture=shelf.picture(result, (clouds[j], clouds[i])))


def _body(title: str, assembly: Assembly, names: Sequence[str], pairs: Sequence[Pair], table: str) -> str:
    placed = sum(map(len, assembly.components))
    figures = {
        "scans placed": f"{placed} of {len(assembly.poses)}", "components": str(len(assembly.components)),
        "pairs believed": str(len(assembly.edges)), "pairs not believed": str(len(assembly.doubted)),
        "pairs tried": str(assembly.tried), "time": f"{sum(assembly.seconds.values()):.1f} s",
    }
    return f"""{head(title, "assembly report", "results")}
<main class="wide" id="results">
{facts(figures)}
{_left_out(assembly, names)}
{_models(assembly)}
<section id="graphs" class="columns" aria-label="Components from above">{_graphs(assembly, names, pairs)}</section>
<section class="pairs" aria-label="Pairs">{table}</section>
{_placed(assembly, names)}
</main>
{foot(in_3d=bool(assembly.components))}"""


def _models(assembly: Assembly) -> str:
    """The viewer of the components; of none, nothing."""
    if not assembly.components:
        return ""
    tints = {"scan": "scan", "height": "height", "plain": "nothing"}
    return model_viewer("The model in 3D", tints, {}, min(len(assembly.components), _SHOWN))


def _graphs(assembly: Assembly, names: Sequence[str], pairs: Sequence[Pair]) -> str:
    edges = [
        Edge(i, j, row, _kind(result, believed), f"{names[j]} onto {names[i]}")
        for row, (i, j, result, believed) in enumerate(pairs)
    ]
    drawn = [
        f"<figure><h3>Component {number}: {len(members)} scans</h3>{scan_graph(model, members, names, edges)}"
        "<figcaption>From above. A line is a pair that was accepted: green with evidence to spare, ochre with little, "
        "dashed where the others contradict it. A click on a line shows the pair.</figcaption></figure>"
        for number, (members, model) in enumerate(
            zip(assembly.components[:_SHOWN], assembly.models, strict=False), 1
        )
    ]
    return "".join(drawn)


def _kind(result: PairResult, believed: bool) -> str:
    if not believed:
        return "doubted"
    return "strong" if strength(result) >= _STRONG else "weak"


def _left_out(assembly: Assembly, names: Sequence[str]) -> str:
    if not assembly.left_out:
        return ""
    items = "".join(f"<li><b>{escape(names[k])}</b>: {escape(why)}</li>" for k, why in assembly.left_out.items())
    return f'<section class="left-out"><h3>Left out</h3><ul>{items}</ul></section>'


def _placed(assembly: Assembly, names: Sequence[str]) -> str:
    """How well each scan is placed: root of the trace of each half of its covariance."""
    rows = []
    for number, members in enumerate(assembly.components, 1):
        for k in members:
            variance = np.diagonal(np.asarray(assembly.covariances[k]))
            turn, shift = np.degrees(np.sqrt(variance[:3].sum())), np.sqrt(variance[3:].sum())
            rows.append(
                f"<tr><th scope=row>{k + 1}</th><td>{escape(names[k])}</td><td>{number}</td><td>{shift:.2g}</td>"
                f"<td>{turn:.2g}°</td></tr>"
            )
    return f"""<figure class="placed"><h3>How well each scan is placed</h3><div class="scroll"><table class="plain">
<thead><tr><th scope=col>number</th><th scope=col>scan</th><th scope=col>component</th><th scope=col>place</th>
<th scope=col>turn</th></tr></thead><tbody>{"".join(rows)}</tbody></table></div>
<figcaption>Standard deviations, relative to the first scan of the component, or to the poses that were given; lengths
in the scans’ unit.</figcaption></figure>"""
