"""The building, put together in a process of its own, whose memory and that of all its children is watched.

    python benchmarks/assemble_building.py JOB.json      does what the file says, and writes its answer beside it

is what `whole` and `executors` start: for each run a fresh process, so that its peak is its own.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import building
import numpy as np

from fieldalign.motions import best_motion

FOLDER = building.FOLDER
SCANS, POINTS, PART = 200, 1_000_000, 40
SMALL_SCANS, SMALL_POINTS, SMALL_PART = 12, 50_000, 6
LIMIT = 0.03  # metres
EXECUTORS = {"1 process": None, "2 processes": 2, "local Dask cluster": "local"}
DOF = {False: "levelled", True: None}

_made: set[Path] = set()  # by this process


def whole(arguments, free: bool) -> dict:
    """All scans on two processes: places, pairs, memory, time."""
    folder = made(arguments, free)
    row, poses = assembled(folder, list(range(len(building.files(folder)))), free, executor=2)
    shared = np.load(folder / "truth.npz")["shared"]
    return {"run": row, "building": building.described(shared)} | off(poses, building.truth(folder))


def executors(arguments) -> dict:
    """A part of the levelled building on each executor: the same bits, and what each takes."""
    folder = made(arguments, free=False)
    chosen = building.part(folder, SMALL_PART if arguments.quick else PART)
    runs, first = {}, None
    for name, executor in EXECUTORS.items():
        runs[name], poses = assembled(folder, chosen, False, executor)
        first = poses if first is None else first
        runs[name] |= off(poses, building.truth(folder)[chosen])
        runs[name]["same"] = runs[name]["error"] is None and np.array_equal(first, poses, equal_nan=True)
        print(name, "same" if runs[name]["same"] else "NOT THE SAME", f"{runs[name]['wall_s']:.0f} s", flush=True)
    return {"runs": runs}


def made(arguments, free: bool) -> Path:
    """The folder of the building. It is made once by this process, or was left there by --keep; only one lies there."""
    scans, points = (SMALL_SCANS, SMALL_POINTS) if arguments.quick else (SCANS, POINTS)
    folder = arguments.building / f"{'small-' if arguments.quick else ''}{'free' if free else 'levelled'}"
    there = (folder / "truth.npz").exists() and len(building.files(folder)) == scans
    if not (there and (arguments.keep or folder in _made)):
        remove(arguments)
        took = building.make(folder, scans, points, free, seed=0)
        print(f"{folder}: {scans} scans in {took['seconds']:.0f} s", flush=True)
        _made.add(folder)
    return folder


def remove(arguments) -> None:
    """What this process has made, unless it is to be kept."""
    while _made and not arguments.keep:
        shutil.rmtree(_made.pop())


# ------------------------------------------------------------------------------------------------ one run


def assembled(folder: Path, chosen: list[int], free: bool, executor) -> tuple[dict, np.ndarray]:
    """What a run took, and its poses (n, 4, 4): NaN for a scan that is not in the largest component."""
    paths = [str(building.files(folder)[k]) for k in chosen]
    with tempfile.TemporaryDirectory(prefix="bench-assemble-") as place:
        job = Path(place, "job.json")
        job.write_text(json.dumps({"paths": paths, "dof": DOF[free], "executor": executor}))
        start = time.perf_counter()
        process = subprocess.Popen([sys.executable, __file__, str(job)])
        peak = watched(process)
        took = {"scans": len(paths), "wall_s": time.perf_counter() - start, "peak_gib": peak / 2**30}
        if process.returncode:
            return took | {"error": f"exit status {process.returncode}"}, np.full((len(paths), 4, 4), np.nan)
        told = json.loads(job.with_suffix(".told").read_text())
        return told | took | {"error": None}, np.load(job.with_suffix(".npy"))


def watched(process: subprocess.Popen) -> int:
    """The most bytes that a process and all its descendants held at one time: shared pages are counted once."""
    import psutil

    peak = 0
    while process.poll() is None:
        held = 0
        try:
            family = psutil.Process(process.pid)
            for member in [family, *family.children(recursive=True)]:
                held += _held(member)
        except psutil.Error:  # it has just ended
            pass
        peak = max(peak, held)
        time.sleep(0.2)
    return peak


def _held(process) -> int:
    """Bytes of a process: its share of all pages where the system tells it (Linux), else its resident ones."""
    import psutil

    try:
        told = process.memory_full_info()
        return getattr(told, "pss", told.rss)
    except psutil.Error:
        return 0


def off(poses: np.ndarray, T: np.ndarray) -> dict:
    """Metres by which each scanner's place is off, after the poses are laid on the true ones by the motion of the scan
    with which most others agree, and then by least squares of those."""
    placed = np.flatnonzero(np.isfinite(poses[:, 0, 0]))
    metres = np.full(len(T), np.nan)
    if len(placed) >= 3:
        there = T[placed, :3, 3]
        tried = [_places(M, poses[placed]) for M in T[placed] @ np.linalg.inv(poses[placed])]
        agree = max((np.linalg.norm(here - there, axis=1) <= LIMIT for here in tried), key=np.sum)
        M = best_motion(poses[placed][agree, :3, 3], there[agree]) if agree.sum() >= 3 else np.eye(4)
        metres[placed] = np.linalg.norm(_places(M, poses[placed]) - there, axis=1)
    within = int((metres <= LIMIT).sum())
    return {"placed": len(placed), "within": within, "m": [None if np.isnan(m) else float(m) for m in metres]}


def _places(M: np.ndarray, poses: np.ndarray) -> np.ndarray:
    return poses[:, :3, 3] @ M[:3, :3].T + M[:3, 3]


def _run(job: Path) -> None:
    """Inside of the fresh process."""
    import fieldalign as fa

    asked = json.loads(job.read_text())
    cpu = time.perf_counter()
    found = fa.assemble(
        asked["paths"], dof=asked["dof"], sensor_at_origin=True, executor=asked["executor"], seed=0,
        progress=_progress(),
    )
    largest = set(found.components[0]) if found.components else set()
    poses = np.stack([found.poses[k] if k in largest else np.full((4, 4), np.nan) for k in range(len(asked["paths"]))])
    told = {
        "assemble_s": time.perf_counter() - cpu,
        "tried": found.tried,
        "edges": len(found.edges),
        "doubted": len(found.doubted),
        "components": [len(members) for members in found.components],
        "stages_s": dict(found.seconds),
        "left_out": {str(k): reason for k, reason in found.left_out.items()},
    }
    np.save(job.with_suffix(".npy"), poses)
    job.with_suffix(".told").write_text(json.dumps(told))


def _progress():
    """Prints every tenth of a stage, with the time since the start."""
    start, said = time.perf_counter(), {}

    def progress(stage: str, finished: int, of: int) -> None:
        tenth = 10 * finished // max(of, 1)
        if said.get(stage) != (tenth, of):
            said[stage] = (tenth, of)
            print(f"   {time.perf_counter() - start:6.0f} s  {stage} {finished} of {of}", flush=True)

    return progress


if __name__ == "__main__":
    _run(Path(sys.argv[1]))
