"""The front door for many pairs: each is registered where there is room, and none is done twice."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, closing
from typing import Any, TypeAlias

from .arguments import as_count, check_one_of, check_positive
from .assembly.executor import AnyExecutor, Done, as_executor
from .assembly.pair_result import PairResult
from .assembly.pairs import Pair, Pairs, RegisterPair, told
from .assembly.record import RunRecord
from .dof import as_dof
from .settings import Settings, as_settings
from .threads import resolve_threads

Progress: TypeAlias = Callable[[int, int], None]


def register_many(
    pairs: Iterable[Pair],
    *,
    executor: AnyExecutor = None,
    run_folder: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    search: bool | None = None,
    search_radius: float | None = None,
    search_angle: float | None = None,
    method: str = "robust",
    settings: Settings | str | None = None,
    seed: int = 0,
    threads: int | None = None,
    dof: Any = None,
    scale: bool = False,
    drop_nonfinite: bool = True,
) -> list[PairResult]:
    """The motions of many pairs, each as `fa.register` finds it; one result per pair, in their order.

    pairs: (source, target) or (source, target, init), clouds as `fa.register` takes them. A cloud of several pairs (the
        same path, or the same object) is made ready once per process. Equal pairs are registered once.
    executor: where the work runs. None: here, one pair after the other. A number: in so many processes; a script then
        needs its `if __name__ == "__main__":`. "local": on a Dask cluster of this machine; "tcp://...": on the Dask
        scheduler there, whose workers must see the paths (other clouds are sent to them once). Or an executor
        (fieldalign.assembly.executor). Where it runs changes no bit of a result.
    run_folder: a folder in which each result is recorded at once; a run that was interrupted, however, goes on from
        there. It holds one run: the same settings, unchanged scans; pairs may be added. A pair that failed is tried
        again: its file may have been out of reach, or its worker out of memory.
    progress: called as progress(finished, of) after each pair that had to be registered, and first with finished = 0.
    threads: of each registration; None: so many that the machine is busy but not crowded.
    The others are those of `fa.register`, for all pairs alike.

    The results hold less than those of `fa.register`, see PairResult. A cloud that cannot be read, an init that is no
    pose, whatever else goes wrong in a pair, or a worker that dies of it three times, is that pair's result: reason
    FAILED, and the sentence in `error`.

    Raises ArgumentError for pairs that are none and for settings out of range, and RunError for a run folder that is in
    use or holds another run, for a full disk (what is recorded stays), and where workers cannot be had.
    """
    check_one_of("method", method, ("robust", "paper"))
    for name, value in (("search_radius", search_radius), ("search_angle", search_angle)):
        if value is not None:
            check_positive(name, value)
    options: dict[str, Any] = {
        "search": search, "search_radius": search_radius, "search_angle": search_angle, "method": method,
        "settings": None if settings is None else as_settings(settings), "seed": as_count(seed, "seed", 0),
        "dof": as_dof(dof), "scale": bool(scale), "drop_nonfinite": bool(drop_nonfinite),
    }
    chosen, wanted = as_executor(executor), Pairs(pairs)
    used = chosen.threads if threads is None else resolve_threads(threads)
    found: dict[str, PairResult] = {}
    with ExitStack() as opened:
        record = None
        if run_folder is not None:
            record = opened.enter_context(RunRecord(run_folder, told(options), wanted.identities()))
            known = {key: PairResult.from_dict(record.done[key]) for key in wanted.tasks if key in record.done}
            found = {key: result for key, result in known.items() if result.error is None}
        missing = [task for key, task in wanted.tasks.items() if key not in found]
        if missing:  # else no worker need start
            items = wanted.items(used, options["drop_nonfinite"])
            work = opened.enter_context(closing(chosen.run(RegisterPair(options, used), missing, items)))
            for done in _watched(work, progress, len(missing)):
                found[done.key] = wanted.result(done)
                if record is not None:
                    record.add(done.key, found[done.key].to_dict())
    return [found[key] for key in wanted.keys]


def _watched(work: Iterator[Done], progress: Progress | None, of: int) -> Iterator[Done]:
    """The same, while progress is told."""
    tell = progress or (lambda finished, of: None)
    tell(0, of)
    for finished, done in enumerate(work, 1):
        yield done
        tell(finished, of)
