"""Time of every method on 10,000 points, and time and memory against the number of points."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ...fields.protocol import Floats
from ...motions import exp_twist
from ...threads import resolve_threads
from ...whole_file import write_text
from .. import curves, tables
from ..alone import Alone
from ..case import Case, Moved, spread
from ..columns import ANY_POSE, PRIOR, Answer
from ..comparison import Comparison
from ..data_sets import modelnet, twists
from ..data_sets.shapes import Shape
from ..published import BY_EXPERIMENT
from ..request import Report, Request
from ..results import Results, page, write_json
from ..tables import Cell, number
from ..trial import Trial
from . import common as objects

_POINTS = 10_000
_SHAPES = 5     # of which each is registered once by each method
_COUNTS = 1_000, 10_000, 100_000, 1_000_000
_BLOCK = 50_000  # points that are drawn at once
_PATIENCE = 1.5  # seconds; a method that takes longer is not given ten times as many points
_LEAST = {"seconds": 1e-3, "peak_mib": 0.1}  # the bottom of the picture's axes, which are logarithmic
_MIB = 2**20

Growth = dict[int, Results]  # by the number of points

_OWN = (PRIOR, ANY_POSE, objects.PAPER)
_NAME = "efficiency"
_PROTOCOL = (
    f"Time: {_POINTS:,} points of each of {_SHAPES} shapes of ModelNet40, and the same moved as the text says; "
    "medians. Each method is called once before, on a part of a shape, so that loading and starting are no part of it. "
    "All methods take turns on a shape, first with one thread each, then with all cores.",
    "Whatever executor is asked for, the work is done by one process, one registration after the other: beside another "
    "one, neither the clock nor the caches are this one's. CPU time is that of all threads.",
    f"Growth: {_COUNTS[0]:,} to {_COUNTS[-1]:,} points of one mesh, all cores, each registration in a fresh process; "
    "memory is by how much its peak grows in the registration, over the clouds and what the libraries hold. A method "
    f"that takes more than {_PATIENCE:g} s, there or in the first table, is not given more points.",
    objects.SIZE, objects.GUESS,
)


@dataclass(frozen=True, eq=False)
class _Drawn:
    """Points of a surface, drawn in blocks, so that the process's peak of memory is not that of drawing."""

    shape: Shape
    count: int
    seed: int

    def __call__(self) -> Floats:
        points = np.empty((self.count, 3))
        for start in range(0, self.count, _BLOCK):
            block = points[start : start + _BLOCK]
            block[:] = self.shape.sample(len(block), self.seed + start)
        return points


@dataclass(frozen=True)
class _Weighed(Trial):
    """A trial that tells by how much the process's peak of memory grows, too: in a fresh one, what a method takes."""

    def measured(self, call: Callable[[], Answer]) -> tuple[Answer, dict[str, float]]:
        before = _peak()
        answer, cost = super().measured(call)
        return answer, cost | {"peak_mib": (_peak() - before) / _MIB}


def _peak() -> float:
    """The most memory that this process has held so far, in bytes; NaN where the system does not say."""
    try:
        import resource
    except ImportError:
        return float("nan")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return float(peak if sys.platform == "darwin" else 1024 * peak)


def _some_shapes(data: Path, seed: int) -> list[Case]:
    shapes = spread(modelnet.shapes(data), _SHAPES)
    motions = twists.drawn(np.random.default_rng(seed), len(shapes))
    return [
        Case(shape.name, "10^4 points", Moved(partial(shape.sample, _POINTS, seed), exp_twist(twist)), exp_twist(twist))
        for shape, twist in zip(shapes, motions, strict=True)
    ]


def _one_shape(data: Path, seed: int, count: int) -> list[Case]:
    shape = objects.surfaces(data)[0]
    T = exp_twist(twists.drawn(np.random.default_rng(seed), 1)[0])
    return [Case(f"{shape.name} {count}", str(count), Moved(_Drawn(shape, count, seed), T), T)]


_TIME = Comparison(
    name=_NAME, title="Efficiency: time, and time and memory against the number of points", protocol=_PROTOCOL,
    cases=_some_shapes, own=_OWN, peers=objects.PEERS, voxel=objects.VOXEL, success=objects.NEAR,
    text=lambda results: "",
)


def efficiency(request: Request) -> Report:
    """Runs it: efficiency.json, efficiency.md with the tables, and efficiency.png with the growth."""
    folder = request.run_folder or request.output / f"{_NAME}.run"
    cores = resolve_threads(None)
    by_threads = {
        threads: _TIME.measure(replace(request, executor=Alone(threads), run_folder=folder / f"{threads}"))
        for threads in dict.fromkeys((1, cores))
    }
    growing = replace(request, executor=Alone(cores, anew=True), run_folder=folder / "growth")
    growth = dict(_grown(replace(growing, columns=_quick(by_threads[cores]))))
    text, path = _text(by_threads, growth), request.output / _NAME
    head = by_threads[1].head
    found = head | {"one_thread": _plain(by_threads[1]), "all_threads": _plain(by_threads[cores])}
    found |= {"growth": [row for results in growth.values() for row in results.to_dict()["rows"]]}
    _draw(growth, path.with_suffix(".png"))
    return Report(text, [
        write_json(found, path.with_suffix(".json")),
        write_text(page(head, text, len(by_threads[1].cases)), path.with_suffix(".md")), path.with_suffix(".png"),
    ], _TIME.title, [by_threads[1]])


def _grown(request: Request) -> Iterator[tuple[int, Results]]:
    """Ever more points, by the methods that are quick enough."""
    for count in _COUNTS:
        larger = replace(_TIME, name=f"{_NAME} {count}", record=f"{_NAME} growth", trial=_Weighed,
                         cases=partial(_one_shape, count=count))
        results = larger.measure(request)
        yield count, results
        request = replace(request, columns=_quick(results))
        if not request.columns:
            return


def _quick(results: Results) -> tuple[str, ...]:
    """The methods that may be given more points."""
    return tuple(method for method in results.titles if _cost(results, method, "seconds") <= _PATIENCE)


def _cost(results: Results, method: str, key: str) -> float:
    """The median of what a method takes; infinite where it never gave a pose, or was not asked."""
    costs = [row[key] for _, row in results.column(method) if key in row] if method in results.titles else []
    return float(np.median(costs)) if costs else np.inf


def _plain(results: Results) -> Mapping[str, Any]:
    whole = results.to_dict()
    return {name: whole[name] for name in ("methods", "cases", "rows")}


def _text(by_threads: Mapping[int, Results], growth: Growth) -> str:
    """Three tables: time on 10^4 points, time and memory against the number of points, and what is published."""
    one, *more = by_threads.values()
    several = more[0] if more else one
    keys = ("seconds", "cpu_seconds")
    time = tables.as_markdown(
        ["method", "1 thread, ms", "CPU, ms", f"{max(by_threads)} threads, ms", "CPU, ms", "right"],
        [[title, *(_cell(1e3 * _cost(results, method, key)) for results in (one, several) for key in keys),
          f"{int(one.successes(method).sum())} of {len(one.cases)}"] for method, title in one.titles.items()],
    )
    titles = growth[_COUNTS[0]].titles
    grown = tables.as_markdown(["method", *(f"{count:,} points" for count in growth)], [
        [title, *(_both(results, method) for results in growth.values())] for method, title in titles.items()
    ])
    return "\n\n".join([
        f"## {_POINTS:,} points", time, "## Growth: ms, MiB", grown, "## Published",
        tables.published(BY_EXPERIMENT[_NAME]),
    ])


def _both(results: Results, method: str) -> str:
    seconds, mib = (_cost(results, method, key) for key in ("seconds", "peak_mib"))
    return f"{number(1e3 * seconds)}, {number(mib)}" if np.isfinite(seconds) else ""


def _cell(value: float) -> Cell:
    return value if np.isfinite(value) else None


def _draw(growth: Growth, path: Path) -> None:
    """Time and memory against the number of points, both logarithmic."""
    titles = growth[_COUNTS[0]].titles
    figure, panels = curves.new_panels(2, len(titles))
    for axes, (key, name) in zip(panels, (("seconds", "time (s)"), ("peak_mib", "memory (MiB)")), strict=True):
        for line, (method, title) in enumerate(titles.items()):
            costs = np.array([_cost(results, method, key) for results in growth.values()])
            costs[~np.isfinite(costs)] = np.nan  # not measured
            curves.draw_line(axes, line, title, np.array(list(growth)), np.maximum(costs, _LEAST[key]), marker="o")
        axes.set(xscale="log", yscale="log", xlabel="points in each cloud", ylabel=name,
                 xlim=(_COUNTS[0] / 1.3, 1.3 * _COUNTS[-1]))
    curves.save(figure, panels, path)
