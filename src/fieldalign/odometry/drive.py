"""A whole drive: each frame of a sequence through the odometry, and all that comes of it into a folder.

    trajectory_tum.txt, trajectory_kitti.txt    the poses, world_from_sensor; see trajectory_files.py
    frames.csv                                  of each frame: verdict, covariance, timing; see frames_file.py
    map.ply                                     the map, at the end
    summary.json                                how many frames, how far, how fast, at the end

The first three grow by a line a frame, and are valid however the run ends.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter, process_time
from typing import Any, Protocol

import numpy as np

from ..clouds.cloud import Array, PointCloud
from ..clouds.files import write_cloud
from ..errors import ArgumentError, RunError
from ..motions import Matrix
from ..whole_file import replacing
from .frames_file import FrameRow, FramesWriter
from .interruption import interruptible
from .reason import Tracking
from .sequences.sequence import Frame, Sequence, ahead
from .trajectory import Trajectory
from .trajectory_files import TrajectoryWriter

Progress = Callable[[int, int | None], None]


class Step(Protocol):
    """What an odometry says of its latest step; str(reason) is a sentence, reason.value a word."""

    @property
    def pose(self) -> Matrix: ...  # noqa: D102
    @property
    def covariance(self) -> Matrix: ...  # noqa: D102
    @property
    def reason(self) -> Any: ...  # noqa: D102
    @property
    def seconds(self) -> Mapping[str, float]: ...  # noqa: D102


class OdometryLike(Protocol):
    """What a drive asks of an odometry: as `fa.Odometry`; step(None) is a frame that is missing."""

    @property
    def last(self) -> Step | None: ...  # noqa: D102
    @property
    def map(self) -> PointCloud: ...  # noqa: D102
    def step(  # noqa: D102
        self, cloud: PointCloud | None, times: Array | None = None, stamp: float | None = None
    ) -> Matrix: ...


@dataclass(eq=False)
class Drive:
    """What came of a drive.

    times, poses, covariances: of the frames so far. rows: what frames.csv says of them. stages: seconds of each step by
    stage. signal: the number of the one that ended it before its time; 0: none did.
    """

    sequence: Sequence
    times: list[float] = field(default_factory=list)
    poses: list[Matrix] = field(default_factory=list)
    covariances: list[Matrix] = field(default_factory=list)
    rows: list[FrameRow] = field(default_factory=list)
    stages: list[Mapping[str, float]] = field(default_factory=list)
    has_stamps: bool = True
    signal: int = 0

    @property
    def interrupted(self) -> bool:
        """Whether it was ended before its time."""
        return self.signal != 0

    @property
    def tracked(self) -> bool:
        """Whether the odometry tracked every frame of the sequence."""
        known = {reason.value for reason in Tracking if reason.is_tracked}
        return not self.interrupted and bool(self.rows) and all(row.reason in known for row in self.rows)

    @property
    def trajectory(self) -> Trajectory:
        """The poses of all frames, also of those that were missing."""
        n = len(self.times)
        return Trajectory(
            np.array(self.times), np.reshape(self.poses, (n, 4, 4)), np.reshape(self.covariances, (n, 6, 6)),
            self.has_stamps,
        )

    def to_dict(self) -> dict[str, Any]:
        """The summary, ready for JSON; times of a frame are medians over all frames."""
        missing = [row.frame for row in self.rows if row.message]
        return {
            "sequence": self.sequence.name,
            "kind": self.sequence.kind,
            "frames": len(self.rows),
            "frames_of_the_sequence": self.sequence.length,
            "interrupted": self.interrupted,
            "missing": missing,
            "reasons": dict(Counter(row.reason for row in self.rows)),
            "length": float(self.trajectory.distances[-1]) if self.rows else 0.0,
            "times": "seconds" if self.has_stamps else "frame numbers",
            "seconds_total": {name: sum(getattr(row, name) for row in self.rows) for name in ("read", "step", "cpu")},
            "seconds_a_frame": {name: _median(getattr(row, name) for row in self.rows)
                                for name in ("read", "step", "cpu")},
            "seconds_a_frame_by_stage": {name: _median(step.get(name, 0.0) for step in self.stages)
                                         for name in dict.fromkeys(name for step in self.stages for name in step)},
        }


def run(
    sequence: Sequence,
    odometry: OdometryLike,
    output: str | os.PathLike[str],
    progress: Progress | None = None,
    *,
    prefetch: bool = False,
) -> Drive:
    """Takes all frames of a sequence through the odometry and writes what comes of it into a folder.

    output: the folder, made where it is not there; what a run before left in these files is replaced.
    progress: called as progress(finished, of) after each frame; of is None where the number is not known.
    prefetch: a thread reads the next frame while one is worked on; its work is then part of what `cpu` counts.

    A frame without a cloud, or with one that the odometry refuses, is a missing one and ends nothing. A SIGINT (Ctrl-C)
    or SIGTERM ends the drive after the frame at hand, and everything is written; `interrupted` says so.

    Raises CloudFileError where no frame at all can be read, RunError where the folder cannot be written; what is
    written by then stays.
    """
    folder = _emptied(output)
    drive = Drive(sequence)
    with ExitStack() as files:
        writers = [files.enter_context(TrajectoryWriter(folder / f"trajectory_{form}.txt", form))
                   for form in ("tum", "kitti")]
        frames_file = files.enter_context(FramesWriter(folder / "frames.csv"))
        stop = files.enter_context(interruptible())
        for frame, read in _timed(ahead(iter(sequence)) if prefetch else iter(sequence)):
            _take(drive, odometry, frame, read)
            for writer in writers:
                writer.add(drive.times[-1], drive.poses[-1])
            frames_file.add(drive.rows[-1], drive.covariances[-1])
            if progress is not None:
                progress(len(drive.rows), sequence.length)
            drive.signal = stop()
            if drive.signal:
                break
        _finish(drive, odometry, folder)
    return drive


def _take(drive: Drive, odometry: OdometryLike, frame: Frame, read: float) -> None:
    """One step, and what is to be written down of it."""
    began, worked = perf_counter(), process_time()
    message = _step(odometry, frame)
    seconds, cpu = perf_counter() - began, process_time() - worked
    last = odometry.last
    assert last is not None
    drive.has_stamps &= frame.stamp is not None
    time = float(frame.index) if frame.stamp is None else frame.stamp
    drive.times.append(time)
    drive.poses.append(np.array(last.pose))
    drive.covariances.append(np.array(last.covariance))
    drive.stages.append(dict(last.seconds))
    points = 0 if frame.cloud is None else len(frame.cloud)
    drive.rows.append(FrameRow(frame.index, time, points, last.reason.value, message, read, seconds, cpu))


def _step(odometry: OdometryLike, frame: Frame) -> str:
    """Why the frame counts as missing; empty where it does not."""
    if frame.cloud is None:
        odometry.step(None, None, frame.stamp)
        return frame.reason
    try:
        odometry.step(frame.cloud, frame.cloud.times, frame.stamp)
    except ArgumentError as error:
        odometry.step(None, None, frame.stamp)
        return str(error)
    return ""


def _timed(frames: Iterator[Frame]) -> Iterator[tuple[Frame, float]]:
    """The frames, and the seconds that each was waited for."""
    while True:
        began = perf_counter()
        frame = next(frames, None)
        if frame is None:
            return
        yield frame, perf_counter() - began


def _emptied(output: str | os.PathLike[str]) -> Path:
    """The folder, without what a run before wrote at its end."""
    folder = Path(output)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in ("map.ply", "summary.json", "odometry_tum.txt", "trajectory.png"):
            (folder / name).unlink(missing_ok=True)
    except OSError as error:
        raise RunError(f"{folder} cannot be written: {error.strerror or error}") from error
    return folder


def _finish(drive: Drive, odometry: OdometryLike, folder: Path) -> None:
    write_cloud(folder / "map.ply", odometry.map)
    _write_summary(folder / "summary.json", drive.to_dict())


def add_to_summary(folder: str | os.PathLike[str], **parts: Any) -> None:
    """Adds what was found after a drive to its summary.json. Raises RunError where it cannot be written."""
    path = Path(folder) / "summary.json"
    _write_summary(path, json.loads(path.read_text()) | parts)


def _write_summary(path: Path, summary: Mapping[str, Any]) -> None:
    try:
        with replacing(path) as unfinished:
            unfinished.write_text(json.dumps(summary, indent=1))
    except OSError as error:
        raise RunError(f"{path} cannot be written: {error.strerror or error}") from error


def _median(values: Iterable[float]) -> float:
    """0 of nothing."""
    return float(np.median(list(values) or [0.0]))
