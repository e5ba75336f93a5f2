"""The work on one case by one method, wherever it runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter, process_time
from typing import Any

import numpy as np

from ..assembly.work import Load
from ..evaluation import rotation_error, translation_error
from ..fields.protocol import Floats
from .case import Case
from .columns import Align, Answer, Column
from .symmetry import errors_modulo_symmetry

_warm: set[tuple[str, int]] = set()  # what this process has run before, with so many threads
_last: dict[tuple[str, str], tuple[Floats, Floats]] = {}  # the clouds of the last case, which the next method wants


@dataclass(frozen=True)
class Trial:
    """The work on one case by one method, for an executor. run: unlike that of any other cases."""

    threads: int
    seed: int
    run: str = ""

    def __call__(self, data: tuple[Case, Column], load: Load) -> dict[str, Any]:
        """A row of the results: T, row by row; RRE in degrees, RTE in the clouds' unit; what it took."""
        case, column = data
        source, target = self._clouds(case)
        _warm_up(column.align, self.threads, source)
        seed = self.seed + case.seed
        answer, cost = self.measured(lambda: column.align(source, target, case.T_guess, self.threads, seed))
        T, T_true = answer.T_target_source, case.T_target_source
        row = {
            "T": T[:3].ravel().tolist(), "accepted": answer.accepted, "rre_deg": rotation_error(T, T_true),
            "rte": translation_error(T, T_true),
        } | cost
        if case.shape is not None:
            modulo = errors_modulo_symmetry(case.shape(), T, T_true, self.threads)
            row |= {"rre_modulo_deg": modulo[0], "rte_modulo": modulo[1]}
        return row

    def measured(self, call: Callable[[], Answer]) -> tuple[Answer, dict[str, float]]:
        """What a call gives, and what it takes: seconds by the clock, and of all cores."""
        wall, cpu = perf_counter(), process_time()
        answer = call()
        return answer, {"seconds": perf_counter() - wall, "cpu_seconds": process_time() - cpu}

    def _clouds(self, case: Case) -> tuple[Floats, Floats]:
        """The clouds of a case: copies, since the next method gets the same ones."""
        key = self.run, case.name
        if key not in _last:
            _last.clear()
            _last[key] = case.clouds()
        source, target = _last[key]
        return source.copy(), target.copy()


def _warm_up(align: Align, threads: int, cloud: Floats) -> None:
    """Calls a method once in this process, on the quarter of a cloud that lies about its first point: what it loads and
    starts is none of its time. A made-up toy would not do: KISS-Matcher dies of points too far apart for its voxel."""
    if (repr(align), threads) not in _warm:
        _warm.add((repr(align), threads))
        away = np.linalg.norm(cloud - cloud[0], axis=1)
        toy = cloud[np.argsort(away, kind="stable")[: max(1000, len(cloud) // 4)]]
        try:
            align(toy, toy.copy(), np.eye(4), threads, 0)
        except Exception:  # that it cannot do with a part says nothing of the whole
            return
