"""Lets the tests of this folder share their strategies."""

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))  # so that hypothesis' decorators find them when the tests are collected


@pytest.fixture(autouse=True)
def one_thread(monkeypatch):
    """Tiny clouds: threads would only take time to start."""
    monkeypatch.setattr("fieldalign.threads.os.sched_getaffinity", lambda _: {0}, raising=False)
