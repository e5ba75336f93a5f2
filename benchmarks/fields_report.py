"""Tables and picture of the benchmark of fields, from its fields.json alone.

    python benchmarks/fields_report.py docs/benchmarks

makes them again without measuring.
"""

from __future__ import annotations

import json
import sys
from itertools import product
from pathlib import Path

import numpy as np
from any_pose_report import digits, table
from columns import median, numbers, write_json
from fields_made import ALIKE, CELLS, KINDS, LEAST_TURN, MARGIN, NOISE, SEEN
from verdict_report import accepted, at_most, counted, share, where

SCALE = 0.03  # largest error of a right scale's logarithm
EXACT, OVER_BOUND, NEES = 1e-6, 1.2, 6.0  # targets: rad and share of the extent; error / bound; its expected value
METHODS = {
    "fieldalign": "**fieldalign, no guess**",
    "fieldalign, from the guess": "**fieldalign, from the guess**",
    "open3d": "Open3D ICP, point to plane, from the guess",
}
INTRODUCTION = """\
Measured on {machine} in one process, {date}, with {versions}; a row for each trial in fields.json. All start from no
guess where nothing else is said. Errors are medians of the right answers; a shift is that of the middle of what is
seen, an extent the diagonal of the bounding box. Times are medians over all trials, right or not, from arrays or ready
fields to the pose. Seed {seed}.
"""
PAIRINGS = f"""\
{{count}} meshes of data/meshes, {{shares}}. Each is moved twice at random in SE(3), the same for all 16
pairings. Points: {{points:,}}, uniform by area, with noise of {NOISE:g} of the extent; on any other kind {SEEN:.2f} of
the surface, on one side of a random plane; on points the source is cut so. Volume: {CELLS} cells along the longest edge
and {MARGIN} around, filled anew in the moved frame. Callable: the exact signed distance, without a gradient. Right:
within {{degrees:g}} degrees and {{percent:g}} % of the extent. "On the surface" counts as well what lies within
{ALIKE:g} of the extent of the true surface on average, so a pose that takes the shape to itself.
"""
SYMMETRY = f"""\
Taken: {{taken}}. Left out as symmetric, since turned by {LEAST_TURN:g} degrees or more they lie within {ALIKE:g} of the
extent of themselves on average (without any registration: fields_made.symmetry): {{left}}.
"""
FUSION = """\
Every second scan is fused into a truncated signed distance (fields_made.fused); each other scan is registered from
random poses against that volume, and against the fused scans' points. Right: within 5 degrees and 5 mm; the truth of
these scans was itself made by registration.
"""
PRECISION = """\
Points on about two thirds of a mesh, moved, against the mesh, {shapes} shapes. The bound counts all points and the
mesh's true normals. The guess is off by 2 degrees and 2 % of the extent. Open3D aligns to 100,000 points on the mesh
with its normals, reach 2 % of the extent, up to 100 iterations. RMS and NEES are over the right answers.
"""


def write(results: dict, folder: Path) -> None:
    """fields.json, fields.md and fields.png."""
    write_json(results, folder / "fields.json")
    (folder / "fields.md").write_text(as_markdown(results))
    if "pairings" in results and "precision" in results:
        plot(results, folder / "fields.png")


def as_markdown(results: dict) -> str:
    versions = ", ".join(f"{name} {number}" for name, number in results["versions"].items())
    seed = next(results[name]["seed"] for name in PARTS if name in results)
    parts = [INTRODUCTION.format(machine=results["machine"], date=results["date"], versions=versions, seed=seed)]
    for name, (title, tables) in PARTS.items():
        if name in results:
            parts += [f"## {title}", *tables(results[name], results["protocol"])]
    wrong = {name: results[name]["wrong"] for name in ("freedoms", "scales") if name in results}
    parts += ["## Pairs of which every answer is wrong", table_of_wrong(wrong)] if wrong else []
    return "\n\n".join(part for part in parts if part) + "\n"


# ------------------------------------------------------------------------------------------------ tables


def summary(trials: dict, rows: np.ndarray, unit: float) -> list:
    """Recall, errors of the right answers (degrees, and shifts times the unit), verdicts, and time, of some trials."""
    right = rows & np.array(trials["right"], bool)
    errors = told(median(trials["deg"], right)), told(unit * median(trials["shift"], right))
    verdicts = share(accepted(trials), right), counted(accepted(trials), rows & ~right)
    return [share(right, rows), *errors, *verdicts, f"{median(trials['wall_ms'], rows):.0f}"]


def told(value: float) -> str:
    """Three significant digits; nothing for NaN."""
    return f"{value:.2e}" if 0 < value < 1e-3 else digits(value)


def head(shift: str) -> list[str]:
    return ["recall", "deg", shift, "right: accepted", "wrong: accepted", "ms"]


def pairings(measured: dict, protocol: dict) -> list[str]:
    trials, (degrees, extents) = measured["trials"], protocol["tolerance"]
    taken = list(dict.fromkeys(trials["shape"]))
    left = [name for name in measured["symmetry"] if name not in taken]
    off, rows = np.array(numbers(trials["off"], slice(None))) < ALIKE, []
    for one, other in product(KINDS, KINDS):
        of = where(trials, source=one, target=other)
        recall, *rest = summary(trials, of, 100)
        found = share(np.array(trials["right"], bool) | off, of)
        away = 100 * median(trials["off"], of & np.array(trials["right"], bool))
        rows.append([one, other, recall, found, *rest[:2], told(away), *rest[2:]])
    recall, *rest = head("shift, % of the extent")
    titles = ["source", "target", recall, "on the surface", *rest[:2], "off the surface, %", *rest[2:]]
    said = PAIRINGS.format(
        count=len(taken), shares="the first closed ones that are not symmetric", points=protocol["points"],
        degrees=degrees, percent=100 * extents,
    )
    return [said, table(titles, rows), lost(trials), SYMMETRY.format(taken=", ".join(taken), left=", ".join(left))]


def lost(trials: dict) -> str:
    """Answers that are not right, by shape."""
    said = {}
    for k in np.flatnonzero(~np.array(trials["right"], bool)):
        answer = f"{trials['source'][k]} on {trials['target'][k]} {trials['reason'][k]}"
        if trials["deg"][k] is not None:
            answer += f" ({trials['deg'][k]:.0f} deg, {100 * trials['off'][k]:.2g} % off)"
        said.setdefault(trials["shape"][k], []).append(answer)
    listed = [f"- {shape}: {'; '.join(answers)}" for shape, answers in said.items()]
    return "\n".join([f"Lost, {sum(map(len, said.values()))}:", "", *listed])


def fusion(measured: dict, protocol: dict) -> list[str]:
    trials, volumes = measured["trials"], measured["volumes"]
    rows = []
    for name, target in product(volumes["object"], ("volume", "points")):
        of = where(trials, object=name, target=target)
        rows.append([name, f"fused {target}", int(of.sum()), *summary(trials, of, 1e3)])
    parts = zip(volumes["object"], volumes["scans"], volumes["voxel"], volumes["seconds"], strict=True)
    made = [f"{name}: {', '.join(scans)}; cells of {1e3 * v:.2f} mm, {s:.1f} s" for name, scans, v, s in parts]
    return [FUSION + "Fused " + ". ".join(made) + ".", table(["object", "target", "trials", *head("mm")], rows)]


def precision(measured: dict, protocol: dict) -> list[str]:
    trials = measured["trials"]
    exact, noisy = [], []
    for method, title in METHODS.items():
        of = where(trials, method=method, sigma=0.0)
        right = of & np.array(trials["right"], bool)
        largest = [f"{numbers(trials[key], right).max(initial=0):.1e}" for key in ("rad", "share")]
        exact.append([title, counted(right, of), *largest, f"{EXACT:g}", f"{median(trials['wall_ms'], of):.0f}"])
    for sigma, (method, title) in product(sigmas(trials), METHODS.items()):
        of = where(trials, method=method, sigma=sigma)
        right = of & np.array(trials["right"], bool)
        ratios = [f"{ratio:.2f}" for ratio in over_bound(trials, right)]
        said = ["", "", ""]
        if method != "open3d":
            said = [f"{np.mean(numbers(trials['nees'], right)):.1f}", f"{NEES:g}", share(accepted(trials), right)]
        cells = [counted(right, of), *ratios, f"{OVER_BOUND:g}", *said, f"{median(trials['wall_ms'], of):.0f}"]
        noisy.append([f"{sigma:g}", title, *cells])
    of_exact = ["without noise", "right", "largest rad", "largest shift, of the extent", "target", "ms"]
    ratios = [f"{what} / bound, RMS" for what in ("turn", "shift")]
    of_noisy = ["noise", "method", "right", *ratios, "target", "mean NEES", "target", "right: accepted", "ms"]
    said = PRECISION.format(shapes=len(set(trials["shape"])))
    return [said, table(of_exact, exact), table(of_noisy, noisy), lost_precision(trials)]


def lost_precision(trials: dict) -> str:
    rows = np.flatnonzero(~np.array(trials["right"], bool))
    said = [
        f"{trials['shape'][k]} ({trials['draw'][k]}, {trials['sigma'][k]:g}) {trials['method'][k]}: "
        f"{digits(trials['deg'][k] or np.nan)} deg, {trials['reason'][k]}"
        for k in rows
    ]
    return f"Not right: {'; '.join(said)}." if said else ""


def sigmas(trials: dict) -> list[float]:
    return [sigma for sigma in dict.fromkeys(trials["sigma"]) if sigma > 0]


def over_bound(trials: dict, rows: np.ndarray) -> list[float]:
    """Root mean squares of turn and shift over those of the bound."""
    squares = [trials["mean_square"][k] for k in np.flatnonzero(rows)]
    return np.sqrt(np.mean(squares, axis=0)).tolist() if squares else [np.nan, np.nan]


def freedoms(measured: dict, protocol: dict) -> list[str]:
    trials = measured["trials"]
    by_dof = {dof: where(trials, dof=dof) for dof in ("all", "levelled")}
    rows = [[dof, int(of.sum()), *summary(trials, of, 1e3)] for dof, of in by_dof.items()]
    said = "Indoor pairs, moved so that the truth is a turn about z and a shift; right within 5 degrees and 200 mm."
    return [said, table(["free", "pairs", *head("mm")], rows)]


def scales(measured: dict, protocol: dict) -> list[str]:
    trials, rows = measured["trials"], []
    for name in dict.fromkeys(trials["set"]):
        of = where(trials, set=name)
        right = of & np.array(trials["right"], bool)
        recall, *rest = summary(trials, of, 1e3)
        growth = f"{100 * median(trials['growth'], right):.2f}"
        rows.append([name, int(of.sum()), recall, growth, *rest])
    recall, *rest = head("mm")
    lost_pairs = [k for k, right in enumerate(trials["right"]) if not right]
    listed = [f"{trials['name'][k]} x {trials['factor'][k]:.2f}: {trials['reason'][k]}" for k in lost_pairs]
    said = f"The source at exp(U(-1, 1)) of its size; right within its set's tolerance and {100 * SCALE:g} % of scale."
    table_of_sets = table(["set", "pairs", recall, "scale, %", *rest], rows)
    return [said, table_of_sets, f"Not right: {'; '.join(listed)}." if listed else ""]


def table_of_wrong(wrong: dict) -> str:
    rows = []
    for name, trials in wrong.items():
        of_kind = {kind: where(trials, kind=kind) for kind in dict.fromkeys(trials["kind"])}
        for kind, of in (of_kind | {"all": np.ones(len(trials["kind"]), bool)}).items():
            false, count = int((accepted(trials) & of).sum()), int(of.sum())
            bound = f"{100 * at_most(false, count):.1f} %"
            listed = "; ".join(np.array(trials["name"])[accepted(trials) & of]) if kind != "all" else ""
            taken = f"{median(trials['wall_ms'], of):.0f}"
            rows.append([WRONG[name], kind, f"{false} of {count}", bound, taken, listed])
    return table(["free", "kind", "accepted", "at most, 95 %", "ms", "which"], rows)


WRONG = {"freedoms": "levelled", "scales": "scale"}
PARTS = {
    "pairings": ("Every kind of field on each other", pairings),
    "fusion": ("Scans against fused scans", fusion),
    "precision": ("A scan against a mesh, with exact truth", precision),
    "freedoms": ("Levelled motions", freedoms),
    "scales": ("Free scale", scales),
}


# ------------------------------------------------------------------------------------------------ picture


def plot(results: dict, path: Path) -> None:
    """Recall and time of each kind on each; error over the Cramer-Rao bound by noise."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(17, 4.6), layout="constrained")
    recall, taken, error = figure.subplots(1, 3)
    trials = results["pairings"]["trials"]
    cells = [where(trials, source=one, target=other) for one, other in product(KINDS, KINDS)]
    right = np.array(trials["right"], float)
    _matrix(recall, [right[of].mean() for of in cells], "recall", "{:.2f}", vmin=0, vmax=1)
    times = [median(trials["wall_ms"], of) / 1e3 for of in cells]
    _matrix(taken, times, "median time, s", "{:.2f}", cmap="viridis_r", norm="log")
    _errors(error, results["precision"]["trials"])
    figure.savefig(path, dpi=110)


def _matrix(axes, values: list, title: str, form: str, **style) -> None:
    numbers = np.array(values).reshape(len(KINDS), -1)
    axes.imshow(numbers, **style)
    for (i, j), value in np.ndenumerate(numbers):
        axes.text(j, i, form.format(value), ha="center", va="center", color="white", bbox={"color": "#0006"})
    axes.set(xticks=range(len(KINDS)), yticks=range(len(KINDS)), xticklabels=KINDS, yticklabels=KINDS, title=title)
    axes.set(xlabel="target", ylabel="source")


def _errors(axes, trials: dict) -> None:
    for method, colour in zip(METHODS, ("black", "tab:blue", "tab:orange"), strict=True):
        right = where(trials, method=method) & np.array(trials["right"], bool)
        found = [over_bound(trials, right & where(trials, sigma=sigma)) for sigma in sigmas(trials)]
        for part, style, what in ((0, "o-", "turn"), (1, "s--", "shift")):
            label = f"{METHODS[method].strip('*')}: {what}"
            axes.plot(sigmas(trials), [ratios[part] for ratios in found], style, color=colour, label=label)
    for level, word in ((1, "Cramér-Rao bound"), (OVER_BOUND, "target")):
        axes.axhline(level, color="grey", linestyle=":" if level == 1 else "-", linewidth=0.8, label=word)
    axes.set(xscale="log", xlabel="noise, share of the extent", ylabel="RMS error / bound")
    axes.set_title("Points against a mesh")
    axes.set_xticks(sigmas(trials), [f"{sigma:g}" for sigma in sigmas(trials)])
    axes.minorticks_off()
    axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.02, 1))


if __name__ == "__main__":
    output = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/benchmarks")
    write(json.loads((output / "fields.json").read_text()), output)
