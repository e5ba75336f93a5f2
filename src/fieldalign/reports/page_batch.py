"""The report of many pairs: a table that sorts, what failed first, and each pair's picture a click away."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from ..assembly.pair_result import PairResult
from ..errors import ArgumentError, FieldalignError
from ..prepare import prepare_named, prepare_pair
from ..threads import resolve_threads
from ..verdict import Reason
from .page import Page, checked_page_path, foot, head, part, write_page
from .pose_forms import pose_forms
from .scene import scene_of, viewer_data

_PICTURES = 500        # at most, the weakest pairs'
_ROOM = 400_000        # points of all pictures together: 6 MB
_FEWEST, _MOST = 400, 20_000  # points of a cloud in a picture
_KEPT = 16             # clouds that wait for the next pair
_VIEW = ("three.min.js", "viewer.js")


def write_batch_report(
    results: Sequence[PairResult],
    pairs: Sequence[Sequence[Any]],
    path: str | os.PathLike[str],
    title: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Writes the results of many pairs as one HTML page; returns the path.

    A table that sorts by any column, what is not accepted first, the weakest evidence before the stronger; a row shows
    both clouds in 3D as in `write_report`, the verdict and the pose. Of more than 500 pairs the weakest have pictures.

    results: of `fa.register_many`. pairs: as they were handed in there, (source, target, ...) each; the clouds are read
        again for the pictures. path: ends in .html; it is replaced whole or not at all. title: one line.
    progress: called with how many pictures are made, of how many.

    Raises ArgumentError for a path that cannot be written, and where there are not as many pairs as results.
    """
    path = checked_page_path(path)
    if len(pairs) != len(results):
        raise ArgumentError(f"pairs must be as many as the {len(results)} results, but are {len(pairs)}")
    order = sorted(range(len(results)), key=lambda k: (results[k].accepted, _strength(results[k])))
    scenes, rows = _Pictures(len(results), progress), []
    for k in order:
        rows.append((results[k], scenes.add(results[k], pairs[k])))
    name = title or f"{len(results)} pairs"
    data = {"scenes": scenes.made, "pairs": [_told(result, scene) for result, scene in rows]}
    scripts = (*(_VIEW if scenes.made else ()), "table.js", "page.js")
    return write_page(Page(name, _body(name, [result for result, _ in rows], bool(scenes.made)), scripts, data), path)


def _strength(result: PairResult) -> float:
    """How strong the evidence is; -1 of what failed."""
    if result.error is not None:
        return -1.0
    return result.evidence.strength if result.evidence else 0.0


class _Pictures:
    """The scenes of the page, one after the other. made: in the viewer's form."""

    def __init__(self, pairs: int, progress: Callable[[int, int], None] | None) -> None:
        self.made: list[dict[str, Any]] = []
        self._of, self._asked = min(pairs, _PICTURES), 0
        self._points = int(np.clip(_ROOM / (2 * max(self._of, 1)), _FEWEST, _MOST))
        self._progress = progress
        self._clouds: dict[Any, Any] = {}

    def add(self, result: PairResult, pair: Sequence[Any]) -> int | None:
        """Makes the picture of a pair; its number, or None where there is none."""
        if self._asked == self._of:
            return None
        if self._progress is not None:
            self._progress(self._asked, self._of)
        self._asked += 1
        if result.error is not None:
            return None
        try:
            clouds = prepare_pair(self._ready(pair[0]), self._ready(pair[1]), resolve_threads(None), True)
            scene = scene_of(result, *clouds, most=self._points, with_pseudo=False)
        except (FieldalignError, OSError):  # gone since then: the row stays
            return None
        self.made.append(viewer_data(scene))
        return len(self.made) - 1

    def _ready(self, cloud: Any) -> Any:
        """A file's cloud, read once for successive pairs; others as they are."""
        if not isinstance(cloud, str | os.PathLike):
            return cloud
        key = os.fspath(cloud)
        if key not in self._clouds:
            if len(self._clouds) == _KEPT:
                self._clouds.pop(next(iter(self._clouds)))
            self._clouds[key] = prepare_named(cloud, "cloud", None, True)
        return self._clouds[key]


def _told(result: PairResult, scene: int | None) -> dict[str, Any]:
    """What a row's click shows."""
    pose = "" if result.error is not None else pose_forms(result.T_target_source)[0].text
    return {"name": _name(result), "verdict": result.verdict, "pose": pose, "scene": scene}


def _name(result: PairResult) -> str:
    return f"{result.source} onto {result.target}"


def _body(title: str, results: Sequence[PairResult], has_pictures: bool) -> str:
    rows = "".join(_row(k, result) for k, result in enumerate(results))
    viewer = part("viewer.html") if has_pictures else ""
    return f"""{head(title, "batch report", "pairs")}
<main class="wide">
{_counts(results)}
<div class="beside">
<section aria-labelledby="list"><h3 id="list" class="unseen">All pairs</h3>
<div class="scroll"><table id="pairs"><thead><tr>{_headers()}</tr></thead><tbody>{rows}</tbody></table></div></section>
<section id="shown" aria-labelledby="chosen" aria-live="polite"><h2 id="chosen"></h2><p id="said"></p>
{viewer}
<div id="form0"><pre tabindex="0"></pre><p class="copying">
<button type="button" class="copy" data-of="form0">Copy</button> <span id="told" role="status"></span></p></div>
</section>
</div>
</main>
{foot()}"""


def _counts(results: Sequence[PairResult]) -> str:
    """How many there are of each reason."""
    counts = Counter(result.reason for result in results)
    cells = "".join(
        f"<div><dt>{reason.value.replace('_', ' ')}</dt><dd>{counts[reason]}</dd></div>"
        for reason in Reason if counts[reason]
    )
    return f'<dl class="facts">{cells}</dl>'


def _headers() -> str:
    names = {"pair": "", "verdict": "", "evidence": "number", "overlap": "number", "residual": "number", "ms": "number"}
    return "".join(
        f'<th scope="col" class="{kind}"><button type="button" class="sort">{name}</button></th>'
        for name, kind in names.items()
    )


def _row(number: int, result: PairResult) -> str:
    mark = "good" if result.accepted else "bad"
    failed = result.error is not None
    numbers = (
        (_strength(result), "{:.2g}×"), (max(result.overlap, result.overlap_target), "{:.0%}"), (result.rmse, "{:.2g}"),
        (1e3 * sum(result.seconds.values()), "{:.0f}"),
    )
    cells = "".join(
        '<td class="number" data-value="">–</td>' if failed
        else f'<td class="number" data-value="{value!r}">{form.format(value)}</td>'
        for value, form in numbers
    )
    name = escape(_name(result))
    word = result.reason.value.replace("_", " ")
    return (
        f'<tr data-pair="{number}"><th scope="row" data-value="{name}">'
        f'<button type="button" class="pick" aria-pressed="false">{name}</button></th>'
        f'<td class="{mark}" data-value="{word}"><span class="mark">{word}</span></td>{cells}</tr>'
    )
