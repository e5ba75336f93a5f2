"""Pairs as rows of a table that sorts, each with its picture a click away: what pages of many scans share."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np

from ..assembly.pair_result import PairResult
from ..errors import FieldalignError
from ..prepare import prepare_named, prepare_pair
from ..threads import resolve_threads
from .page import part
from .pose_forms import pose_forms
from .scene import scene_of, viewer_data

Progress = Callable[[int, int], None]

_PICTURES = 500        # at most, those of the first rows
_ROOM = 400_000        # points of all pictures together: 6 MB
_FEWEST, _MOST = 400, 20_000  # points of a cloud in a picture
_KEPT = 16             # clouds that wait for the next pair
_VIEW = ("three.min.js", "viewer.js")


@dataclass(frozen=True, eq=False)
class Row:
    """A pair in the table. name, verdict, said: plain text: which, a word, and sentences. good: whether it may be used.
    numbers: a value for each column of numbers, and how it is written; None where there is none. pair: both clouds."""

    name: str
    result: PairResult
    verdict: str
    said: str
    good: bool
    numbers: Sequence[tuple[float, str] | None]
    pair: Sequence[Any]


def strength(result: PairResult) -> float:
    """How strong the evidence is; -1 of what failed."""
    if result.error is not None:
        return -1.0
    return result.evidence.strength if result.evidence else 0.0


def table_data(rows: Sequence[Row], progress: Progress | None) -> dict[str, Any]:
    """What the scripts need: a scene for each of the first rows, and what a click on each row shows."""
    pictures, pairs = _Pictures(len(rows), progress), []
    for row in rows:
        pose = "" if row.result.error is not None else pose_forms(row.result.T_target_source)[0].text
        pairs.append({"name": row.name, "verdict": row.said, "pose": pose, "scene": pictures.add(row)})
    return {"scenes": pictures.made, "pairs": pairs}


def table_scripts(data: dict[str, Any]) -> tuple[str, ...]:
    """The scripts of a page with a table: the viewer only where it has something to show."""
    return (*(_VIEW if data["scenes"] else ()), "table.js", "page.js")


def table_beside_view(rows: Sequence[Row], columns: Sequence[str], data: dict[str, Any]) -> str:
    """The table, and beside it the pair that is chosen. columns: the names of those of numbers."""
    viewer = part("viewer.html") if data["scenes"] else ""
    names = "".join(_header(name, "") for name in ("pair", "verdict"))
    names += "".join(_header(name, "number") for name in columns)
    body = "".join(_row(number, row) for number, row in enumerate(rows))
    return f"""<div class="beside">
<section aria-labelledby="list"><h3 id="list" class="unseen">All pairs</h3>
<div class="scroll"><table id="pairs"><thead><tr>{names}</tr></thead><tbody>{body}</tbody></table></div></section>
<section id="shown" aria-labelledby="chosen" aria-live="polite"><h2 id="chosen"></h2><p id="said"></p>
{viewer}
<div id="form0"><pre tabindex="0"></pre><p class="copying">
<button type="button" class="copy" data-of="form0">Copy</button> <span id="told" role="status"></span></p></div>
</section>
</div>"""


def _header(name: str, kind: str) -> str:
    return f'<th scope="col" class="{kind}"><button type="button" class="sort">{escape(name)}</button></th>'


def _row(number: int, row: Row) -> str:
    cells = "".join(
        '<td class="number" data-value="">–</td>' if cell is None
        else f'<td class="number" data-value="{cell[0]!r}">{escape(cell[1])}</td>'
        for cell in row.numbers
    )
    name, word, mark = escape(row.name), escape(row.verdict), "good" if row.good else "bad"
    return (
        f'<tr data-pair="{number}"><th scope="row" data-value="{name}">'
        f'<button type="button" class="pick" aria-pressed="false">{name}</button></th>'
        f'<td class="{mark}" data-value="{word}"><span class="mark">{word}</span></td>{cells}</tr>'
    )


class _Pictures:
    """The scenes of the page, one after the other. made: in the viewer's form."""

    def __init__(self, pairs: int, progress: Progress | None) -> None:
        self.made: list[dict[str, Any]] = []
        self._of, self._asked = min(pairs, _PICTURES), 0
        self._points = int(np.clip(_ROOM / (2 * max(self._of, 1)), _FEWEST, _MOST))
        self._progress = progress
        self._clouds: dict[Any, Any] = {}

    def add(self, row: Row) -> int | None:
        """Makes the picture of a pair; its number, or None where there is none."""
        if self._asked == self._of:
            return None
        if self._progress is not None:
            self._progress(self._asked, self._of)
        self._asked += 1
        if row.result.error is not None:
            return None
        try:
            clouds = prepare_pair(self._ready(row.pair[0]), self._ready(row.pair[1]), resolve_threads(None), True)
            scene = scene_of(row.result, *clouds, most=self._points, with_pseudo=False)
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
