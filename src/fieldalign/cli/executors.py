"""Where the work on many pairs runs, as commands are told."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from ..assembly.executor import AnyExecutor


def executor_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """The options of a command that works on many pairs: run_folder, workers, dask, seed."""
    for option in (
        click.option("--seed", type=int, default=0, show_default=True, help="Seed of every random draw."),
        click.option("--dask", metavar="ADDRESS",
                     help="Run on the Dask scheduler at tcp://..., or on a cluster here: local."),
        click.option("--workers", type=click.IntRange(min=1),
                     help="How many processes; with --dask local, how many workers."),
        click.option("--run", "run_folder", type=click.Path(file_okay=False),
                     help="Record each result in this folder at once; call it again to go on after an interruption."),
    ):
        command = option(command)
    return command


def chosen_executor(workers: int | None, dask: str | None) -> AnyExecutor:
    """The executor that the options name; this process where they name none."""
    from ..assembly.executor import Dask, Processes

    if dask is not None:
        return Dask(dask, workers)
    return None if workers in (None, 1) else Processes(workers)
