"""Tasks in processes of this machine, which may die."""

from __future__ import annotations

import os
import pickle
from collections.abc import Generator, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory, gettempdir
from typing import TYPE_CHECKING, Any, NamedTuple

from ..arguments import as_count
from ..errors import RunError
from ..threads import resolve_threads
from .record import naming_errors
from .work import HERE, Done, Function, Items, Line, Results, Task, perform_away, sentence_of, unsendable

if TYPE_CHECKING:  # loaded where processes are made: import fieldalign stays light
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing.connection import Connection

_AHEAD = 2   # tasks away per process: one that it does, and one that waits for it
_GONE = 0.2  # seconds from the first that a death shows to its last


class Processes:
    """Tasks in so many processes, by default one per core; each is started afresh, so a script needs its
    `if __name__ == "__main__":`.

    Items lie in a temporary file, from which a process takes each that it needs once: none waits for one that it does
    not need, and what is in memory is not there once more per process.
    """

    def __init__(self, count: int | None = None) -> None:
        cores = resolve_threads(None)
        self.count = cores if count is None else as_count(count, "count", 1)
        self.threads = max(1, cores // self.count)

    def run(self, function: Function, tasks: Iterable[Task], items: Items) -> Results:
        """See Executor.run."""
        line = Line(tasks, _AHEAD * self.count)
        with _spooled(items) as spool:
            broken = True
            while broken:
                with _pool(self.count, spool) as pool:
                    broken = yield from _until_broken(pool, function, line)


def _until_broken(pool: ProcessPoolExecutor, function: Function, line: Line) -> Generator[Done, None, bool]:
    """Does tasks until none is left, or until a worker has died, which ends its pool; whether that was so."""
    from concurrent.futures import FIRST_COMPLETED, wait
    from concurrent.futures.process import BrokenProcessPool

    broken = False
    while True:
        if not broken:
            broken = not _send(pool, function, line)
        if not line.away:
            return broken
        for future in wait(line.away, return_when=FIRST_COMPLETED).done:
            error = future.exception()
            if isinstance(error, BrokenProcessPool):
                broken = True
                yield from line.died(future)
            elif error is not None:  # the task could not be sent
                yield Done(line.back(future).key, error=sentence_of(error))
            else:
                line.back(future)
                yield pickle.loads(future.result())


def _send(pool: ProcessPoolExecutor, function: Function, line: Line) -> bool:
    """Sends the tasks for which there is room; False where the pool was found broken."""
    from concurrent.futures.process import BrokenProcessPool

    for task in line.ready():
        try:
            line.away[pool.submit(_perform, function, task)] = task
        except BrokenProcessPool:
            line.put_back(task)
            return False
    return True


@contextmanager
def _pool(count: int, spool: _Spool) -> Iterator[ProcessPoolExecutor]:
    """Fresh processes; they end with the block, and at once where it is left by an exception or this process dies."""
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor

    fresh = multiprocessing.get_context("spawn")  # a fork would copy locks that threads hold
    watched, held = fresh.Pipe(duplex=False)
    pool = ProcessPoolExecutor(count, fresh, initializer=_begin, initargs=(watched, spool))
    try:
        _check_alive(pool)
        yield pool
    except BaseException:
        held.close()
        raise
    finally:
        pool.shutdown(cancel_futures=True)
        held.close()
        watched.close()


def _check_alive(pool: ProcessPoolExecutor) -> None:
    from concurrent.futures.process import BrokenProcessPool

    try:
        pool.submit(os.getpid).result()
    except BrokenProcessPool as error:
        raise RunError(
            "worker processes cannot start: a script that uses them must do so under `if __name__ == '__main__':`, "
            "and the system must have room for them"
        ) from error


class _Spool(NamedTuple):
    """A file of pickled makers of items, and where each begins."""

    path: Path
    places: dict[str, int]

    def make(self, name: str) -> Any:
        with open(self.path, "rb") as file:
            file.seek(self.places[name])
            return pickle.load(file)()


@contextmanager
def _spooled(items: Items) -> Iterator[_Spool]:
    with ExitStack() as opened:
        with naming_errors(Path(gettempdir(), "fieldalign")):
            folder = opened.enter_context(TemporaryDirectory(prefix="fieldalign-"))
            spool = _Spool(Path(folder, "items"), {})
            with open(spool.path, "wb") as file:
                for name, make in items.items():
                    spool.places[name] = file.tell()
                    _write(file, name, make)
        yield spool


def _write(file: Any, name: str, make: Any) -> None:
    try:
        pickle.dump(make, file, pickle.HIGHEST_PROTOCOL)
    except OSError:
        raise
    except Exception as error:  # pickling raises anything
        raise unsendable(name, error) from error


# ------------------------------------------------------------------------------------------------- inside of a process

_spool: _Spool | None = None


def _begin(watched: Connection, spool: _Spool) -> None:
    """Makes a new process ready: it ends with the pipe, and leaves Ctrl-C to the one that holds it."""
    import signal
    import threading

    global _spool
    _spool = spool
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(watched, spool), daemon=True).start()


def _end_with(watched: Connection, spool: _Spool) -> None:
    """Nothing is ever sent: the pipe is readable when its other end is closed, by the run or by death. The dead leave
    their temporary file, which may hold whole clouds."""
    from multiprocessing import parent_process
    from shutil import rmtree

    watched.poll(None)
    if (parent := parent_process()) is not None:
        parent.join(_GONE)
        if not parent.is_alive():
            rmtree(spool.path.parent, ignore_errors=True)
    os._exit(1)


def _perform(function: Function, task: Task) -> bytes:
    assert _spool is not None
    spool = _spool
    return perform_away(function, task, lambda name: HERE.get(name, lambda: spool.make(name)))
