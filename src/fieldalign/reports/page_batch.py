"""The report of many pairs: a table that sorts, what failed first, and each pair's picture a click away."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..assembly.pair_result import PairResult
from ..errors import ArgumentError
from ..verdict import Reason
from .page import Page, checked_page_path, facts, foot, head, write_page
from .pair_table import Progress, Row, Shelf, strength, table_beside_view, table_data, table_scripts, worst

_COLUMNS = ("evidence", "overlap", "residual", "ms")


def write_batch_report(
    results: Sequence[PairResult],
    pairs: Sequence[Sequence[Any]],
    path: str | os.PathLike[str],
    title: str | None = None,
    progress: Progress | None = None,
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
    order = sorted(range(len(results)), key=lambda k: (results[k].accepted, strength(results[k])))
    shelf = Shelf()
    rows, which = worst([_row(results[k], pairs[k], shelf) for k in order])
    data = table_data(rows, progress)
    name = title or f"{len(results)} pairs"
    counts = Counter(result.reason for result in results)
    body = f"""{head(name, "batch report", "pairs")}
<main class="wide">
{facts({_word(reason): str(counts[reason]) for reason in Reason if counts[reason]})}
{table_beside_view(rows, _COLUMNS, data, above=which)}
</main>
{foot()}"""
    return write_page(Page(name, body, table_scripts(data), data), path)


def _row(result: PairResult, pair: Sequence[Any], shelf: Shelf) -> Row:
    time = 1e3 * sum(result.seconds.values())
    overlap = max(result.overlap, result.overlap_target)
    numbers = (
        (strength(result), f"{strength(result):.2g}×"), (overlap, f"{overlap:.0%}"),
        (result.rmse, f"{result.rmse:.2g}"), (time, f"{time:.0f}"),
    )
    failed = result.error is not None
    return Row(
        f"{result.source} onto {result.target}", _word(result.reason), result.verdict, result.accepted,
        [None] * len(numbers) if failed else numbers, pose=None if failed else result.T_target_source,
        picture=shelf.picture(result, pair),
    )


def _word(reason: Reason) -> str:
    return reason.value.replace("_", " ")
