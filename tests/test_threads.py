"""How many threads, and tasks side by side: their answers in order, their errors in the open."""

import threading

import pytest

from fieldalign.errors import ArgumentError
from fieldalign.threads import resolve_threads, side_by_side


def test_none_is_as_many_as_there_are_and_a_number_is_itself():
    assert resolve_threads(None) >= 1
    assert [resolve_threads(n) for n in (1, 2, 300)] == [1, 2, 300]


@pytest.mark.parametrize("threads", [0, -1, 1.5, True, "2"])
def test_anything_else_is_refused(threads):
    with pytest.raises(ArgumentError, match=r"^threads must be an integer of at least 1"):
        resolve_threads(threads)


@pytest.mark.parametrize("threads", [1, 2, 3, 8])
def test_answers_come_in_the_order_of_the_tasks(threads):
    release = threading.Event()

    def first():
        assert threads == 1 or release.wait(10)
        return "first"

    def second():
        release.set()
        return "second"

    assert side_by_side(threads, first, second) == ["first", "second"]


def test_one_thread_is_the_callers_own():
    assert side_by_side(1, threading.get_ident, threading.get_ident) == [threading.get_ident()] * 2


def test_two_tasks_run_at_once():
    both = threading.Barrier(2, timeout=10)
    assert sorted(side_by_side(2, both.wait, both.wait)) == [0, 1]


@pytest.mark.parametrize("threads", [1, 2])
def test_an_error_is_raised_and_the_first_of_two(threads):
    def fail(word):
        raise ValueError(word)

    with pytest.raises(ValueError, match=r"^one$"):
        side_by_side(threads, lambda: fail("one"), lambda: fail("two"))
    with pytest.raises(ValueError, match=r"^two$"):
        side_by_side(threads, lambda: 1, lambda: fail("two"))
