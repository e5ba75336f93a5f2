"""An experiment that is many registrations by several methods: cases, columns, a table, a picture."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path

from ..assembly.record import RunRecord
from ..assembly.work import Task
from ..errors import ArgumentError
from ..whole_file import write_text
from . import results
from .alone import telling
from .case import Case, spread
from .columns import ByPeer, Column, peers_in, unloadable
from .data_sets.files import is_part
from .request import Report, Request
from .results import Further, Results, Row
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
    text: text(results), the table and what stands below it.
    draw: draw(results, path), the picture; None: none.
    few: how many cases are run of this project's part of the data where no limit is given; None: all.
    trial: the work on one case by one method.
    record: the experiment whose cases these are, so that its record serves for both; None: its own.
    further: what else each method is measured by, see Results; None: nothing.
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
    few: int | None = None
    trial: type[Trial] = Trial
    record: str | None = None
    further: Further | None = None

    def __call__(self, request: Request) -> Report:
        """Runs it: NAME.json with every pair, NAME.md with the table, NAME.png where there is a picture."""
        measured = self.measure(request)
        path = request.output / self.name
        text = self.text(measured)
        files = [results.write_json(measured.to_dict(), path.with_suffix(".json")),
                 write_text(results.page(measured.head, text, len(measured.cases)), path.with_suffix(".md"))]
        if self.draw is not None:
            self.draw(measured, path.with_suffix(".png"))
            files.append(path.with_suffix(".png"))
        return Report(text, files, self.title, [measured])

    def measure(self, request: Request) -> Results:
        """Every case by every method; what the run folder holds is not done again."""
        every = self.cases(request.data, request.seed)
        cases = spread(every, self._limit(request))
        columns, faults = self._chosen(request)
        rows = self._rows(request, cases, columns)
        titles = {column.name: column.title for column in columns}
        shown = () if len(cases) == len(every) else (f"{len(cases)} of {len(every)} registrations, spread evenly.",)
        head = results.head(self.name, self.title, (*self.protocol, *shown), request.data, request.seed)
        return Results(cases, titles, rows, self.success, request.seed, head | {"not_measured": faults}, self.further)

    def _limit(self, request: Request) -> int | None:
        return self.few if request.limit is None and is_part(request.data) else request.limit

    def columns(self, request: Request) -> dict[str, Column]:
        """The methods that can be asked for, by name."""
        return {column.name: column for column in self.own} | self._peers(request)

    def _chosen(self, request: Request) -> tuple[list[Column], dict[str, str]]:
        """The methods that are asked for, and why some cannot be had; raises ArgumentError for a name of none."""
        columns = self.columns(request)
        chosen = asked_of(columns, request)
        faults = unloadable(align for name in chosen if isinstance(align := columns[name].align, ByPeer))
        return [columns[name] for name in chosen if name not in faults], faults

    def _peers(self, request: Request) -> dict[str, Column]:
        """Other people's methods that the experiment is for, as far as the folder has them."""
        if request.peers is None:
            return {}
        folder, checkouts = str(request.peers.absolute()), request.checkouts
        titles = peers_in(request.peers, (*self.peers, *checkouts), checkouts)
        return {
            name: Column(name, title, ByPeer(folder, name, self.voxel, self.from_guess,
                                             str(checkouts[name].absolute()) if name in checkouts else None))
            for name, title in titles.items()
        }

    def _rows(self, request: Request, cases: list[Case], columns: list[Column]) -> dict[tuple[str, str], Row]:
        """By (case, method); cases in turn, so that a noisy moment of the machine hits all methods alike."""
        names = {f"{case.name}|{column.name}": (case, column) for case in cases for column in columns}
        run = {"experiment": self.record or self.name, "data": str(request.data.absolute()), "seed": request.seed}
        trial = self.trial(request.executor.threads, request.seed, repr(run))
        folder = request.run_folder or request.output / f"{run['experiment']}.run"
        methods = {column.name: repr(column.align) for column in columns}
        with ExitStack() as opened:
            record = opened.enter_context(RunRecord(folder, run, methods))
            found: dict[str, Row] = {key: record.done[key] for key in names if key in record.done}
            tasks = [Task(key, (), data) for key, data in names.items() if key not in found]
            request.tell(self.name, 0, len(tasks))
            opened.enter_context(telling(trial.threads))
            work = opened.enter_context(closing(request.executor.run(trial, tasks, {}))) if tasks else ()
            for finished, done in enumerate(work, 1):
                found[done.key] = done.value if done.error is None else {"error": done.error}
                record.add(done.key, found[done.key])
                request.tell(self.name, finished, len(tasks))
        return {(case.name, column.name): found[key] for key, (case, column) in names.items()}


def asked_of(known: Collection[str], request: Request) -> list[str]:
    """The names of methods that are asked for; raises ArgumentError for one that is not known."""
    names = list(known) if request.columns is None else list(request.columns)
    if unknown := [name for name in names if name not in known]:
        raise ArgumentError(f"columns must be of {', '.join(known)}, but {unknown[0]!r} is none"
                            + ("" if request.peers else "; other people's methods need --peers FOLDER"))
    return names
