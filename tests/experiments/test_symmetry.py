"""Errors modulo symmetry, on a box with a square base and on a shape without any."""

import numpy as np
import pytest

from fieldalign.experiments.symmetry import errors_modulo_symmetry
from fieldalign.motions import exp_twist


@pytest.fixture(scope="module")
def box():
    """Points of a box 1 x 1 x 0.6 that a quarter of a turn about z lays on itself, on a grid."""
    u, v = (a.ravel() for a in np.meshgrid(*[np.linspace(-0.5, 0.5, 31)] * 2))
    w, height = (a.ravel() for a in np.meshgrid(np.linspace(-0.5, 0.5, 31), np.linspace(-0.3, 0.3, 19)))
    sides = [np.c_[w, s + 0 * w, height] for s in (-0.5, 0.5)] + [np.c_[s + 0 * w, w, height] for s in (-0.5, 0.5)]
    return np.concatenate([np.c_[u, v, 0 * u - 0.3], np.c_[u, v, 0 * u + 0.3], *sides])


def turned(degrees, shift=0.0):
    T = exp_twist(np.r_[0, 0, np.radians(degrees), 0, 0, 0])
    T[0, 3] = shift
    return T


@pytest.mark.parametrize(("degrees", "rest"), [(90, 0), (180, 0), (93, 3), (2, 2)])
def test_box_turned_by_a_quarter_is_the_same_box(box, degrees, rest):
    T_true = exp_twist(np.array([0.3, -0.2, 0.4, 0.5, 0.1, -0.3]))
    found = errors_modulo_symmetry(box, T_true @ turned(degrees), T_true, threads=1)
    assert found[0] == pytest.approx(rest, abs=1e-3)
    assert found[1] == pytest.approx(0, abs=1e-5)


def test_without_symmetry_errors_are_plain(corner):
    found = errors_modulo_symmetry(corner, turned(90, 0.2), np.eye(4), threads=1)
    assert found == pytest.approx((90, 0.2))


def test_shape_that_cannot_be_registered_has_plain_errors():
    line = np.c_[np.linspace(0, 1, 5), np.zeros((5, 2))][[0, 0, 0, 4, 4]]
    assert errors_modulo_symmetry(line, turned(90, 0.2), np.eye(4), threads=1) == pytest.approx((90, 0.2))
