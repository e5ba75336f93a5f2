"""Where the work on many pairs runs, as commands are told; and the bar that shows how far it is."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import click

from ..assembly.executor import AnyExecutor, Dask, Processes


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
    if dask is not None:
        return Dask(dask, workers)
    return None if workers in (None, 1) else Processes(workers)


@contextmanager
def bar() -> Iterator[Callable[[str, int, int | None], None]]:
    """A bar on stderr with the time that is left, for stages of work: tell(stage, finished, of), where None is a number
    that nobody knows. Nothing where no person looks."""
    shown: Any = None

    def tell(stage: str, finished: int, of: int | None) -> None:
        nonlocal shown
        if finished == 0:
            if shown is not None:
                shown.render_finish()
            shown = click.progressbar(
                (None for _ in ()), length=of, label=stage, file=sys.stderr, hidden=not sys.stderr.isatty(),
                show_pos=True,
            )
            shown.render_progress()
        shown.update(finished - shown.pos)

    try:
        yield tell
    finally:
        if shown is not None:
            shown.render_finish()
