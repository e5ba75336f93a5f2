"""The figure of a trajectory: KITTI's sequence 00 without loop closure."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from ...assembly.record import RunRecord
from ...assembly.work import Task
from ...errors import DataSetError
from ...evaluation import Evaluation, evaluate
from ...motions import Matrix
from ...odometry.trajectory import Trajectory
from ...settings import PRESETS
from ...whole_file import write_text
from .. import results, tables
from ..alone import telling
from ..comparison import asked_of
from ..data_sets import kitti
from ..data_sets.kitti import KittiSequence
from ..request import Report, Request
from .streams import Doing, ScanToScan, Stream, Work, has_kiss_icp

NAME = "kitti-trajectory"
TITLE = "Figure: KITTI's sequence 00 without loop closure"
PROTOCOL = (
    "Every scan of sequence 00 in turn; with --limit the first so many. ../shared/data has the first 16.",
    "The paper's method, scan to scan, with ISS keypoints: each scan onto the one before, from the identity (the paper "
    "does not say from where; the motion of the step before as a guess gives the same to a millimetre on the first 15 "
    "steps), and the motions one after the other. A step without an answer repeats the motion before.",
    "fieldalign's odometry as it comes, told nothing; KISS-ICP (with --peers) told that the sensor reaches 100 m. No "
    "loops are closed, and no scan is corrected for KITTI's known error of its vertical angles.",
    "Errors in the LiDAR's frame, all in the frame of the first scan. KITTI's measure: the mean over segments of 100 "
    "to 800 m, where the drive is so long. The truth is KITTI's; of ../shared/data SemanticKITTI's, good to 1-5 cm.",
)
TITLES = {
    "default": "fieldalign, odometry", "paper": "the paper's method, scan to scan", "kiss-icp": "KISS-ICP",
}


def run(request: Request) -> Report:
    """Writes NAME.json with every pose, NAME.md with the table and NAME.png with the ways.

    Raises DataSetError where there is no sequence 00, ArgumentError for columns that there are not.
    """
    drive = _first(kitti.sequence(request.data, "00"), request.limit)
    known = [name for name in TITLES if name != "kiss-icp" or (request.peers and has_kiss_icp(request.peers))]
    found = _done(request, _works(request, drive, asked_of(known, request)))
    trajectories, faults = _trajectories(found, len(drive))
    truth = _trajectory(drive.world_from_lidar)
    evaluations = {
        name: evaluate(trajectory, truth, max_difference=None, alignment="origin")
        for name, trajectory in trajectories.items()
    }
    costs = {name: _cost(found, name) for name in trajectories}
    return _report(request, drive, evaluations, costs, faults)


def _first(drive: KittiSequence, limit: int | None) -> KittiSequence:
    """Its first scans, two at least."""
    n = len(drive) if limit is None else min(max(limit, 2), len(drive))
    if n < 2:
        raise DataSetError(f"{drive.folder} holds {n} scan, but a trajectory has two at least")
    return KittiSequence(drive.name, drive.folder, drive.frames[:n], drive.files[:n], drive.world_from_lidar[:n],
                         drive.positions[:n], drive.truth)


def _works(request: Request, drive: KittiSequence, columns: list[str]) -> dict[str, Work]:
    """The long ones first, by key: of a stream its column, of a step of the paper's method that and its number."""
    peers = str((request.peers or Path()).absolute())
    streams = {"default": Stream(drive.files), "kiss-icp": Stream(drive.files, peers)}
    works: dict[str, Work] = {name: stream for name, stream in streams.items() if name in columns}
    if "paper" in columns:
        settings = PRESETS["outdoor"]
        works |= {f"paper|{k}": ScanToScan(drive.pair(k, k + 1), settings, request.seed) for k in range(len(drive) - 1)}
    return works


def _done(request: Request, works: dict[str, Work]) -> dict[str, dict[str, Any]]:
    """What comes of all the work; what the run folder holds is not done again."""
    executor, folder = request.executor, request.run_folder or request.output / f"{NAME}.run"
    run = {"experiment": NAME, "data": str(request.data.absolute()), "seed": request.seed}
    lengths = {key: f"{len(work.files)} scans, {work.peers}" for key, work in works.items() if isinstance(work, Stream)}
    with RunRecord(folder, run, lengths) as record, telling(executor.threads):
        found = {key: record.done[key] for key in works if key in record.done}
        tasks = [Task(key, (), work) for key, work in works.items() if key not in found]
        request.tell(NAME, 0, len(tasks))
        with closing(executor.run(Doing(executor.threads), tasks, {})) as work:
            for finished, done in enumerate(work, 1):
                found[done.key] = done.value if done.error is None else {"error": done.error}
                record.add(done.key, found[done.key])
                request.tell(NAME, finished, len(tasks))
    return found


def _trajectories(found: dict[str, dict[str, Any]], n: int) -> tuple[dict[str, Trajectory], dict[str, str]]:
    """By column; and of those without one, or whose steps are not all there, why."""
    trajectories, faults = {}, {}
    for name in TITLES:
        if name == "paper" and "paper|0" in found:
            steps = [found[f"paper|{k}"] for k in range(n - 1)]
            if lost := [step["error"] for step in steps if "error" in step]:
                faults[name] = f"{len(lost)} of {n - 1} steps have no answer, the first since {lost[0]}"
            if len(lost) < n - 1:
                trajectories[name] = _trajectory(_chained([step.get("T") for step in steps]))
        elif name in found and "error" in found[name]:
            faults[name] = found[name]["error"]
        elif name in found:
            trajectories[name] = _trajectory(np.stack([_matrix(row) for row in found[name]["poses"]]))
    return trajectories, faults


def _chained(steps: list[list[float] | None]) -> Matrix:
    """Poses (n, 4, 4) in the first scan's frame; None repeats the motion before."""
    motion, poses = np.eye(4), [np.eye(4)]
    for step in steps:
        motion = motion if step is None else _matrix(step)
        poses.append(poses[-1] @ motion)
    return np.stack(poses)


def _matrix(rows: list[float]) -> Matrix:
    return np.vstack([np.reshape(rows, (3, 4)), [0.0, 0.0, 0.0, 1.0]])


def _trajectory(poses: Matrix) -> Trajectory:
    """In the frame of its first pose."""
    return Trajectory(np.arange(float(len(poses))), poses, has_times=False)


def _cost(found: dict[str, dict[str, Any]], name: str) -> float:
    """CPU seconds of a scan, median."""
    if name == "paper":
        return float(np.median([row["cpu_seconds"] for key, row in found.items()
                                if key.startswith("paper|") and "error" not in row]))
    return float(np.median(found[name]["cpu_seconds"]))


def _report(
    request: Request, drive: KittiSequence, evaluations: dict[str, Evaluation], costs: dict[str, float],
    faults: dict[str, str]
) -> Report:
    path = request.output / NAME
    head = results.head(NAME, TITLE, PROTOCOL, request.data, request.seed) | {
        "truth": drive.truth, "scans": len(drive), "not_measured": faults,
    }
    text = _table(drive, evaluations, costs)
    found = [
        {"method": name, "cpu_seconds": costs[name], "end_error_m": _end_error(evaluation)} | evaluation.to_dict()
        | {"poses": evaluation.trajectory.poses[:, :3].reshape(-1, 12).tolist()}
        for name, evaluation in evaluations.items()
    ]
    files = [results.write_json(head | {"methods": found}, path.with_suffix(".json")),
             write_text(results.page(head, text, len(drive)), path.with_suffix(".md"))]
    drives = {TITLES[name]: evaluation for name, evaluation in evaluations.items()}
    return Report(text, files + _picture(path.with_suffix(".png"), evaluations), TITLE, drives=drives)


def _table(drive: KittiSequence, evaluations: dict[str, Evaluation], costs: dict[str, float]) -> str:
    header = ["method", "KITTI, translation (%)", "KITTI, rotation (deg / 100 m)", "end error (m)", "ATE, rmse (m)",
              "RPE, rmse (m)", "RPE, rmse (deg)", "CPU ms a scan"]
    length = _trajectory(drive.world_from_lidar).distances[-1]
    below = "" if any(len(e.segments) for e in evaluations.values()) else "; below 100 m KITTI's measure says nothing"
    return "\n\n".join([
        tables.as_markdown(header, [
            [TITLES[name], *_cells(evaluation), 1e3 * costs[name]] for name, evaluation in evaluations.items()
        ]),
        f"{len(drive)} scans over {length:.4g} m{below}.",
    ])


def _cells(evaluation: Evaluation) -> list[tables.Cell]:
    segments, ate, rpe = evaluation.segments, evaluation.absolute.to_dict(), evaluation.relative.to_dict()
    kitti_errors = (segments.translation_percent, segments.rotation_deg_per_100m) if len(segments) else (None, None)
    rmse = [part["rmse"] if part else None for part in (ate["translation"], rpe["translation"], rpe["rotation_deg"])]
    return [*kitti_errors, _end_error(evaluation), *rmse]


def _end_error(evaluation: Evaluation) -> float:
    return float(evaluation.absolute.translation[-1])


def _picture(path: Path, evaluations: dict[str, Evaluation]) -> list[Path]:
    """Of no trajectory none."""
    from ...reports.trajectory_picture import trajectories_picture

    if not evaluations:
        return []
    ways = {TITLES[name]: evaluation.trajectory for name, evaluation in evaluations.items()}
    truth = next(iter(evaluations.values())).truth
    return [trajectories_picture(ways, path, truth, TITLE.removeprefix("Figure: "))]
