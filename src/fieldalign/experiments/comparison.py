"""An experiment that is many registrations by several methods: cases, columns, a table, a picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path

from ..assembly.record import RunRecord
from ..assembly.work import Task
from ..errors import ArgumentError
from . import results
from .case import Case, spread
from .columns import ByPeer, Column, peers_in
from .request import Report, Request
from .results import Results, Row
from .trial import Trial


@dataclass(frozen=True)
class Comparison:
    """Many registrations with known answers, by several methods side by side.

    name, title: of the experiment. protocol: sentences that say what is done, and what was assumed.
    cases: cases(data, seed), all that there are.
    own: the columns of this project. peers: other people's methods that the experiment is for, by name.
    voxel: the length that peers are told. from_guess: whether peers start from each case's guess, or from the
        centroids laid on each other.
    success: degrees and length within which a registration is right.
    symmetric: whether shapes may be like themselves when they are turned.
    text: text(results), the table and what stands below it.
    draw: draw(results, path), the picture; None: none.
    """

    name: str
    title: str
    protocol: Sequence[str]
    cases: Callable[[Path, int], list[Case]]
    own: Sequence[Column]
    peers: Sequence[str]
    voxel: float
    success: tuple[float, float]
    text: Callable[[Results], str]
    draw: Callable[[Results, Path], None] | None = None
    from_guess: bool = False
    symmetric: bool = False

    def __call__(self, request: Request) -> Report:
        """Runs it: NAME.json with every pair, NAME.md with the table, NAME.png where there is a picture."""
        measured = self.measure(request)
        path = request.output / self.name
        text = self.text(measured)
        files = [results.write_json(measured.to_dict(), path.with_suffix(".json")),
                 results.write_text(_page(self, measured, text), path.with_suffix(".md"))]
        if self.draw is not None:
            self.draw(measured, path.with_suffix(".png"))
            files.append(path.with_suffix(".png"))
        return Report(text, files)

    def measure(self, request: Request) -> Results:
        """Every case by every method; what the run folder holds is not done again."""
        cases = spread(self.cases(request.data, request.seed), request.limit)
        columns = self._columns(request)
        rows = self._rows(request, cases, columns)
        titles = {column.name: column.title for column in columns}
        head = results.head(self.name, self.title, self.protocol, request.data, request.seed)
        return Results(cases, titles, rows, self.success, request.seed, head)

    def _columns(self, request: Request) -> list[Column]:
        """The methods that are asked for and can be had; raises ArgumentError for a name of none."""
        columns = {column.name: column for column in self.own}
        if request.peers is not None:
            titles = peers_in(request.peers, (*self.peers, *request.checkouts), request.checkouts)
            for name, title in titles.items():
                checkout = request.checkouts.get(name)
                align = ByPeer(str(request.peers.absolute()), name, self.voxel, self.from_guess,
                               None if checkout is None else str(checkout.absolute()))
                columns[name] = Column(name, title, align)
        chosen = columns if request.columns is None else request.columns
        if unknown := [name for name in chosen if name not in columns]:
            raise ArgumentError(f"columns must be of {', '.join(columns)}, but {unknown[0]!r} is none"
                                + ("" if request.peers else "; other people's methods need --peers FOLDER"))
        return [columns[name] for name in chosen]

    def _rows(self, request: Request, cases: list[Case], columns: list[Column]) -> dict[tuple[str, str], Row]:
        """By (case, method); cases in turn, so that a noisy moment of the machine hits all methods alike."""
        names = {f"{case.name}|{column.name}": (case, column) for case in cases for column in columns}
        trial = Trial(request.executor.threads, request.seed, self.symmetric)
        run = {"experiment": self.name, "data": str(request.data.absolute()), "seed": request.seed}
        methods = {column.name: repr(column.align) for column in columns}
        found: dict[str, Row] = {}
        with ExitStack() as opened:
            record = None
            if request.run_folder is not None:
                record = opened.enter_context(RunRecord(request.run_folder, run, methods))
                found = {key: record.done[key] for key in names if key in record.done}
            tasks = [Task(key, (), data) for key, data in names.items() if key not in found]
            request.tell(self.name, 0, len(tasks))
            work = opened.enter_context(closing(request.executor.run(trial, tasks, {}))) if tasks else ()
            for finished, done in enumerate(work, 1):
                found[done.key] = done.value if done.error is None else {"error": done.error}
                if record is not None:
                    record.add(done.key, found[done.key])
                request.tell(self.name, finished, len(tasks))
        return {(case.name, column.name): found[key] for key, (case, column) in names.items()}


def _page(experiment: Comparison, measured: Results, text: str) -> str:
    """The table as a page: what was done, on what, and what came of it."""
    head = measured.head
    made = ", ".join(f"{name} {number}" for name, number in head["versions"].items())
    return "\n".join([
        f"# {experiment.title}", "", *(f"- {sentence}" for sentence in experiment.protocol), "", text, "",
        f"{len(measured.cases)} registrations, seed {head['seed']}, {head['machine']}, {head['date']}; {made}.", "",
    ])
