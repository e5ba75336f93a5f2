"""The work on a drive: two scans by the paper's method, or all of them by an odometry."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from time import perf_counter, process_time
from typing import Any, TypeAlias

import numpy as np

from ...assembly.work import Load
from ...motions import Matrix
from ...odometry import Odometry
from ...register import register
from ...settings import Settings
from ..columns import adapters
from ..data_sets.files import points_of
from ..data_sets.kitti import ScanPair

REACH = 100.0  # m, of KITTI's sensor, that KISS-ICP is told

Step: TypeAlias = Callable[[Matrix], Matrix]
Work: TypeAlias = "ScanToScan | Stream"


@dataclass(frozen=True)
class ScanToScan:
    """The motion between two scans by the paper's method, from the identity."""

    pair: ScanPair
    settings: Settings
    seed: int

    def __call__(self, threads: int) -> dict[str, Any]:
        """T, row by row, and the seconds that it took."""
        source, target = self.pair.clouds()
        began, worked = perf_counter(), process_time()
        result = register(source, target, init=np.eye(4), method="paper", settings=self.settings, seed=self.seed,
                          threads=threads)
        return {"T": _rows(result.T_target_source), "seconds": perf_counter() - began,
                "cpu_seconds": process_time() - worked}


@dataclass(frozen=True)
class Stream:
    """All scans, by fieldalign's odometry or, of a folder of adapters, by KISS-ICP."""

    files: tuple[str, ...]
    peers: str | None = None

    def __call__(self, threads: int) -> dict[str, Any]:
        """The poses, row by row, and the seconds that each step took."""
        step = _fieldalign() if self.peers is None else _kiss_icp(self.peers, threads)
        poses, seconds, cpu = [], [], []
        for file in self.files:
            points = points_of(file)
            began, worked = perf_counter(), process_time()
            poses.append(_rows(step(points)))
            seconds.append(perf_counter() - began)
            cpu.append(process_time() - worked)
        return {"poses": poses, "seconds": seconds, "cpu_seconds": cpu}


@dataclass(frozen=True)
class Doing:
    """Does work, for an executor."""

    threads: int

    def __call__(self, work: Work, load: Load) -> dict[str, Any]:
        """What comes of it, as JSON can hold it."""
        return work(self.threads)


def has_kiss_icp(peers: Path) -> bool:
    """Whether a folder of adapters has the odometry, too."""
    return (peers / "kiss_icp.py").is_file()


def _fieldalign() -> Step:
    odometry = Odometry()
    return lambda points: odometry.step(points)


def _kiss_icp(folder: str, threads: int) -> Step:
    """KITTI's scans are deskewed as they are published."""
    package = adapters(folder)
    odometry = import_module(f"{package.__name__}.kiss_icp").Odometry(False, REACH, threads)
    return lambda points: np.asarray(odometry.step(points, None), float)


def _rows(T: Matrix) -> list[float]:
    rows: list[float] = T[:3].ravel().tolist()
    return rows
