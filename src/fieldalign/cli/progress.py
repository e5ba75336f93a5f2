"""What a command is at, on stderr while it works: a bar on a terminal, lines elsewhere. Results alone go to stdout.

A thread writes all of it, so that the time runs on while one call into the core takes long.
"""

from __future__ import annotations

import os
import shutil
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from time import perf_counter
from typing import Protocol, TypeAlias

from . import loudness

# Seconds: what is quicker is not told; between two lines of one step; between two pictures of a bar.
_BAR_AFTER, _LINE_AFTER, _NEXT_LINE, _NEXT_PICTURE = 0.3, 1.0, 10.0, 0.2
_WIDEST = 30  # characters of the bar itself
_CLEAR = "\r\x1b[K"

Tell: TypeAlias = Callable[[str, float, float | None], None]


@dataclass(frozen=True)
class _Step:
    """How far a step is, at the moment `now`. of: None where nobody knows. counted: these are numbers of things."""

    name: str
    finished: float
    of: float | None
    counted: bool
    began: float
    now: float

    def left(self, now: float) -> str:
        """The time that is left, if it goes on as it did; nothing where that is over."""
        if not self.of or not self.finished:
            return ""
        left = (self.now - self.began) * (self.of - self.finished) / self.finished - (now - self.now)
        return f", {_clock(left)} left" if left > 0 else ""

    def position(self) -> str:
        """How many of how many."""
        if not self.counted:
            return ""
        return f" {self.finished:.0f}" + ("" if self.of is None else f" of {self.of:.0f}")


class _Display(Protocol):
    def show(self, step: _Step, now: float) -> None: ...
    def end(self, step: _Step, now: float) -> None: ...


class _Bar:
    def __init__(self) -> None:
        self._began, self._drawn = perf_counter(), False

    def show(self, step: _Step, now: float) -> None:
        if now - self._began < _BAR_AFTER:
            return
        share = step.finished / step.of if step.of else 0.0
        done = round(_WIDEST * min(share, 1.0))
        bar = f" [{'#' * done}{'-' * (_WIDEST - done)}]" if step.of else ""
        text = f"{step.name}{bar}{step.position()}, {_clock(now - step.began)}{step.left(now)}"
        sys.stderr.write(_CLEAR + text[: shutil.get_terminal_size().columns - 1])
        sys.stderr.flush()
        self._drawn = True

    def end(self, step: _Step, now: float) -> None:
        if self._drawn:
            sys.stderr.write(_CLEAR)
            sys.stderr.flush()


class _Lines:
    """Of a step that takes long: a line at its start, one now and then, and one at its end."""

    def __init__(self, patience: float) -> None:
        self._patience = patience
        self._name, self._began, self._told = "", 0.0, 0.0

    def show(self, step: _Step, now: float) -> None:
        if step.name != self._name:
            self._name, self._began, self._told = step.name, now, 0.0
        if not self._told and now - self._began >= self._patience:
            self._say(step, "" if step.of is None or not step.counted else f": {step.of:.0f}", now)
        elif self._told and now - self._told >= _NEXT_LINE:
            self._say(step, f":{step.position()} after {_clock(now - self._began)}{step.left(now)}", now)

    def end(self, step: _Step, now: float) -> None:
        if self._told:
            self._say(step, f": done in {now - self._began:.1f} s", now)
        self._name = ""

    def _say(self, step: _Step, what: str, now: float) -> None:
        sys.stderr.write(f"{step.name}{what}\n")
        sys.stderr.flush()
        self._told = now


@contextmanager
def bar(counted: bool = True) -> Iterator[Tell]:
    """Shows the steps of a command and the time that is left: tell(step, finished, of), where None is a number that
    nobody knows. A step begins with finished = 0, and ends with the next one or with the block.

    counted: whether finished and of are numbers of things, to be shown.
    """
    display = _display()
    if display is None:
        yield lambda name, finished, of: None
        return
    steps: SimpleQueue[_Step | None] = SimpleQueue()
    began = perf_counter()

    def tell(name: str, finished: float, of: float | None) -> None:
        nonlocal began
        now = perf_counter()
        if finished == 0:
            began = now
        steps.put(_Step(name, finished, of, counted, began, now))

    writer = threading.Thread(target=_write, args=(display, steps), daemon=True)
    writer.start()
    try:
        yield tell
    finally:
        steps.put(None)
        writer.join(1.0)


@contextmanager
def stages(weights: Mapping[str, float]) -> Iterator[Callable[[], None]]:
    """A bar over named stages; call what it gives at the start of each. weights: about how the time is divided."""
    finished, waiting = 0.0, iter(weights.items())
    whole = sum(weights.values())
    with bar(counted=False) as tell:

        def begin() -> None:
            nonlocal finished
            name, weight = next(waiting)
            tell(name, finished, whole)
            finished += weight

        yield begin


def file_size(*paths: str) -> float:
    """Bytes in files, as the weight of a stage that reads them; a little of what is no file."""
    return 1.0 + sum(os.path.getsize(path) for path in paths if os.path.isfile(path))


def _display() -> _Display | None:
    if loudness.is_verbose():
        return _Lines(0.0)
    if loudness.is_quiet():
        return None
    return _Bar() if sys.stderr.isatty() else _Lines(_LINE_AFTER)


def _write(display: _Display, steps: SimpleQueue[_Step | None]) -> None:
    """Shows what comes until None comes."""
    step: _Step | None = None
    while True:
        try:
            following = steps.get(timeout=_NEXT_PICTURE)
        except Empty:
            following = step
        else:
            if step is not None and (following is None or following.name != step.name):
                display.end(step, perf_counter())
            if following is None:
                return
        step = following
        if step is not None:
            display.show(step, perf_counter())


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
