"""fieldalign experiment NAME: the paper's experiments, one command each."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..errors import ArgumentError
from .executors import chosen_executor, executor_options
from .files import check_report, made_folder
from .progress import bar

if TYPE_CHECKING:
    from ..experiments import Report

NAMES = (
    "modelnet40", "shapenet", "success-rate", "efficiency", "density", "noise", "distance-field", "pseudo-sets",
    "data-examples", "3dmatch", "kitti", "kitti-trajectory", "ablation",
)


@click.command("experiment")
@click.argument("name", type=click.Choice(NAMES))
@click.option("--data", required=True, type=click.Path(exists=True, file_okay=False),
              help="The folder of the data set, in its published layout.")
@click.option("--output", required=True, type=click.Path(file_okay=False), help="The folder of the results.")
@click.option("--peers", type=click.Path(exists=True, file_okay=False),
              help="Measure other people's methods, too: a folder of adapters, such as benchmarks/peers.")
@click.option("--columns", help="Measure these methods only, by name, with commas between them.")
@click.option("--pointnetlk-revisited", "pointnetlk", type=click.Path(exists=True, file_okay=False),
              help="A checkout of PointNetLK-Revisited with its weights, to be measured, too (with --peers).")
@click.option("--limit", type=click.IntRange(min=1),
              help="At most so many cases, spread evenly; by default all, of ../shared/data as many as take minutes.")
@click.option("--report", "page", type=click.Path(dir_okay=False),
              help="Write a page: the methods side by side, and every registration, the worst first and in 3D (.html).")
@executor_options
def command(
    name: str,
    data: str,
    output: str,
    peers: str | None,
    columns: str | None,
    pointnetlk: str | None,
    limit: int | None,
    page: str | None,
    run_folder: str | None,
    workers: int | None,
    dask: str | None,
    seed: int,
) -> int:
    """Run an experiment of the paper on its data set, as people have it on disk.

    Writes NAME.json (protocol, versions, seeds, every pair), NAME.md (the table, published figures beside) and NAME.png
    into the folder, which is made where it is not there; of several tables in one NAME.md, each has a .json of its own.
    Called again after an interruption it goes on from there.
    """
    from ..assembly.executor import as_executor
    from ..experiments import NAMES as PLACES
    from ..experiments import Request, run
    from ..threads import resolve_threads

    check_report(page)
    if page is not None and PLACES[name][0].startswith("pictures."):
        raise ArgumentError(f"--report shows registrations, but {name} is a picture: it has none")
    folder = made_folder(output)
    if pointnetlk is not None and peers is None:
        raise ArgumentError("--pointnetlk-revisited needs --peers FOLDER, which holds its adapter")
    checkouts = {} if pointnetlk is None else {"pointnetlk-revisited": Path(pointnetlk)}
    executor = as_executor(chosen_executor(workers or resolve_threads(None), dask))
    with bar() as tell:
        report = run(name, Request(
            Path(data), folder, executor, seed, limit, None if columns is None else tuple(columns.split(",")),
            None if peers is None else Path(peers), checkouts,
            Path(run_folder) if run_folder else None, tell,
        ))
        if page is not None:
            _write_page(report, page, lambda finished, of: tell("drawing", finished, of))
    click.echo(report.text)
    for file in [*report.files, *([page] if page is not None and (report.results or report.drives) else [])]:
        click.echo(f"wrote {file}")
    return 0


def _write_page(report: Report, path: str, progress: Callable[[int, int], None]) -> None:
    """Of registrations a table; of a drive the first method's trajectory beside the truth."""
    from ..reports import write_experiment_report, write_odometry_report

    if report.results:
        write_experiment_report(report.results, path, report.title, progress)
    for title, evaluation in list(report.drives.items())[:1]:
        write_odometry_report(evaluation.trajectory, path, evaluation=evaluation, title=f"{report.title}, {title}")
