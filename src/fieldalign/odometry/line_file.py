"""A text file that grows by whole lines, and is valid up to the last one however its writer ends."""

from __future__ import annotations

import os
from pathlib import Path

from ..errors import RunError

_BINARY = getattr(os, "O_BINARY", 0)  # on Windows


class LineFile:
    """Begins a file anew; each line that is added is handed to the system at once, so the death of this process loses
    none. Close it, or use `with`.

    Raises RunError where the file cannot be begun or a line cannot be written; then all lines before it stay.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        try:
            self._file = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND | _BINARY, 0o666)
        except (OSError, ValueError) as error:  # ValueError: what can be no path
            raise self._refused(error) from error

    def add(self, line: str) -> None:
        """Adds a line, whole or not at all."""
        size = os.fstat(self._file).st_size
        rest = memoryview((line + "\n").encode())
        try:
            while rest:
                rest = rest[os.write(self._file, rest):]
        except OSError as error:
            os.ftruncate(self._file, size)
            raise self._refused(error) from error

    def close(self) -> None:
        """Forces the lines onto the disk."""
        if self._file >= 0:
            os.fsync(self._file)
            os.close(self._file)
            self._file = -1

    def __enter__(self) -> LineFile:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _refused(self, error: OSError | ValueError) -> RunError:
        return RunError(f"{self.path} cannot be written: {getattr(error, 'strerror', None) or error}")
