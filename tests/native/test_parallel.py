"""Work in blocks by several threads: the same bits by any number, for many callers at once, and after a fork."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from fieldalign import _core


@pytest.fixture(scope="module")
def points():
    """Many blocks, and one that is not full."""
    return np.random.default_rng(0).normal(size=(200_003, 3)) * [1e3, 1, 1e-3]


def survey_bits(points, threads):
    return [part.tobytes() for part in _core.survey(points, threads)]


@pytest.mark.parametrize("threads", [2, 3, 8, 64, 1000])
def test_sums_do_not_depend_on_the_threads(points, threads):
    assert survey_bits(points, threads) == survey_bits(points, 1)


@pytest.mark.parametrize("n", [1, 2, 16_383, 16_384, 16_385, 32_768])
def test_each_item_is_in_one_block(points, n):
    bounds, mean = _core.survey(points[:n], 8)
    assert np.array_equal(bounds, [points[:n].min(axis=0), points[:n].max(axis=0)])
    assert np.allclose(mean, points[:n].mean(axis=0), rtol=1e-12, atol=1e-12)


def test_many_callers_at_once(points):
    expected = survey_bits(points, 1)
    with ThreadPoolExecutor(8) as pool:
        assert all(bits == expected for bits in pool.map(lambda _: survey_bits(points, 8), range(64)))


def test_an_error_is_raised_to_the_caller_and_the_next_call_is_none_the_worse(points):
    bounds, _ = _core.survey(points, 2)
    for threads in (1, 2, 8):
        with pytest.raises(ValueError, match="voxel is less than"):
            _core.thin(points, bounds, 1e-9, threads)
        assert len(_core.thin(points, bounds, 100.0, threads)[0]) > 10


AFTER_A_FORK = """
import os
import numpy as np
from fieldalign import _core
points = np.random.default_rng(0).random((200_000, 3))
before = _core.survey(points, 4)[1]
child = os.fork()
if child == 0:
    os._exit(0 if np.array_equal(_core.survey(points, 4)[1], before) else 1)
print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_a_forked_process_has_threads_of_its_own():
    command = [sys.executable, "-W", "ignore", "-c", AFTER_A_FORK]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=30)
    assert ran.stdout == "0\n"
