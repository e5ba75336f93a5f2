"""Where figures may be written, and how they begin; `whole_file.write_figure` writes them."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from ..errors import ArgumentError, missing_extra

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
