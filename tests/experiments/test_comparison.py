"""What the experiments share: cases by columns on an executor, recorded, resumed, summed up."""

import json
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from fieldalign.assembly.executor import Processes, Serial
from fieldalign.errors import ArgumentError
from fieldalign.experiments import Request, trial
from fieldalign.experiments.case import Case, Moved, spread
from fieldalign.experiments.columns import Answer, ByPaper, Column
from fieldalign.experiments.comparison import Comparison
from fieldalign.experiments.objects import accuracy
from fieldalign.experiments.tables import accuracy as table
from fieldalign.motions import exp_twist
from fieldalign.settings import PRESETS


def clouds(seed):
    return np.random.default_rng(seed).normal(size=(200, 3)) * [1, 0.7, 0.4]


def cases(data, seed):
    motions = [exp_twist(0.1 * np.random.default_rng([seed, k]).normal(size=6)) for k in range(4)]
    return [Case(f"case {k}", "even" if k % 2 == 0 else "odd", Moved(partial(clouds, k), T), T)
            for k, T in enumerate(motions)]


@dataclass
class Counting:
    """Says what it is asked; its answer is the identity. raises: for which of its calls."""

    calls: list
    raises: bool = False

    def __call__(self, source, target, T_guess, threads, seed):
        self.calls.append(len(source))
        if self.raises:
            raise ValueError("it cannot")
        return Answer(np.eye(4), None)

    def __repr__(self):
        return "Counting"


def comparison(*columns):
    return Comparison("tiny", "A tiny experiment", ("Nothing is assumed.",), cases, columns,
                      ("gicp", "icp-point", "fgr"), 0.1, (1.0, 0.01), lambda results: table(results, "m"))


def request(folder, **other):
    return Request(folder, folder, Serial(1), **other)


@pytest.fixture
def calls(monkeypatch):
    """Whom Counting tells; nothing has been warmed up in this process."""
    monkeypatch.setattr(trial, "_warm", set())
    return []


def test_every_case_by_every_column(tmp_path, calls):
    columns = Column("paper", "Paper", ByPaper(PRESETS["object"])), Column("none", "None", Counting(calls))
    results = comparison(*columns).measure(request(tmp_path))
    assert set(results.rows) == {(f"case {k}", name) for k in range(4) for name in ("paper", "none")}
    assert results.groups == ["even", "odd"]
    assert results.successes("paper").all()
    assert not results.successes("none").any()
    assert results.summary("none")["rre_deg"]["median"] > 1
    assert len(calls) == 5  # one of them to warm up


def test_clouds_of_a_case_are_made_once_and_kept_from_harm(tmp_path, calls):
    made = []

    def spoil(source, target, *_):
        source[:] = 0
        return Answer(np.eye(4), None)

    def make(k):
        made.append(k)
        return clouds(k)

    def few(data, seed):
        return [Case("one", "", Moved(partial(make, 0), np.eye(4)), np.eye(4))]

    columns = (Column("spoils", "", spoil), Column("paper", "", ByPaper(PRESETS["object"])))
    results = replace(comparison(*columns), cases=few).measure(request(tmp_path))
    assert made == [0]
    assert results.successes("paper").all()


def test_run_goes_on_where_it_was(tmp_path, calls):
    experiment = comparison(Column("none", "None", Counting(calls)))
    experiment.measure(request(tmp_path, limit=2))
    before = len(calls)
    results = experiment.measure(request(tmp_path))
    assert len(calls) - before == 2
    assert len(results.rows) == 4
    experiment.measure(request(tmp_path))
    assert len(calls) - before == 2


def test_what_raises_is_no_pose(tmp_path, calls):
    results = comparison(Column("none", "Broken", Counting(calls, raises=True))).measure(request(tmp_path))
    found = results.summary("none")
    assert found["without_pose"] == 4
    assert found["success"]["share"] == 0
    assert "it cannot" in results.rows["case 0", "none"]["error"]
    assert "Broken (no pose in 4 of 4)" in table(results)


def test_files_hold_every_pair(tmp_path, calls):
    report = comparison(Column("none", "None", Counting(calls)))(request(tmp_path))
    whole = json.loads((tmp_path / "tiny.json").read_text())
    assert len(whole["rows"]) == len(whole["cases"]) == 4
    assert {(entry["group"], entry["method"]) for entry in whole["measures"]} == {
        (group, "none") for group in ("all", "even", "odd")}
    assert "Nothing is assumed." in (tmp_path / "tiny.md").read_text()
    assert report.text in (tmp_path / "tiny.md").read_text()


def test_unknown_column_is_refused(tmp_path, calls):
    experiment = comparison(Column("none", "None", Counting(calls)))
    with pytest.raises(ArgumentError, match="columns must be of none, but 'gicp' is none; other people's"):
        experiment.measure(request(tmp_path, columns=("gicp",)))


def test_peers_of_a_folder(tmp_path, peers, calls):
    """One works; one raises; one cannot be loaded and is left out; one that needs a checkout is not asked."""
    results = comparison(Column("none", "None", Counting(calls))).measure(request(tmp_path, peers=peers))
    assert results.titles == {"none": "None", "gicp": "Means", "fgr": "Raises"}
    assert results.head["not_measured"] == {"icp-point": "No module named 'a_package_that_nobody_has'"}
    assert np.isfinite(results.values("rre_deg", "gicp")).all()
    assert results.values("rte", "gicp").max() < 0.5
    assert results.summary("fgr")["without_pose"] == 4


def test_peer_with_a_checkout(tmp_path, peers):
    experiment = comparison()
    asked = request(tmp_path, peers=peers, checkouts={"needy": Path("somewhere")}, columns=("needy",))
    assert experiment.measure(asked).titles == {"needy": "Needs a checkout"}


def test_folder_without_adapters_is_refused(tmp_path):
    with pytest.raises(ArgumentError, match="peers must be a folder with adapters"):
        comparison().measure(request(tmp_path, peers=tmp_path))


def test_serial_and_processes_give_the_same_poses(tmp_path, small, peers):
    answers = []
    for number, executor in enumerate((Serial(1), Processes(2))):
        folder = tmp_path / str(number)
        folder.mkdir()
        asked = Request(small, folder, executor, columns=("default", "paper", "gicp"), peers=peers)
        results = accuracy.MODELNET40.measure(asked)
        assert not results.summary("gicp")["without_pose"]
        answers.append({key: row["T"] for key, row in results.rows.items()})
    assert answers[0] == answers[1]


@pytest.mark.parametrize(("limit", "expected"), [(None, range(10)), (20, range(10)), (3, [0, 3, 6])])
def test_spread(limit, expected):
    assert spread(range(10), limit) == list(expected)
