"""What is worked out when first asked for, once; and two clouds side by side."""

import threading
import time

import pytest

from fieldalign.lazy import lazy


class Cloud:
    def __init__(self):
        self.calls = 0

    @lazy
    def size(self):
        """How large it is."""
        self.calls += 1
        return [self.calls]

    @lazy
    def broken(self):
        self.calls += 1
        raise ValueError("no size")


def test_it_is_worked_out_once_and_for_each_alone():
    one, other = Cloud(), Cloud()
    assert one.calls == 0
    assert one.size is one.size
    assert (one.calls, other.calls) == (1, 0)
    assert other.size is not one.size


def test_it_keeps_its_words():
    assert Cloud.size.__doc__ == "How large it is."
    assert isinstance(Cloud.size, lazy)


def test_an_error_is_not_kept():
    cloud = Cloud()
    for _ in range(2):
        with pytest.raises(ValueError, match="no size"):
            _ = cloud.broken
    assert cloud.calls == 2


def test_two_clouds_do_not_wait_for_each_other():
    """functools.cached_property of Python 3.11 has one lock for both: this would never end."""
    both = threading.Barrier(2, timeout=10)

    class Meeting:
        @lazy
        def met(self):
            both.wait()
            return True

    clouds = [Meeting(), Meeting()]
    threads = [threading.Thread(target=lambda cloud=cloud: cloud.met) for cloud in clouds]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [cloud.__dict__.get("met") for cloud in clouds] == [True, True]


def test_threads_that_ask_at_once_get_one_answer():
    class Slow:
        @lazy
        def answer(self):
            time.sleep(0.02)
            return object()

    slow, answers = Slow(), []
    threads = [threading.Thread(target=lambda: answers.append(slow.answer)) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(set(map(id, answers))) == 1
    assert slow.answer is answers[0]
