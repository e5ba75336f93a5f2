"""How many threads a call may use."""

from __future__ import annotations

import os

from .errors import ArgumentError


def resolve_threads(threads: int | None) -> int:
    """`threads` itself, or for None as many as this process may use; raises ArgumentError for less than 1."""
    if threads is None:
        affinity = getattr(os, "sched_getaffinity", None)  # not on macOS and Windows
        return len(affinity(0)) if affinity else os.cpu_count() or 1
    if isinstance(threads, bool) or not isinstance(threads, int) or threads < 1:
        raise ArgumentError(f"threads must be None (all cores) or an integer of at least 1, but is {threads!r}")
    return threads
