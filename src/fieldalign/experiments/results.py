"""What came of every case and method, as arrays, and as a file."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..motions import Matrix
from ..whole_file import write_text
from . import measures
from .case import Case

Row = Mapping[str, Any]
Further: TypeAlias = "Callable[[Results, str, str | None], dict[str, Any]]"


@dataclass(frozen=True, eq=False)
class Results:
    """What came of every case and method.

    cases: in their order. titles: of the methods, by name. rows: by (case, method); of a method that raised, its
    sentence as "error". success: within so many degrees, and so far. head: protocol, versions, machine.
    further: further(results, method, group), what else a method is measured by; it joins the summary.
    """

    cases: list[Case]
    titles: dict[str, str]
    rows: dict[tuple[str, str], Row]
    success: tuple[float, float]
    seed: int
    head: dict[str, Any]
    further: Further | None = None

    @property
    def groups(self) -> list[str]:
        """The groups of the cases, in the order in which they come."""
        return list(dict.fromkeys(case.group for case in self.cases))

    def column(self, method: str, group: str | None = None) -> list[tuple[Case, Row]]:
        """The cases of a group (None: all) and what came of them by a method."""
        return [(case, self.rows[case.name, method]) for case in self.cases if group in (None, case.group)]

    def values(self, key: str, method: str, group: str | None = None) -> Matrix:
        """One number of each row (n,), infinite where the method raised."""
        return np.array([row.get(key, np.inf) for _, row in self.column(method, group)], float)

    def summary(self, method: str, group: str | None = None) -> dict[str, Any]:
        """The measures of a method: RRE and RTE over all cases in which it gave a pose (modulo symmetries, too, where
        there may be some), the pooled Euler measure, the share of successes over all cases, seconds."""
        rows = self.column(method, group)
        given = [(case, row) for case, row in rows if "error" not in row]
        kinds = [key for key in ("rre_deg", "rte", "rre_modulo_deg", "rte_modulo") if given and key in given[0][1]]
        found: dict[str, Any] = {"cases": len(rows), "without_pose": len(rows) - len(given)}
        found |= {key: measures.summary(_finite(self.values(key, method, group)), self.seed) for key in kinds}
        found["success"] = measures.share(self.successes(method, group))
        if "rre_modulo_deg" in kinds:
            found["success_modulo"] = measures.share(self.successes(method, group, modulo=True))
        if given:
            found |= _pooled(given)
            found |= {key: float(np.median([row[key] for _, row in given])) for key in ("seconds", "cpu_seconds")}
        found |= {} if self.further is None else self.further(self, method, group)
        return found | self._trust(method, group)

    def successes(
        self, method: str, group: str | None = None, modulo: bool = False, within: tuple[float, float] | None = None
    ) -> NDArray[np.bool_]:
        """Whether each case is right, (n,). modulo: symmetries of the shape. within: other bounds than `success`."""
        names = ("rre_modulo_deg", "rte_modulo") if modulo else ("rre_deg", "rte")
        degrees, lengths = (self.values(name, method, group) for name in names)
        bounds = self.success if within is None else within
        return np.asarray((degrees <= bounds[0]) & (lengths <= bounds[1]))

    @property
    def modulo(self) -> bool:
        """Whether errors are given modulo the shapes' symmetries, too."""
        return any(case.shape is not None for case in self.cases)

    def _trust(self, method: str, group: str | None) -> dict[str, Any]:
        """Of a method that judges itself: how many it accepts, and how many of these are wrong."""
        accepted = [row.get("accepted") for _, row in self.column(method, group)]
        if all(verdict is None for verdict in accepted):
            return {}
        trusted = np.array([verdict is True for verdict in accepted])
        wrong = trusted & np.logical_not(self.successes(method, group))
        return {"accepted": int(trusted.sum()), "accepted_wrong": int(wrong.sum())}

    def to_dict(self) -> dict[str, Any]:
        """All of it for JSON: the head, the measures of every method over all cases and over each group, every pair."""
        groups = [None, *self.groups] if len(self.groups) > 1 else [None]
        return self.head | {
            "success_within": {"degrees": self.success[0], "length": self.success[1]},
            "methods": self.titles,
            "measures": [
                {"group": group or "all", "method": method} | self.summary(method, group)
                for group in groups for method in self.titles
            ],
            "cases": [
                {"name": case.name, "group": case.group, "T_target_source": case.T_target_source[:3].ravel().tolist()}
                for case in self.cases
            ],
            "rows": [
                {"case": case.name, "method": method} | dict(self.rows[case.name, method])
                for case in self.cases for method in self.titles
            ],
        }


def _finite(values: Matrix) -> Matrix:
    return values[np.isfinite(values)]


def _pooled(given: Iterable[tuple[Case, Row]]) -> dict[str, Any]:
    """The pooled Euler measure of rows with a pose."""
    T_true = np.stack([case.T_target_source for case, _ in given])
    T = np.tile(np.eye(4), (len(T_true), 1, 1))
    T[:, :3] = np.array([row["T"] for _, row in given]).reshape(-1, 3, 4)
    return {
        name: {"rmse": float(measures.rmse(errors)), "median": float(np.median(errors))}
        for name, errors in zip(("euler_deg", "translation_components"), measures.euler_errors(T, T_true), strict=True)
    }


def head(name: str, title: str, protocol: Iterable[str], data: Path, seed: int) -> dict[str, Any]:
    """What every results file begins with."""
    return {
        "experiment": name, "title": title, "protocol": list(protocol), "data": str(data), "seed": seed,
        "versions": versions(), "machine": machine(), "date": datetime.now(UTC).isoformat("T", "seconds"),
    }


def page(head: Mapping[str, Any], text: str, count: int, heading: str = "#") -> str:
    """A table as a page in Markdown, or a part of one: what was done, on what, and what came of it."""
    faults = [f"Not measured: {name} ({fault})." for name, fault in head.get("not_measured", {}).items()]
    made = ", ".join(f"{name} {number}" for name, number in head["versions"].items())
    return "\n".join([
        f"{heading} {head['title']}", "", *(f"- {sentence}" for sentence in head["protocol"]), "", text, "", *faults,
        f"{count} registrations by each method, seed {head['seed']}, {head['machine']}, {head['date']}; {made}.", "",
    ])


def versions() -> dict[str, str]:
    """Of this project, of what it stands on, and of the peers that are installed."""
    packages = ("fieldalign", "numpy", "scipy", "small_gicp", "open3d", "kiss-matcher", "kiss-icp", "pycpd", "probreg",
                "torch")
    return {"python": platform.python_version()} | {name: v for name in packages if (v := _version(name)) is not None}


def machine() -> str:
    """The processor, and how many cores of it."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    model = next((line.split(":")[1].strip() for line in lines if "model name" in line), platform.processor())
    return f"{os.cpu_count()} cores of {model}"


def write_json(found: Mapping[str, Any], path: Path) -> Path:
    """Writes results, whole or not at all, a line for each pair; returns the path."""
    lines = [f" {json.dumps(key)}: {_listed(value)}" for key, value in found.items()]
    return write_text("{\n" + ",\n".join(lines) + "\n}\n", path)


def _listed(value: Any) -> str:
    if not (isinstance(value, list) and value and isinstance(value[0], dict)):
        return json.dumps(value)
    return "[\n" + ",\n".join(f"  {json.dumps(entry)}" for entry in value) + "\n ]"


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
