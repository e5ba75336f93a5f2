"""Tasks on a Dask cluster, of this machine or of many; its workers may die and its scheduler may be lost."""

from __future__ import annotations

import logging
import pickle
import secrets
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from time import monotonic
from typing import Any

from ..arguments import as_count
from ..errors import ArgumentError, RunError, missing_extra
from ..threads import resolve_threads
from .work import HERE, Done, Function, Items, Line, Results, Task, perform_away, sentence_of, unsendable

_AHEAD = 4         # tasks away per thread of the cluster
_LEAST = 16        # tasks away, before it has any
_ASKED = 5.0       # seconds after which the cluster is asked again how large it is
_PATIENCE = 10     # seconds to wait for a scheduler
_HERE = "127.0.0.1"
_DATA = 64 * 1024  # bytes: what pickles to more is data, and no mere path


class Dask:
    """Tasks on the workers of a Dask scheduler at an address ("tcp://10.0.0.1:8786"), or of a cluster of this machine
    ("local", with so many workers; by default one per core).

    Items that are paths travel with each task and are read on the worker: all must see the same files. Items that are
    data are scattered: Dask brings each once to a worker that needs it, so that no file system need be shared; where
    the worker that held one has died, it is scattered again from here.
    """

    def __init__(self, address: str = "local", workers: int | None = None) -> None:
        if address != "local" and workers is not None:
            raise ArgumentError(f"workers belong to a local cluster, but the address is {address!r}")
        cores = resolve_threads(None)
        self.address = address
        self.workers = cores if workers is None else as_count(workers, "workers", 1)
        # Elsewhere a worker has a thread per core, as a rule, and each does a task of its own.
        self.threads = max(1, cores // self.workers) if address == "local" else 1

    def run(self, function: Function, tasks: Iterable[Task], items: Items) -> Results:
        """See Executor.run; a scheduler that is lost in between is a RunError."""
        with self._client() as client:
            run = secrets.token_hex(8)
            try:
                yield from _Run(client, self.address, run, function, items).results(tasks)
            finally:
                with suppress(Exception):  # whoever is gone keeps nothing
                    client.run(_forget, run)

    @contextmanager
    def _client(self) -> Iterator[Any]:
        """A client, and a cluster of this machine where that is asked for; both end with the block."""
        try:
            from distributed import Client, LocalCluster
        except ImportError as error:
            raise missing_extra("dask", "work on a Dask cluster") from error
        if self.address != "local":
            with _connected(Client, self.address) as client:
                yield client
            return
        with (
            # A death is judged here (work.Line), where a suspect goes again alone.
            # Whoever reaches a scheduler may run code on its workers: nothing of it listens to other machines.
            LocalCluster(n_workers=self.workers, threads_per_worker=1, host=_HERE, dashboard_address=f"{_HERE}:0",
                         worker_dashboard_address=f"{_HERE}:0", silence_logs=logging.CRITICAL,
                         scheduler_kwargs={"allowed_failures": 0}) as cluster,
            Client(cluster, set_as_default=False) as client,
        ):
            yield client


def _connected(make_client: Any, address: str) -> Any:
    try:
        return make_client(address, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        raise RunError(f"no Dask scheduler answers at {address}: {sentence_of(error)}") from error


class _Run:
    """One run on a cluster. name: sets its items apart from those of other runs on the same workers."""

    def __init__(self, client: Any, address: str, name: str, function: Function, items: Items) -> None:
        self._client, self._address, self._name, self._function = client, address, name, function
        self._items = items
        self._sent: dict[str, Any] = {}  # what stands for an item in a task: its maker, or the future of scattered data
        self._asked = -_ASKED

    def results(self, tasks: Iterable[Task]) -> Results:
        from distributed import as_completed

        finished, line = as_completed(loop=self._client.loop), Line(tasks, _LEAST)
        while True:
            line.room = self._room(line.room)
            for task in line.ready():
                future = self._send(task)
                line.away[future] = task
                finished.add(future)
            if not line.away:
                return
            yield from self._outcomes(finished.next_batch(), line)

    def _room(self, known: int) -> int:
        """How many tasks may be away; a cluster may grow."""
        if monotonic() - self._asked < _ASKED:
            return known
        self._asked = monotonic()
        return max(_LEAST, _AHEAD * sum(map(int, self._client.nthreads().values())))

    def _send(self, task: Task) -> Any:
        makers = {name: self._maker(name) for name in task.needs}
        return self._client.submit(_perform, self._function, task, makers, self._name, pure=False)

    def _maker(self, name: str) -> Any:
        """What a task carries for an item."""
        known = self._sent.get(name)
        if known is None or getattr(known, "status", "finished") in ("cancelled", "lost", "error"):
            known = self._sent[name] = self._shipped(name)
        return known

    def _shipped(self, name: str) -> Any:
        make = self._items[name]
        try:
            size = len(pickle.dumps(make, pickle.HIGHEST_PROTOCOL))
        except Exception as error:  # pickling raises anything
            raise unsendable(name, error) from error
        if size <= _DATA:
            return make
        try:
            return self._client.scatter(make, hash=False)
        except (OSError, TimeoutError) as error:
            raise RunError(f"the Dask cluster at {self._address} takes no data: {sentence_of(error)}") from error

    def _outcomes(self, futures: list[Any], line: Line) -> Iterator[Done]:
        """What came of tasks that are over, fetched in one go: one by one it would take 5 ms each, not 2."""
        finished = [future for future in futures if future.status == "finished"]
        try:
            values = dict(zip(finished, self._client.gather(finished), strict=True))
        except Exception:  # one was lost in between; each tells for itself
            values = {}
        for future in futures:
            yield from self._outcome(future, values, line)

    def _outcome(self, future: Any, values: dict[Any, bytes], line: Line) -> Iterator[Done]:
        """What came of a task that is over; where its worker or its data was lost, it may go again."""
        from distributed import KilledWorker

        try:
            done: Done = pickle.loads(values[future] if future in values else future.result())
            line.back(future)
            yield done
        except KilledWorker as error:
            yield from line.died(future, error.allowed_failures + 1)
        except Exception as error:
            if future.status == "error":  # the task could not be sent
                yield Done(line.back(future).key, error=sentence_of(error))
            else:
                self._check_scheduler(error)
                yield from line.died(future)

    def _check_scheduler(self, error: Exception) -> None:
        if getattr(error, "reason", None) == "scheduler-connection-lost" or self._client.status != "running":
            raise RunError(f"the Dask scheduler at {self._address} is lost: what is recorded stays") from error


# --------------------------------------------------------------------------------------------------- inside of a worker


def _perform(function: Function, task: Task, makers: Items, run: str) -> bytes:
    return perform_away(function, task, lambda name: HERE.get((run, name), makers[name]))


def _forget(run: str) -> None:
    HERE.drop(lambda name: name[0] == run)
