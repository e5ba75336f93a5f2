"""Tables of the assembly benchmark, from its assemble.json alone.

    python benchmarks/assemble_report.py docs/benchmarks

makes them again without measuring.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from pathlib import Path

import numpy as np
from any_pose_report import digits, table
from columns import write_json
from verdict_report import where

METHODS = {
    "fieldalign": "**fieldalign**",
    "ransac": "Open3D multiway, FPFH + RANSAC",
    "kiss": "KISS-Matcher + Open3D's pose graph",
}
SETS = {
    "bunny": "bunny", "dragon": "dragon", "indoor": "indoor fragments", "kitti07": "kitti07 submaps",
    "heap": "all four in one heap",
}  # fmt: skip
PLACED, PAIRS, MEMORY, MINUTES = 0.03, 10, 4.0, 15.0  # targets: m, pairs a scan, GiB, minutes
CORES = 2
INTRODUCTION = """\
Measured on {machine}, {date}, with {versions}; a row for each run in assemble.json. Scans are in random order, each
moved at random in SE(3), or turned about the vertical where it says levelled. fieldalign is told no length.
"""
ABOUT_SETS = """\
Right: within 2 degrees and 2 % of the scan's extent (at its centroid) of the truth, in the largest component of its
set, after that is laid on the truth by the mean motion of the scans that agree best. Foreign: scans in a component of
another set. Whole: the components are the sets, no more and no fewer. Sums over {seeds} seed(s), of the peers over the
first; medians of time. The peers try all pairs, told the voxel of each set. On the heap they do not run: no voxel suits
objects and streets alike.
"""
ABOUT_BUILDING = """\
{scans} scans of a simulated building (benchmarks/building.py) with exact truth, from files, on two processes; told that
each scan is in the frame of its sensor. Error: of the scanner's place, in the largest component, after that is laid on
the truth by those places that agree. Memory: the peak of all processes together, shared pages counted once. Of the
surface that a scan sees, its nearest neighbour sees {first} (smallest, tenth, half, nine tenths of the scans), its
third nearest {third}; the chain that joins all has a link of {weakest}.
"""
ABOUT_EXECUTORS = """\
{scans} scans of the same building, levelled, in one process on two threads, in two processes and on a Dask cluster of
this machine. Same: all poses equal those of the first row to the bit.
"""
ABOUT_PROJECTION = """\
From the run of {scans} levelled scans: work that is done apart for each scan or pair is shared by all cores, of {cores}
to a machine; reading and registering grow with the number of scans, glances with its square; the joint refinement and
the model are counted as if one machine did them alone, and grow with the number of scans. Moving the scans over a
network is not in it. The model's check: from the run of {part} scans it foretells {foretold:.1f} minutes for {scans};
{measured:.1f} were measured.
"""


def write(results: dict, folder: Path) -> None:
    """assemble.json and assemble.md."""
    write_json(results, folder / "assemble.json")
    (folder / "assemble.md").write_text(as_markdown(results))


def as_markdown(results: dict) -> str:
    versions = ", ".join(f"{name} {number}" for name, number in results["versions"].items())
    parts = [INTRODUCTION.format(machine=results["machine"], date=results["date"], versions=versions)]
    if results.get("quick"):
        parts.append("**A quick run: one seed, no peers, a small building.**")
    if "sets" in results:
        parts += ["## Real sets", *of_sets(results["sets"]["rows"])]
    runs = {name: results[name] for name in ("levelled", "free") if name in results}
    if runs:
        parts += ["## A simulated building", *of_building(runs)]
    if "executors" in results:
        parts += ["## The same on other executors", *of_executors(results["executors"]["runs"])]
    if "levelled" in results and results["levelled"]["run"]["error"] is None:
        parts += ["## Projection to 10,000 scans", *of_projection(results)]
    return "\n\n".join(part for part in parts if part) + "\n"


# ------------------------------------------------------------------------------------------------ real sets


def of_sets(rows: dict) -> list[str]:
    cells = []
    for name, title in SETS.items():
        for method, said in METHODS.items():
            of = np.flatnonzero(where(rows, set=name, method=method))
            if len(of):
                cells.append([title, said, *_of_method(rows, of)])
    titles = [
        "set", "method", "scans", "placed", "right", "target", "foreign", "target", "whole", "target", "median deg",
        "largest", "median % of extent", "largest", "pairs", "s", "cpu s",
    ]  # fmt: skip
    seeds = len(set(rows["seed"]))
    return [ABOUT_SETS.format(seeds=seeds), table(titles, cells), missed(rows)]


def _of_method(rows: dict, of: np.ndarray) -> list:
    def total(key: str) -> int:
        return sum(int(rows[key][k]) for k in of)

    def middle(key: str) -> str:
        return digits(float(np.median([rows[key][k] for k in of])))

    deg, share = (np.concatenate([np.array(rows[key][k], float) for k in of]) for key in ("deg", "share"))
    errors = [digits(f(values)) if len(values) else "" for values in (deg, 100 * share) for f in (np.median, np.max)]
    counts = [total("scans"), total("placed"), total("right"), total("scans"), total("foreign"), 0]
    whole, spent = [total("whole"), len(of)], [middle(key) for key in ("tried", "wall_s", "cpu_s")]
    return [*counts, *whole, *errors, *spent]


def missed(rows: dict) -> str:
    """Which scans are not right, by run."""
    said = []
    for k, lost in enumerate(rows["missed"]):
        if lost:
            which = ", ".join(f"{count} of {name}" for name, count in Counter(lost).items())
            run = METHODS[rows["method"][k]].strip("*"), SETS[rows["set"][k]], f"seed {rows['seed'][k]}"
            said.append(f"- {', '.join(run)}: {which}")
    return "\n".join(["Not right:", "", *said]) if said else "Every scan of every run is right."


# ------------------------------------------------------------------------------------------------ building


def of_building(runs: dict) -> list[str]:
    rows = []
    for name, measured in runs.items():
        row = measured["run"]
        rows.append([name, row["scans"], measured["within"], row["scans"], *_errors(measured), *_costs(row)])
    titles = ["freedom", "scans", "within 3 cm", "target", "median mm", "largest mm", *COSTS]
    made = next(iter(runs.values()))
    first, third = (
        ", ".join(f"{v:.0%}" for v in made["building"][f"{which}_neighbour"]) for which in ("first", "third")
    )
    told = ABOUT_BUILDING.format(
        scans=made["run"]["scans"], first=first, third=third, weakest=f"{made['building']['weakest_link']:.0%}"
    )
    return [told, table(titles, rows), of_stages({name: m["run"] for name, m in runs.items()}), left_out(runs)]


COSTS = ["pairs a scan", "target", "peak GiB", "target", "minutes", "target"]


def _errors(measured: dict) -> list[str]:
    metres = np.array([m for m in measured["m"] if m is not None])
    return [digits(1e3 * f(metres)) if len(metres) else "" for f in (np.median, np.max)]


def _costs(row: dict) -> list[str]:
    pairs = f"{row['tried'] / row['scans']:.1f}" if row["error"] is None else row["error"]
    return [pairs, f"{PAIRS}", f"{row['peak_gib']:.2f}", f"{MEMORY:g}", f"{row['wall_s'] / 60:.1f}", f"{MINUTES:g}"]


def of_stages(runs: dict) -> str:
    """Seconds by stage."""
    done = {name: row for name, row in runs.items() if row["error"] is None}
    if not done:
        return ""
    stages = list(dict.fromkeys(stage for row in done.values() for stage in row["stages_s"]))
    rows = [[name, *(f"{row['stages_s'].get(stage, 0):.1f}" for stage in stages)] for name, row in done.items()]
    return table(["seconds of", *stages], rows)


def left_out(runs: dict) -> str:
    said = [
        f"- {name}, scan {k}: {reason}"
        for name, measured in runs.items()
        for k, reason in measured["run"].get("left_out", {}).items()
    ]
    return "\n".join(["Left out:", "", *said]) if said else ""


def of_executors(runs: dict) -> list[str]:
    rows = []
    for name, row in runs.items():
        same = "yes" if row["same"] else "**no**"
        rows.append([name, row["scans"], row["within"], *_errors(row), same, *_costs(row)[::2]])
    titles = ["executor", "scans", "within 3 cm", "median mm", "largest mm", "same", *COSTS[::2]]
    scans = next(iter(runs.values()))["scans"]
    return [ABOUT_EXECUTORS.format(scans=scans), table(titles, rows), of_stages(runs)]


# ------------------------------------------------------------------------------------------------ projection


def of_projection(results: dict) -> list[str]:
    run = results["levelled"]["run"]
    rows = []
    for machines in (1, 2, 4, 8, 16, 32, 64):
        parts = projected(run, 10_000, machines)
        rows.append([machines, *(hours(seconds) for seconds in (*parts.values(), sum(parts.values())))])
    told = ""
    small = results.get("executors", {}).get("runs", {}).get("2 processes", {"error": "not run"})
    if small["error"] is None:
        foretold = sum(projected(small, run["scans"], 1).values()) / 60
        told = ABOUT_PROJECTION.format(
            scans=run["scans"], part=small["scans"], foretold=foretold, measured=run["assemble_s"] / 60, cores=CORES
        )
    return [told, table(["machines", *(f"{name}, h" for name in parts), "all, h"], rows)]


def projected(run: dict, scans: int, machines: int) -> dict[str, float]:
    """Seconds by stage for so many scans, from those of a run on one machine."""
    growth, stages = scans / run["scans"], run["stages_s"]
    alone = ("refine", "fuse")
    return {
        stage: seconds * growth ** (2 if stage == "glance" else 1) / (1 if stage in alone else machines)
        for stage, seconds in stages.items()
    }


def hours(seconds: float) -> str:
    return f"{seconds / 3600:.2f}"


if __name__ == "__main__":
    output = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/benchmarks")
    write(json.loads((output / "assemble.json").read_text()), output)
