"""Pairs as rows of a table that sorts, each with its picture a click away: what pages of many scans share."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from html import escape
from typing import Any

import numpy as np

from ..assembly.pair_result import PairResult
from ..errors import FieldalignError
from ..fields.protocol import Floats
from ..prepare import prepare_named, prepare_pair
from ..threads import resolve_threads
from .pose_forms import pose_forms
from .scene import scene_of, viewer_data
from .viewer import PAIR_SCRIPTS, pair_viewer

Progress = Callable[[int, int], None]
Picture = Callable[[int], dict[str, Any]]

_ROWS = 4000           # of a table: 1 to 1.3 KB each
_PICTURES = 500        # at most, those of the first rows
_ROOM = 400_000        # points of all pictures together: 6 MB
_FEWEST, _MOST = 400, 20_000  # points of a cloud in a picture
_KEPT = 16             # clouds that wait for the next pair


@dataclass(frozen=True, eq=False)
class Row:
    """A pair in the table. name, verdict, said: plain text: which, a word, and sentences. good: whether it may be used.
    numbers: a value for each column of numbers, and how it is written; None where there is none. tags: plain text of
    each column of words. pose: (4, 4) or (3, 3), to be copied. picture: makes the scene of so many points of each
    cloud, in the viewer's form."""

    name: str
    verdict: str
    said: str
    good: bool
    numbers: Sequence[tuple[float, str] | None]
    tags: Sequence[str] = ()
    pose: Floats | None = None
    picture: Picture | None = None


def strength(result: PairResult) -> float:
    """How strong the evidence is; -1 of what failed."""
    if result.error is not None:
        return -1.0
    return result.evidence.strength if result.evidence else 0.0


class Shelf:
    """Clouds that wait for the next pair: a file is read once for successive pairs."""

    def __init__(self) -> None:
        self._clouds: dict[Any, Any] = {}

    def picture(self, result: PairResult, pair: Sequence[Any]) -> Picture | None:
        """The picture of a pair and the pose that was found; of what failed, none."""
        return None if result.error is not None else partial(self._scene, result.T_target_source, pair)

    def _scene(self, T: Floats, pair: Sequence[Any], most: int) -> dict[str, Any]:
        clouds = prepare_pair(self._ready(pair[0]), self._ready(pair[1]), resolve_threads(None), True)
        return viewer_data(scene_of(T, *clouds, most=most))

    def _ready(self, cloud: Any) -> Any:
        """A file's cloud; others as they are."""
        if not isinstance(cloud, str | os.PathLike):
            return cloud
        key = os.fspath(cloud)
        if key not in self._clouds:
            if len(self._clouds) == _KEPT:
                self._clouds.pop(next(iter(self._clouds)))
            self._clouds[key] = prepare_named(cloud, "cloud", None, True)
        return self._clouds[key]


def worst(rows: Sequence[Row]) -> tuple[Sequence[Row], str]:
    """The first rows, as many as a page may hold, and a sentence where these are not all."""
    return rows[:_ROWS], f"The first {_ROWS:,} of {len(rows):,}." if len(rows) > _ROWS else ""


def table_data(rows: Sequence[Row], progress: Progress | None, most: int | None = None) -> dict[str, Any]:
    """What the scripts need: a scene for each of the first rows, and what a click on each row shows. most: so many
    scenes at most; None: 500."""
    of = min(len(rows), _PICTURES if most is None else most)
    points = int(np.clip(_ROOM / (2 * max(of, 1)), _FEWEST, _MOST))
    scenes: list[dict[str, Any]] = []
    pairs = []
    for number, row in enumerate(rows):
        scene = None
        if number < of:
            if progress is not None:
                progress(number, of)
            scene = _made(row, points)
        pairs.append({
            "name": ", ".join([row.name, *row.tags[:1]]), "verdict": row.said,
            "scene": None if scene is None else len(scenes),
            "pose": "" if row.pose is None else pose_forms(row.pose)[0].text,
        })
        scenes += [] if scene is None else [scene]
    return {"scenes": scenes, "pairs": pairs}


def _made(row: Row, points: int) -> dict[str, Any] | None:
    """The picture of a row, None where there is none."""
    if row.picture is None:
        return None
    try:
        return row.picture(points)
    except (FieldalignError, OSError):  # the clouds are gone since then: the row stays
        return None


def table_scripts(data: dict[str, Any]) -> tuple[str, ...]:
    """The scripts of a page with a table: the viewer only where it has something to show."""
    return (*(PAIR_SCRIPTS if data["scenes"] else ()), "table.js", "page.js")


def table_beside_view(
    rows: Sequence[Row], columns: Sequence[str], data: dict[str, Any], words: Sequence[str] = (), above: str = ""
) -> str:
    """The table, and beside it the pair that is chosen. columns: the names of those of numbers; words: of those of
    words, the first of which stand before, the others behind; above: HTML that stands above the table."""
    viewer = pair_viewer() if data["scenes"] else ""
    names = "".join(header(name, "") for name in ("pair", "verdict", *words[:1]))
    names += "".join(header(name, "number") for name in columns) + "".join(header(name, "") for name in words[1:])
    body = "".join(_row(number, row) for number, row in enumerate(rows))
    return f"""<div class="beside">
<section aria-labelledby="list"><h3 id="list" class="unseen">All pairs</h3>
{above}
<div class="scroll"><table id="pairs" class="sortable"><thead><tr>{names}</tr></thead>
<tbody>{body}</tbody></table></div>
</section>
<section id="shown" aria-labelledby="chosen" aria-live="polite"><h2 id="chosen"></h2><p id="said"></p>
{viewer}
<div id="form0"><pre tabindex="0"></pre><p class="copying">
<button type="button" class="copy" data-of="form0">Copy</button> <span id="told" role="status"></span></p></div>
</section>
</div>"""


def header(name: str, kind: str) -> str:
    """The head of a column of a table that sorts; kind: "number" or nothing."""
    return f'<th scope="col" class="{kind}"><button type="button" class="sort">{escape(name)}</button></th>'


def number_cell(cell: tuple[float, str] | None) -> str:
    """A number of a table that sorts, as it counts and as it is written; None: there is none."""
    if cell is None:
        return '<td class="number" data-value="">–</td>'
    return f'<td class="number" data-value="{cell[0]!r}">{escape(cell[1])}</td>'


def _row(number: int, row: Row) -> str:
    words = [f'<td class="word" data-value="{escape(tag)}">{escape(tag)}</td>' for tag in row.tags]
    cells = "".join([*words[:1], *map(number_cell, row.numbers), *words[1:]])
    name, word, mark = escape(row.name), escape(row.verdict), "good" if row.good else "bad"
    return (
        f'<tr data-pair="{number}"><th scope="row" data-value="{name}">'
        f'<button type="button" class="pick" aria-pressed="false">{name}</button></th>'
        f'<td class="{mark}" data-value="{word}"><span class="mark">{word}</span></td>{cells}</tr>'
    )
