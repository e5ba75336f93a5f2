"""Progress on a terminal: a bar over the stages of a command."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import click


@contextmanager
def stages(*names: str) -> Iterator[Callable[[], None]]:
    """A bar on stderr over the named stages; call what it gives at the start of each. Nothing where no person looks."""
    waiting = iter(names)
    with click.progressbar(
        length=len(names), file=sys.stderr, hidden=not sys.stderr.isatty(), item_show_func=lambda name: name
    ) as bar:
        started = False

        def begin() -> None:
            nonlocal started
            bar.update(int(started), next(waiting))
            started = True

        yield begin
