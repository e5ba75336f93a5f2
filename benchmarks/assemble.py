"""Many scans in any order and pose: real sets, one heap of them all, and a building of hundreds of large scans.

    make bench-assemble         (or: python benchmarks/assemble.py --output docs/benchmarks)
    python benchmarks/assemble.py --only sets --quick --output /tmp/assemble

Writes assemble.json (every figure) and assemble.md (the tables that the docs quote) into the output folder, after each
part. Data: ../shared/data or $FIELDALIGN_DATA. Beside fieldalign, on the separate sets, Open3D's multiway registration
with FPFH + RANSAC and with KISS-Matcher for the pairs, told a voxel that suits each set; fieldalign is told nothing.
They take a second a pair, and run on the first of three seeds.
The building (benchmarks/building.py) is made in /tmp or --building, levelled, then free: 2.6 GB at a time, with --keep
twice that. An hour on two cores; --quick takes some minutes.
"""

from __future__ import annotations

from two_cores import THREADS

# isort: split
import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path

import assemble_building as building
import assemble_report as report
import numpy as np
from any_pose import version_of
from assemble_sets import EVERYTHING, SETS, Heap, draw, judged
from columns import Columns
from paper import _processor as processor
from scenes import DATA

import fieldalign as fa

HEAPS = {name: (name,) for name in SETS} | {"heap": EVERYTHING}
PEERS = {"ransac": "Open3D multiway, FPFH + RANSAC", "kiss": "KISS-Matcher + Open3D's pose graph"}


# ------------------------------------------------------------------------------------------------ real sets


def sets(arguments: argparse.Namespace) -> dict:
    """A row for each set, seed and method."""
    columns, (seeds, names) = Columns(), (1, list(SETS)) if arguments.quick else (3, list(HEAPS))
    for seed in range(seeds):
        for name in names:
            heap = draw(HEAPS[name], seed)
            for method, assemble in methods(name, arguments.quick or seed > 0).items():
                row = measured(assemble, heap)
                columns.add(set=name, seed=seed, method=method, **row)
                print(name, seed, method, in_short(row), flush=True)
    return {"rows": columns.lists()}


def methods(name: str, quick: bool) -> dict[str, Callable]:
    """What runs on a set: no voxel suits the heap, so the peers cannot be told one for it."""
    chosen = {"fieldalign": fieldalign}
    if name != "heap" and not quick:
        from peers import open3d_multiway as multiway

        voxel = SETS[name].voxel
        for find in PEERS:
            chosen[find] = lambda heap, seed, find=find: multiway.assemble(heap.clouds, voxel, find)
    return chosen


def fieldalign(heap: Heap, seed: int) -> tuple[list, list, int]:
    """fieldalign, told nothing, in this process on two threads."""
    found = fa.assemble(heap.clouds, seed=seed, threads=THREADS)
    return found.poses, found.components, found.tried


def measured(assemble: Callable, heap: Heap, seed: int = 0) -> dict:
    wall, cpu = time.perf_counter(), time.process_time()
    try:
        poses, components, tried = assemble(heap, seed)
    except Exception as error:  # a peer that finds nothing may raise; the set is lost, not the benchmark
        print(f"   {type(error).__name__}: {error}", flush=True)
        poses, components, tried = [None] * len(heap.clouds), [], 0
    taken = {"wall_s": time.perf_counter() - wall, "cpu_s": time.process_time() - cpu}
    return judged(heap, poses, components) | {"tried": tried} | taken


def in_short(row: dict) -> str:
    worst = f"{max(row['deg'], default=np.nan):.3g} deg {100 * max(row['share'], default=np.nan):.2g} %"
    missed = f" missed {', '.join(row['missed'])}" if row["missed"] else ""
    whole = "whole" if row["whole"] else f"{row['components']} components"
    counts = f"{row['right']} of {row['scans']} right, {row['foreign']} foreign, {whole}"
    return f"{counts}, worst {worst}, {row['tried']} pairs, {row['wall_s']:.1f} s{missed}"


# ------------------------------------------------------------------------------------------------ command line

PARTS = {
    "sets": sets,
    "levelled": lambda arguments: building.whole(arguments, free=False),
    "executors": building.executors,
    "free": lambda arguments: building.whole(arguments, free=True),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", choices=list(PARTS), help="parts to measure; the others are kept")
    parser.add_argument("--quick", action="store_true", help="separate sets, one seed, no peers; a small building")
    parser.add_argument("--building", type=Path, default=building.FOLDER, help="where the building is made")
    parser.add_argument("--keep", action="store_true", help="leave the building there, and use what is there already")
    parser.add_argument("--output", type=Path, default=Path("docs/benchmarks"))
    arguments = parser.parse_args()
    if not DATA.is_dir():
        raise SystemExit(f"no data: neither $FIELDALIGN_DATA nor {DATA} is a folder")
    arguments.output.mkdir(parents=True, exist_ok=True)
    earlier = arguments.output / "assemble.json"
    results = json.loads(earlier.read_text()) if arguments.only and earlier.exists() else {}
    results |= head(arguments.quick)
    try:
        for name in arguments.only or PARTS:
            start = time.perf_counter()
            results[name] = PARTS[name](arguments)
            results[name]["seconds"] = time.perf_counter() - start
            report.write(results, arguments.output)
    finally:
        building.remove(arguments)
    print(report.as_markdown(results))


def head(quick: bool) -> dict:
    installed = ("numpy", "scipy", "open3d", "kiss-matcher", "distributed")
    return {
        "machine": f"{THREADS} cores of {processor()}",
        "date": time.strftime("%Y-%m-%d"),
        "quick": quick,
        "versions": {"fieldalign": fa.__version__} | {name: version_of(name) for name in installed},
    }


if __name__ == "__main__":
    main()
