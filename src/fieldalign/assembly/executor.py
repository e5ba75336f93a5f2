"""Where work on many items runs: in this process, in several, or on a cluster; the answers are the same bits."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol, TypeAlias, runtime_checkable

from ..arguments import as_count
from ..errors import ArgumentError
from ..threads import resolve_threads
from .on_dask import Dask
from .processes import Processes
from .work import Done, Function, Items, Load, Results, Shelf, Task, perform

__all__ = ["AnyExecutor", "Dask", "Done", "Executor", "Function", "Items", "Load", "Processes", "Serial", "Task",
           "as_executor"]


@runtime_checkable
class Executor(Protocol):
    """Something that does tasks."""

    @property
    def threads(self) -> int:
        """How many threads a task should use, so that the machine is busy but not crowded."""
        ...

    def run(self, function: Function, tasks: Iterable[Task], items: Items) -> Results:
        """Does all tasks and yields what came of each as it is done, in any order; tasks are drawn as there is room.

        function: function(task.data, load), importable by name in another process (or a functools.partial of such a
            one); load(name) gives an item that the task needs.
        items: how each item is made, by name: callables that pickle. A process makes an item once and keeps the 64 that
            were used last.

        What a task raises, and a worker that dies three times at it, is that task's `error`. Close what this gives
        (contextlib.closing) and the workers end, whatever they were at.

        Raises RunError where workers cannot be had or are lost for good, and ArgumentError for items that do not
        pickle where they must.
        """
        ...


AnyExecutor: TypeAlias = Executor | int | str | None


class Serial:
    """All tasks in this process, one after the other, each on all cores (or so many threads)."""

    def __init__(self, threads: int | None = None) -> None:
        self.threads = resolve_threads(threads)

    def run(self, function: Function, tasks: Iterable[Task], items: Items) -> Results:
        """See Executor.run; items need not pickle."""
        shelf = Shelf()
        for task in tasks:
            yield perform(function, task, lambda name: shelf.get(name, items[name]))


def as_executor(executor: AnyExecutor) -> Executor:
    """None: this process. A number: so many processes. "local" or an address: Dask. Or an Executor itself.

    Raises ArgumentError for anything else.
    """
    if executor is None:
        return Serial()
    if isinstance(executor, str):
        return Dask(executor)
    if isinstance(executor, Executor):
        return executor
    if isinstance(executor, int) and not isinstance(executor, bool):
        return Processes(as_count(executor, "executor", 1))
    raise ArgumentError(
        "executor must be None, a number of processes, 'local', the address of a Dask scheduler, or an Executor, "
        f"but is {executor!r}"
    )
