"""What a registration costs: O(N) once, for the field, and O(K L) for K iterations of L pseudo points.

    python benchmarks/neural_cost.py --output docs/benchmarks

The paper says so (Sec. IV-E) of neural fields, and O(N log N) and O(K L log N) of a search tree. Here both: networks as
examples/neural_field.py fits them, at so many steps for each point, and PointFields; method "paper", all K iterations.
Writes neural_cost.json and neural_cost.png. One thread. Two minutes; --quick takes half a minute. Needs the extras
neural and viz.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import runpy
import time
from collections.abc import Callable
from itertools import product
from pathlib import Path

import numpy as np
import torch

import fieldalign as fa
from fieldalign.clouds.simulated import simulate_pair

EXAMPLE = Path(__file__).parents[1] / "examples" / "neural_field.py"
ITERATIONS, PSEUDO = (5, 20, 80), (250, 1000, 4000, 16_000)
TYPICAL = 20, 1000  # K and L in the paper
MARKERS = "ov^"  # of the iterations in the figure
STEADY = 1000  # pseudo points from which an iteration's fixed cost is small
POINTS = {"neural": (3000, 10_000, 30_000, 100_000), "points": (3000, 10_000, 30_000, 100_000, 300_000, 1_000_000)}
TITLES = {"neural": "neural field", "points": "points"}
QUICK = 10_000  # points at most


def settings(iterations: int, pseudo: int) -> fa.Settings:
    return fa.Settings(pseudo_count=pseudo, max_iterations=iterations, tolerance=1e-300)  # never still: all iterations


def built(kind: str, scan: fa.PointCloud, fit: Callable) -> tuple[fa.PreparedCloud, float]:
    """A scan's field, and the seconds it took."""
    start = time.perf_counter()
    prepared = fa.prepare(fit(scan) if kind == "neural" else scan, threads=1)
    prepared.build()
    return prepared, time.perf_counter() - start


def aligned(source: fa.PreparedCloud, target: fa.PreparedCloud, iterations: int, pseudo: int, runs: int) -> float:
    """Seconds of the iterations alone; the fastest run, which others on the machine disturbed least."""
    chosen, taken = settings(iterations, pseudo), []
    for _ in range(runs):
        result = fa.register(source, target, method="paper", settings=chosen, threads=1)
        assert result.iterations == iterations
        taken.append(result.seconds["align"])
    return min(taken)


def measure(kind: str, largest: int, runs: int) -> dict:
    """Seconds by N, of the field and of a typical alignment, and by K and L at the largest N."""
    fit, by_points = runpy.run_path(str(EXAMPLE))["fitted"], []
    built(kind, simulate_pair(seed=0, points=1000).source, fit)  # whatever is done at first use only
    for count in (n for n in POINTS[kind] if n <= largest):
        scans = simulate_pair(seed=0, points=count, overlap=0.8)
        (source, first), (target, second) = (built(kind, scan, fit) for scan in (scans.source, scans.target))
        once, align = min(first, second), aligned(source, target, *TYPICAL, runs)
        by_points.append({"points": count, "build_s": once, "align_s": align})
        print("   ", kind, by_points[-1], flush=True)
    by_work = [
        {"iterations": k, "pseudo_points": count, "align_s": aligned(source, target, k, count, runs)}
        for k, count in product(ITERATIONS, PSEUDO)
    ]
    points, steady = [row["points"] for row in by_points], [row for row in by_work if row["pseudo_points"] >= STEADY]
    return {
        "by_points": by_points,
        "by_work": by_work,
        "exponent_build_points": exponent(points, [row["build_s"] for row in by_points]),
        "exponent_align_points": exponent(points, [row["align_s"] for row in by_points]),
        "exponent_align_work": exponent([work(row) for row in steady], [row["align_s"] for row in steady]),
        "microseconds_per_pseudo_point": 1e6 * by_work[-1]["align_s"] / work(by_work[-1]),
    }


def work(row: dict) -> int:
    return row["iterations"] * row["pseudo_points"]


def exponent(x: list, y: list) -> float:
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def plot(results: dict, path: Path) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 5.2), layout="constrained")
    by_points, by_work = figure.subplots(1, 2)
    for kind, color in (("neural", "C1"), ("points", "C0")):
        found, title = results[kind], TITLES[kind]
        points = [row["points"] for row in found["by_points"]]
        for what, words, style in (("build", "once", "o-"), ("align", "K = {} and L = {}".format(*TYPICAL), "s:")):
            label = f"{title}, {words}: exponent {found[f'exponent_{what}_points']:.2f}"
            by_points.loglog(points, [row[f"{what}_s"] for row in found["by_points"]], style, color=color, label=label)
        slope_one(by_points, points, found["by_points"][-1]["build_s"])
        for iterations, marker in zip(ITERATIONS, MARKERS, strict=True):
            rows = [row for row in found["by_work"] if row["iterations"] == iterations]
            by_work.loglog([*map(work, rows)], [row["align_s"] for row in rows], marker, color=color, mfc="none")
        slope_one(by_work, sorted(map(work, found["by_work"])), found["by_work"][-1]["align_s"])
        label = f"{title}, N = {points[-1]:,}: exponent {found['exponent_align_work']:.2f} from L = {STEADY} on"
        by_work.plot([], [], "o", color=color, mfc="none", label=label)
    by_points.set(xlabel="N, points of a scan", ylabel="seconds, one thread", title="by N: a field, and an alignment")
    by_work.set(xlabel="K L, iterations times pseudo points", ylabel="seconds, one thread", title="by K L: alignments")
    for iterations, marker in zip(ITERATIONS, MARKERS, strict=True):
        by_work.plot([], [], marker, color="grey", mfc="none", label=f"K = {iterations}")
    for axes in (by_points, by_work):
        axes.plot([], [], "--", color="grey", label="exponent 1")
        axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.13))
    figure.savefig(path, dpi=120)


def slope_one(axes, x: list, last: float) -> None:
    """What is proportional to x and ends at the last measurement."""
    axes.loglog(x, [last * one / x[-1] for one in x], "--", color="grey", lw=0.8, zorder=0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("docs/benchmarks"))
    parser.add_argument("--quick", action="store_true", help="small scans, each measured once: half a minute")
    arguments = parser.parse_args()
    largest, runs = (QUICK, 1) if arguments.quick else (max(map(max, POINTS.values())), 3)
    torch.set_num_threads(1)
    arguments.output.mkdir(parents=True, exist_ok=True)
    results = {
        "machine": f"one of {os.cpu_count()} cores of {_processor()}", "date": time.strftime("%Y-%m-%d"),
        "fieldalign": fa.__version__, "numpy": np.__version__, "torch": torch.__version__,
    }
    for kind in POINTS:
        results[kind] = measure(kind, largest, runs)
    (arguments.output / "neural_cost.json").write_text(json.dumps(results, indent=1))
    plot(results, arguments.output / "neural_cost.png")


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    return next((line.split(":")[1].strip() for line in lines if "model name" in line), platform.processor())


if __name__ == "__main__":
    main()
