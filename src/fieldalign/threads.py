"""How many threads a call may use."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from .arguments import as_count

_MOST = 1024  # that are of use to anyone


def resolve_threads(threads: int | None) -> int:
    """`threads` itself, or for None as many as this process may use; raises ArgumentError for less than 1."""
    if threads is None:
        affinity = getattr(os, "sched_getaffinity", None)  # not on macOS and Windows
        return len(affinity(0)) if affinity else os.cpu_count() or 1
    return min(as_count(threads, "threads", 1), _MOST)


def side_by_side(threads: int, *tasks: Callable[[], Any]) -> list[Any]:
    """The answers of tasks that do not depend on each other, run at once where there is more than one thread."""
    if threads == 1:
        return [task() for task in tasks]
    with ThreadPoolExecutor(min(threads, len(tasks))) as pool:
        return [job.result() for job in [pool.submit(task) for task in tasks]]
