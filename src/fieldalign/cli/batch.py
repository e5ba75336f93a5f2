"""fieldalign batch PAIRS.CSV: the motions of many pairs."""

from __future__ import annotations

import csv
import io
import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

import fieldalign as fa

from ..errors import ArgumentError
from .executors import chosen_executor, executor_options
from .files import check_folder, check_report, write_text
from .poses import read_pose
from .progress import Tell, bar

if TYPE_CHECKING:
    from ..motions import Matrix

_SHOWN = 10  # failures that are told
_POSE = [f"T{row}{column}" for row in range(4) for column in range(4)]
_COLUMNS = ["source", "target", "accepted", "reason", *_POSE, "overlap", "overlap_target", "rmse", "seconds", "error"]


class Row(NamedTuple):
    """A row of the list: both paths as they stand there, and the guess."""

    source: str
    target: str
    init: Matrix | None


@click.command("batch")
@click.argument("pairs", type=click.Path(exists=True, dir_okay=False), metavar="PAIRS.CSV")
@click.option("--output", type=click.Path(dir_okay=False), help="Write the results as CSV to this file.")
@click.option("--json", "json_path", type=click.Path(allow_dash=True), help="Write the results as JSON; - for stdout.")
@click.option("--report", type=click.Path(dir_okay=False),
              help="Write a page: a table that sorts, failures first, each pair in 3D a click away (.html).")
@executor_options
def command(
    pairs: str,
    output: str | None,
    json_path: str | None,
    report: str | None,
    run_folder: str | None,
    workers: int | None,
    dask: str | None,
    seed: int,
) -> int:
    """Find the motion of each pair that PAIRS.CSV names, from any pose.

    It has the columns source, target and, where there are guesses, init: a file with a pose or 16 numbers; others are
    passed over. Paths are relative to its folder. A pair that fails does not stop the rest.

    Exit status 0: all are accepted; 3: some are not.
    """
    rows = read_rows(Path(pairs))
    check_folder(output, json_path)
    check_report(report)
    folder = Path(pairs).parent
    given = [(str(folder / row.source), str(folder / row.target), row.init) for row in rows]
    with bar() as tell:
        results = fa.register_many(
            given, executor=chosen_executor(workers, dask), run_folder=run_folder, seed=seed,
            progress=lambda finished, of: tell("registering", finished, of),
        )
        if report is not None:
            _write_report(results, given, report, f"{Path(pairs).name}: {len(results)} pairs", tell)
    plain = json.dumps([result.to_dict() for result in results], indent=1)
    write_text(output, _csv(rows, results))
    write_text(json_path, plain)
    if json_path == "-":
        click.echo(plain)
    else:
        _print(results)
    return 0 if all(result.accepted for result in results) else 3


def _write_report(
    results: Sequence[fa.PairResult], pairs: Sequence[Sequence[Any]], path: str, title: str, tell: Tell
) -> None:
    from ..reports.page_batch import write_batch_report

    write_batch_report(results, pairs, path, title, lambda finished, of: tell("drawing", finished, of))


def read_rows(path: Path) -> list[Row]:
    """The rows of a list of pairs; raises ArgumentError that names the line for what is none."""
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file, skipinitialspace=True)
            absent = [name for name in ("source", "target") if name not in (reader.fieldnames or ())]
            if absent:
                raise ArgumentError(f"{path} must begin with a header that names source and target, but lacks {absent}")
            rows = [_row(row, path, reader.line_num) for row in reader]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ArgumentError(f"{path} cannot be read as CSV: {error}") from error
    if not rows:
        raise ArgumentError(f"{path} must hold pairs, but holds none")
    return rows


def _row(row: dict[str, Any], path: Path, line: int) -> Row:
    source, target, init = ((row.get(name) or "").strip() for name in ("source", "target", "init"))
    if not source or not target:
        raise ArgumentError(f"{path}, line {line}: source and target must be paths, but are {source!r} and {target!r}")
    beside = path.parent / init
    text = str(beside) if init and beside.is_file() else init
    return Row(source, target, read_pose(text, f"{path}, line {line}: init") if init else None)


def _csv(rows: Sequence[Row], results: Sequence[fa.PairResult]) -> str:
    file = io.StringIO()
    writer = csv.writer(file)
    writer.writerow(_COLUMNS)
    for row, result in zip(rows, results, strict=True):
        writer.writerow([row.source, row.target, str(result.accepted).lower(), result.reason.value,
                         *_numbers(result), result.error or ""])
    return file.getvalue()


def _numbers(result: fa.PairResult) -> list[str]:
    """The pose, row by row, the shares, rmse and seconds, so that the same bits are read; blank where it failed."""
    if result.error is not None:
        return [""] * (len(_POSE) + 4)
    values = [*result.T_target_source.ravel().tolist(), result.overlap, result.overlap_target, result.rmse]
    return [repr(value) for value in values] + [f"{sum(result.seconds.values()):.4f}"]


def _print(results: Sequence[fa.PairResult]) -> None:
    """How many there are of each reason, and what failed."""
    counts = Counter(result.reason for result in results)
    for reason in fa.Reason:
        if counts[reason]:
            click.echo(f"{reason.value:<20}{counts[reason]:>8}{counts[reason] / len(results):>7.0%}")
    click.echo(f"{'pairs':<20}{len(results):>8}")
    failures = [result for result in results if result.error is not None]
    for result in failures[:_SHOWN]:
        click.echo(f"failed: {result.source} -> {result.target}: {result.error}")
    if len(failures) > _SHOWN:
        click.echo(f"... and {len(failures) - _SHOWN} more")
