"""What the tests share: seeded clouds, random motions, and the real scans where they are to be had."""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fieldalign as fa
from fieldalign.motions import apply, exp_twist

DATA = Path(os.environ.get("FIELDALIGN_DATA", Path(__file__).parents[2] / "shared" / "data"))


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder of real scans; its licences do not let it into the repository."""
    if not DATA.is_dir():
        pytest.skip(f"no real scans: neither $FIELDALIGN_DATA nor {DATA} is a folder")
    return DATA


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20221)


@pytest.fixture(scope="session")
def corner() -> np.ndarray:
    """Three walls of a room with a box and a ball in it: 6000 points, metres, a unique pose."""
    rng = np.random.default_rng(7)
    u, v = rng.uniform(0, 3, (2, 1500))
    walls = [np.c_[u, v, 0 * u], np.c_[u, 0 * u, 0.7 * v], np.c_[0 * u, u, 0.7 * v]]
    a, b = rng.uniform(0, 1, (2, 600))
    top, front = np.c_[1 + a, 1 + 0.6 * b, 0 * a + 0.5], np.c_[1 + a, 0 * a + 1, 0.5 * b]
    box = [top, front, np.c_[0 * a + 2, 1 + 0.6 * a, 0.5 * b]]
    ball = rng.normal(size=(1200, 3))
    ball = 0.4 * ball / np.linalg.norm(ball, axis=1)[:, None] + [2.3, 0.6, 1.2]
    return np.vstack([*walls, *box, ball])[rng.permutation(7500)[:6000]]


@pytest.fixture
def motion():
    """Makes a random motion (4, 4): rotation angle in degrees, length of the shift."""

    def make(rng: np.random.Generator, degrees: float, shift: float) -> np.ndarray:
        axis, step = rng.normal(size=(2, 3))
        w = np.radians(degrees) * axis / np.linalg.norm(axis)
        T = exp_twist(np.r_[w, 0, 0, 0])
        T[:3, 3] = shift * step / np.linalg.norm(step)
        assert np.isclose(Rotation.from_matrix(T[:3, :3]).magnitude(), np.radians(degrees))
        return T

    return make


@pytest.fixture(scope="session")
def any_motion():
    """Makes a random motion (4, 4): a rotation from all of SO(3) alike, and the length of the shift."""

    def make(rng: np.random.Generator, shift: float) -> np.ndarray:
        T, step = np.eye(4), rng.normal(size=3)
        T[:3, :3] = Rotation.random(random_state=rng).as_matrix()
        T[:3, 3] = shift * step / np.linalg.norm(step)
        return T

    return make


@pytest.fixture
def pair(corner, motion, rng):
    """Two copies of the corner, 30 degrees and half a metre apart, and the motion between them."""
    T = motion(rng, 30, 0.5)
    return corner, apply(T, corner), T


@pytest.fixture(scope="session")
def winding():
    """Makes the poses (n, 4, 4) of a drive of n frames, about a metre each, that turns, climbs and rolls a little."""

    def make(seed: int, n: int, noise: float = 0.0) -> np.ndarray:
        rng = np.random.default_rng(seed)
        turns = np.cumsum(rng.normal(size=(n, 3)), axis=0) * [0.002, 0.002, 0.02]
        poses = np.tile(np.eye(4), (n, 1, 1))
        for k in range(1, n):
            step = exp_twist(np.r_[turns[k] * 0.2, 1 + 0.1 * np.sin(k / 9), 0, 0.02 * np.cos(k / 30)])
            poses[k] = poses[k - 1] @ step @ exp_twist(noise * rng.normal(size=6))
        return poses

    return make


@pytest.fixture(params=["robust", "paper"])
def register(request):
    """fa.register, by either method."""
    return partial(fa.register, method=request.param)


@pytest.fixture(scope="session")
def same_span():
    """Whether two sets of columns span one space."""

    def check(basis: np.ndarray, expected: np.ndarray) -> bool:
        Q, E = np.linalg.qr(basis)[0], np.linalg.qr(expected)[0]
        return basis.shape == expected.shape and np.allclose(Q @ Q.T, E @ E.T, atol=1e-6)

    return check
