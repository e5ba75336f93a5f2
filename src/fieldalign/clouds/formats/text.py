"""Text: .xyz, .txt, .csv with comma, semicolon or white space, one point a line.

Names may stand in a first line or in a comment line (# or //) above the numbers; what nameless columns mean
is told by `columns.cloud_from_table`. A whole number alone above the numbers is the number of points (PTS).
"""

from __future__ import annotations

from itertools import chain
from pathlib import Path
from typing import NamedTuple, TextIO

import numpy as np

from ...errors import CloudFileError
from ..cloud import Array, PointCloud
from . import require_bytes
from .columns import cloud_from_columns, cloud_from_table, columns_of

COMMENTS = ("#", "//")
LONGEST_LINE = 100_000
ROWS_AT_ONCE = 65536


class _Head(NamedTuple):
    """What stands above the numbers, and the first row of them ("" where there is none)."""

    comments: list[str]
    header: str | None
    promised: int | None
    first_row: str

    @property
    def delimiter(self) -> str | None:
        line = next(filter(None, [self.first_row, self.header, *reversed(self.comments)]), "")
        return next((sign for sign in ";," if sign in line), None)

    def names(self) -> list[str] | None:
        """Of the columns; a comment counts only where it names x, y, z and as many columns as there are."""
        if self.header is not None:
            return _words(self.header, self.delimiter)
        for comment in reversed(self.comments):
            names = _words(comment, self.delimiter)
            fits = not self.first_row or len(names) == len(_words(self.first_row, self.delimiter))
            if fits and {"x", "y", "z"} <= {name.lower() for name in names}:
                return names
        return None


def read(path: Path) -> PointCloud:
    """Every value as float64."""
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        head = _read_head(file)
        require_bytes(2 * (head.promised or 0), path.stat().st_size, f"{head.promised} points")
        table = _read_table(file, head)
    if head.promised not in (None, len(table)):
        raise CloudFileError(f"promises {head.promised} points in its first line, but holds {len(table)}")
    names = head.names()
    if names is None:
        return cloud_from_table(table)
    if len(set(names)) != len(names) or len(names) != table.shape[1]:
        raise CloudFileError(
            f"has {table.shape[1]} columns, but its header names {len(names)}: {', '.join(names)[:200]}"
        )
    return cloud_from_columns(dict(zip(names, table.T, strict=True)))


def write(path: Path, cloud: PointCloud) -> list[str]:
    """With as many digits as give each value back; the names stand in a header (csv) or a comment (else)."""
    columns, left_out = columns_of(cloud)
    is_csv = path.suffix.lower() == ".csv"
    delimiter = "," if is_csv else " "
    row = delimiter.join(_format(values) for values in columns.values()) + "\n"
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write(("" if is_csv else "# ") + delimiter.join(columns) + "\n")
        for start in range(0, len(cloud), ROWS_AT_ONCE):
            parts = (values[start : start + ROWS_AT_ONCE].tolist() for values in columns.values())
            file.writelines(row % values for values in zip(*parts, strict=True))
    return left_out + (["the viewpoint"] if cloud.viewpoint is not None else [])


def _read_head(file: TextIO) -> _Head:
    comments: list[str] = []
    header = count = None
    while line := file.readline(LONGEST_LINE):
        text = line.strip()
        if "\0" in text:
            raise CloudFileError("is no text file: it holds zero bytes")
        if text.startswith(COMMENTS):
            comments.append(text.lstrip("#/"))
        elif text.isdecimal() and count is None:
            count = int(text)
        elif _are_numbers(text):
            return _Head(comments, header, count, line)
        elif text and header is not None:
            raise CloudFileError(f"has a line that is no row of numbers: {text[:60]!r}")
        elif text:
            header = text
    return _Head(comments, header, count, "")


def _read_table(file: TextIO, head: _Head) -> Array:
    if head.first_row:
        rows = chain([head.first_row], file)
        return np.loadtxt(rows, delimiter=head.delimiter, comments=COMMENTS, ndmin=2)
    names = head.names()
    if names is None and head.promised is None:
        raise CloudFileError("holds no row of numbers")
    return np.empty((0, len(names or "xyz")))


def _are_numbers(text: str) -> bool:
    try:
        return bool([float(word) for word in text.replace(",", " ").replace(";", " ").split()])
    except ValueError:
        return False


def _words(line: str, delimiter: str | None) -> list[str]:
    return [word.strip().strip('"') for word in line.strip().split(delimiter)]


def _format(values: Array) -> str:
    return {"f4": "%.9g", "f8": "%.17g"}.get(values.dtype.str[1:], "%d")
