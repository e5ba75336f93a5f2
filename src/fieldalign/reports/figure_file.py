"""Figures of matplotlib: one place makes them, and writes them whole or not at all, or says which file failed."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from ..errors import ArgumentError, missing_extra
from ..whole_file import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".svg", ".pdf")


def checked_path(path: str | os.PathLike[str]) -> Path:
    """The path, if a picture can be written there; raises ArgumentError for another suffix or a missing folder."""
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise ArgumentError(f"path must end in one of {', '.join(SUFFIXES)}, but is {str(path)!r}")
    if not path.parent.is_dir():
        raise ArgumentError(f"path must lie in a folder that exists, but is {str(path)!r}")
    return path


def new_figure(width: float, height: float, dpi: float, layout: Literal["constrained"] | None = None) -> Figure:
    """An empty figure, in inches; raises MissingExtraError without matplotlib."""
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise missing_extra("viz", "drawing a picture") from error
    return Figure(figsize=(width, height), dpi=dpi, layout=layout)


def save(figure: Figure, path: Path) -> Path:
    """Writes a figure in the format of the suffix; an older file is replaced only when the new one is complete. Raises
    ArgumentError that names the file where it cannot be written."""
    try:
        with replacing(path) as unfinished:
            figure.savefig(unfinished, format=path.suffix[1:].lower())
    except OSError as error:
        raise ArgumentError(f"{path} cannot be written: {error.strerror or error}") from error
    return path
