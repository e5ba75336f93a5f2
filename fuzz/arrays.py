"""Arrays as nobody would want them: of every shape of cloud, and with every kind of value."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
SIZES = (0, 1, 2, 3, 4, 7, 16, 48, 49, 130, 300, 1000)
BLOCKS = (16383, 16384, 16385, 20_000)  # about what a thread takes at a time
SIZES_OF_WORLDS = (1e-310, 1e-160, 1e-20, 1e-3, 1.0, 1e3, 5e6, 1e8, 1e15, 1e20, 1e155, 1e300, 1.7e308)
ODD = (
    0.0,
    -0.0,
    np.nan,
    np.inf,
    -np.inf,
    5e-324,
    1e-310,
    1e-38,
    2.0**31,
    -(2.0**31) - 1,
    2.0**53,
    1e19,
    3e38,
    1e300,
    -1e300,
)


def number(rng: np.random.Generator, share_odd: float = 0.3) -> float:
    """Any number."""
    return float(rng.choice(ODD) if rng.random() < share_odd else rng.normal() * 10 ** rng.uniform(-6, 6))


def length(rng: np.random.Generator, share_odd: float = 0.2) -> float:
    """Mostly a length that fits a cloud of extent 1."""
    return number(rng) if rng.random() < share_odd else float(10 ** rng.uniform(-3, 1))


def count(rng: np.random.Generator) -> int:
    """How many points."""
    return int(rng.choice(BLOCKS if rng.random() < 0.01 else SIZES))


def values(rng: np.random.Generator, *shape: int) -> Floats:
    """Numbers of any size, here and there an odd one, or very many."""
    drawn = rng.normal(size=shape) * (rng.choice(SIZES_OF_WORLDS) if rng.random() < 0.3 else 1.0)
    share = rng.choice([0.0, 0.0, 0.01, 0.5, 1.0])
    return np.where(rng.random(shape) < share, rng.choice(ODD, shape), drawn)


def cloud(rng: np.random.Generator, n: int | None = None, *, is_finite: bool = False) -> Floats:
    """Points (n, 3): a box, a sphere, a lattice, a plane, a line, one place, copies, a far outlier, or mere numbers."""
    n = count(rng) if n is None else n
    unit = rng.normal(size=(n, 3))
    kind = rng.integers(9)
    if kind == 0:
        points = rng.random((n, 3))
    elif kind == 1:
        points = unit / np.maximum(np.linalg.norm(unit, axis=1, keepdims=True), 1e-9)
    elif kind == 2:
        points = rng.integers(0, 5, (n, 3)).astype(float)
    elif kind == 3:
        points = unit * [1, 1, 0]
    elif kind == 4:
        points = unit[:, :1] * rng.normal(size=3)
    elif kind == 5:
        points = np.broadcast_to(rng.normal(size=3), (n, 3)).copy()
    elif kind == 6:
        points = unit[rng.integers(0, max(n // 3, 1), n)] if n else unit
    elif kind == 7:
        points = unit
        points[: n // 50 + 1] *= 1e9
    else:
        points = values(rng, n, 3)
    if rng.random() < 0.3:
        points = points * rng.choice(SIZES_OF_WORLDS[:9] if is_finite else SIZES_OF_WORLDS)
    if rng.random() < 0.3:
        points = points + rng.choice([1.0, 5e6, 1e8, -1e15])
    return np.nan_to_num(points, nan=0.0, posinf=1e15, neginf=-1e15) if is_finite else points


def directions(rng: np.random.Generator, n: int) -> Floats:
    """Mostly unit vectors (n, 3)."""
    if rng.random() < 0.2:
        return values(rng, n, 3)
    drawn = rng.normal(size=(n, 3))
    if rng.random() < 0.3:
        drawn = np.eye(3)[rng.integers(0, 3, n)]
    return np.ascontiguousarray(drawn / np.linalg.norm(drawn, axis=1, keepdims=True))


def motion(rng: np.random.Generator) -> Floats:
    """Mostly a motion (4, 4)."""
    if rng.random() < 0.2:
        return values(rng, 4, 4)
    T = np.eye(4)
    T[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    T[:3, 3] = rng.normal(size=3) * rng.choice([0.1, 1.0, 1e6])
    return T


def broken(rng: np.random.Generator, array: NDArray) -> object:
    """The array in another type, shape or order, or no array at all."""
    ways = (
        lambda: array.astype(np.float32),
        lambda: array.astype(np.float16),
        lambda: np.nan_to_num(array).astype(np.int64),
        lambda: np.asfortranarray(array),
        lambda: array[::2],
        lambda: array[::-1],
        lambda: array.T,
        lambda: array.ravel(),
        lambda: array[:-1],
        lambda: array[None],
        lambda: array.astype(">f8"),
        lambda: array.astype(complex),
        lambda: array.astype(object),
        lambda: array.tolist(),
        lambda: None,
        lambda: "points",
        lambda: np.zeros((0, 0)),
        lambda: np.broadcast_to(array[:1], array.shape),
    )
    with np.errstate(all="ignore"):
        return ways[rng.integers(len(ways))]()
