"""The scans at work: thinned once and kept in files, and everything that is done with them, recorded as it is done."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack, closing
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from ..fields.protocol import Floats
from ..prepare import CloudLike
from .executor import Executor
from .identity import identity_of
from .record import RunRecord, naming_errors
from .scan import read_scan, thinned, write_scan
from .stages import fetch
from .work import Done, Function, Task

Progress: TypeAlias = Callable[[str, int, int], None]


def name_of(scan: int) -> str:
    """The name of a scan in tasks and files; names are in the order of the scans."""
    return f"{scan:06d}"


class Workshop:
    """Where the scans of an assembly lie, and the executor and the record of what is done with them.

    folder: of the run, which goes on where it ended; None: a temporary one. progress: called as progress(stage,
    finished, of). sensor_at_origin, keeps_height: see scan.py. Use `with`.
    """

    def __init__(
        self, clouds: Sequence[CloudLike], executor: Executor, folder: Any, settings: Mapping[str, Any],
        progress: Progress | None, threads: int, sensor_at_origin: bool = False, keeps_height: bool = False,
    ) -> None:
        self.clouds, self.executor, self.threads = clouds, executor, threads
        self._how = threads, sensor_at_origin, keeps_height
        self._progress = progress or (lambda stage, finished, of: None)
        with ExitStack() as opened:
            self._record = None
            if folder is None:
                with naming_errors(Path(tempfile.gettempdir(), "fieldalign")):
                    folder = opened.enter_context(tempfile.TemporaryDirectory(prefix="fieldalign-"))
            else:
                identities = {name_of(k): identity_of(cloud, f"clouds[{k}]") for k, cloud in enumerate(clouds)}
                self._record = opened.enter_context(RunRecord(folder, settings, identities))
            self._scans = Path(folder, "scans")
            with naming_errors(self._scans):
                self._scans.mkdir(exist_ok=True)
            self._opened = opened.pop_all()

    def __enter__(self) -> Workshop:
        return self

    def __exit__(self, *error: object) -> None:
        self._opened.__exit__(*error)  # type: ignore[arg-type]

    def thin(self) -> tuple[dict[int, tuple[float, float]], dict[int, Floats], Floats, dict[int, str]]:
        """Thins each scan into a file. Voxel and extent, and where it was taken from (3,), of each that can be read;
        the origins (n, 3) that they are seen from; and of the others why not."""
        missing = [k for k in range(len(self.clouds)) if not self.path(k).exists()]
        items = {}
        for k in missing:
            cloud, name = _absolute(self.clouds[k]), _called(self.clouds[k], k)
            items[name_of(k)] = partial(thinned, cloud, name, *self._how)
        broken = {}
        for done in self._watched("reading", fetch, [Task(name, (name,), name) for name in items], items):
            if done.error is None:
                with naming_errors(path := self.path(int(done.key))):
                    write_scan(path, done.value)
            else:
                broken[int(done.key)] = done.error
        lengths, places, origins = {}, {}, np.zeros((len(self.clouds), 3))
        for k in range(len(self.clouds)):
            if k not in broken:
                scan = read_scan(self.path(k))
                lengths[k], places[k], origins[k] = (scan.voxel, scan.extent), scan.place, scan.origin
        return lengths, places, origins, dict(sorted(broken.items()))

    def do(
        self, stage: str, function: Function, tasks: Iterable[Task], plain: Callable[[Any], Any] | None = None,
        back: Callable[[Any], Any] = lambda value: value,
    ) -> dict[str, Done]:
        """What comes of each task, by key. plain: makes a value ready for the record, and `back` undoes it; None: the
        work is quick, and not recorded."""
        tasks, found = list(tasks), {}
        if plain is not None and self._record is not None:
            known = self._record.done
            found = {t.key: Done(t.key, back(known[t.key])) for t in tasks if t.key in known}
        needed = {name for task in tasks for name in task.needs}
        items = {name: partial(read_scan, self.path(int(name))) for name in sorted(needed)}
        for done in self._watched(stage, function, [t for t in tasks if t.key not in found], items):
            found[done.key] = done
            if plain is not None and self._record is not None and done.error is None:
                self._record.add(done.key, plain(done.value))
        return {task.key: found[task.key] for task in tasks}

    def path(self, scan: int) -> Path:
        """Where a thinned scan is kept."""
        return self._scans / f"{name_of(scan)}.npz"

    def _watched(self, stage: str, function: Function, tasks: list[Task], items: Mapping[str, Any]) -> Iterable[Done]:
        self._progress(stage, 0, len(tasks))
        if not tasks:
            return
        with closing(self.executor.run(function, tasks, items)) as work:
            for finished, done in enumerate(work, 1):
                yield done
                self._progress(stage, finished, len(tasks))


def _called(cloud: CloudLike, k: int) -> str:
    return str(cloud) if isinstance(cloud, str | Path) else f"clouds[{k}]"


def _absolute(cloud: CloudLike) -> CloudLike:
    """A path that another process finds, too."""
    return str(Path(cloud).absolute()) if isinstance(cloud, str | Path) else cloud
