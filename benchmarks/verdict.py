"""The verdict: how often a wrong pose is accepted and a right one refused, what it costs, and whether the covariance
is calibrated; beside what peers offer for the same question.

    make bench-verdict          (or: python benchmarks/verdict.py --output docs/benchmarks)

Writes verdict.json (a row for each trial), verdict.md (the tables that the docs quote) and verdict.png into the output
folder. Data: ../shared/data or $FIELDALIGN_DATA. The trials are those of verdict_trials.py; each is one call on one
thread, in a pool of processes; what it costs is measured afterwards, alone, on two threads. About an hour on two
cores; --quick takes two minutes.
"""

from __future__ import annotations

from two_cores import THREADS

# isort: split
import argparse
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import simulations
import verdict_report as report
from any_pose import version_of
from columns import Columns
from paper import _processor as processor
from scenes import DATA, INDOOR, SETS, apply
from scipy.spatial.transform import Rotation
from verdict_trials import REGISTER, VERIFY, Trial, evenly, points_of, trials

import fieldalign as fa
from fieldalign.evaluation import rotation_error

IMPRECISE = 2.0  # tolerances: beyond, a pose is wrong
CORRESPONDENCE = 1.5  # voxels, of Open3D's evaluation
ROOMS = 5000  # the first room of the calibration: no room of any trial
FULL, QUICK = (1.0, (150, 300), 25, 100_000, 60), (0.02, (8, 16), 1, 30_000, 6)  # scale, peers', rooms, rays, timed

_trials: list[Trial] = []  # of this process


def prepare(seed: int, scale: float) -> None:
    """Every process of the pool makes the list of trials for itself: they hold functions, which cannot be sent."""
    _trials.extend(trials(seed, scale))


# ------------------------------------------------------------------------------------------------ one trial


def judged(place: int) -> dict:
    """The row of a trial: the pose that came out, its label, the verdict and its evidence."""
    trial = _trials[place]
    source, target, T_true, tolerance, init, ask = trial.make()
    row = {
        "kind": trial.kind,
        "set": trial.set,
        "scene": trial.scene,
        "name": trial.name,
        "half": trial.half,
        "overlap": trial.overlap,
        "ask": ask,
        "guess": init is not None,
        "sighted": isinstance(source, fa.PointCloud),
    }
    try:
        found = answer(source, target, init, ask)
    except fa.FieldalignError as error:
        print(f"{trial.kind} {trial.name}: {type(error).__name__}: {error}", flush=True)
        return row | {"label": "wrong", "accepted": False, "reason": "raised", "strength": 0.0, "pose": None}
    pose = init if ask == VERIFY else found.T_target_source
    return row | labelled(pose, T_true, tolerance, points_of(source)) | told(found) | {"pose": pose}


def answer(source, target, init, ask: str) -> fa.RegistrationResult:
    """fieldalign's answer on one thread: a registration, from the guess if there is one, or the verdict on a pose."""
    if ask == VERIFY:
        return fa.verify(source, target, init, search=True, threads=1)
    return fa.register(source, target, init=init, threads=1)


def told(found: fa.RegistrationResult) -> dict:
    """What a result says of itself."""
    return {
        "accepted": bool(found.accepted),
        "reason": found.reason.value,
        "strength": float(found.evidence.strength),
        "open": found.unobservable.shape[1],
        "overlaps": [float(found.overlap), float(found.overlap_target)],
        "alternatives": len(found.alternatives),
        "evidence": found.evidence.to_dict(),
    }


def labelled(T: np.ndarray, T_true: np.ndarray | None, tolerance: tuple | None, source: np.ndarray) -> dict:
    """Errors in degrees and metres of the source's centroid, and right, imprecise or wrong."""
    if T_true is None:
        return {"label": "wrong", "deg": None, "m": None}
    centre = source.mean(axis=0, keepdims=True)
    turned = rotation_error(T, T_true)
    shifted = float(np.linalg.norm(apply(T, centre) - apply(T_true, centre)))
    off = max(turned / tolerance[0], shifted / tolerance[1])
    return {
        "label": "right" if off < 1 else "imprecise" if off < IMPRECISE else "wrong",
        "deg": float(turned),
        "m": shifted,
    }


# ------------------------------------------------------------------------------------------------ peers


def compared(job: tuple[int, np.ndarray]) -> dict:
    """What the peers say of a trial, as they come, each with the label of the pose it speaks of.

    Open3D judges fieldalign's pose; small_gicp aligns from it; KISS-Matcher finds its own.
    """
    place, pose = job
    trial = _trials[place]
    source, target, T_true, tolerance, *_ = trial.make()
    source, target = points_of(source), points_of(target)
    row = {"place": place, "voxel": trial.voxel}
    for peer, ask in (("open3d", by_open3d), ("gicp", by_gicp), ("kiss", by_kiss)):
        try:
            T, said = ask(source, target, trial.voxel, pose)
        except RuntimeError as error:  # a peer that finds nothing may raise
            print(f"{peer}, {trial.name}: {error}", flush=True)
            T, said = pose, {}
        row |= {f"{peer}_label": labelled(T, T_true, tolerance, source)["label"]}
        row |= {f"{peer}_{what}": value for what, value in said.items()}
    return row


def by_open3d(source, target, voxel: float, T: np.ndarray) -> tuple[np.ndarray, dict]:
    evaluation, _ = open3d_at(source, target, voxel, T)
    return T, {"fitness": evaluation.fitness, "rmse": evaluation.inlier_rmse}


def by_gicp(source, target, voxel: float, T: np.ndarray) -> tuple[np.ndarray, dict]:
    found, points = gicp_from(source, target, voxel, T)
    return found.T_target_source, {"error": found.error, "inliers": found.num_inliers, "points": points}


def by_kiss(source, target, voxel: float, T: np.ndarray) -> tuple[np.ndarray, dict]:
    import kiss_matcher
    from peers.kiss import VOXEL

    scale = VOXEL / voxel
    matcher = kiss_matcher.KISSMatcher(kiss_matcher.KISSMatcherConfig(VOXEL))
    found = matcher.estimate(*((scale * cloud).astype(np.float32) for cloud in (source, target)))
    own = np.eye(4)
    own[:3, :3], own[:3, 3] = found.rotation, found.translation / scale
    return own, {"inliers": matcher.get_num_final_inliers()}


def open3d_at(source, target, voxel: float, T: np.ndarray) -> tuple:
    """Open3D's evaluation of a pose, and its information matrix there."""
    import open3d as o3d

    clouds = [o3d.geometry.PointCloud(o3d.utility.Vector3dVector(c)).voxel_down_sample(voxel) for c in (source, target)]
    registration, reach = o3d.pipelines.registration, CORRESPONDENCE * voxel
    evaluation = registration.evaluate_registration(*clouds, reach, T)
    return evaluation, registration.get_information_matrix_from_point_clouds(*clouds, reach, T)


def gicp_from(source, target, voxel: float, T: np.ndarray) -> tuple:
    """small_gicp's result from a pose, on the benchmark's last level, and how many source points it had."""
    from peers.gicp import LAST, aligned

    return aligned(LAST, source, target, voxel, 1, T)


def sample(rows: list[dict], right: int, wrong: int) -> list[tuple[int, np.ndarray]]:
    """Trials for the peers, evenly chosen from those that any tool could be asked: register, without a guess."""
    chosen = []
    for label, count in (("right", right), ("wrong", wrong)):
        fit = [row["ask"] == REGISTER and not row["guess"] and row["pose"] is not None for row in rows]
        chosen += evenly([k for k, row in enumerate(rows) if fit[k] and row["label"] == label], count)
    return [(place, rows[place]["pose"]) for place in chosen]


# ------------------------------------------------------------------------------------------------ calibration


def scans(rooms: int, largest: int) -> list[tuple]:
    """The simulated pairs of the calibration: room, overlap, rays, noise (m)."""
    sensors = [(30_000, 0.005), (100_000, 0.005), (30_000, 0.001), (30_000, 0.02)]
    numbers = range(ROOMS, ROOMS + rooms)
    return [job for job in product(numbers, (0.9, 0.7, 0.5, 0.3), sensors) if job[2][0] <= largest]


def calibrated(job: tuple) -> dict:
    """The squared error over the stated covariance (NEES) of one simulated pair: ours, Open3D's and small_gicp's.

    Each takes the error in its own convention. fieldalign: T_true = Exp(x) T about reference_point. Open3D: the same
    about the target's origin; its matrix is that of a unit spread of the paired points, "open3d_scaled" puts their
    mean square (of one coordinate) in its place. small_gicp: T_true = T Exp(x), H as it comes.
    """
    number, overlap, (rays, noise) = job
    target, source, T_true, _ = simulations.simulate(number, overlap=overlap, rays=(rays, rays), noise=noise)
    found = fa.register(source, target, threads=1)
    T = found.T_target_source
    row = {"room": number, "overlap": overlap, "rays": rays, "noise": noise} | told(found)
    row |= labelled(T, T_true, INDOOR, source)
    if row["label"] == "wrong":
        return row
    voxel = SETS["simulated"].voxel
    evaluation, spread = open3d_at(source, target, voxel, T)
    other, _ = gicp_from(source, target, voxel, T)
    correction = T_true @ np.linalg.inv(T)
    open3d = squared(twist(correction, np.zeros(3)), spread)
    own = np.linalg.inv(other.T_target_source) @ T_true
    return row | {
        "nees": squared(twist(correction, found.reference_point), found.information),
        "open3d": open3d,
        "open3d_scaled": open3d / (evaluation.inlier_rmse**2 / 3),
        "gicp": squared(twist(own, np.zeros(3)), other.H),
    }


def twist(D: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """The small motion D (4, 4) as rotation vector and shift of the centre (6,)."""
    return np.r_[Rotation.from_matrix(D[:3, :3]).as_rotvec(), apply(D, centre[None])[0] - centre]


def squared(x: np.ndarray, information: np.ndarray) -> float:
    return float(x @ information @ x)


# ------------------------------------------------------------------------------------------------ cost


def costs(count: int) -> list[dict]:
    """Time of the verdict beside that of the whole, on right pairs, alone on two threads."""
    right = evenly([trial for trial in trials() if trial.kind == "right"], count)
    timed(right[0])  # warms up
    return [timed(trial) for trial in right]


def timed(trial: Trial) -> dict:
    source, target, *_ = trial.make()
    stages = {stage: 1e3 * s for stage, s in fa.register(source, target, threads=THREADS).seconds.items()}
    return {"set": trial.set, "name": trial.name, "stages_ms": stages}


# ------------------------------------------------------------------------------------------------ command line


def in_pool(pool: ProcessPoolExecutor, work: Callable, jobs: Iterable, what: str) -> list[dict]:
    """The rows of all jobs, in their order."""
    jobs, rows, start = list(jobs), [], time.perf_counter()
    for row in pool.map(work, jobs, chunksize=2):
        rows.append(row)
        if len(rows) % 50 == 0 or len(rows) == len(jobs):
            print(f"{what}: {len(rows)} of {len(jobs)}, {time.perf_counter() - start:.0f} s", flush=True)
    return rows


def in_columns(rows: list[dict], without: str = "") -> dict:
    columns = Columns()
    for row in rows:
        columns.add(**{key: value for key, value in row.items() if key != without})
    return columns.lists()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("docs/benchmarks"))
    parser.add_argument("--jobs", type=int, default=2, help="processes, each on one thread")
    parser.add_argument("--seed", type=int, default=0, help="of the wrong trials")
    parser.add_argument("--quick", action="store_true", help="one trial in fifty, few pairs for all else")
    arguments = parser.parse_args()
    if not DATA.is_dir():
        raise SystemExit(f"no data: neither $FIELDALIGN_DATA nor {DATA} is a folder")
    scale, peers, rooms, largest, pairs = QUICK if arguments.quick else FULL
    arguments.output.mkdir(parents=True, exist_ok=True)
    setting = {"mp_context": get_context("spawn"), "initializer": prepare, "initargs": (arguments.seed, scale)}
    with ProcessPoolExecutor(arguments.jobs, **setting) as pool:
        rows = in_pool(pool, judged, range(len(trials(arguments.seed, scale))), "trials")
        beside = in_pool(pool, compared, sample(rows, *peers), "peers")
        calibration = in_pool(pool, calibrated, scans(rooms, largest), "calibration")
    results = head(arguments.seed) | {
        "trials": in_columns(rows, without="pose"),
        "peers": in_columns(beside),
        "calibration": in_columns(calibration),
        "cost": in_columns(costs(pairs)),
    }
    report.write(results, arguments.output)
    print(report.as_markdown(results))


def head(seed: int) -> dict:
    installed = ("numpy", "small_gicp", "open3d", "kiss-matcher")
    return {
        "machine": f"{THREADS} cores of {processor()}",
        "date": time.strftime("%Y-%m-%d"),
        "seed": seed,
        "versions": {"fieldalign": fa.__version__} | {name: version_of(name) for name in installed},
    }


if __name__ == "__main__":
    main()
