"""Where work runs: the same answers everywhere, failures that stay their own, and workers that die."""

import sys
import time
from contextlib import closing
from functools import partial

import pytest

import fieldalign as fa
from fieldalign.assembly.executor import Dask, Executor, Processes, Serial, Task, as_executor
from fieldalign.assembly.work import Line, Shelf


@pytest.fixture(params=["serial", "processes", "dask"])
def executor(request):
    if request.param == "dask":
        return Dask(request.getfixturevalue("cluster"))
    return Serial() if request.param == "serial" else Processes(2)


def work_off(executor, function, tasks, items):
    with closing(executor.run(function, tasks, items)) as work:
        done = list(work)
    assert len({one.key for one in done}) == len(done)
    return {one.key: one for one in done}


def numbered(count, needs=(), data=lambda number: number):
    return (Task(str(number), needs, data(number)) for number in range(count))


# ----------------------------------------------------------------------------------------------------------- anywhere


def test_each_task_is_done_and_each_item_made_once_per_process(executor, jobs, tmp_path):
    log = tmp_path / "log"
    items = {"ten": partial(jobs.made, 10, log)}
    done = work_off(executor, jobs.plus_item, numbered(40, ("ten",)), items)
    assert {key: one.value for key, one in done.items()} == {str(k): k + 10 for k in range(40)}
    makers = log.read_text().split()
    assert len(makers) == len(set(makers)) <= 2


def test_what_a_task_raises_is_its_own_failure(executor, jobs):
    items = {"ten": partial(jobs.made, 10), "broken": jobs.broken}
    tasks = [Task(name, ("ten", "broken"), name) for name in ("ours", "other", "exit", "item", "fine")]
    done = work_off(executor, jobs.fails, tasks, items)
    assert {name: one.error for name, one in done.items()} == {
        "ours": "it is ours", "other": "ZeroDivisionError: by zero", "exit": "SystemExit: 3",
        "item": "this scan is broken", "fine": None,
    }
    assert done["fine"].value == 10


def test_an_item_that_a_task_does_not_need_is_not_there(executor, jobs):
    done = work_off(executor, jobs.undeclared, [Task("a", ("ten",))], {"ten": int, "other": int})
    assert "other is none of the items that a needs" in done["a"].error


def test_no_tasks_give_nothing(executor, jobs):
    assert work_off(executor, jobs.plus_item, (), {}) == {}


def test_tasks_are_drawn_as_there_is_room(executor, jobs):
    drawn = []
    tasks = (drawn.append(task.key) or task for task in numbered(200, ("ten",)))
    with closing(executor.run(jobs.plus_item, tasks, {"ten": partial(jobs.made, 10)})) as work:
        next(work)
        assert len(drawn) <= 40


# -------------------------------------------------------------------------------------------------- in other processes


@pytest.fixture(params=["processes", "dask"])
def elsewhere(request):
    return Processes(2) if request.param == "processes" else Dask(request.getfixturevalue("cluster"))


def test_a_value_that_does_not_pickle_is_a_failure(elsewhere, jobs):
    tasks = [Task("no pickle", ("ten",), "no pickle"), Task("fine", ("ten",), "fine")]
    done = work_off(elsewhere, jobs.fails, tasks, {"ten": partial(jobs.made, 10)})
    assert "pickle" in done["no pickle"].error
    assert done["fine"].error is None


def test_an_item_that_does_not_pickle_is_one_clear_error(elsewhere, jobs):
    with pytest.raises(fa.ArgumentError, match="ten cannot be sent to another process"):
        work_off(elsewhere, jobs.plus_item, numbered(2, ("ten",)), {"ten": lambda: 10})


def test_a_worker_that_is_killed_loses_nothing(elsewhere, jobs, tmp_path):
    items = {"data": partial(jobs.made, jobs.ones())}
    tasks = numbered(12, ("data",), lambda number: (number, tmp_path / "marker"))
    done = work_off(elsewhere, jobs.dies_once, tasks, items)
    assert (tmp_path / "marker").exists()
    assert {key: one.value for key, one in done.items()} == {str(k): k + 20_000 for k in range(12)}


def test_a_task_that_kills_its_workers_is_a_failure_and_no_other_is(jobs):
    """Without a cluster, whose own retries take longer; the line that tasks stand in is the same."""
    done = work_off(Processes(2), jobs.kills, numbered(10), {})
    assert [key for key, one in done.items() if one.error] == ["3"]
    assert "the worker died 3 times" in done["3"].error


def test_workers_end_with_the_run_that_is_left(jobs):
    began = time.monotonic()
    with closing(Processes(2).run(jobs.waits, (Task(str(k), (), 60 * k) for k in range(3)), {})) as work:
        next(work)
    assert time.monotonic() - began < 30


def test_workers_that_cannot_start_are_one_clear_error(jobs, monkeypatch):
    monkeypatch.setattr("fieldalign.assembly.processes._begin", jobs.dies)
    with pytest.raises(fa.RunError, match="worker processes cannot start"):
        work_off(Processes(1), jobs.waits, numbered(1), {})


def test_a_scheduler_that_does_not_answer_is_one_clear_error(jobs, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("fieldalign.assembly.on_dask._PATIENCE", 0.2)
    with pytest.raises(fa.RunError, match="no Dask scheduler answers at tcp://127"):
        work_off(Dask("tcp://127.0.0.1:9"), jobs.waits, numbered(1), {})


def test_a_cluster_without_dask_names_the_extra(jobs, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(fa.MissingExtraError, match=r"fieldalign\[dask\]"):
        work_off(Dask(), jobs.waits, numbered(1), {})


# ---------------------------------------------------------------------------------------------------------- the parts


def test_what_stands_for_an_executor():
    assert isinstance(as_executor(None), Serial)
    assert as_executor(3).count == 3
    assert as_executor("tcp://here:1").address == "tcp://here:1"
    assert isinstance(own := as_executor(Serial(1)), Executor)
    assert as_executor(own) is own
    for other in (0, -1, True, 2.0, [1]):
        with pytest.raises(fa.ArgumentError, match="executor must be"):
            as_executor(other)
    with pytest.raises(fa.ArgumentError, match="workers belong to a local cluster"):
        Dask("tcp://here:1", 2)


def test_a_shelf_keeps_what_was_used_last():
    shelf, made = Shelf(2), []
    for name in "abacab":
        assert shelf.get(name, lambda name=name: made.append(name) or name) == name
    assert made == ["a", "b", "c", "b"]
    shelf.drop(lambda name: name == "b")
    shelf.get("a", pytest.fail)
    assert shelf.get("b", lambda: 2) == 2


def test_an_item_that_could_not_be_made_is_tried_again():
    shelf = Shelf()
    with pytest.raises(ZeroDivisionError):
        shelf.get("a", lambda: 1 / 0)
    assert shelf.get("a", lambda: 1) == 1


def test_a_suspect_goes_alone():
    line = Line(numbered(6), room=3)
    for task in line.ready():
        line.away[task.key] = task
    assert list(line.away) == ["0", "1", "2"]
    assert list(line.died("1")) == []
    assert list(line.ready()) == []  # the others are still away
    line.back("0"), line.back("2")
    for task in line.ready():
        line.away[task.key] = task
    assert list(line.away) == ["1"]
    line.back("1")
    assert [task.key for task in line.ready() if not line.away.update({task.key: task})] == ["3", "4", "5"]


def test_a_cluster_of_this_machine_listens_to_no_other(jobs):
    """Whoever reaches its scheduler may run code on its workers; its dashboard shows what they do."""
    pytest.importorskip("distributed")
    psutil = pytest.importorskip("psutil")
    with closing(Dask("local", 1).run(jobs.waits, numbered(2), {})) as work:
        next(work)
        family = [psutil.Process(), *psutil.Process().children(recursive=True)]
        listening = [c.laddr for p in family for c in p.net_connections("inet") if c.status == psutil.CONN_LISTEN]
    assert len(listening) >= 4  # the scheduler, its dashboard, a worker, its nanny
    assert {address.ip for address in listening} == {"127.0.0.1"}
