"""A recording for the Rerun viewer (.rrd): clouds, the motion of the source as a transform, trajectories in time."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import missing_extra
from ..motions import Matrix
from ..odometry.trajectory import Trajectory
from ..whole_file import write_bytes
from .cloud_picture import COLORS, Layer
from .painting import Array

_FAR = 1e4  # times its size that a cloud may lie from the origin: Rerun has float32


def write_clouds_recording(
    layers: Sequence[Layer], poses: Sequence[Matrix | None], path: str | os.PathLike[str], title: str
) -> Path:
    """Clouds, each in its own frame, with the motion that brings it into the world's.

    layers: as they are before their motion. poses: (4, 4) world_from_cloud of each, or None: it lies in the world. On
    the time line "pose" they are as they came at 0, and moved at 1.

    Raises MissingExtraError without Rerun, and ArgumentError where the file cannot be written.
    """
    rr, recording = _begin(title)
    shift = _shift([layer.points if pose is None else layer.points @ pose[:3, :3].T + pose[:3, 3]
                    for layer, pose in zip(layers, poses, strict=True)])
    if shift.any():
        recording.log("world", rr.TextDocument(f"shifted by {(-shift).tolist()}"), static=True)
    for name, layer, pose in zip(_names([layer.name for layer in layers]), layers, poses, strict=True):
        # The cloud about its own middle, so that float32 holds it wherever it lies.
        middle = np.zeros(3) if pose is None else _shift([layer.points])
        offset = shift if pose is None else middle
        recording.log(f"world/{name}/points", _points(rr, layer.points - offset, layer.colors), static=True)
        if pose is not None:
            for step, T in enumerate((np.eye(4), pose)):
                recording.set_time("pose", sequence=step)
                recording.log(f"world/{name}", _transform(rr, T, T[:3, :3] @ middle + T[:3, 3] - shift))
    return _save(recording, path)


def write_trajectory_recording(
    trajectories: Mapping[str, Trajectory], path: str | os.PathLike[str], title: str, truth: Trajectory | None = None
) -> Path:
    """Trajectories by name: each way as a line, and its sensor that moves along the time line: "time" in seconds, or
    "frame" where one has no times. Raises as write_clouds_recording does."""
    rr, recording = _begin(title)
    ways = trajectories if truth is None else trajectories | {"truth": truth}  # type: ignore[operator]
    shift = _shift([way.positions for way in ways.values()])
    has_times = all(way.has_times for way in ways.values())
    for number, (name, way) in enumerate(zip(_names(ways), ways.values(), strict=True)):
        color = _bytes(np.array(COLORS[number % len(COLORS)]))
        line = rr.LineStrips3D([way.positions - shift], colors=[color])
        recording.log(f"world/{name}/way", line, static=True)
        for k, (time, pose) in enumerate(zip(way.times.tolist(), way.poses, strict=True)):
            recording.set_time(**({"timeline": "time", "duration": time} if has_times
                                  else {"timeline": "frame", "sequence": k}))
            recording.log(f"world/{name}/sensor", _transform(rr, pose, pose[:3, 3] - shift))
    return _save(recording, path)


def _begin(title: str) -> tuple[Any, Any]:
    try:
        import rerun as rr
    except ImportError as error:
        raise missing_extra("rerun", "writing a recording for Rerun (.rrd)") from error
    recording = rr.RecordingStream("fieldalign")
    recording.send_recording_name(title)
    recording.memory = recording.memory_recording()
    recording.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    return rr, recording


def _save(recording: Any, path: str | os.PathLike[str]) -> Path:
    return write_bytes(recording.memory.drain_as_bytes(), path)


def _points(rr: Any, points: Array, colors: Array) -> Any:
    return rr.Points3D(points.astype(np.float32), colors=_bytes(colors))


def _transform(rr: Any, T: Matrix, shift: Array) -> Any:
    return rr.Transform3D(translation=shift, mat3x3=T[:3, :3])


def _bytes(colors: Array) -> NDArray[np.uint8]:
    return np.rint(255 * colors).astype(np.uint8)


def _shift(clouds: Sequence[Array]) -> Array:
    """What to take from coordinates that lie too far off for float32: their middle in whole numbers; else nothing."""
    places = np.concatenate(clouds)
    middle = np.median(places, axis=0)
    size = float(np.linalg.norm(np.ptp(places, axis=0)))
    return np.rint(middle) if float(np.abs(middle).max()) > _FAR * size else np.zeros(3)


def _names(names: Sequence[str] | Mapping[str, Any]) -> list[str]:
    """Names that tell all apart; a "/" would make a branch of Rerun's tree."""
    plain = [name.replace("/", "_") for name in names]
    return [name if plain.count(name) == 1 else f"{name} ({k})" for k, name in enumerate(plain, 1)]
