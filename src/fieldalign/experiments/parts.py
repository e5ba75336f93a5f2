"""An experiment of several comparisons: the paper's protocol and the benchmark's, say, each with its own table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..errors import DataSetError
from ..whole_file import write_text
from . import results
from .comparison import Comparison, asked_of
from .request import Report, Request


@dataclass(frozen=True)
class Parts:
    """Several comparisons under one name.

    name, title: of the experiment. parts: each with a name of its own. beside: what stands below all the tables, as
    published figures do.
    """

    name: str
    title: str
    parts: Sequence[Comparison]
    beside: str = ""

    def __call__(self, request: Request) -> Report:
        """Runs those parts whose data are there: a .json of each by its name, and NAME.md with all the tables.

        Raises DataSetError where there are data of none, ArgumentError for columns that are in none.
        """
        asked_of({name: part for part in self.parts for name in part.columns(request)}, request)
        pages, texts, files = [f"# {self.title}", ""], [], []
        every: list[results.Results] = []
        left_out: list[DataSetError] = []
        for part, asked in self._asked(request):
            try:
                measured = part.measure(asked)
            except DataSetError as error:
                left_out.append(error)
                continue
            every.append(measured)
            text = part.text(measured)
            pages.append(results.page(measured.head, text, len(measured.cases), "##"))
            texts += [f"{part.title}\n\n{text}\n"]
            files.append(results.write_json(measured.to_dict(), request.output / f"{part.name}.json"))
        if not files:
            raise left_out[0]
        below = [self.beside, *(f"Left out: {error}." for error in left_out)]
        files.append(write_text("\n\n".join([*pages, *below]) + "\n", request.output / f"{self.name}.md"))
        return Report("\n\n".join([*texts, *below]), files, self.title, every)

    def _asked(self, request: Request) -> list[tuple[Comparison, Request]]:
        """What each part is asked: for those of the columns that it has, and for a record of its own; without those
        that have none of them."""
        folder, asked = request.run_folder or request.output / f"{self.name}.run", []
        for part in self.parts:
            has = part.columns(request)
            columns = None if request.columns is None else tuple(name for name in request.columns if name in has)
            if columns != ():
                asked.append((part, replace(request, columns=columns, run_folder=folder / part.name)))
        return asked
