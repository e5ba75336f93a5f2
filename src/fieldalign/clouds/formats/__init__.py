"""Cloud formats, a module each: `read(path) -> PointCloud` and, where it makes sense, `write(path, cloud)`.

A reader raises CloudFileError with a predicate ("promises 8 points, but ..."), to which files.py adds the
file's name; whatever else a library raises, files.py turns into a CloudFileError. A writer returns what its
format has no place for.
"""

from __future__ import annotations

from typing import BinaryIO

from ...errors import CloudFileError
from ..cloud import Array


def require_bytes(needed: int, present: int, promise: str) -> None:
    """Raises CloudFileError where a file cannot hold what its header promises: before any allocation."""
    if not 0 <= needed <= present:
        raise CloudFileError(
            f"promises {promise}, at least {needed} bytes, but holds only {max(present, 0)} bytes of data"
        )


def write_rows(file: BinaryIO, rows: Array) -> None:
    """Writes the bytes of rows (n, ...), C-contiguous. Not rows.tofile(file): of what cannot be written when the C
    library empties its buffer, at the end, NumPy says nothing, and on a full disk a file would lack its last bytes."""
    file.write(rows.view("u1").data)
