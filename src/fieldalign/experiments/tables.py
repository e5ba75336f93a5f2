"""Tables in Markdown: the measures of every method, and published figures beside."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from .published import Published
from .results import Results

Cell = str | float | int | None


def as_markdown(header: Sequence[str], rows: Iterable[Sequence[Cell]]) -> str:
    """A table with aligned columns; numbers with three significant digits, nothing where there is None."""
    lines = [list(header)] + [[cell if isinstance(cell, str) else number(cell) for cell in row] for row in rows]
    widths = [max(len(line[k]) for line in lines) for k in range(len(header))]
    rule = ["-" * width for width in widths]
    return "\n".join(
        "| " + " | ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)) + " |"
        for line in [lines[0], rule, *lines[1:]]
    )


def number(value: float | None, digits: int = 3) -> str:
    """A number for people."""
    if value is None:
        return ""
    if isinstance(value, int):
        return str(value)
    return f"{value:.{digits}g}" if abs(value) < 1000 else f"{value:.0f}"


def accuracy(results: Results, unit: str = "", group: str | None = None, pooled: bool = False) -> str:
    """The table of a group of cases (None: all), a row for each method. pooled: with the pooled Euler measure, too."""
    in_unit = f" ({unit})" if unit else ""
    within = f"within {results.success[0]:g} deg, {results.success[1]:g} {unit}".rstrip()
    header = ["method", "RRE RMSE (deg)", "RRE median", f"RTE RMSE{in_unit}", "RTE median"]
    header += ["Euler RMSE (deg)", "Euler median", "shift RMSE, by component", "shift median"] if pooled else []
    header += [within]
    header += ["RRE RMSE modulo symmetry", "RTE RMSE modulo symmetry", f"{within}, modulo symmetry"] * results.modulo
    return as_markdown([*header, "CPU ms"], [
        _row(title, results.summary(method, group), results.modulo, pooled) for method, title in results.titles.items()
    ])


def _row(title: str, found: dict[str, Any], modulo: bool, pooled: bool) -> list[Cell]:
    """A method's cells; the sums are over the cases in which it gave a pose, the share of successes over all."""
    if found["without_pose"]:
        title += f" (no pose in {found['without_pose']} of {found['cases']})"
    cells: list[Cell] = [title]
    for kind in ("rre_deg", "rte"):
        cells += [_with_interval(found.get(kind)), found[kind]["median"] if kind in found else None]
    if pooled:
        for kind in ("euler_deg", "translation_components"):
            cells += [found.get(kind, {}).get(measure) for measure in ("rmse", "median")]
    cells += [share_cell(found["success"])]
    if modulo:
        cells += [_with_interval(found.get(kind)) for kind in ("rre_modulo_deg", "rte_modulo")]
        cells += [share_cell(found.get("success_modulo"))]
    return [*cells, 1e3 * found["cpu_seconds"] if "cpu_seconds" in found else None]


def by_group(results: Results, axis: str, within: tuple[float, float] | None = None) -> str:
    """The share of successes of every method in every group; axis: what the groups differ by."""
    return as_markdown([axis, *results.groups], [
        [title, *(float(results.successes(method, group, results.modulo, within).mean()) for group in results.groups)]
        for method, title in results.titles.items()
    ])


def by_threshold(results: Results, thresholds: Sequence[tuple[float, float]]) -> str:
    """The share of successes of every method within several errors of rotation (degrees), and of translation."""
    header = [f"{degrees:g} deg" for degrees, _ in thresholds] + [f"{length:g}" for _, length in thresholds]
    bounds = [(degrees, np.inf) for degrees, _ in thresholds] + [(np.inf, length) for _, length in thresholds]
    return as_markdown(["method", *header], [
        [title, *(float(results.successes(method, within=within).mean()) for within in bounds)]
        for method, title in results.titles.items()
    ])


def published(entries: Iterable[Published]) -> str:
    """Figures that others have published, a table for each kind of figures."""
    kinds: dict[tuple[str, ...], list[Published]] = {}
    for entry in entries:
        kinds.setdefault(tuple(entry.figures), []).append(entry)
    return "\n\n".join(
        as_markdown(["published", *(name.replace("_", " ") for name in names), "source"],
                    [[entry.method, *entry.figures.values(), entry.source] for entry in alike])
        for names, alike in kinds.items()
    )


def share_cell(found: dict[str, Any] | None) -> str:
    """A share and its 95 % interval."""
    if not found or found["share"] is None:
        return ""
    low, high = found["interval"]
    return f"{found['share']:.3f} ({low:.3f}-{high:.3f})"


def medians(found: dict[str, Any]) -> list[Cell]:
    """Of RRE and RTE, over all cases with a pose."""
    return [found[kind]["median"] if kind in found else None for kind in ("rre_deg", "rte")]


def trusted(found: dict[str, Any]) -> str:
    """Of a method that judges itself: how many answers it accepts, and how many of these are wrong."""
    return f"{found['accepted']} ({found['accepted_wrong']})" if "accepted" in found else ""


def _with_interval(found: dict[str, Any] | None) -> str:
    """An RMSE and its 95 % interval."""
    if not found or found["rmse"] is None:
        return ""
    low, high = found["rmse_interval"]
    return f"{number(found['rmse'])} ({number(low, 2)}-{number(high, 2)})"
