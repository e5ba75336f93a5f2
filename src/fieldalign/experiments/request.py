"""What an experiment is asked, and what it answers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

from ..assembly.executor import Executor
from ..evaluation import Evaluation
from .results import Results

Tell: TypeAlias = Callable[[str, int, int | None], None]  # a stage, how much of it is done, and of how much


@dataclass(frozen=True, eq=False)
class Request:
    """What an experiment is asked.

    data: the folder of the data set, in its published layout, or ../shared/data of this project's checkouts.
    output: the folder of the results, which exists.
    executor: where the work runs. seed: of every random draw.
    limit: at most so many cases, spread evenly over all that there are; None: all, or as many as the experiment takes
        of this project's part of the data.
    columns: the methods to measure, by name; None: all that the experiment is for.
    peers: a folder with adapters of other people's methods (benchmarks/peers of the checkout); None: none.
    checkouts: of methods that are not in the package index, by name: the folder with their code and weights.
    run_folder: where each result is recorded at once, and from which an interrupted run goes on; None: NAME.run in
        output.
    tell: is told how far the work is.
    """

    data: Path
    output: Path
    executor: Executor
    seed: int = 0
    limit: int | None = None
    columns: tuple[str, ...] | None = None
    peers: Path | None = None
    checkouts: Mapping[str, Path] = field(default_factory=dict)
    run_folder: Path | None = None
    tell: Tell = lambda stage, finished, of: None


@dataclass(frozen=True)
class Report:
    """What an experiment answers: a text for the terminal, the files that it has written, and what a page of it shows:
    the results of its registrations, part by part, or the trajectories beside the truth, by the names of their methods;
    title: of the experiment.
    """

    text: str
    files: list[Path]
    title: str = ""
    results: Sequence[Results] = ()
    drives: Mapping[str, Evaluation] = field(default_factory=dict)
