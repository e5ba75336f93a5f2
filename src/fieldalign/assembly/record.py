"""The record of a run: a folder with one file, to which each result is added at once and from which a run goes on.

    8 hex digits, a blank, JSON         CRC-32 of the JSON's bytes; one line each
    {"run": {...}, "scans": {...}}      first: what the run is, and what each scan is; again where scans were added
    {"key": "...", "result": {...}}     then: what came of each piece of work

A line is handed to the system at once, so the death of this process loses none. It is forced onto the disk once a
second and at the end: a power cut may lose the results of one second, while a sync of each would cost some 10 ms.
"""

from __future__ import annotations

import errno
import json
import os
import re
import warnings
import zlib
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from time import monotonic
from typing import Any

from ..errors import FieldalignError, RunError
from .lock import only_one

FORMAT = 1

_FILE = "record.jsonl"
_SYNCED = 1.0  # seconds
_BINARY = getattr(os, "O_BINARY", 0)  # on Windows
_BEGINNING = re.compile(rb"[0-9a-f]{8} \{")


class RunRecord:
    """The record in a folder, which is made where it is not there. One writer at a time; close it, or use `with`.

    run: what decides about results (seed, settings), as JSON can hold it. scans: by name, what tells that a scan is
        still the same (see identity.py). A run that goes on must agree with both; it may have more scans.
    done: what was recorded before, by key.

    A line that is torn at the end, as a crash leaves it, is cut off. One that is damaged in the middle is warned of,
    and its work counts as not done.

    Raises RunError where another run writes here, for a folder that cannot be written, for a record of other inputs or
    of another version, and for a full disk; then all that was recorded stays.
    """

    def __init__(self, folder: str | os.PathLike[str], run: Mapping[str, Any], scans: Mapping[str, Any]) -> None:
        from .. import __version__

        self.path = Path(folder, _FILE)
        self.done: dict[str, Any] = {}
        run = {"format": FORMAT, "version": __version__} | dict(run)
        with ExitStack() as opened:
            with naming_errors(self.path):
                self.path.parent.mkdir(parents=True, exist_ok=True)
                opened.enter_context(only_one(self.path.with_name("lock")))
                self._file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_APPEND | _BINARY, 0o666)
            opened.callback(os.close, self._file)
            self._synced = monotonic()
            self._go_on(_plain(run), _plain(scans))
            self._opened = opened.pop_all()

    def add(self, key: str, result: Mapping[str, Any] | list[Any]) -> None:
        """Records what came of a piece of work."""
        self._append({"key": key, "result": result})
        if monotonic() - self._synced >= _SYNCED:
            self._sync()

    def close(self) -> None:
        """Forces everything onto the disk and lets the next writer in."""
        with self._opened:
            self._sync()

    def __enter__(self) -> RunRecord:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _go_on(self, run: dict[str, Any], scans: dict[str, Any]) -> None:
        """Reads what is there, and writes what this run is as far as that does not say it."""
        known: dict[str, Any] | None = None
        for entry in self._entries():
            if "run" in entry:
                self._check_same("setting", entry["run"], run, of_all=True)
                known = (known or {}) | entry["scans"]
            elif known is not None:
                self.done[entry["key"]] = entry["result"]
            else:
                raise self._no_record()
        self._check_same("scan", known or {}, scans)
        new = {name: scan for name, scan in scans.items() if name not in (known or {})}
        if new or known is None:
            self._append({"run": run, "scans": new})
            self._sync()

    def _check_same(self, what: str, known: dict[str, Any], given: dict[str, Any], of_all: bool = False) -> None:
        """Raises where something was recorded otherwise than it is given; of all, also where it was not there."""
        names = known.keys() | given.keys() if of_all else known.keys() & given.keys()
        if other := sorted(name for name in names if known.get(name) != given.get(name)):
            name, before, now = other[0], known.get(other[0]), given.get(other[0])
            raise RunError(
                f"{self.path.parent} holds a run of other inputs: the {what} {name} was {before}, but is {now}; "
                "give it a folder of its own"
            )

    def _entries(self) -> Iterator[dict[str, Any]]:
        """What the lines hold; a torn end is cut off."""
        end, damaged, number = 0, 0, 0
        with open(self.path, "rb") as file:
            for number, line in enumerate(file, 1):
                if damaged:
                    self._report(damaged)
                entry = _decoded(line)
                damaged = 0 if entry is not None else number
                if entry is not None:
                    yield entry
                elif number == 1 and (line.endswith(b"\n") or not _BEGINNING.match(line)):
                    raise self._no_record()
                end += len(line)
            if damaged:
                os.ftruncate(self._file, end - len(line))

    def _no_record(self) -> RunError:
        return RunError(f"{self.path} is no record, or its first line is damaged: remove it to begin anew")

    def _report(self, number: int) -> None:
        warnings.warn(f"{self.path}: line {number} is damaged, so its work is done again", stacklevel=2)

    def _append(self, entry: Mapping[str, Any]) -> None:
        """Adds a line, whole or not at all."""
        size = os.fstat(self._file).st_size
        rest = memoryview(_encoded(entry))
        with naming_errors(self.path):
            try:
                while rest:
                    rest = rest[os.write(self._file, rest):]
            except BaseException:
                os.ftruncate(self._file, size)
                raise

    def _sync(self) -> None:
        with naming_errors(self.path):
            os.fsync(self._file)
        self._synced = monotonic()


@contextmanager
def naming_errors(path: Path) -> Iterator[None]:
    """Makes one clear RunError of what the system refuses when `path` is written."""
    try:
        yield
    except FieldalignError:  # a clear error already, though it be a ValueError, too
        raise
    except (OSError, ValueError) as error:  # ValueError: what can be no path
        if getattr(error, "errno", None) in (errno.ENOSPC, errno.EDQUOT):
            raise RunError(
                f"the disk of {path.parent} is full: what is recorded stays, and the run goes on from there "
                "when there is room"
            ) from error
        raise RunError(f"{path} cannot be written: {getattr(error, 'strerror', None) or error}") from error


def _plain(value: Mapping[str, Any]) -> dict[str, Any]:
    """As it comes back from JSON: tuples are lists there."""
    plain: dict[str, Any] = json.loads(json.dumps(dict(value)))
    return plain


def _encoded(entry: Mapping[str, Any]) -> bytes:
    text = json.dumps(entry, separators=(",", ":")).encode()
    return b"%08x %s\n" % (zlib.crc32(text), text)


def _decoded(line: bytes) -> dict[str, Any] | None:
    """What a line holds; None where it is torn, damaged or no line of a record."""
    text = line[9:-1]
    if not line.endswith(b"\n") or line[:9] != b"%08x " % zlib.crc32(text):
        return None
    try:
        entry: Any = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return entry if _is_entry(entry) else None


def _is_entry(entry: Any) -> bool:
    if not isinstance(entry, dict):
        return False
    if "run" in entry:
        return isinstance(entry["run"], dict) and isinstance(entry.get("scans"), dict)
    return isinstance(entry.get("key"), str) and isinstance(entry.get("result"), dict | list)
