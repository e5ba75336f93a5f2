"""The report of an experiment: the methods side by side, and every registration, the worst first, with its picture."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ArgumentError
from ..fields.protocol import Floats
from ..prepare import prepare_pair
from ..prepared import PreparedCloud
from ..threads import resolve_threads
from .page import Page, checked_page_path, facts, foot, head, write_page
from .pair_table import Progress, Row, header, number_cell, table_beside_view, table_data, table_scripts, worst
from .scene import scene_of, viewer_data

if TYPE_CHECKING:
    from ..experiments.case import Case
    from ..experiments.results import Results

_PICTURES = 120  # of the worst; their clouds are made again
_KEPT = 8        # pairs of clouds that wait for the next method's picture
_COLUMNS = ("off by", "rotation", "translation", "ms")
_MEASURES = ("cases", "right", "no pose", "accepted", "of these wrong", "rotation", "translation", "CPU ms")
_TRUSTED, _NO_POSE, _WRONG, _RIGHT = range(4)
_WORDS = {_TRUSTED: "wrong, yet accepted", _NO_POSE: "no pose", _WRONG: "wrong", _RIGHT: "right"}


@dataclass(frozen=True, eq=False)
class _Trial:
    """One case by one method. row: what came of it. off: how many times as far from the truth as is allowed, modulo the
    shape's symmetries where it may have some; infinite without a pose."""

    results: Results
    case: Case
    method: str
    row: dict[str, Any]
    off: float

    @property
    def kind(self) -> int:
        """The worst first: trusted though it is wrong."""
        if "error" in self.row:
            return _NO_POSE
        if self.off <= 1:
            return _RIGHT
        return _TRUSTED if self.row.get("accepted") else _WRONG


def write_experiment_report(
    results: Sequence[Results],
    path: str | os.PathLike[str],
    title: str | None = None,
    progress: Progress | None = None,
) -> Path:
    """Writes what came of an experiment as one HTML page; returns the path.

    A table of the methods for each part, and one of all registrations, wrong ones that the method itself accepts first,
    then those without a pose, then by how far they are off; the worst 120 in 3D a click away, before, after and at the
    truth. Their clouds are made again from their cases.

    results: of each part, as `fieldalign.experiments.Report` has them. path: ends in .html; it is replaced whole or not
        at all. title: one line. progress: called with how many pictures are made, of how many.

    Raises ArgumentError for a path that cannot be written, and where there is no registration.
    """
    path = checked_page_path(path)
    trials = [trial for part in results for trial in _trials(part)]
    if not trials:
        raise ArgumentError("results must hold registrations to report, but hold none")
    trials.sort(key=lambda trial: (trial.kind, -trial.off, trial.case.name, trial.method))
    several = len(results) > 1
    clouds = lru_cache(_KEPT)(_prepared)
    rows, which = worst([_row(trial, several, partial(_picture, trial, clouds)) for trial in trials])
    data = table_data(rows, progress, _PICTURES)
    name = title or results[0].head["title"]
    words = ("method", "group", *(["part"] if several else []))
    body = f"""{head(name, "experiment report", "results")}
<main class="wide" id="results">
{facts(_figures(trials))}
<section class="columns" aria-label="Methods">{"".join(map(_methods, results))}</section>
{table_beside_view(rows, _COLUMNS, data, words, _above(trials, which))}
</main>
{foot(in_3d=bool(data["scenes"]))}"""
    return write_page(Page(name, body, table_scripts(data), data), path)


def _trials(results: Results) -> list[_Trial]:
    degrees, length = results.success
    found = []
    for (case, method), row in results.rows.items():
        kinds = ("rre_modulo_deg", "rte_modulo") if "rre_modulo_deg" in row else ("rre_deg", "rte")
        turn, shift = (row.get(kind, np.inf) for kind in kinds)
        found.append((case, method, dict(row), max(turn / degrees, shift / length)))
    cases = {case.name: case for case in results.cases}
    return [_Trial(results, cases[case], *rest) for case, *rest in found]


def _row(trial: _Trial, several: bool, picture: partial[dict[str, Any]]) -> Row:
    row, kind = trial.row, trial.kind
    numbers = None if "error" in row else (
        (trial.off, f"{trial.off:.2g}×"), (row["rre_deg"], f"{row['rre_deg']:.2g}°"),
        (row["rte"], f"{row['rte']:.2g}"), (1e3 * row["seconds"], f"{1e3 * row['seconds']:.0f}"),
    )
    part = [trial.results.head["title"]] if several else []
    return Row(
        trial.case.name, _WORDS[kind], _said(trial), kind == _RIGHT, numbers or [None] * len(_COLUMNS),
        (trial.results.titles[trial.method], trial.case.group, *part), None if "error" in row else _pose(row), picture,
    )


def _said(trial: _Trial) -> str:
    """How far off it is, and what the method says of itself, in sentences."""
    row, (degrees, length) = trial.row, trial.results.success
    if "error" in row:
        return f"No pose: {row['error']}. The picture shows the truth."
    said = f"{row['rre_deg']:.3g}° and {row['rte']:.3g} from the truth; {degrees:g}° and {length:g} are allowed."
    if "rre_modulo_deg" in row:
        said += f" Modulo symmetries, as it counts: {row['rre_modulo_deg']:.3g}° and {row['rte_modulo']:.3g}."
    verdict = {None: "", True: " The method accepts it.", False: " The method does not accept it."}
    return said + verdict[row.get("accepted")]


def _picture(trial: _Trial, clouds: Any, most: int) -> dict[str, Any]:
    """Both clouds before and after the pose that was found, and at the truth."""
    truth = trial.case.T_target_source
    source, target = clouds(trial.case)
    if "error" in trial.row:
        return viewer_data(scene_of(truth, source, target, most), name="the truth")
    return viewer_data(scene_of(_pose(trial.row), source, target, most), {"the truth": truth}, "as found")


def _prepared(case: Case) -> tuple[PreparedCloud, PreparedCloud]:
    return prepare_pair(*case.clouds(), resolve_threads(None), True)


def _pose(row: dict[str, Any]) -> Floats:
    return np.vstack([np.reshape(row["T"], (3, 4)), [0.0, 0.0, 0.0, 1.0]])


def _figures(trials: Sequence[_Trial]) -> dict[str, str]:
    counts = Counter(trial.kind for trial in trials)
    methods = {trial.method for trial in trials}
    return {"registrations": str(len(trials)), "methods": str(len(methods))} | {
        word: str(counts[kind]) for kind, word in _WORDS.items() if counts[kind] or kind == _RIGHT
    }


def _methods(results: Results) -> str:
    """The measures of each method as a table that sorts, and what was done."""
    degrees, length = results.success
    names = header("method", "") + "".join(header(name, "number") for name in _MEASURES)
    rows = "".join(map(partial(_method, results), results.titles))
    protocol = "".join(f"<li>{escape(sentence)}</li>" for sentence in results.head.get("protocol", ()))
    return f"""<figure class="part"><h3>{escape(results.head["title"])}</h3>
<div class="scroll"><table class="sortable"><thead><tr>{names}</tr></thead><tbody>{rows}</tbody></table></div>
<figcaption>Right is within {degrees:g}° and {length:g} of the truth{_modulo(results)}; medians of the errors and of the
time. <details><summary>What was done</summary><ul>{protocol}</ul></details></figcaption></figure>"""


def _modulo(results: Results) -> str:
    return ", modulo the shape’s symmetries" if results.modulo else ""


def _method(results: Results, method: str) -> str:
    """A row: how many are right, what it says of itself, how far it is off, and what it takes."""
    rows = [row for _, row in results.column(method)]
    right = int(results.successes(method, modulo=results.modulo).sum())
    given = [row for row in rows if "error" not in row]
    accepted = [row for row in given if row.get("accepted") is not None]
    trusted = results.summary(method) if accepted else {}
    median = {key: float(np.median([row[key] for row in given])) for key in ("rre_deg", "rte", "cpu_seconds") if given}
    cells = [
        (len(rows), str(len(rows))), (right / len(rows), f"{right / len(rows):.1%}"),
        (len(rows) - len(given), str(len(rows) - len(given))),
        *((trusted[key], str(trusted[key])) if trusted else None for key in ("accepted", "accepted_wrong")),
        (median["rre_deg"], f"{median['rre_deg']:.2g}°") if given else None,
        (median["rte"], f"{median['rte']:.2g}") if given else None,
        (1e3 * median["cpu_seconds"], f"{1e3 * median['cpu_seconds']:.0f}") if given else None,
    ]
    title = escape(results.titles[method])
    return f'<tr><th scope="row" data-value="{title}">{title}</th>{"".join(map(number_cell, cells))}</tr>'


def _above(trials: Sequence[_Trial], which: str) -> str:
    """Above the table: which method to show, and which rows there are."""
    titles = dict.fromkeys(trial.results.titles[trial.method] for trial in trials)
    options = "".join(f"<option>{escape(title)}</option>" for title in titles)
    return f"""<p class="choice"><label>Show <select id="only"><option value="">all methods</option>{options}</select>
</label> <span>The worst first; off by: times what is allowed. {which}</span></p>"""
