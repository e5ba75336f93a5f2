"""The times of frames in text files: one a line, seconds, or a date as in KITTI's raw drives."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ...errors import CloudFileError

_DATE = re.compile(r"(1[7-9]|2[01])\d\d-\d\d-\d\d([T ]\d\d:\d\d(:\d\d(\.\d{1,18})?)?)?", re.ASCII)  # UTC


def read_stamps(path: Path) -> list[float]:
    """Seconds; of dates (`2011-09-26 13:02:25.964389445`, UTC) since 1970.

    Raises CloudFileError that names the line where it is neither.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise CloudFileError(f"{path} cannot be read as a list of times: {error}") from error
    stamps = []
    for number, line in enumerate(lines, 1):
        text = line.strip()
        if not text or text.startswith("#"):
            continue
        try:
            stamp = _seconds(text)
        except ValueError as error:
            raise CloudFileError(f"{path} line {number} is no time: {text[:60]!r}") from error
        if not np.isfinite(stamp):
            raise CloudFileError(f"{path} line {number} is no time: {text[:60]!r}")
        stamps.append(stamp)
    return stamps


def _seconds(text: str) -> float:
    if "-" not in text[1:].lower().replace("e-", ""):
        return float(text)
    if not _DATE.fullmatch(text):  # a time zone, too many digits, or a year beyond 64 bits of nanoseconds
        raise ValueError
    return int(np.datetime64(text.replace(" ", "T", 1), "ns").astype(np.int64)) / 1e9
