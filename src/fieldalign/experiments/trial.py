"""The work on one case by one method, wherever it runs."""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter, process_time
from typing import Any

import numpy as np

from ..assembly.work import Load
from ..evaluation import rotation_error, translation_error
from .case import Case
from .columns import Align, Column
from .symmetry import errors_modulo_symmetry

_warm: set[tuple[str, int]] = set()  # what this process has run before, with so many threads


@dataclass(frozen=True)
class Trial:
    """The work on one case by one method, for an executor. symmetric: whether shapes may be like themselves when they
    are turned, so that errors are given modulo that, too."""

    threads: int
    seed: int
    symmetric: bool

    def __call__(self, data: tuple[Case, Column], load: Load) -> dict[str, Any]:
        """A row of the results: T, row by row; RRE in degrees, RTE in the clouds' unit; what it took."""
        case, column = data
        source, target = case.clouds()
        _warm_up(column.align, self.threads)
        wall, cpu = perf_counter(), process_time()
        answer = column.align(source, target, case.T_guess, self.threads, self.seed)
        wall, cpu = perf_counter() - wall, process_time() - cpu
        T, T_true = answer.T_target_source, case.T_target_source
        row = {
            "T": T[:3].ravel().tolist(), "accepted": answer.accepted, "rre_deg": rotation_error(T, T_true),
            "rte": translation_error(T, T_true), "seconds": wall, "cpu_seconds": cpu,
        }
        if self.symmetric:
            modulo = errors_modulo_symmetry(source, T, T_true, self.threads)
            row |= {"rre_modulo_deg": modulo[0], "rte_modulo": modulo[1]}
        return row


def _warm_up(align: Align, threads: int) -> None:
    """Calls a method once in this process: what it loads and starts is none of its time."""
    if (repr(align), threads) not in _warm:
        _warm.add((repr(align), threads))
        toy = np.random.default_rng(0).normal(size=(500, 3))
        try:
            align(toy, toy, np.eye(4), threads, 0)
        except Exception:  # that it cannot do with a toy says nothing of the data
            return
