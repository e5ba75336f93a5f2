"""How many threads a call may use."""

from __future__ import annotations

import os

from .arguments import as_count


def resolve_threads(threads: int | None) -> int:
    """`threads` itself, or for None as many as this process may use; raises ArgumentError for less than 1."""
    if threads is None:
        affinity = getattr(os, "sched_getaffinity", None)  # not on macOS and Windows
        return len(affinity(0)) if affinity else os.cpu_count() or 1
    return as_count(threads, "threads", 1)
