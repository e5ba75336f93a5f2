"""Killed at random moments, a command leaves what is whole, and called again it ends as if nothing had been.

The campaign of hundreds of kills is `python tests/faults/campaign.py`; here are a dozen of it.
"""

import os
import signal
import sys
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="processes are found through /proc")


@pytest.fixture(scope="module")
def campaign():
    sys.path.insert(0, str(Path(__file__).parent))
    import campaign

    yield campaign
    sys.path.remove(str(Path(__file__).parent))


@pytest.fixture(scope="module")
def data(campaign, tmp_path_factory):
    folder = tmp_path_factory.mktemp("data")
    campaign.make_data(folder / "data")
    return folder / "data"


@pytest.mark.slow
@pytest.mark.parametrize(("name", "kills"), [("assemble, alone", 3), ("batch", 4), ("odometry", 3), ("experiment", 2)])
def test_killed_at_random_moments(campaign, data, tmp_path, name, kills):
    tally = campaign.disturb(name, data, tmp_path, kills, np.random.default_rng(len(name)))
    assert sum(tally.kills.values()) == kills


def test_a_run_that_is_killed_leaves_no_process_and_no_temporary_file(campaign, data, tmp_path):
    """While its workers are at work: what was there for them goes with them."""
    chain = campaign.Chain("batch", data, tmp_path / "chain")
    process = chain.start()
    record = chain.folder / "run" / "record.jsonl"
    while not (record.exists() and campaign.check_record(record) > 1):
        assert process.poll() is None
    os.kill(process.pid, signal.SIGKILL)
    process.communicate()
    assert chain.wait_for_workers() < 5
    assert list((chain.folder / "tmp").iterdir()) == []
