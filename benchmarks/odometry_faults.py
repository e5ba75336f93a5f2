"""What goes wrong on a drive: frames that are missing, empty or broken, clocks that jump, halts; the error after."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from odometry_run import METHODS, Record
from odometry_sets import Frame, Sequence, read

from fieldalign.evaluation import rotation_error, translation_error

BEFORE, AFTER = 60, 80  # frames that are run before and after a fault
FROM, UNTIL = 10, 40  # the error is that of the motion from so many frames before it to so many after it
HEARD = 30  # frames, from the fault on, within which something has to be said
LOST = 20  # frames in a gap of 2 s
QUIET = "", "TRACKED"  # what is said where nothing is wrong

Frames = list[Frame | None]  # None: the frame never came


def none(frames: Frames) -> None:
    """Nothing."""


def dropped(frames: Frames) -> None:
    frames[BEFORE] = None


def gap(frames: Frames) -> None:
    frames[BEFORE : BEFORE + LOST] = [None] * LOST


def empty(frames: Frames) -> None:
    frames[BEFORE] = Frame(np.zeros((0, 3), np.float32), np.zeros(0))


def broken(frames: Frames) -> None:
    frames[BEFORE] = Frame(np.full_like(frames[BEFORE].points, np.nan), frames[BEFORE].times)


def hidden(frames: Frames) -> None:
    """What remains is a sector of 36 degrees."""
    frame = frames[BEFORE]
    kept = frame.times < np.quantile(frame.times, 0.1)
    frames[BEFORE] = Frame(frame.points[kept], frame.times[kept])


def ahead(frames: Frames) -> None:
    _shift(frames, 100.0)


def back(frames: Frames) -> None:
    _shift(frames, -5.0)


def _shift(frames: Frames, seconds: float) -> None:
    frames[BEFORE:] = [Frame(frame.points, frame.times + seconds) for frame in frames[BEFORE:]]


@dataclass(frozen=True)
class Fault:
    """What it is called, what it does to the frames, and whether it happens at a halt instead of under way."""

    title: str
    do: Callable[[Frames], None]
    halt: bool = False


FAULTS = {
    "none": Fault("nothing", none),
    "dropped": Fault("a frame is missing", dropped),
    "empty": Fault("an empty frame", empty),
    "broken": Fault("a frame of NaN", broken),
    "hidden": Fault("90 % of a frame missing", hidden),
    "ahead": Fault("the clock jumps 100 s ahead", ahead),
    "back": Fault("the clock jumps 5 s back", back),
    "gap": Fault("a gap of 2 s", gap),
    "halt": Fault("a standstill", none, halt=True),
}


def suffered(sequence: Sequence, fault: Fault, name: str, reach: float) -> dict:
    """How a method gets over a fault: metres and degrees by which the motion across it is off, and what it said."""
    truth = sequence.truths["end"]
    at, until = _halt(truth) if fault.halt else 2 * (_underway(truth),)
    start, lasts = at - BEFORE, until - at
    frames: Frames = [read(file) for file in sequence.files[start : until + AFTER]]
    fault.do(frames)
    record, answered, error = _answers(name, frames, reach)
    first, last = BEFORE - FROM, BEFORE + lasts + UNTIL
    if last not in answered:
        return {"m": None, "deg": None, "said": [], "error": error}
    motion = _motion(record.poses, answered.index(first), answered.index(last))
    true = [_motion(poses, start + first, start + last) for poses in sequence.truths.values()]
    m, deg = min((translation_error(motion, T), rotation_error(motion, T)) for T in true)
    heard = [said for k, said in zip(answered, record.said, strict=True) if 0 <= k - BEFORE < HEARD + lasts]
    return {"m": m, "deg": deg, "said": list(dict.fromkeys(s for s in heard if s not in QUIET)), "error": error}


def _motion(poses, first: int, last: int) -> np.ndarray:
    return np.linalg.inv(poses[first]) @ poses[last]


def _answers(name: str, frames: Frames, reach: float) -> tuple[Record, list[int], str | None]:
    """The record, which frames it is of, and what was raised."""
    method, record, answered = METHODS[name](True, reach), Record(), []
    for k, frame in enumerate(frames):
        if frame is not None:
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    record.take(*method.step(frame))
            except Exception as error:  # that is what is to be found out
                return record, answered, type(error).__name__
            answered.append(k)
    return record, answered, None


def _underway(truth: np.ndarray) -> int:
    """Where it has gone on at full speed for the longest."""
    pace = _pace(truth)
    window = BEFORE + LOST + UNTIL
    slowest = [pace[k - BEFORE : k + LOST + UNTIL].min() for k in range(BEFORE, len(pace) - window)]
    return BEFORE + int(np.argmax(slowest))


def _halt(truth: np.ndarray) -> tuple[int, int]:
    """When the first standstill after the beginning starts and ends."""
    stands = np.flatnonzero(_pace(truth) < 1e-3)
    stands = stands[stands > 2 * BEFORE]
    after = np.flatnonzero(np.diff(stands) > 1)
    return int(stands[0]), int(stands[after[0]] if len(after) else stands[-1])


def _pace(truth: np.ndarray) -> np.ndarray:
    """Metres from frame to frame."""
    return np.linalg.norm(np.diff(truth[:, :3, 3], axis=0), axis=1)
