"""Where work is measured: in one process, with nothing beside it, and with the threads that it is told."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from ..assembly.executor import Function, Items, Processes, Task
from ..assembly.work import Results

_NAMES = "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"


@contextmanager
def telling(threads: int) -> Iterator[None]:
    """Processes that start in this block give so many threads to libraries that cannot be told otherwise."""
    before = {name: os.environ.get(name) for name in _NAMES}
    os.environ.update(dict.fromkeys(_NAMES, str(threads)))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


@dataclass(frozen=True)
class Alone:
    """An executor: one task after the other, in one process that does nothing else.

    threads: of each task. anew: a fresh process for each, so that its memory is this task's.
    """

    threads: int
    anew: bool = False

    def run(self, function: Function, tasks: Iterable[Task], items: Items) -> Results:
        """See Executor.run."""
        for together in ([task] for task in tasks) if self.anew else [tasks]:
            yield from Processes(1).run(function, together, items)
