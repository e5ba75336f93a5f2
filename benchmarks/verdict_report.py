"""Tables and the picture of the verdict benchmark, from its verdict.json alone.

    python benchmarks/verdict_report.py docs/benchmarks

makes them again without measuring.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from pathlib import Path

import numpy as np
from any_pose_report import digits, table
from columns import numbers, write_json
from scipy.stats import beta, chi2, rankdata

LEVEL = 0.95
BELOW = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.14), "ncols": 2, "fontsize": 8}  # a legend, of axes
HALVES = ("fit", "report")
NO_ANSWER = ("period, register", "period, verify", "symmetric", "degenerate")
INTRODUCTION = """\
Measured on {machine}, {date}, with {versions}. A trial is right within the tolerance of its set, imprecise within twice
that (counted apart), else wrong; where clouds do not meet, are mirror images, or cannot be told apart from themselves
moved, every answer is wrong. Thresholds are the same for all sets. The two halves share no scene, but for one: the
office fragments turn out to show the kitchen of 3DMatch. Bounds are one-sided, Clopper-Pearson, at {level:.0%}.
"""


def write(results: dict, folder: Path) -> None:
    """verdict.json, verdict.md and verdict.png."""
    write_json(results, folder / "verdict.json")
    (folder / "verdict.md").write_text(as_markdown(results))
    plot(results, folder / "verdict.png")


def as_markdown(results: dict) -> str:
    versions = ", ".join(f"{name} {number}" for name, number in results["versions"].items())
    trials, peers = results["trials"], results["peers"]
    parts = [
        INTRODUCTION.format(machine=results["machine"], date=results["date"], versions=versions, level=LEVEL),
        "## Wrong poses that were accepted",
        table_of_false(trials),
        listed(trials),
        "## Right poses that were accepted",
        table_of_right(trials),
        "## What was said, by kind",
        table_of_reasons(trials),
        "## The strength of the evidence as a score: area under the ROC",
        table_of_areas(trials),
        "## Beside the peers, on a sample of the same trials",
        table_of_peers(trials, peers),
        "## Squared error over the stated covariance (NEES), simulated pairs",
        table_of_calibration(results["calibration"]),
        table_of_covariances(results["calibration"]),
        "## Cost",
        table_of_cost(results["cost"]),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


# ------------------------------------------------------------------------------------------------ rows


def where(columns: dict, **wanted) -> np.ndarray:
    """Which rows have these values; a tuple means any of them."""
    chosen = np.ones(len(next(iter(columns.values()))), bool)
    for key, value in wanted.items():
        values = value if isinstance(value, tuple) else (value,)
        chosen &= np.array([cell in values for cell in columns[key]], bool)
    return chosen


def accepted(columns: dict) -> np.ndarray:
    return np.array(columns["accepted"], bool)


def at_most(count: int, of: int) -> float:
    """The upper bound on a rate of which `count` were seen among `of`."""
    return float(beta.ppf(LEVEL, count + 1, of - count)) if count < of else 1.0


def share(part: np.ndarray, of: np.ndarray) -> str:
    return f"{(part & of).sum() / of.sum():.3f}" if of.any() else ""


def counted(part: np.ndarray, of: np.ndarray) -> str:
    return f"{(part & of).sum()} of {of.sum()}" if of.any() else ""


# ------------------------------------------------------------------------------------------------ verdicts


def table_of_false(trials: dict) -> str:
    """One row for each kind of trial, and all together."""
    yes, rows = accepted(trials), []
    kinds = {kind: where(trials, kind=kind) for kind in dict.fromkeys(trials["kind"])}
    for name, of in (kinds | {"**all**": np.ones(len(yes), bool)}).items():
        wrong, imprecise = of & where(trials, label="wrong"), of & where(trials, label="imprecise")
        false, total = int((wrong & yes).sum()), int(wrong.sum())
        bound = f"{100 * at_most(false, total):.2f} %" if total else ""
        halves = [counted(yes, wrong & where(trials, half=half)) for half in HALVES]
        rows.append([name, int(of.sum()), total, false, bound, *halves, counted(yes, imprecise)])
    head = ["kind", "trials", "wrong", "of these accepted", "rate at most", *(f"{half} half" for half in HALVES)]
    return table([*head, "imprecise, accepted"], rows)


def listed(trials: dict) -> str:
    """The wrong poses that were accepted, one a line."""
    lines = []
    for place in np.flatnonzero(where(trials, label="wrong") & accepted(trials)):
        name, kind, half, deg, metres = (trials[key][place] for key in ("name", "kind", "half", "deg", "m"))
        off = "" if deg is None else f", {deg:.1f} deg, {1e3 * metres:.0f} mm"
        lines.append(f"- {kind}, {name} ({half} half){off}: strength {trials['strength'][place]:.2f}")
    return "\n".join(lines)


def table_of_right(trials: dict) -> str:
    """Right pairs by set and by overlap: how many were found, and how many of these were accepted."""
    yes, pairs = accepted(trials), where(trials, kind="right")
    groups = {name: pairs & where(trials, set=name) for name in dict.fromkeys(_cells(trials, "set", pairs))}
    overlaps = dict.fromkeys(_cells(trials, "overlap", pairs))
    groups |= {f"**overlap {overlap}**": pairs & where(trials, overlap=overlap) for overlap in overlaps}
    groups["sensors' places known"] = pairs & where(trials, sighted=True)
    rows = []
    for name, of in groups.items():
        right = of & where(trials, label="right")
        halves = [share(yes, right & where(trials, half=half)) for half in HALVES]
        low = f"{1 - at_most(int((right & ~yes).sum()), int(right.sum())):.3f}" if right.any() else ""
        rows.append([name, int(of.sum()), int(right.sum()), share(yes, right), low, *halves])
    head = ["set", "pairs", "found", "of these accepted", "share at least", *(f"{half} half" for half in HALVES)]
    return table(head, rows)


def table_of_reasons(trials: dict) -> str:
    """How often each reason was given, by kind; right poses and wrong ones apart."""
    reasons = sorted(dict.fromkeys(trials["reason"]))
    rows = []
    for kind in dict.fromkeys(trials["kind"]):
        for label in ("right", "imprecise", "wrong"):
            said = Counter(_cells(trials, "reason", where(trials, kind=kind, label=label)))
            if said:
                rows.append([kind, label, *(said[reason] or "" for reason in reasons)])
    return table(["kind", "pose", *(reason.replace("_", " ") for reason in reasons)], rows)


def _cells(columns: dict, key: str, rows: np.ndarray) -> list:
    return [columns[key][place] for place in np.flatnonzero(rows)]


# ------------------------------------------------------------------------------------------------ scores


def area(right: np.ndarray, wrong: np.ndarray) -> float:
    """The chance that a right pose scores above a wrong one; ties count half."""
    if not (len(right) and len(wrong)):
        return float("nan")
    ranks = rankdata(np.concatenate([right, wrong]))[: len(right)]
    return float((ranks.sum() - len(right) * (len(right) + 1) / 2) / (len(right) * len(wrong)))


def curve(right: np.ndarray, wrong: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shares of wrong and of right poses that reach each score, from the highest score down."""
    steps = np.unique(np.concatenate([right, wrong]))[::-1]
    return tuple(1 - np.searchsorted(np.sort(scores), steps) / len(scores) for scores in (wrong, right))


def by_label(scores: np.ndarray, labels: list) -> tuple[np.ndarray, np.ndarray]:
    """Scores of right and of wrong poses; imprecise ones are left out."""
    return tuple(scores[np.array([label == wanted for label in labels], bool)] for wanted in ("right", "wrong"))


def table_of_areas(trials: dict) -> str:
    """Right poses of each set against all wrong ones: one threshold must serve all sets; and by kind and half."""
    scores = np.array(trials["strength"], float)
    right, wrong = where(trials, label="right"), where(trials, label="wrong")
    pairs = right & where(trials, kind="right")
    groups = {"all": (right, wrong)}
    groups |= {f"{half} half": (right & where(trials, half=half), wrong & where(trials, half=half)) for half in HALVES}
    sets = dict.fromkeys(_cells(trials, "set", pairs))
    groups |= {f"right pairs of {name}, all wrong": (pairs & where(trials, set=name), wrong) for name in sets}
    kinds = dict.fromkeys(_cells(trials, "kind", wrong))
    groups |= {f"all right pairs, {kind}": (pairs, wrong & where(trials, kind=kind)) for kind in kinds}
    rows = []
    for name, (one, other) in groups.items():
        rows.append([name, int(one.sum()), int(other.sum()), *separation(scores[one], scores[other])])
    return table(["", "right", "wrong", *SEPARATION], rows)


SEPARATION = ["area", "right ones above every wrong one", "above 99 % of the wrong ones"]


def separation(right: np.ndarray, wrong: np.ndarray) -> list[str]:
    """Area, and the shares of right poses that score higher than all, and than 99 %, of the wrong ones."""
    if not (len(right) and len(wrong)):
        return ["", "", ""]
    limits = wrong.max(), np.quantile(wrong, 0.99)
    return [f"{area(right, wrong):.4f}", *(f"{(right > limit).mean():.3f}" for limit in limits)]


def scores_of_peers(trials: dict, peers: dict) -> dict[str, tuple[np.ndarray, list]]:
    """Each measure as a score (higher is better; -inf where a peer has no answer) and the labels of its poses.

    Lengths are told in voxels and small_gicp's sums by its counts: raw, they would compare sets, not poses.
    """
    strength = np.array([trials["strength"][place] for place in peers["place"]], float)
    fitness, rmse, error, inliers, points, kiss, voxel = (
        np.array([np.nan if cell is None else cell for cell in peers[key]], float)
        for key in (
            "open3d_fitness",
            "open3d_rmse",
            "gicp_error",
            "gicp_inliers",
            "gicp_points",
            "kiss_inliers",
            "voxel",
        )
    )
    paired = np.where(inliers > 0, inliers, np.nan)
    ours = [trials["label"][place] for place in peers["place"]]
    found = {
        "**fieldalign, strength**": (strength, ours),
        "Open3D, fitness": (fitness, peers["open3d_label"]),
        "Open3D, inlier RMSE": (np.where(fitness > 0, -rmse / voxel, np.nan), peers["open3d_label"]),
        "small_gicp, share of inliers": (inliers / points, peers["gicp_label"]),
        "small_gicp, error of an inlier": (-error / paired, peers["gicp_label"]),
        "KISS-Matcher, final inliers": (kiss, peers["kiss_label"]),
    }
    return {name: (np.nan_to_num(scores, nan=-np.inf), labels) for name, (scores, labels) in found.items()}


def table_of_peers(trials: dict, peers: dict) -> str:
    rows = []
    for name, (scores, labels) in scores_of_peers(trials, peers).items():
        right, wrong = by_label(scores, labels)
        rows.append([name, len(right), len(wrong), *separation(right, wrong)])
    said = (
        "Open3D judges fieldalign's poses, at 1.5 voxels; small_gicp aligns from them; KISS-Matcher finds its own, and "
        "its labels are those of its own poses."
    )
    return f"{table(['measure', 'right', 'wrong', *SEPARATION], rows)}\n\n{said}"


# ------------------------------------------------------------------------------------------------ covariance

COVARIANCES = {
    "nees": "**fieldalign**",
    "gicp": "small_gicp, H as it comes",
    "open3d": "Open3D, information matrix as it comes",
    "open3d_scaled": "Open3D, over the inliers' mean square",
}


def known(measured: dict) -> np.ndarray:
    """The pairs that count: found, accepted, and held in all six directions."""
    return where(measured, label=("right", "imprecise"), open=0) & accepted(measured)


def table_of_calibration(measured: dict) -> str:
    """Mean and 95 % quantile of fieldalign's NEES of accepted poses, by what the scans were like."""
    every, rows = known(measured), []
    groups = {"**all**": np.ones(len(every), bool)}
    for key, unit in (("overlap", ""), ("noise", " m"), ("rays", "")):
        groups |= {f"{key} {value:g}{unit}": where(measured, **{key: value}) for value in _values(measured, key)}
    for overlap in _values(measured, "overlap"):
        for noise in _values(measured, "noise"):
            groups[f"overlap {overlap:g}, noise {noise:g} m"] = where(measured, overlap=overlap, noise=noise)
    for name, of in groups.items():
        rows.append([name, int(of.sum()), int((of & every).sum()), *_spread(measured["nees"], of & every)])
    target = f"{chi2(6).mean():.0f}, {chi2(6).ppf(LEVEL):.1f} and {chi2(6).median():.1f}"
    said = f"Chi-square, six degrees of freedom: {target}. Counted are accepted poses"
    said += " of scans that meet in all six directions; a pose in a wrong minimum is not covered by its covariance."
    return f"{table(['pairs', 'made', 'counted', 'mean', '95 % quantile', 'median'], rows)}\n\n{said}"


def _values(measured: dict, key: str) -> list[float]:
    return sorted(set(measured[key]), reverse=key == "overlap")


def _spread(column: list, rows: np.ndarray) -> list[str]:
    """Mean, 95 % quantile, median."""
    values = numbers(column, rows)
    return (
        [digits(v) for v in (values.mean(), np.quantile(values, LEVEL), np.median(values))] if len(values) else [""] * 3
    )


def table_of_covariances(measured: dict) -> str:
    every = known(measured)
    rows = [[title, *_spread(measured[key], every)] for key, title in COVARIANCES.items() if key in measured]
    return table(["on the same pairs", "mean", "95 % quantile", "median"], rows)


def table_of_cost(cost: dict) -> str:
    """The verdict's time, and what it adds to the rest."""
    judge = np.array(cost["stages_ms"]["judge"], float)
    whole = np.sum(list(cost["stages_ms"].values()), axis=0)
    rows = []
    for name in [*dict.fromkeys(cost["set"]), None]:
        of = np.ones(len(judge), bool) if name is None else where(cost, set=name)
        added = np.median(judge[of] / (whole - judge)[of])
        medians = (digits(float(np.median(ms[of]))) for ms in (judge, whole))
        rows.append([name or "**all**", int(of.sum()), *medians, f"{100 * added:.1f} %"])
    return table(["set", "pairs", "verdict ms", "whole ms", "adds"], rows)


# ------------------------------------------------------------------------------------------------ picture


def plot(results: dict, path: Path) -> None:
    """ROC beside the peers; the strength of right and wrong ones; the NEES against chi-square."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(16, 5.6), layout="constrained")
    roc, histogram, calibration = figure.subplots(1, 3)
    _plot_roc(roc, results["trials"], results["peers"])
    _plot_histogram(histogram, results["trials"])
    _plot_calibration(calibration, results["calibration"])
    figure.savefig(path, dpi=110)


def _plot_roc(axes, trials: dict, peers: dict) -> None:
    every = by_label(np.array(trials["strength"], float), trials["label"])
    least = 0.5 / max(len(every[1]), 1)
    shown = {f"fieldalign, all {sum(map(len, every)):,} trials": every}
    shown |= {n.strip("*"): by_label(*scored) for n, scored in scores_of_peers(trials, peers).items()}
    for place, (name, (right, wrong)) in enumerate(shown.items()):
        style = {"linewidth": 2.5, "color": "black"} if place == 0 else {"linewidth": 1.3}
        if len(right) and len(wrong):
            false, true = curve(right, wrong)
            label = f"{name}: {area(right, wrong):.4f}"
            axes.step(np.clip(false, least, None), true, where="post", label=label, **style)
    axes.set(xscale="log", xlim=(least, 1), ylim=(-0.02, 1.02))
    axes.set(xlabel="share of wrong poses accepted", ylabel="share of right poses accepted", title="ROC, and its area")
    axes.legend(**BELOW)


def _plot_histogram(axes, trials: dict) -> None:
    scores = np.array(trials["strength"], float)
    no_answer = where(trials, kind=NO_ANSWER)
    right, wrong = where(trials, label="right"), where(trials, label="wrong")
    parts = {"right": right, "wrong": wrong & ~no_answer, "the data cannot tell": wrong & no_answer}
    for (name, of), colour in zip(parts.items(), ("tab:green", "tab:red", "tab:orange"), strict=True):
        shown, style = np.clip(scores[of], 0.01, 30), {"histtype": "step", "linewidth": 1.8}
        axes.hist(shown, np.geomspace(0.01, 30, 61), color=colour, label=name, **style)
    axes.axvline(1, color="grey", linestyle="--")
    axes.set(xlabel="strength; accepted from 1 on", ylabel="trials", xscale="log", yscale="log")
    axes.set_title("The evidence")
    axes.legend()


def _plot_calibration(axes, measured: dict) -> None:
    every = known(measured)
    for key, title in COVARIANCES.items():
        values = np.sort(numbers(measured[key], every)) if key in measured else []
        if len(values):
            style = {"linewidth": 2.5, "color": "black"} if key == "nees" else {"linewidth": 1.3}
            axes.step(values, np.arange(1, len(values) + 1) / len(values), label=title.strip("*"), **style)
    grid = np.geomspace(0.05, 60, 200)
    axes.plot(grid, chi2(6).cdf(grid), "--", color="grey", label="chi-square, 6 degrees of freedom")
    axes.set(xscale="log", xlabel="squared error over the stated covariance", ylabel="share of pairs below")
    axes.set_title("Calibration of the covariance")
    axes.legend(**BELOW)


if __name__ == "__main__":
    output = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/benchmarks")
    write(json.loads((output / "verdict.json").read_text()), output)
