"""The sequences of the odometry benchmark: short real ones of ../shared/data, and simulated drives in a folder."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from scenes import DATA

from fieldalign.evaluation import absolute_errors, relative_errors, segment_errors

KITTI = tuple(range(100, 801, 100))  # metres, of the segments
INDOOR = tuple(range(10, 81, 10))  # of a walk of 200 m
PICTURED = 10  # every so many frames, for the picture


@dataclass(frozen=True, eq=False)
class Frame:
    """points: (N, 3) float32; times: (N,) float64, seconds, or None."""

    points: np.ndarray
    times: np.ndarray | None


@dataclass(frozen=True, eq=False)
class Sequence:
    """Files of frames, and what is known of the truth: poses (n, 4, 4) by the moment of the sweep that they are for."""

    files: list[Path]
    truths: dict[str, np.ndarray]
    lengths: tuple = KITTI

    def __len__(self) -> int:
        return len(self.files)

    def first(self, count: int | None) -> Sequence:
        truths = {moment: poses[:count] for moment, poses in self.truths.items()}
        return Sequence(self.files[:count], truths, self.lengths)

    def frames(self, timeless: bool = False) -> Iterator[Frame]:
        """One by one, read when they are asked for."""
        for file in self.files:
            frame = read(file)
            yield Frame(frame.points, None) if timeless else frame

    @property
    def metres(self) -> float:
        places = next(iter(self.truths.values()))[:, :3, 3]
        return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


def read(file: Path) -> Frame:
    with np.load(file) as frame:
        times = frame["stamp"] + frame["times"].astype(float) if "times" in frame else None
        return Frame(frame["xyz"], times)


def real(name: str) -> Sequence:
    """kitti00 beside SemanticKITTI's poses, the others beside a chain of GICP."""
    folder = DATA / name
    if name == "kitti00":
        poses = np.load(folder / "poses.npz")["world_from_lidar_semantickitti"]
    else:
        poses = _chained(np.load(folder / "reference_poses.npz")["prev_from_next_gicp"])
    return Sequence(sorted(folder.glob("[0-9]*.npz")), {"given": poses})


def _chained(steps: np.ndarray) -> np.ndarray:
    poses = [np.eye(4)]
    for step in steps:
        poses.append(poses[-1] @ step)
    return np.stack(poses)


def drive(folder: Path, indoors: bool) -> Sequence:
    """A drive that benchmarks/drives.py has made; as much of it as is there."""
    files = sorted(folder.glob("[0-9]*.npz"))
    with np.load(folder / "poses.npz") as poses:
        names = {"start": "world_from_lidar_start", "middle": "world_from_lidar_middle", "end": "world_from_lidar"}
        truths = {moment: poses[name][: len(files)] for moment, name in names.items()}
    return Sequence(files, truths, INDOOR if indoors else KITTI)


def judged(sequence: Sequence, poses: np.ndarray) -> dict:
    """Errors of poses (n, 4, 4), taken for that moment of the sweep, of those that the truth is known at, at which the
    drift is least."""
    rows = {moment: _judged(truth, poses, sequence.lengths) for moment, truth in sequence.truths.items()}
    moment = min(rows, key=lambda moment: rows[moment]["t_percent"] or rows[moment]["rpe_m"])
    return {"moment": moment} | rows[moment]


def _judged(truth: np.ndarray, poses: np.ndarray, lengths: tuple) -> dict:
    """end_m: of the last pose, the first ones laid on each other. ate_m: RMS, aligned by all places. rpe_m, rpe_deg:
    RMS, from frame to frame. t_percent, r_deg_100m: KITTI's."""
    from_first = partial(np.matmul, np.linalg.inv(truth[0]))
    absolute, T = absolute_errors(truth, poses, "positions")
    relative, segments = relative_errors(truth, poses), segment_errors(truth, poses, lengths)
    found = from_first(T @ poses), from_first(truth)
    return {
        "end_m": float(np.linalg.norm((np.linalg.inv(poses[0]) @ poses[-1] - from_first(truth[-1]))[:3, 3])),
        "ate_m": _rms(absolute.translation),
        "rpe_m": _rms(relative.translation),
        "rpe_deg": _rms(relative.rotation),
        "t_percent": segments.translation_percent if len(segments) else None,
        "r_deg_100m": segments.rotation_deg_per_100m if len(segments) else None,
        "path": {axis: found[0][::PICTURED, k, 3].tolist() for k, axis in enumerate("xyz")},
        "true_path": {axis: found[1][::PICTURED, k, 3].tolist() for k, axis in enumerate("xyz")},
    }


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
