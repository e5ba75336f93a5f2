"""The same bits wherever the work is done: in threads beside each other, after a fork, in other processes, under Dask,
and whatever the environment says of threads."""

import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

import pytest

import fieldalign as fa
from fieldalign.assembly.executor import Dask, Processes, Task

HERE = Path(__file__).parent


@pytest.fixture(scope="module")
def everything():
    """The module, which new processes find, too."""
    pytest.importorskip("igl")
    sys.path.insert(0, str(HERE))
    import everything

    yield everything
    sys.path.remove(str(HERE))


@pytest.fixture(scope="module")
def alone(everything):
    return everything.digests(1)


@pytest.mark.parametrize("threads", [2, 4, 8])
def test_any_number_of_threads_and_repeated(everything, alone, threads):
    assert everything.digests(threads) == alone


def test_many_callers_at_once(everything, alone):
    with ThreadPoolExecutor(4) as pool:
        assert all(digests == alone for digests in pool.map(everything.digests, [1, 2, 3, None]))


@pytest.mark.parametrize("kind", ["processes", "dask"])
def test_another_process(everything, alone, kind):
    if kind == "dask":
        pytest.importorskip("distributed")
    executor = Dask("local", 1) if kind == "dask" else Processes(1)
    with closing(executor.run(everything.task, [Task("all", (), 2)], {})) as work:
        assert [done.value for done in work] == [alone]


FORKED = """
import json, os, sys
sys.path.insert(0, sys.argv[1])
import everything
before = everything.digests(4)
if hasattr(os, "fork"):
    reading, writing = os.pipe()
    if os.fork() == 0:
        os.write(writing, json.dumps(everything.digests(4)).encode())
        os._exit(0)
    os.wait()
    assert json.loads(os.read(reading, 1 << 16)) == before
print(json.dumps(before))
"""
# Neither one thread nor as many as there are cores, as a BLAS has them by itself; a fork then leaves some behind.
ENVIRONMENT = {"OPENBLAS_NUM_THREADS": "3", "OMP_NUM_THREADS": "3", "MKL_NUM_THREADS": "3", "PYTHONHASHSEED": "1"}


def test_whatever_the_environment_says_and_after_a_fork(everything, alone):
    """A fork copies no threads: what waited for those of the parent would hang, and the time ends that."""
    paths = os.pathsep.join([str(Path(fa.__file__).parents[1]), *filter(None, [os.environ.get("PYTHONPATH")])])
    ran = subprocess.run([sys.executable, "-W", "ignore", "-c", FORKED, HERE], capture_output=True, text=True,
                         timeout=300, env=os.environ | {"PYTHONPATH": paths} | ENVIRONMENT, check=False)
    assert ran.stderr == ""
    assert json.loads(ran.stdout) == alone


def test_nothing_reads_the_environment():
    """But for the colours of a terminal, and for what tells other people's libraries their threads while they are
    measured."""
    package = Path(fa.__file__).parent
    reads = {path.relative_to(package).as_posix() for path in package.rglob("*.py")
             if "os.environ" in (text := path.read_text()) or "getenv" in text}
    assert reads == {"cli/plot.py", "experiments/alone.py", "experiments/columns.py"}
