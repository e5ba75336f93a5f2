"""Tables and the picture of the odometry benchmark, from its odometry.json alone.

    python benchmarks/odometry_report.py docs/benchmarks

makes them again without measuring.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
from any_pose_report import digits, table
from columns import rows_in, write_json
from odometry_faults import FAULTS, FROM, UNTIL

OURS, RIGID, PEER, PROTOTYPE = "fieldalign", "rigid", "kiss", "prototype"
METHODS = {OURS: "**fieldalign**", RIGID: "fieldalign, deskew=False", PEER: "KISS-ICP", PROTOTYPE: "prototype"}
DRIFT, ATE, CPU_REAL, CPU_DRIVES, STEADY = 1 / 2, 1 / 3, 1 / 13, 1 / 15, 0.05  # targets: ours over the peer's
END = {"kitti00": 0.065}  # metres
INTRODUCTION = """\
Measured on {machine}, {date}, with {versions}.
All methods of a row see the same frames, one after the other in one process; CPU and wall times are medians over
frames. fieldalign is told nothing, KISS-ICP the reach of the sensor, of which its voxel is a hundredth: 100 m, its
default, and indoors 20 m, at which it drifts least.{notes}
"""
ABOUT_REAL = """\
Real scans, all methods told to take them as they are. kitti00: against SemanticKITTI's poses; the two others against a
chain of GICP, good for 1.5 cm or so. End: how far the last place is off, when the first pose is laid on the truth.
Ratio: ours over KISS-ICP's. The prototype (../shared/prototype/odometry) is told its voxel; it is measured where its
source is at hand.
"""
ABOUT_DRIVES = """\
Simulated drives with exact truth (benchmarks/drives.py): a sensor of 64 beams, 10 Hz, indoors 16 beams; motion within
the sweep, range noise of 2 cm, constant errors of beams of 1 cm, lost returns, traffic. Deskewed: all methods are given
the points' times. No times: the same frames without; KISS-ICP then does not deskew, fieldalign finds out by itself how
the sensor spins (fieldalign, deskew=False: is told not to). t_err and r_err: KITTI's, means over segments of 100 to
800 m, indoors of 10 to 80 m, from every tenth frame on. ATE: RMS, aligned by all places; RPE: RMS, from frame to frame.
Each method's poses are taken for that moment of the sweep (start, middle, end) at which their t_err is least. Loops
closed (--loops): by fa.close_loops at the end; blank where it changed nothing. Ratio: ours over KISS-ICP's, which
closes none.
"""
ABOUT_ENDURANCE = """\
To and fro over the first {lap} frames of the loop, deskewed (on the way back the frames and the times within them run
backwards), each method alone in a process. Memory: of the whole process. Steady: how much the slowest pass over the
same frames differs from the fastest, the first one, in which the map grows, aside.
"""
ABOUT_FAULTS = """\
On the street, deskewed, at full speed, the standstill at a halt of some seconds: by how much the motion from {before}
frames before the fault to {after} frames after it is off, and what fieldalign says in between.
"""
ORDER = ("street", "loop", "tunnel", "park", "indoor"), ("deskewed", "no times"), (OURS, RIGID, PEER)


def write(results: dict, folder: Path) -> None:
    """odometry.json, odometry.md and odometry.png."""
    write_json(results, folder / "odometry.json")
    (folder / "odometry.md").write_text(as_markdown(results))
    if "drives" in results:
        plot(results["drives"]["rows"], folder / "odometry.png")


def as_markdown(results: dict) -> str:
    versions = ", ".join(f"{name} {number}" for name, number in results["versions"].items())
    parts = [INTRODUCTION.format(
        machine=results["machine"], date=results["date"], versions=versions, notes=results.get("notes", "")
    )]
    if results.get("quick"):
        parts.append("**A quick run: the beginnings of the drives.**")
    for name, (title, tell) in PARTS.items():
        if name in results:
            parts += [f"## {title}", *tell(results[name])]
    return "\n\n".join(part for part in parts if part) + "\n"


def pairs(columns: dict, *keys: str) -> dict[tuple, dict[str, dict]]:
    """The rows of both methods, by what else they have in common."""
    found: dict[tuple, dict[str, dict]] = {}
    for row in sorted(rows_in(columns), key=_place):
        found.setdefault(tuple(row[key] for key in keys), {})[row["method"]] = row
    return found


def _place(row: dict) -> list[int]:
    """Where a row of a drive comes; others stay in their order."""
    keys = ("drive", "mode", "method") if "drive" in row else ()
    return [names.index(row[key]) for key, names in zip(keys, ORDER, strict=False)]


def ratio(both: dict[str, dict], key: str, target: float, of: str = OURS) -> str:
    """Of a method of ours, over the peer's, beside the target; bold where it is missed."""
    if of not in (OURS, RIGID) or PEER not in both or None in (values := [both[m][key] for m in (of, PEER)]):
        return ""
    found = values[0] / values[1]
    said = f"1/{1 / found:.1f}" if found < 1 else f"{found:.2f}"
    return said if found <= target else f"**{said}**"


# ------------------------------------------------------------------------------------------------ parts


def real(measured: dict) -> list[str]:
    cells = []
    for (name,), both in pairs(measured["rows"], "set").items():
        for method, row in both.items():
            first = method == OURS
            end = f"{END[name]} m" if name in END and first else ""
            sizes = [f"{row['frames']}, {row['points'] // 1000}k points", f"{row['metres']:.1f}"]
            errors = [digits(row["end_m"]), end, digits(row["ate_m"]), digits(1e3 * row["rpe_m"])]
            costs = [digits(row["cpu_ms"]), ratio(both, "cpu_ms", CPU_REAL, method), digits(row["wall_ms"])]
            cells.append([name, METHODS[method], *sizes, *errors, *costs])
    head = ["sequence", "method", "frames", "m", "end m", "target", "ATE m", "RPE mm", "CPU ms", "ratio (target 1/13)"]
    return [ABOUT_REAL, table([*head, "wall ms"], cells)]


def drives(measured: dict) -> list[str]:
    cells = []
    for (name, mode), both in pairs(measured["rows"], "drive", "mode").items():
        for method, row in both.items():
            ratios = [ratio(both, key, DRIFT, method) for key in ("t_percent", "r_deg_100m")]
            drift = [digits(np.nan if row[key] is None else row[key]) for key in ("t_percent", "r_deg_100m")]
            errors = [digits(row["end_m"]), digits(row["ate_m"]), digits(1e3 * row["rpe_m"])]
            costs = [digits(row["cpu_ms"]), ratio(both, "cpu_ms", CPU_DRIVES, method)]
            errors += loops(both, method)
            both_drifts = [drift[0], ratios[0], drift[1], ratios[1]]
            cells.append([name, mode, METHODS[method], *both_drifts, *errors, *costs, digits(row["wall_ms"])])
    head = ["drive", "mode", "method", "t_err %", "ratio (1/2)", "r_err deg/100 m", "ratio (1/2)", "end m", "ATE m"]
    head += ["RPE mm", "ATE, loops closed m", "ratio (1/3)", "CPU ms", "ratio (1/15)", "wall ms"]
    return [ABOUT_DRIVES, sizes(measured), table(head, cells)]


def loops(both: dict[str, dict], method: str) -> list[str]:
    """ATE after the loops were closed, over the peer's, which closes none; bold where it is above our own without."""
    row = both[method]
    found = row.get("loops_ate_m")
    if found is None or found == row["ate_m"]:  # where nothing was mended
        return ["", ""]
    said = digits(found) if found < row["ate_m"] else f"**{digits(found)}**"
    return [said, ratio(both | {method: {"ate_m": found}}, "ate_m", ATE, method)]


def sizes(measured: dict) -> str:
    """The drives, and what fieldalign said on them."""
    cells = []
    for (name, mode), both in pairs(measured["rows"], "drive", "mode").items():
        for method in (m for m in (OURS, RIGID) if m in both):
            row = both[method]
            said = ", ".join(f"{what.lower()} {count:.0f}" for what, count in row["said"].items() if count)
            size = [f"{row['metres']:.0f}", row["frames"], f"{row['points'] / 1000:.0f}k"]
            cells.append([name, mode, METHODS[method], *size, said])
    return table(["drive", "mode", "method", "m", "frames", "points, median", "says of so many frames"], cells)


def endurance(measured: dict) -> list[str]:
    cells = []
    for method, found in measured["methods"].items():
        memory, passes = np.array(found["rss_mib"]), np.array(found["pass_cpu_ms"][1:])
        begin, middle, end = (f"{memory[k]:.0f}" for k in (0, len(memory) // 2, -1))
        off = float(np.ptp(passes) / passes.min()) if len(passes) else np.nan
        each = ", ".join(digits(ms) for ms in found["pass_cpu_ms"])
        steady = f"{off:.1%}" if off <= STEADY or method != OURS else f"**{off:.1%}**"
        cells.append([METHODS[method], found["frames"], begin, middle, end, f"{memory.max():.0f}", each, steady])
    head = ["method", "frames", "MiB, first", "halfway", "last", "most", "CPU ms by pass", "steady (target 5 %)"]
    return [ABOUT_ENDURANCE.format(**measured), table(head, cells)]


def faults(measured: dict) -> list[str]:
    cells = []
    for (name,), both in pairs(measured["rows"], "fault").items():
        errors = []
        for row in (both.get(method) for method in (OURS, PEER)):
            if row is None:
                errors += ["", ""]
                continue
            lost = row["error"] or "no pose"
            errors += [lost, ""] if row["m"] is None else [digits(row["m"]), digits(row["deg"])]
        cells.append([FAULTS[name].title, *errors, ", ".join(s.lower() for s in both[OURS]["said"])])
    head = ["fault", "fieldalign m", "deg", "KISS-ICP m", "deg", "fieldalign says"]
    return [ABOUT_FAULTS.format(before=FROM, after=UNTIL), table(head, cells)]


PARTS = {
    "real": ("Real scans", real),
    "drives": ("Simulated drives", drives),
    "endurance": ("Endurance", endurance),
    "faults": ("Faults", faults),
}


# ------------------------------------------------------------------------------------------------ picture


def plot(columns: dict, path: Path) -> None:
    """Each drive from above and its heights, deskewed, both methods beside the truth."""
    from matplotlib.figure import Figure

    chosen = {name: both for (name, mode), both in pairs(columns, "drive", "mode").items() if mode == "deskewed"}
    if not chosen:
        return
    figure = Figure(figsize=(4.2 * len(chosen), 7), layout="constrained")
    panels = figure.subplots(2, len(chosen), squeeze=False, height_ratios=(3, 1))
    for (name, both), above, aside in zip(chosen.items(), *panels, strict=True):
        truth = next(iter(both.values()))["true_path"]
        lines = [("truth", truth, "black", 2.5)]
        lines += [(METHODS[m].strip("*"), both[m]["path"], colour, 1.0) for m, colour in COLOURS.items() if m in both]
        for label, line, colour, width in lines:
            above.plot(line["x"], line["y"], color=colour, linewidth=width, label=label)
            aside.plot(np.array(line["z"]), color=colour, linewidth=width)
        above.set(title=name, aspect="equal", adjustable="datalim")
        aside.set(xlabel="frames / 10", ylabel="height, m")
    panels[0][0].legend(fontsize=8)
    figure.savefig(path, dpi=90)


COLOURS = {OURS: "tab:blue", PEER: "tab:orange"}


if __name__ == "__main__":
    output = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/benchmarks")
    write(json.loads((output / "odometry.json").read_text()), output)
