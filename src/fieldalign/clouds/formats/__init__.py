"""Cloud formats, a module each: `read(path) -> PointCloud` and, where it makes sense, `write(path, cloud)`.

A reader raises CloudFileError with a predicate ("promises 8 points, but ..."), to which files.py adds the
file's name; whatever else a library raises, files.py turns into a CloudFileError. A writer returns what its
format has no place for.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain, islice
from typing import BinaryIO

import numpy as np
from numpy.typing import DTypeLike

from ...errors import CloudFileError
from ..cloud import Array

UNPACKED = 2**28  # bytes: as many may come of any compressed file
PACKED_AT_BEST = 100  # bytes from one byte, beyond that: clouds shrink to a third or a tenth, bombs to a thousandth
BLANKS = b" \t\n\r\v\f\x1c\x1d\x1e\x1f\x85\xa0"  # as NumPy counts them in text that is read as Latin-1


def require_bytes(needed: int, present: int, promise: str) -> None:
    """Raises CloudFileError where a file cannot hold what its header promises: before any allocation."""
    if not 0 <= needed <= present:
        raise CloudFileError(
            f"promises {promise}, at least {needed} bytes, but holds only {max(present, 0)} bytes of data"
        )


def require_unpacked(unpacked: int, packed: int, promise: str) -> None:
    """Raises CloudFileError where compressed data would take more memory than data of a scan ever does."""
    if unpacked > max(UNPACKED, PACKED_AT_BEST * packed):
        raise CloudFileError(
            f"promises {promise}, {unpacked} bytes of {packed} compressed ones, but more than {PACKED_AT_BEST} times "
            "as many are what fills a memory, and no scan"
        )


def write_rows(file: BinaryIO, rows: Array) -> None:
    """Writes the bytes of rows (n, ...), C-contiguous. Not rows.tofile(file): of what cannot be written when the C
    library empties its buffer, at the end, NumPy says nothing, and on a full disk a file would lack its last bytes."""
    file.write(rows.view("u1").data)


def table_of(lines: Iterable[bytes], dtype: DTypeLike, count: int) -> Array:
    """The first `count` lines that hold anything, as rows of a structured type; takes no line beyond them. Raises
    CloudFileError where there are fewer."""
    rows = islice((line for line in lines if line.strip(BLANKS)), count)  # np.loadtxt would warn of empty lines
    first = next(rows, None)
    table = np.empty(0, dtype) if first is None else np.loadtxt(chain([first], rows), dtype, comments=None, ndmin=1)
    if len(table) != count:
        raise CloudFileError(f"promises {count} points, but holds {len(table)}")
    return table
