"""Whatever might be handed in for a cloud, a pose, a number: right, half right, and wrong."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import contextmanager
from decimal import Decimal
from typing import Any

import hypothesis
import hypothesis.strategies as st
import numpy as np

import fieldalign as fa

PHASES = [phase for phase in hypothesis.Phase if phase is not hypothesis.Phase.explain]  # which takes minutes
MORE = int(os.environ.get("FIELDALIGN_EXAMPLES", 1))  # times as many, and drawn anew: a campaign


def examples(count: int) -> Callable[[Any], Any]:
    """So many examples, the same ones each time; in a campaign, more and others."""
    return hypothesis.settings(
        max_examples=count * MORE,
        derandomize=MORE == 1,
        deadline=None,
        database=None,
        phases=PHASES[:3] if os.environ.get("NOSHRINK") else PHASES,
        suppress_health_check=list(hypothesis.HealthCheck),
    )


@contextmanager
def refusing(*allowed: type[BaseException]):
    """Lets pass what is documented: fieldalign's own exceptions, whose sentence is no empty one, and those allowed."""
    try:
        yield
    except fa.FieldalignError as error:
        told = len(str(error)) > 15 and not isinstance(error.__cause__, NEVER)
        if not told:
            raise AssertionError(f"no sentence, or a slip of ours behind it: {error!r}") from error
    except allowed:
        pass


NEVER = (MemoryError, AssertionError, AttributeError, NameError, Warning)  # behind an exception of ours
SIZES = (0, 1, 2, 3, 4, 10, 40)
UNITS = (1e-310, 1e-200, 1e-20, 1e-3, 1.0, 1e3, 1e14, 1e20, 1e200, 1e308)
OFFSETS = (0.0, 1.0, 5e6, 1e8, -1e14)
ODD = (np.nan, np.inf, -np.inf, 0.0, -0.0, 5e-324, 1e300, -1.7e308)
DTYPES = ("f8", "f4", "f2", ">f8", ">f4", "i1", "u2", "i8", "u8", "?", "c16", "O", "U5", "M8[s]", "g")


def _box(rng, n):
    return rng.random((n, 3))


def _sphere(rng, n):
    points = rng.normal(size=(n, 3))
    return points / np.maximum(np.linalg.norm(points, axis=1, keepdims=True), 1e-9)


def _plane(rng, n):
    return rng.normal(size=(n, 3)) * [1, 1, 0]


def _line(rng, n):
    return rng.normal(size=(n, 1)) * rng.normal(size=3)


def _place(rng, n):
    return np.tile(rng.normal(size=3), (n, 1))


def _copies(rng, n):
    return rng.normal(size=(max(n // 4, 1), 3))[rng.integers(0, max(n // 4, 1), n)]


def _lattice(rng, n):
    return rng.integers(0, 3, (n, 3)).astype(float)


def _outlier(rng, n):
    points = rng.random((n, 3))
    points[:1] *= 1e9
    return points


def _corner(rng, n):
    points = rng.random((n, 3))
    points[np.arange(n), rng.integers(0, 3, n)] = 0
    return points


SHAPES = (_box, _sphere, _plane, _line, _place, _copies, _lattice, _outlier, _corner)


@st.composite
def right_points(draw, sizes=SIZES):
    """float64 points (N, 3) of any shape and scale, finite."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    points = draw(st.sampled_from(SHAPES))(rng, draw(st.sampled_from(sizes)))
    return points * draw(st.sampled_from(UNITS[2:7])) + draw(st.sampled_from(OFFSETS))


@st.composite
def points(draw):
    """Points (N, 3) with anything in them."""
    given_ = draw(right_points())
    with np.errstate(all="ignore"):
        given_ = given_ * draw(st.sampled_from((1.0, *UNITS)))
    if len(given_) and draw(st.booleans()):
        share = draw(st.sampled_from((0.05, 0.5, 1.0)))
        rng = np.random.default_rng(len(given_))
        given_[rng.random(given_.shape) < share] = draw(st.sampled_from(ODD))
    return given_


@st.composite
def laid_out(draw, arrays):
    """An array in another memory order, and not to be written to."""
    array = draw(arrays)
    way = draw(st.sampled_from(("C", "F", "strided", "reversed", "readonly", "broadcast", "masked", "list")))
    if way == "F":
        array = np.asfortranarray(array)
    elif way == "strided":
        array = np.repeat(array, 2, axis=0)[::2]
    elif way == "reversed":
        array = array[::-1]
    elif way == "readonly":
        array.flags.writeable = False
    elif way == "broadcast" and len(array):
        array = np.broadcast_to(array[:1], array.shape)
    elif way == "masked":
        return np.ma.masked_array(array, mask=np.arange(array.size).reshape(array.shape) % 5 == 0)
    elif way == "list":
        return array.tolist()
    return array


def cast(array: np.ndarray, dtype: str) -> Any:
    """The array as another type, as NumPy does it."""
    with np.errstate(all="ignore"):
        if np.dtype(dtype).kind in "iuM":
            array = np.nan_to_num(array, posinf=0, neginf=0).clip(-100, 100)
        return array.astype(dtype)


def of_wrong_kind():
    """What is no array of numbers at all."""
    return st.sampled_from(
        (
            None,
            "points",
            b"points",
            3,
            3.5,
            object(),
            [],
            [[]],
            [[1, 2, 3], [4, 5]],
            [[1, 2, 3], "abc"],
            {},
            {"x": 1},
            set(),
            iter([1, 2]),
            [None] * 3,
            [[10**400, 1, 2]] * 4,
            [[Decimal(1), 2, 3]] * 4,
            np.float64(3),
            np.zeros(()),
            np.zeros(3),
            np.zeros((3, 0)),
            np.zeros((0, 3, 3)),
            np.zeros((5, 4)),
            np.zeros((2, 3, 4)),
            np.zeros((1, 1, 1, 1, 1)),
            range(9),
            np.zeros(4, [("x", "f4"), ("y", "f4"), ("z", "f4")]),
            float,
            lambda x: x,
        )
    )


def clouds():
    """Anything for a cloud, right or wrong."""
    typed = st.builds(cast, points(), st.sampled_from(DTYPES))
    flat = points().map(lambda p: p[:, :2])
    return st.one_of(laid_out(right_points()), laid_out(points()), typed, flat, of_wrong_kind())


def numbers():
    """Anything for a number."""
    return st.one_of(
        st.sampled_from(
            (
                0,
                1,
                -1,
                2,
                0.5,
                1e-320,
                1e300,
                np.nan,
                np.inf,
                -np.inf,
                True,
                None,
                "1",
                10**400,
                -(10**400),
                2**63,
                2**31,
                np.float32(0.1),
                np.int8(3),
                np.complex128(1),
                1j,
                np.array(1.0),
                np.array([1.0]),
                [1],
                object,
            )
        ),
        st.floats(),
        st.integers(-5, 200),
    )


@st.composite
def motions(draw):
    """A rigid motion (4, 4)."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    T = np.eye(4)
    q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    T[:3, :3] = q * np.linalg.det(q)
    T[:3, 3] = rng.normal(size=3) * draw(st.sampled_from((0.0, 1.0, 5e6)))
    return T


def poses():
    """Anything for a pose."""

    def spoilt(T, value, row, column, factor):
        with np.errstate(all="ignore"):
            T = T * factor
        T[row, column] = value
        return T

    wrong = st.builds(
        spoilt, motions(), st.sampled_from(ODD), st.integers(0, 3), st.integers(0, 3), st.sampled_from(UNITS)
    )
    typed = st.builds(cast, motions(), st.sampled_from(DTYPES))
    return st.one_of(motions(), laid_out(motions()), wrong, typed, of_wrong_kind(), st.none())


def is_pose(T: Any, size: int = 4) -> bool:
    """Whether it is a rigid motion (size, size), finite."""
    R = np.asarray(T)[:-1, :-1]
    return (
        np.shape(T) == (size, size) and bool(np.isfinite(T).all()) and np.allclose(R @ R.T, np.eye(size - 1), atol=1e-6)
    )
