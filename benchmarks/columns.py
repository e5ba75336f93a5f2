"""Measurements in columns: one list for each figure, as compact JSON; and what is read out of them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np


class Columns:
    """Rows of figures, kept by column; a nested dict (time by stage) is a column of columns."""

    def __init__(self) -> None:
        self._rows: list[dict] = []

    def add(self, **row) -> None:
        self._rows.append(row)

    def last(self) -> dict:
        return self._rows[-1]

    def lists(self) -> dict:
        """Column -> list. Rows without a nested key have 0 there, rows without a plain one None."""
        return _lists(self._rows)


def _lists(rows: list[dict], absent=None) -> dict:
    lists = {}
    for key in dict.fromkeys(key for row in rows for key in row):
        cells = [row.get(key, absent) for row in rows]
        nested = any(isinstance(cell, dict) for cell in cells)
        lists[key] = _lists([cell or {} for cell in cells], 0.0) if nested else cells
    return lists


def write_json(results: dict, path: Path) -> None:
    """JSON with five significant digits, broken where people look: one line a list."""
    path.write_text(_dumped(results, 0) + "\n")


def _dumped(value, depth: int) -> str:
    if not isinstance(value, dict):
        return json.dumps(_rounded(value))
    inner = ",\n".join(f"{' ' * (depth + 1)}{json.dumps(key)}: {_dumped(v, depth + 1)}" for key, v in value.items())
    return f"{{\n{inner}\n{' ' * depth}}}"


def _rounded(value):
    if isinstance(value, list | tuple):
        return [_rounded(v) for v in value]
    return float(f"{value:.5g}") if isinstance(value, float | np.floating) else value


# ------------------------------------------------------------------------------------------------ reading


def rows_in(columns: dict) -> list[dict]:
    """The rows of what `Columns.lists` gave, each with its nested dicts; cells that are 0 for nothing stay so."""
    count = max((len(column) for column in columns.values() if isinstance(column, list)), default=0)
    return [{key: _at(column, k) for key, column in columns.items()} for k in range(count)]


def _at(column, k: int):
    return {key: _at(inner, k) for key, inner in column.items()} if isinstance(column, dict) else column[k]


def numbers(column: list, rows: np.ndarray) -> np.ndarray:
    """The rows of a column as floats, None as NaN."""
    return np.array(column, float)[rows]


def rows_of(cases: dict, group: str | None = None) -> np.ndarray:
    """Which rows belong to a group; None: all."""
    return np.array([group is None or g == group for g in cases["group"]])


def summary(method: dict, rows: np.ndarray) -> dict:
    """Recall; medians of the right answers' errors; time of all."""
    right = rows & np.array(method["right"], bool)
    wall = numbers(method["wall_ms"], rows)
    return {
        "pairs": int(rows.sum()),
        "recall": float(right.sum() / rows.sum()),
        "deg": median(method["deg"], right),
        "mm": 1e3 * median(method["m"], right),
        "wall_ms": np.quantile(wall, (0.5, 0.1, 0.9)).tolist(),
        "cpu_ms": median(method["cpu_ms"], rows),
    }


def both_right(one: dict, other: dict, rows: np.ndarray) -> np.ndarray:
    return rows & np.array(one["right"], bool) & np.array(other["right"], bool)


def median(column: list, rows: np.ndarray) -> float:
    found = numbers(column, rows)
    return float(np.median(found)) if len(found) else float("nan")


def over_bound(method: dict, rows: np.ndarray) -> dict | None:
    """Errors of the right answers over the Cramer-Rao bound: (rotation, shift) by medians and by root mean squares."""
    bounded = [ratio is not None for ratio in method["over_bound"]]
    right = rows & np.array(method["right"], bool) & np.array(bounded)
    if not right.any():
        return None
    chosen = np.flatnonzero(right)
    ratios = np.array([method["over_bound"][row] for row in chosen])
    squares = np.array([method["mean_square"][row] for row in chosen])
    return {"median": np.median(ratios, axis=0).tolist(), "rms": np.sqrt(squares.mean(axis=0)).tolist()}
