"""Files that are written whole or not at all."""

from __future__ import annotations

import io
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from .errors import ArgumentError


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A name beside `path` to write to; what is written there replaces `path`, unless something is raised.

    Raises FileNotFoundError where there is no such folder.
    """
    target = Path(os.path.realpath(path))
    if not target.parent.is_dir():
        raise FileNotFoundError(f"there is no folder {target.parent}")
    unfinished = target.with_name(f".{target.stem}.{secrets.token_hex(4)}{target.suffix}")
    try:
        yield unfinished
        os.replace(unfinished, target)
    finally:
        unfinished.unlink(missing_ok=True)


def write_text(text: str, path: str | os.PathLike[str]) -> Path:
    """Writes a text, as write_bytes."""
    return write_bytes(text.encode(), path)


def write_figure(figure: Any, path: str | os.PathLike[str]) -> Path:
    """Writes a figure of matplotlib in the format that the suffix names; otherwise as write_bytes."""
    picture = io.BytesIO()  # matplotlib and its encoders come to harm in their own ways on a full disk
    figure.savefig(picture, format=Path(path).suffix[1:].lower())
    return write_bytes(picture.getvalue(), path)


def write_bytes(content: bytes, path: str | os.PathLike[str]) -> Path:
    """Writes a file, whole or not at all; returns the path. Raises ArgumentError where it cannot be written."""
    try:
        with replacing(path) as unfinished:
            unfinished.write_bytes(content)
    except (OSError, ValueError) as error:  # ValueError: what can be no path
        raise ArgumentError(f"{path} cannot be written: {getattr(error, 'strerror', None) or error}") from error
    return Path(path)
