"""Tables and curves of the any-pose benchmark, from its any_pose.json alone.

    python benchmarks/any_pose_report.py docs/benchmarks

makes them again without measuring.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import peers
from columns import both_right, median, numbers, over_bound, rows_of, summary, write_json

LEAD = "fieldalign"
TITLES = {name: title for name, (_, title, _) in peers.METHODS.items()}
INTRODUCTION = """\
Each pair is moved by a random motion, the same for every method; all run on {machine} in one process, {date}, with
{versions}. A right answer is within the tolerance of the set; errors are medians of the right answers, lengths are the
displacement of the source's centroid. "Common pairs": fieldalign's median / the peer's, on the pairs that both got
right. Time is the median over all pairs, right or not (10 % - 90 %), from plain arrays to the pose. The peers are told
the voxel of the set and are used as is best for them (benchmarks/peers); fieldalign is told no length.
"""


def write(results: dict, folder: Path) -> None:
    """any_pose.json, any_pose.md and the pictures."""
    write_json(results, folder / "any_pose.json")
    (folder / "any_pose.md").write_text(as_markdown(results))
    curves = {name[6:]: measured for name, measured in results["sets"].items() if name.startswith("curve-")}
    if curves:
        plot_curves(curves, folder / "any_pose-curves.png")
    if "growth" in results:
        plot_growth(results["growth"], folder / "any_pose-growth.png")


def as_markdown(results: dict) -> str:
    versions = ", ".join(f"{name} {number}" for name, number in results["versions"].items())
    parts = [INTRODUCTION.format(machine=results["machine"], date=results["date"], versions=versions)]
    measured = results["sets"]
    for name, one in measured.items():
        degrees, metres = one["tolerance"]
        title = f"## {name}: within {degrees:g} deg and {1e3 * metres:g} mm; the peers' voxel {1e3 * one['voxel']:g} mm"
        parts += [title, table_of_set(one), table_of_groups(one), table_of_bound(one)]
    parts += ["## fieldalign: time by stage, and the floor", table_of_time(measured)]
    parts += ["## fieldalign: the verdict", table_of_verdicts(measured), "## Lost pairs", lost(measured)]
    if "growth" in results:
        parts += ["## Growth: one pair of simulated scans, sampled ever denser", table_of_growth(results["growth"])]
    return "\n\n".join(part for part in parts if part) + "\n"


# ------------------------------------------------------------------------------------------------ tables


def table(head: list[str], rows: list[list]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)


def table_of_set(measured: dict) -> str:
    """One row for each method."""
    methods, every = measured["methods"], rows_of(measured["cases"])
    rows = []
    for method, column in methods.items():
        found = summary(column, every)
        common = beside(methods[LEAD], column, every) if LEAD in methods and method != LEAD else ["", ""]
        wall = "{:.0f} ({:.0f} - {:.0f})".format(*found["wall_ms"])
        errors = [digits(found["deg"]), digits(found["mm"])]
        recall, cpu = f"{found['recall']:.3f}", f"{found['cpu_ms']:.0f}"
        rows.append([title(method), found["pairs"], recall, *errors, *common, wall, cpu])
    head = ["method", "pairs", "recall", "deg", "mm", "deg, common pairs", "mm, common pairs", "wall ms", "CPU ms"]
    return table(head, rows)


def beside(lead: dict, other: dict, rows: np.ndarray) -> list[str]:
    """Median errors of the leading method / of the other, where both are right: degrees, mm."""
    common = both_right(lead, other, rows)
    if not common.any():
        return ["", ""]
    pairs = ((k, median(lead[key], common), median(other[key], common)) for key, k in (("deg", 1), ("m", 1e3)))
    return [f"{digits(k * one)} / {digits(k * two)}" for k, one, two in pairs]


def table_of_groups(measured: dict) -> str:
    """Recall, and median errors of the right answers, by group; empty where there is one group."""
    groups = list(dict.fromkeys(measured["cases"]["group"]))
    if len(groups) < 2:
        return ""
    rows = []
    for method, column in measured["methods"].items():
        found = [summary(column, rows_of(measured["cases"], group)) for group in groups]
        rows.append([title(method), *(f"{f['recall']:.2f}: {both_errors(f['deg'], f['mm'])}" for f in found)])
    return table(["recall: errors", *groups], rows)


def table_of_bound(measured: dict) -> str:
    """Errors over the Cramer-Rao bound, rotation / shift, by group; empty for real scans."""
    cases = measured["cases"]
    if not any(least is not None for least in cases["least_deg"]):
        return ""
    groups = list(dict.fromkeys(cases["group"]))
    least = ["the bound's median error"]
    for group in [None, *groups]:
        rows = rows_of(cases, group) & np.isfinite(numbers(cases["least_deg"], slice(None)))
        least.append(both_errors(median(cases["least_deg"], rows), 1e3 * median(cases["least_m"], rows)))
    rows = [[*least, ""]]
    for method, column in measured["methods"].items():
        found = [over_bound(column, rows_of(cases, group)) for group in [None, *groups]]
        cells = ["{:.2f} / {:.2f}".format(*f["median"]) if f else "" for f in found]
        rows.append([title(method), *cells, "{:.2f} / {:.2f}".format(*found[0]["rms"]) if found[0] else ""])
    return table(["error / bound, medians: rotation / shift", "all", *groups, "all, root mean squares"], rows)


def table_of_time(sets: dict) -> str:
    """fieldalign's time by stage, beside one pass over the points and thinning of both clouds at the peers' voxel."""
    rows = []
    for name, measured in sets.items():
        cases, every = measured["cases"], rows_of(measured["cases"])
        floor = numbers(cases["pass_ms"], every) + numbers(cases["thin_ms"], every)
        for method, column in ours(measured).items():
            wall = numbers(column["wall_ms"], every)
            stages = ", ".join(f"{s} {digits(median(ms, every))}" for s, ms in column.get("stages_ms", {}).items())
            label = name if method == LEAD else f"{name} ({method})"
            one_pass, thinning = (f"{median(cases[key], every):.1f}" for key in ("pass_ms", "thin_ms"))
            ratio = f"{np.median(wall / floor):.1f}"
            rows.append([label, f"{np.median(wall):.1f}", one_pass, thinning, ratio, stages])
    head = ["set", "wall ms", "one pass ms", "thinning ms", "wall / (pass + thinning)", "median ms by stage"]
    return table(head, rows)


def table_of_verdicts(sets: dict) -> str:
    rows = []
    for name, measured in sets.items():
        for method, column in ours(measured).items():
            right, accepted = np.array(column["right"], bool), np.array(column.get("accepted", []), dtype=bool)
            if len(accepted) == len(right):
                counts = [(right & accepted), (right & ~accepted), (~right & accepted), (~right & ~accepted)]
                rows.append([name if method == LEAD else f"{name} ({method})", *(int(c.sum()) for c in counts)])
    return table(["set", "right, accepted", "right, refused", "wrong, accepted", "wrong, refused"], rows)


def lost(sets: dict) -> str:
    """Each method's lost pairs by set; with errors and verdict for fieldalign."""
    parts = []
    for name, measured in sets.items():
        cases = measured["cases"]
        for method, column in measured["methods"].items():
            places = [place for place, right in enumerate(column["right"]) if not right]
            if places:
                told = method in ours(measured)
                said = [_lost_case(cases, column, p) for p in places] if told else _counted(cases, places)
                parts.append(f"- {name}, {title(method)}, {len(places)}: {'; '.join(said)}")
    return "\n".join(parts)


def _lost_case(cases: dict, column: dict, place: int) -> str:
    where = f"{cases['name'][place]} (seed {cases['seed'][place]})"
    if column["deg"][place] is None:
        return f"{where} raised"
    off = f"{column['deg'][place]:.1f} deg, {1e3 * column['m'][place]:.0f} mm"
    return f"{where} {off}, {'ACCEPTED' if column['accepted'][place] else column['reason'][place]}"


def _counted(cases: dict, places: list[int]) -> list[str]:
    """Names of cases, with how often each was lost where it was more than once."""
    names = [cases["name"][place] for place in places]
    return [n if names.count(n) == 1 else f"{n} x{names.count(n)}" for n in dict.fromkeys(names)]


def table_of_growth(grown: dict) -> str:
    points = np.array(grown["points"], float)
    wall, thinning = (np.array(grown[key], float) for key in ("wall_ms", "thin_ms"))
    beyond = wall - thinning
    rows = []
    for place in range(len(points)):
        stages = ", ".join(f"{stage} {digits(ms[place])}" for stage, ms in grown["stages_ms"].items())
        steps = [digits(value[place]) for value in (wall, np.array(grown["pass_ms"]), thinning, beyond)]
        rows.append([f"{int(points[place]):,}", *steps, digits(grown["deg"][place]), stages])
    said = f"Exponents over all: {_exponent(points, wall):.2f} whole, {_exponent(points, beyond):.2f} beyond thinning."
    head = ["points in each cloud", "wall ms", "one pass ms", "thinning ms", "beyond ms", "deg", "by stage, ms"]
    return f"{table(head, rows)}\n\n{said}"


def _exponent(points: np.ndarray, taken: np.ndarray) -> float:
    usable = taken > 0
    return float(np.polyfit(np.log(points[usable]), np.log(taken[usable]), 1)[0]) if usable.sum() > 1 else float("nan")


def ours(measured: dict) -> dict:
    """fieldalign's columns of a set, with and without a guess."""
    return {method: column for method, column in measured["methods"].items() if method.startswith(LEAD)}


def title(method: str) -> str:
    return f"**{method}**" if method.startswith(LEAD) else TITLES[method]


def both_errors(degrees: float, millimetres: float) -> str:
    return f"{digits(degrees)} deg, {digits(millimetres)} mm" if np.isfinite(degrees) else ""


def digits(value: float) -> str:
    """Three significant digits, without an exponent; nothing for NaN."""
    if not np.isfinite(value):
        return ""
    return np.format_float_positional(float(f"{value:.3g}"), trim="-")


# ------------------------------------------------------------------------------------------------ pictures

AXES = {
    "overlap": "overlap",
    "noise": "range noise, % of the room's diagonal",
    "outliers": "share of outliers",
    "density": "source points to a target point",
}


def plot_curves(curves: dict, path: Path) -> None:
    """Recall, and median rotation error of the right answers beside the bound, for each thing made worse."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.2 * len(curves), 6.6), layout="constrained")
    grid = figure.subplots(2, len(curves), squeeze=False, sharex="col")
    for (recall, error), (what, measured) in zip(grid.T, curves.items(), strict=True):
        _curve(recall, error, measured)
        error.set(xlabel=AXES[what], yscale="log", xscale="log" if what == "density" else "linear")
        if what == "overlap":
            error.invert_xaxis()
    grid[0, 0].set_ylabel("recall")
    grid[1, 0].set_ylabel("median rotation error, degrees")
    figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=len(curves))
    figure.savefig(path, dpi=110)


def _curve(recall, error, measured: dict) -> None:
    cases = measured["cases"]
    groups = list(dict.fromkeys(cases["group"]))
    values = [float(group.split()[-1]) for group in groups]
    for method, column in measured["methods"].items():
        found = [summary(column, rows_of(cases, group)) for group in groups]
        style = {"linewidth": 2.5, "color": "black", "zorder": 3} if method == LEAD else {"linewidth": 1.2}
        name = method if method == LEAD else TITLES[method]
        recall.plot(values, [f["recall"] for f in found], "o-", markersize=4, label=name, **style)
        error.plot(values, [f["deg"] if f["recall"] >= 0.2 else np.nan for f in found], "o-", markersize=4, **style)
    bounded = np.isfinite(numbers(cases["least_deg"], slice(None)))
    least = [median(cases["least_deg"], rows_of(cases, group) & bounded) for group in groups]
    recall.plot([], [], "--", color="grey", label="Cramér-Rao bound")
    error.plot(values, least, "--", color="grey")
    recall.set_ylim(-0.03, 1.03)


def plot_growth(grown: dict, path: Path) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5, 3.6), layout="constrained")
    axes = figure.subplots()
    for key, name in (("wall_ms", "whole registration"), ("thin_ms", "thinning both clouds"), ("pass_ms", "one pass")):
        axes.loglog(grown["points"], grown[key], "o-", label=name)
    beyond = np.subtract(grown["wall_ms"], grown["thin_ms"])
    axes.loglog(grown["points"], beyond, "--", color="grey", label="whole less thinning")
    axes.set(xlabel="points in each cloud", ylabel="ms")
    axes.legend()
    figure.savefig(path, dpi=120)


if __name__ == "__main__":
    output = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/benchmarks")
    write(json.loads((output / "any_pose.json").read_text()), output)
