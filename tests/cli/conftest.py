"""How the tests of the command line run it."""

import numpy as np
import pytest

from fieldalign.cli import main, progress
from fieldalign.clouds.simulated import Box, cast

ROOM = (
    Box((0, 0, -0.5), (30, 20, 1)), Box((0, 0, 5.5), (30, 20, 1)), Box((15, 0, 2), (1, 20, 8)),
    Box((-15, 0, 2), (1, 20, 8)), Box((0, 10, 2), (30, 1, 8)), Box((0, -10, 2), (30, 1, 8)), Box((4, 4, 1), (2, 3, 2)),
    Box((-5, -4, 1.5), (3, 2, 3)), Box((7, -5, 1), (1, 4, 2)), Box((-8, 5, 2), (2, 2, 4)),
)


@pytest.fixture
def call(scans, monkeypatch, capsys):
    """Runs a command in the folder of the scans: exit status, stdout, stderr; what it leaves there is removed."""
    folder, _ = scans
    monkeypatch.chdir(folder)
    monkeypatch.setattr(progress, "_LINE_AFTER", float("inf"))  # a slow machine says no more than a quick one
    before = set(folder.rglob("*"))

    def run(*args):
        with pytest.raises(SystemExit) as ended:
            main([str(arg) for arg in args])
        out, err = capsys.readouterr()
        return ended.value.code, out, err

    yield run
    for left in set(folder.rglob("*")) - before:
        left.unlink()


@pytest.fixture(scope="session")
def seen_from():
    """Points (n, 3) of a room with some boxes, seen from a place in it."""

    def see(place, seed):
        azimuth, elevation = np.meshgrid(np.linspace(-np.pi, np.pi, 360, endpoint=False), np.linspace(-0.5, 0.5, 24))
        across = np.cos(elevation)
        beams = np.stack([across * np.cos(azimuth), across * np.sin(azimuth), np.sin(elevation)], -1).reshape(-1, 3)
        ranges = cast(ROOM, np.tile(place, (len(beams), 1)), beams)
        return beams * (ranges + 0.005 * np.random.default_rng(seed).normal(size=len(beams)))[:, None]

    return see
