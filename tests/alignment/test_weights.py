import numpy as np
import pytest
from scipy.optimize import linprog

from fieldalign import _core
from fieldalign.alignment.weights import linear_step
from fieldalign.settings import Settings


def direct(J, r):
    return linear_step(J, r, np.ones(len(r)), Settings(irls=False))[0]


def reweighted(J, r, **settings):
    return linear_step(J, r, np.ones(len(r)), Settings(**settings))


@pytest.fixture
def problem(rng):
    J = rng.normal(size=(200, 6))
    x = rng.normal(size=6)
    return J, -J @ x, x


def test_information_is_the_weighted_sum(problem, rng):
    J, w = problem[0], rng.random(200)
    assert np.allclose(_core.information(J, w), (J * w[:, None]).T @ J)


def test_direct_is_least_squares(problem, rng):
    J, r, _ = problem
    r = r + rng.normal(size=200)
    assert np.allclose(direct(J, r), np.linalg.lstsq(J, -r, rcond=None)[0])


def test_outliers_do_not_move_the_reweighted_solution(problem, rng):
    J, r, x = problem
    r[:60] += 5
    found, weights = reweighted(J, r, irls_distance=1e-4, irls_tolerance=1e-12)
    assert np.allclose(found, x, atol=1e-6)
    assert weights[:60].max() < 1e-3 * weights[60:].max()
    assert np.abs(direct(J, r) - x).max() > 0.1


def test_reweighting_minimises_the_sum_of_absolute_residuals(problem, rng):
    J, r, _ = problem
    r = r + rng.standard_cauchy(200)
    found, _ = reweighted(J, r, irls_distance=1e-5, irls_tolerance=1e-13, irls_steps=20000)
    # min sum t, -t <= J x + r <= t
    A = np.block([[J, -np.eye(200)], [-J, -np.eye(200)]])
    best = linprog(np.r_[np.zeros(6), np.ones(200)], A, np.r_[-r, r], bounds=[(None, None)] * 6 + [(0, None)] * 200)
    assert np.abs(J @ found + r).sum() == pytest.approx(best.fun, rel=1e-6)


def test_no_step_in_a_direction_without_information(rng):
    J = rng.normal(size=(100, 6))
    J[:, 4] = 0
    x = direct(J, rng.normal(size=100))
    assert abs(x[4]) < 1e-12
    assert np.abs(x).max() > 1e-3


def test_no_information_gives_no_step():
    assert np.array_equal(direct(np.zeros((10, 6)), np.ones(10)), np.zeros(6))


def test_the_unit_of_length_does_not_matter(problem, rng):
    J, r, _ = problem
    J[:, 5] = J[:, 4]  # one direction is free: the pseudo-inverse has to choose
    unit = np.array([1000.0, 1000, 1000, 1, 1, 1])
    assert np.allclose(direct(J * unit, r) * unit, direct(J, r), rtol=1e-6, atol=1e-9)
