"""From any pose: recall, accuracy, time and robustness, beside the peers on the same pairs, poses and threads.

    make bench-any-pose         (or: python benchmarks/any_pose.py --output docs/benchmarks)
    python benchmarks/any_pose.py --sets indoor --methods fieldalign --seeds 1 --output /tmp/any_pose

Writes any_pose.json (every figure), any_pose.md (the tables that the docs quote) and any_pose-*.png into the output
folder, after each set. Data: ../shared/data or $FIELDALIGN_DATA. All methods run in one process on two cores, one after
the other on each pair, in an order that rotates from pair to pair. The peers are told a voxel that suits each set and
are used with the settings that are best for them (benchmarks/peers); fieldalign is told nothing. Some hours on two
cores; --quick takes a few minutes.
"""

from __future__ import annotations

from two_cores import THREADS

# isort: split
import argparse
import json
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import any_pose_report as report
import cramer_rao
import numpy as np
import peers
import simulations
from columns import Columns
from paper import _processor as processor
from scenes import DATA, SETS, Case, apply, pairs

import fieldalign as fa
from fieldalign import _core
from fieldalign.evaluation import rotation_error

SEARCH = "fieldalign, no guess"  # on sets that come with a guess, fieldalign runs without it too
GROWTH = "growth"


# ------------------------------------------------------------------------------------------------ methods


def fieldalign(source, target, voxel, threads, init=None) -> fa.RegistrationResult:
    """fieldalign, told nothing but the guess of sets that come with one."""
    angle = None if init is None else 50.0  # the guess of the paper's setting is off by up to 45 degrees
    return fa.register(source, target, init=init, search_angle=angle, threads=threads)


def without_guess(source, target, voxel, threads, init) -> fa.RegistrationResult:
    return fieldalign(source, target, voxel, threads)


def methods(names: list[str]) -> dict[str, Callable]:
    """The methods to run, each called once so that libraries are loaded and threads are up."""
    chosen = {name: fieldalign if name == "fieldalign" else peers.load(name) for name in names}
    target, source, *_ = simulations.simulate(0, rays=(10_000, 10_000))
    for name, align in chosen.items():
        print("warming up", name, flush=True)
        align(source, target, voxel=0.1, threads=THREADS)
    return chosen


def on_this_set(chosen: dict[str, Callable], name: str) -> dict[str, Callable]:
    """The chosen methods that the set is for."""
    wanted = SETS[name].peers
    running = {method: f for method, f in chosen.items() if wanted is None or method in ("fieldalign", *wanted)}
    return running | {SEARCH: without_guess} if SETS[name].guess and "fieldalign" in chosen else running


# ------------------------------------------------------------------------------------------------ pairs


def measure_set(name: str, chosen: dict[str, Callable], seeds: int, count: int | None) -> dict:
    """Columns over the cases of one set: of the cases themselves, and of each method."""
    running = on_this_set(chosen, name)
    cases, columns = Columns(), {method: Columns() for method in running}
    place = 0
    for seed in range(seeds):
        for case in pairs(name, seed, count):
            bound = cramer_rao.bound(case.simulation) if case.simulation else None
            cases.add(seed=seed, **describe(case, bound))
            order = list(running)[place % len(running) :] + list(running)[: place % len(running)]
            for method in order:
                columns[method].add(**measure(running[method], case, bound))
            place += 1
            print_case(name, seed, case, {method: columns[method].last() for method in running})
    return {
        "voxel": SETS[name].voxel,
        "tolerance": SETS[name].tolerance,
        "cases": cases.lists(),
        "methods": {method: column.lists() for method, column in columns.items()},
    }


def describe(case: Case, bound: cramer_rao.Bound | None) -> dict:
    """What the case is, its floor (one pass, thinning of both clouds), and the least median error that it allows."""
    least = (np.degrees(bound.expected[0]), bound.expected[1]) if bound else (None, None)
    points = {"source_points": len(case.source), "target_points": len(case.target)}
    return {
        "group": case.group,
        "name": case.name,
        **points,
        **floor((case.source, case.target), case.voxel),
        "least_deg": least[0],
        "least_m": least[1],
    }


def floor(clouds: tuple[np.ndarray, np.ndarray], voxel: float) -> dict:
    """What any method must do: one pass over the points of both clouds, and their thinning."""
    return {
        "pass_ms": fastest(lambda: [_core.survey(cloud, THREADS) for cloud in clouds]),
        "thin_ms": fastest(lambda: [fa.thin(cloud, voxel, threads=THREADS) for cloud in clouds]),
    }


def fastest(action: Callable, runs: int = 3) -> float:
    taken = []
    for _ in range(runs):
        start = time.perf_counter()
        action()
        taken.append(1e3 * (time.perf_counter() - start))
    return min(taken)


def measure(align: Callable, case: Case, bound: cramer_rao.Bound | None) -> dict:
    """One run: errors, success, time; for fieldalign the verdict and the time by stage too."""
    time.sleep(0.01)  # threads of the method before go to sleep
    wall, cpu = time.perf_counter(), time.process_time()
    try:
        found = align(case.source, case.target, voxel=case.voxel, threads=THREADS, init=case.init)
    except Exception as error:  # a peer that finds nothing may raise; the pair is lost, not the benchmark
        print(f"   {type(error).__name__}: {error}", flush=True)
        found = np.full((4, 4), np.nan)
    taken = {"wall_ms": 1e3 * (time.perf_counter() - wall), "cpu_ms": 1e3 * (time.process_time() - cpu)}
    T = found.T_target_source if isinstance(found, fa.RegistrationResult) else np.asarray(found)
    return errors(T, case, bound) | taken | verdict(found)


def errors(T: np.ndarray, case: Case, bound: cramer_rao.Bound | None) -> dict:
    """Degrees and metres of the source's centroid, right or not; error over the bound's median, rotation and shift."""
    if not np.isfinite(T).all():
        return {"deg": None, "m": None, "right": False, "over_bound": None, "mean_square": None}
    centre = case.source.mean(axis=0, keepdims=True)
    shifted = float(np.linalg.norm(apply(T, centre) - apply(case.T_target_source, centre)))
    turned = rotation_error(T, case.T_target_source)
    right = turned < case.tolerance[0] and shifted < case.tolerance[1]
    return {"deg": turned, "m": shifted, "right": bool(right), **beside(bound, T, case.T_target_source)}


def beside(bound: cramer_rao.Bound | None, T: np.ndarray, T_true: np.ndarray) -> dict:
    """Rotation and shift of the error over their medians, squared over their mean squares, under the bound."""
    if bound is None:
        return {"over_bound": None, "mean_square": None}
    error = bound.error(T, T_true)
    sizes = np.linalg.norm(error[:3]), np.linalg.norm(error[3:])
    return {
        "over_bound": [size / least for size, least in zip(sizes, bound.expected, strict=True)],
        "mean_square": [(size / rms) ** 2 for size, rms in zip(sizes, bound.rms, strict=True)],
    }


def verdict(found) -> dict:
    if not isinstance(found, fa.RegistrationResult):
        return {}
    stages = {stage: 1e3 * seconds for stage, seconds in found.seconds.items()}
    return {"accepted": bool(found.accepted), "reason": found.reason.name, "stages_ms": stages}


def print_case(name: str, seed: int, case: Case, rows: dict[str, dict]) -> None:
    said = " | ".join(f"{method} {in_short(row)}" for method, row in rows.items())
    print(f"{name} {seed} {case.name}: {said}", flush=True)


def in_short(row: dict) -> str:
    if row["deg"] is None:
        return "RAISED"
    answer = f"{'ok' if row['right'] else 'LOST'} {row['deg']:.3g} deg {1e3 * row['m']:.3g} mm {row['wall_ms']:.0f} ms"
    return answer if row.get("accepted", row["right"]) == row["right"] else f"{answer} BUT {row['reason']}"


# ------------------------------------------------------------------------------------------------ growth


def measure_growth(largest: float, runs: int) -> dict:
    """Time against the number of points, on one pair of simulated scans sampled ever denser."""
    columns = Columns()
    for points in (10_000, 30_000, 100_000, 300_000, 1_000_000, 3_000_000, 10_000_000):
        if points <= largest:
            columns.add(**measure_grown(points, runs if points < 3e6 else 3))
            print("   ", columns.last(), flush=True)
    return columns.lists()


def measure_grown(points: int, runs: int) -> dict:
    """The run of median time, and the floor."""
    target, source, T, _ = simulations.simulate(1, overlap=0.7, rays=(points, points))
    fa.register(source, target, threads=THREADS)
    taken = []
    for _ in range(runs):
        start = time.perf_counter()
        result = fa.register(source, target, threads=THREADS)
        taken.append((1e3 * (time.perf_counter() - start), result))
    wall, result = sorted(taken, key=lambda run: run[0])[runs // 2]
    error = rotation_error(result.T_target_source, T)
    return {"points": points, "wall_ms": wall, **floor((source, target), 0.05), "deg": error, **verdict(result)}


# ------------------------------------------------------------------------------------------------ command line


def main() -> None:
    known = ["fieldalign", *peers.METHODS]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", nargs="+", choices=[*SETS, GROWTH], default=[*SETS, GROWTH])
    parser.add_argument("--methods", nargs="+", choices=known, default=known)
    parser.add_argument("--seeds", type=int, default=3, help="of poses: each pair is moved so often")
    parser.add_argument("--count", type=int, help="at most so many pairs of each group")
    parser.add_argument("--quick", action="store_true", help="two pairs of each group, one seed, growth to 1e5 points")
    parser.add_argument("--update", action="store_true", help="keep the other sets in the output folder's JSON")
    parser.add_argument("--output", type=Path, default=Path("docs/benchmarks"))
    arguments = parser.parse_args()
    if not DATA.is_dir():
        raise SystemExit(f"no data: neither $FIELDALIGN_DATA nor {DATA} is a folder")
    seeds, count = (1, 2) if arguments.quick else (arguments.seeds, arguments.count)
    arguments.output.mkdir(parents=True, exist_ok=True)
    results = started(arguments.output / "any_pose.json" if arguments.update else None)
    chosen = methods(arguments.methods)
    for name in arguments.sets:
        if name == GROWTH and "fieldalign" in chosen:
            results[GROWTH] = measure_growth(1e5 if arguments.quick else 1e7, 5)
        elif name != GROWTH:
            results["sets"][name] = measure_set(name, chosen, seeds, count)
            print(report.table_of_set(results["sets"][name]), flush=True)
        report.write(results, arguments.output)


def started(earlier: Path | None) -> dict:
    """The head of the results; the sets of an earlier file, if there is one."""
    before = json.loads(earlier.read_text()) if earlier and earlier.exists() else {}
    installed = ("numpy", "small_gicp", "open3d", "kiss-matcher")
    return before | {
        "machine": f"{THREADS} cores of {processor()}",
        "date": time.strftime("%Y-%m-%d"),
        "versions": {"fieldalign": fa.__version__} | {name: version_of(name) for name in installed},
        "sets": before.get("sets", {}),
    }


def version_of(package: str) -> str:
    try:
        return version(package)
    except ModuleNotFoundError:
        return "not installed"


if __name__ == "__main__":
    main()
