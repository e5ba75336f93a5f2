"""What is known of each frame, as CSV: one line a frame, valid after each."""

from __future__ import annotations

import csv
import io
import os
from dataclasses import astuple, dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from .line_file import LineFile

UPPER = np.triu_indices(6)  # of a covariance, which is symmetric
_COVARIANCE = [f"c{i}{j}" for i, j in zip(*UPPER, strict=True)]


@dataclass(frozen=True)
class FrameRow:
    """One frame of a drive.

    frame: its number. time: as in the trajectory. points: that the scan had. reason: what the step came to, as
    a word. message: why the scan is missing; empty where it is not. read, step: seconds that passed reading the scan
    and placing it; cpu: seconds that all cores together worked on the latter.
    """

    frame: int
    time: float
    points: int
    reason: str
    message: str
    read: float
    step: float
    cpu: float


class FramesWriter:
    """Writes a line for each frame: its row, then c00 ... c55, the upper triangle of its pose's covariance row by row
    (twist order w, v). Close it, or use `with`. Raises as LineFile does.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._lines = LineFile(path)
        self._lines.add(_csv([field.name for field in fields(FrameRow)] + _COVARIANCE))

    def add(self, row: FrameRow, covariance: ArrayLike) -> None:
        """Adds a frame; covariance: (6, 6)."""
        self._lines.add(_csv([*astuple(row), *np.asarray(covariance, float)[UPPER].tolist()]))

    def close(self) -> None:
        """Forces everything onto the disk."""
        self._lines.close()

    def __enter__(self) -> FramesWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _csv(values: list[object] | list[str]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="").writerow(values)
    return text.getvalue().replace("\n", " ").replace("\r", " ")
