"""What the tests of work need: tasks that workers can import, and a Dask cluster where there is one to be had."""

import logging
import sys
from pathlib import Path

import pytest

HERE = str(Path(__file__).parent)


@pytest.fixture(scope="session")
def jobs():
    """The module of tasks; new processes inherit the path to it."""
    sys.path.insert(0, HERE)
    import work_of_tests

    yield work_of_tests
    sys.path.remove(HERE)


@pytest.fixture(scope="session")
def cluster(jobs):
    """The address of a scheduler of this machine with two workers."""
    distributed = pytest.importorskip("distributed", reason="the extra dask is not installed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address="127.0.0.1:0", worker_dashboard_address="127.0.0.1:0",
        silence_logs=logging.CRITICAL,
    ) as local:
        yield local.scheduler_address
