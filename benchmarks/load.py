"""Load: ten thousand registrations in one process, a hundred threads at once, two cores, a pair of 50 million points.

    python benchmarks/load.py --output docs/benchmarks [--only NAME]

Each part runs in a process of its own, so that its memory is its own. Writes load.json.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import fieldalign as fa
from fieldalign.clouds.simulated import simulate_pair
from fieldalign.evaluation import rotation_error, translation_error

EVERY = 500
HUGE = 50_000_000


def resident() -> float:
    """MB of this process now."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def peak() -> float:
    """MB of this process, at most."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def bits(result: fa.RegistrationResult) -> bytes:
    return result.T_target_source.tobytes() + result.information.tobytes()


def many(count: int = 10_000) -> dict[str, Any]:
    """One small pair after the other, of a hundred different ones, by both methods in turn."""
    pairs = [simulate_pair(seed, 4000) for seed in range(100)]
    memory, pace, first = [], [], {}
    began = time.process_time()  # of both cores together: others use the machine, too
    for k in range(count):
        pair = pairs[k % 100]
        method = "paper" if k // 100 % 2 else "robust"
        found = bits(fa.register(pair.source, pair.target, method=method, threads=2))
        assert first.setdefault((k % 100, method), found) == found
        if k % EVERY == EVERY - 1:
            now = time.process_time()
            memory.append(round(resident(), 1))
            pace.append(round(1e3 * (now - began) / EVERY, 2))
            began = now
            print(k + 1, memory[-1], "MB", pace[-1], "ms of CPU", flush=True)
    return {"registrations": count, "every": EVERY, "resident_mb": memory, "cpu_ms_a_registration": pace,
            "same_bits": True, "growth_mb_after_the_first": round(memory[-1] - memory[0], 1)}


def at_once(callers: int = 100) -> dict[str, Any]:
    """As many threads that call at the same moment, each allowed all cores."""
    pair = simulate_pair(3, 20_000)
    alone = bits(fa.register(pair.source, pair.target))
    one = timed(lambda: fa.register(pair.source, pair.target))
    with ThreadPoolExecutor(callers) as pool:
        seconds = timed(lambda: check(pool.map(lambda _: bits(fa.register(pair.source, pair.target)), range(callers)),
                                      alone))
    return {"callers": callers, "same_bits": True, "seconds": round(seconds, 2),
            "ms_a_registration": round(1e3 * seconds / callers, 1), "ms_alone": round(1e3 * one, 1),
            "peak_mb": round(peak())}


def check(found: Any, expected: bytes) -> None:
    assert all(one == expected for one in found)


def two_cores(count: int = 40) -> dict[str, Any]:
    """The same registrations one after the other and by two callers, one thread each; and with two threads each."""
    pair = simulate_pair(3, 20_000)
    source, target = fa.prepare(pair.source), fa.prepare(pair.target)

    def call(threads: int) -> None:
        fa.register(source, target, threads=threads)

    call(1)
    told: dict[str, Any] = {"registrations": count}
    for name, callers, threads in (("one caller", 1, 1), ("two callers", 2, 1), ("two threads", 1, 2)):
        with ThreadPoolExecutor(callers) as pool:
            times = [timed(lambda p=pool, n=threads: list(p.map(call, [n] * count))) for _ in range(3)]
            told[name] = round(min(times), 3)
    told["gain of two callers"] = round(told["one caller"] / told["two callers"], 2)
    told["gain of two threads"] = round(told["one caller"] / told["two threads"], 2)
    return told


def timed(call: Callable[[], Any]) -> float:
    began = time.perf_counter()
    call()
    return time.perf_counter() - began


def huge_pair() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """50 million points each: half a million of a scan, a hundred times with noise; and T_target_source."""
    pair = simulate_pair(3, 500_000)
    made = []
    for k, cloud in enumerate((pair.source, pair.target)):
        rng, points = np.random.default_rng(k), np.empty((HUGE, 3))
        for start in range(0, HUGE, len(cloud)):
            part = points[start : start + len(cloud)]
            part[:] = cloud.points[: len(part)] + rng.normal(0, 0.003, (len(part), 3))
        made.append(points)
    return made[0], made[1], pair.T_target_source


def huge_arrays() -> dict[str, Any]:
    source, target, T = huge_pair()
    before = resident()
    return huge(lambda: fa.register(source, target), T, before)


def huge_files(suffix: str) -> dict[str, Any]:
    """Written by another process: the memory is of reading and registering alone."""
    with TemporaryDirectory(prefix="load-") as folder:
        subprocess.run([sys.executable, __file__, "--write", folder, suffix], check=True)
        paths = [f"{folder}/{name}{suffix}" for name in ("source", "target")]
        told = huge(lambda: fa.register(*paths), np.load(f"{folder}/T.npy"), resident())
        return told | {"suffix": suffix, "mb_a_file": round(os.path.getsize(paths[0]) / 1e6)}


def write_huge(folder: str, suffix: str) -> None:
    source, target, T = huge_pair()
    np.save(f"{folder}/T.npy", T)
    fa.write_cloud(f"{folder}/source{suffix}", source)
    fa.write_cloud(f"{folder}/target{suffix}", target)


def huge(call: Callable[[], fa.RegistrationResult], T: np.ndarray, before: float) -> dict[str, Any]:
    began, worked = time.perf_counter(), time.process_time()
    result = call()
    seconds, cpu = time.perf_counter() - began, time.process_time() - worked
    return {
        "points": HUGE, "accepted": result.accepted, "seconds": round(seconds, 1),
        "cpu_seconds": round(cpu, 1),
        "rre_deg": round(rotation_error(result.T_target_source, T), 5),
        "rte": round(translation_error(result.T_target_source, T), 6),
        "mb_before": round(before), "peak_mb": round(peak()), "seconds_by_stage": {
            name: round(value, 2) for name, value in result.seconds.items()},
    }


PARTS: dict[str, Callable[[], dict[str, Any]]] = {
    "two_cores": two_cores, "at_once": at_once, "many": many, "huge_arrays": huge_arrays,
    "huge_npy": lambda: huge_files(".npy"), "huge_ply": lambda: huge_files(".ply"),
}


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--output", type=Path)
    parser.add_argument("--only", choices=PARTS)
    parser.add_argument("--part", choices=PARTS)
    parser.add_argument("--write", nargs=2)
    asked = parser.parse_args()
    if asked.write:
        write_huge(*asked.write)
        return
    if asked.part:
        print(json.dumps(PARTS[asked.part]()))
        return
    path = None if asked.output is None else asked.output / "load.json"
    told = json.loads(path.read_text()) if path is not None and path.exists() else {}
    told |= {"machine": f"{os.cpu_count()} cores", "python": platform.python_version(), "numpy": np.__version__}
    for name in [asked.only] if asked.only else PARTS:
        ran = subprocess.run([sys.executable, __file__, "--part", name], stdout=subprocess.PIPE, text=True, check=True)
        told[name] = json.loads(ran.stdout.splitlines()[-1])
        print(name, json.dumps(told[name]), flush=True)
        if path is not None:
            path.write_text(json.dumps(told, indent=1) + "\n")


if __name__ == "__main__":
    main()
