"""fieldalign's odometry and its peer on the same frames, one frame after the other, in one process."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from odometry_sets import Frame, read
from two_cores import THREADS

import fieldalign as fa

REST = 0.003  # seconds between two methods, in which the threads of the first one go to sleep
PAGE = os.sysconf("SC_PAGE_SIZE")
PERIOD = 0.1  # seconds, of the simulated sensors


class Fieldalign:
    """fieldalign, told nothing. Where frames have no times, it finds out by itself whether the sensor spins."""

    def __init__(self, deskew: bool, reach: float, loops: bool = False) -> None:
        self.odometry = fa.Odometry(deskew=deskew, whole=loops)

    def step(self, frame: Frame) -> tuple[Callable[[], np.ndarray], Callable[[], str]]:
        """What is to be timed; and what is to be asked afterwards: how it went."""
        return lambda: self.odometry.step(frame.points, frame.times), lambda: self.odometry.last.reason.name

    def closed(self) -> np.ndarray | None:
        """The poses (n, 4, 4) after the loops were closed."""
        return fa.close_loops(self.odometry, threads=THREADS).trajectory.poses


class Rigid(Fieldalign):
    """fieldalign, told to take each scan as it is."""

    def __init__(self, deskew: bool, reach: float, loops: bool = False) -> None:
        super().__init__(False, reach, loops)


class KissIcp:
    """KISS-ICP, told the reach of the sensor."""

    def __init__(self, deskew: bool, reach: float, loops: bool = False) -> None:
        from peers.kiss_icp import Odometry

        self.odometry = Odometry(deskew, reach, THREADS)

    def closed(self) -> np.ndarray | None:
        """It closes no loops."""
        return None

    def step(self, frame: Frame) -> tuple[Callable[[], np.ndarray], Callable[[], str]]:
        points = frame.points.astype(float)  # its own type, made beforehand
        return lambda: self.odometry.step(points, frame.times), lambda: ""


class Prototype:
    """The prototype, on frames as they are."""

    def __init__(self, deskew: bool, reach: float, loops: bool = False) -> None:
        from peers.odometry_prototype import Odometry

        self.odometry = Odometry()

    def step(self, frame: Frame) -> tuple[Callable[[], np.ndarray], Callable[[], str]]:
        points = np.ascontiguousarray(frame.points, np.float32)
        return lambda: self.odometry.step(points), lambda: ""

    def closed(self) -> np.ndarray | None:
        """It closes no loops."""
        return None


METHODS = {"fieldalign": Fieldalign, "rigid": Rigid, "kiss": KissIcp, "prototype": Prototype}
BOTH = "fieldalign", "kiss"


@dataclass
class Record:
    """What a method answered: a pose, what it said of it, and what it took, for each frame."""

    poses: list[np.ndarray] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    cpu_ms: list[float] = field(default_factory=list)
    wall_ms: list[float] = field(default_factory=list)
    closed: np.ndarray | None = None  # the poses after loops were closed
    closing_s: float = 0.0

    def take(self, step: Callable[[], np.ndarray], say: Callable[[], str]) -> None:
        wall, cpu = time.perf_counter(), time.process_time()
        pose = step()
        self.cpu_ms.append(1e3 * (time.process_time() - cpu))
        self.wall_ms.append(1e3 * (time.perf_counter() - wall))
        self.poses.append(pose)
        self.said.append(say())


def run(
    frames: Iterable[Frame], deskew: bool, reach: float, methods: Iterable[str] = BOTH, loops: bool = False
) -> dict[str, Record]:
    """Every method on every frame; which goes first changes from frame to frame. Loops are closed at the end."""
    running = {name: METHODS[name](deskew, reach, loops) for name in methods}
    records = {name: Record() for name in running}
    for k, frame in enumerate(frames):
        for name in list(running) if k % 2 else reversed(running):
            answer = running[name].step(frame)
            time.sleep(REST)
            records[name].take(*answer)
    if loops:
        for name, method in running.items():
            began = time.perf_counter()
            records[name].closed = method.closed()
            records[name].closing_s = time.perf_counter() - began
    return records


def taken(record: Record) -> dict:
    """Medians of time, ms, without the first frame; and how often what was said."""
    counts = {what: record.said.count(what) for what in dict.fromkeys(record.said) if what}
    return {
        "cpu_ms": float(np.median(record.cpu_ms[1:])),
        "wall_ms": float(np.median(record.wall_ms[1:])),
        "said": counts,
    }


def _to_and_fro(files: list[Path], k: int) -> Frame:
    """Frame k of a drive that goes on backwards in time from its last file, and so on; its clock goes on, too."""
    turn, place = divmod(k, len(files))
    frame = read(files[place if turn % 2 == 0 else -1 - place])
    if turn % 2 == 0:
        return Frame(frame.points, frame.times + turn * len(files) * PERIOD)
    return Frame(frame.points, (turn + 1) * len(files) * PERIOD - frame.times)


def endured(name: str, files: list[Path], frames: int, every: int, reach: float) -> dict:
    """One method alone, in a process of its own, to and fro over the files, until so many frames are done.

    Lists with an entry for each `every` frames: the memory of the process, MiB, and the median CPU time, ms.
    """
    method, took, memory = METHODS[name](True, reach), np.zeros(frames), []
    for k in range(frames):
        record = Record()  # one for each frame: it is not to count as memory
        record.take(*method.step(_to_and_fro(files, k)))
        took[k] = record.cpu_ms[0]
        if (k + 1) % every == 0:
            memory.append(int(Path("/proc/self/statm").read_text().split()[1]) * PAGE / 2**20)
    cpu = np.median(took[: len(memory) * every].reshape(-1, every), axis=1)
    passes = [float(np.median(took[k : k + len(files)])) for k in range(0, frames, len(files))]
    times = {"cpu_ms": cpu.tolist(), "pass_cpu_ms": passes}
    return {"frames": frames, "every": every, "rss_mib": memory} | times
