"""A disk that is full, and a folder that may not be written."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

NOBODY = 65534


@pytest.fixture
def full():
    """Makes the disk full: no file grows beyond so many bytes. What the system says is EFBIG, not ENOSPC, and else the
    same."""
    resource = pytest.importorskip("resource", reason="Windows knows no limit of a file's size")

    @contextmanager
    def limited(size: int) -> Iterator[None]:
        before = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)

    return limited


@pytest.fixture
def read_only():
    """A folder that may be read and not written, by somebody who is not root; within `as_nobody`."""
    if not hasattr(os, "geteuid"):
        pytest.skip("no users on this system")
    folder = Path(tempfile.mkdtemp(prefix="read-only-"))
    yield folder
    shutil.rmtree(folder)


@pytest.fixture
def as_nobody():
    """Drops root's rights for a while: root may write anywhere."""

    @contextmanager
    def dropped(folder: Path) -> Iterator[None]:
        folder.chmod(0o555)
        if is_root := os.geteuid() == 0:
            os.seteuid(NOBODY)
        try:
            yield
        finally:
            if is_root:
                os.seteuid(0)
            folder.chmod(0o755)

    return dropped
