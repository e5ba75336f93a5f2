"""What the pages take for granted."""

import pytest

GROUNDWORK: dict[str, str] = {}


@pytest.fixture(scope="session")
def groundwork():
    """Of each page: code that makes the files and the names that its blocks speak of."""
    return GROUNDWORK
