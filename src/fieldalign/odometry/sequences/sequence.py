"""A sequence of frames, whatever it is read from."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

from ...clouds.cloud import PointCloud
from ...errors import CloudFileError, FieldalignError, MissingExtraError, printable


@dataclass(frozen=True, eq=False)
class Frame:
    """One scan of a sequence.

    index: of the frame, from 0. stamp: when it was taken, seconds; None where nothing tells.
    cloud: in the sensor's frame, its times in seconds on the stamp's clock where the points have any; None where the
        frame is missing or cannot be read, and then reason says why.
    """

    index: int
    stamp: float | None
    cloud: PointCloud | None
    reason: str = ""


@dataclass(frozen=True)
class Sequence:
    """Frames in the order of their time; each iteration reads them anew, one at a time.

    name: of the folder or file. kind: in words. length: how many frames, None where that is not known beforehand.
    A frame that is broken or missing comes without a cloud and ends nothing. Where no frame at all could be read,
    the iteration ends with a CloudFileError.
    """

    name: str
    kind: str
    length: int | None
    frames: Callable[[], Iterator[Frame]]

    def __iter__(self) -> Iterator[Frame]:
        first_reason, any_read = "there is none", False
        for number, frame in enumerate(self.frames()):
            any_read |= frame.cloud is not None
            first_reason = first_reason if number else frame.reason
            yield frame
        if not any_read:
            raise CloudFileError(f"{self.name} ({self.kind}) holds no frame that can be read: {first_reason}")


def frame_of(index: int, stamp: float | None, read: Callable[[], PointCloud]) -> Frame:
    """The frame whose cloud `read` gives; where it raises, the reason stands for the cloud."""
    try:
        return Frame(index, stamp, read())
    except MissingExtraError:  # which all frames would raise
        raise
    except Exception as error:
        return Frame(index, stamp, None, reason_of(error))


def reason_of(error: Exception) -> str:
    """What went wrong, in one line."""
    first_line = printable((str(error).strip() or type(error).__name__).splitlines()[0])
    return first_line if isinstance(error, FieldalignError) else f"{type(error).__name__}: {first_line}"


def ahead(frames: Iterator[Frame]) -> Iterator[Frame]:
    """The same frames; while one is worked on, a thread reads the next."""
    with ThreadPoolExecutor(1) as thread:
        waiting = thread.submit(next, frames, None)
        try:
            while (frame := waiting.result()) is not None:
                waiting = thread.submit(next, frames, None)
                yield frame
        finally:
            close: Any = getattr(frames, "close", None)
            if close is not None:  # by the thread that opened the files
                thread.submit(close)
