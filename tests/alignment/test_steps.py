"""A Gauss-Newton step among the motions that are free, against least squares with a constraint."""

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.alignment.steps import LARGEST_TURN, minimisers, take_steps
from fieldalign.dof import Allowed, Remaining
from fieldalign.motions import exp_twist


def problems(rng, count=5, n=6):
    """Rows J (count, 40, n) and residuals (count, 40), and their H and g."""
    J, r = rng.normal(size=(count, 40, n)), rng.normal(size=(count, 40))
    return J, r, np.swapaxes(J, 1, 2) @ J, np.einsum("bln,bl->bn", J, r)


@pytest.mark.parametrize("n", [6, 7])
@pytest.mark.parametrize("free", [1, 2, 4, 6])
def test_the_minimiser_is_that_of_least_squares_within_the_basis(rng, n, free):
    J, r, H, g = problems(rng, n=n)
    basis = rng.normal(size=(5, n, free))
    found = minimisers(H, g, basis)
    for k in range(5):
        expected = basis[k] @ np.linalg.lstsq(J[k] @ basis[k], -r[k], rcond=None)[0]
        assert np.allclose(found[k], expected, rtol=1e-9, atol=1e-12)


def test_with_all_free_it_is_newtons_step(rng):
    _, _, H, g = problems(rng)
    assert np.allclose(minimisers(H, g, np.tile(np.eye(6), (5, 1, 1))), -np.linalg.solve(H, g[..., None])[..., 0])


def test_columns_of_zeros_change_nothing(rng):
    _, _, H, g = problems(rng)
    basis = rng.normal(size=(5, 6, 3))
    padded = np.concatenate([basis, np.zeros((5, 6, 3))], axis=2)[:, :, [3, 0, 4, 1, 2, 5]]
    assert np.allclose(minimisers(H, g, padded), minimisers(H, g, basis), rtol=1e-12)
    assert not minimisers(H, g, np.zeros((5, 6, 6))).any()


def test_what_nothing_is_known_of_does_not_move(rng):
    """The shortest of all minimisers, measured in standard deviations: a column without rows stays."""
    J, r, *_ = problems(rng)
    J[:, :, 2] = 0
    H, g = np.swapaxes(J, 1, 2) @ J, np.einsum("bln,bl->bn", J, r)
    found = minimisers(H, g, np.tile(np.eye(6), (5, 1, 1)))
    assert not found[:, 2].any()
    for k in range(5):
        assert np.allclose(found[k], np.linalg.lstsq(J[k], -r[k], rcond=None)[0], rtol=1e-9, atol=1e-12)


def test_two_columns_that_are_one_share_the_step(rng):
    _, _, H, g = problems(rng)
    column = rng.normal(size=(5, 6, 1))
    assert np.allclose(minimisers(H, g, np.repeat(column, 2, axis=2)), minimisers(H, g, column), rtol=1e-9)


@pytest.mark.parametrize("unit", [1e-6, 1e-3, 1000.0, 1e6])
def test_no_unit_decides_what_counts_as_information(rng, unit):
    _, _, H, g = problems(rng)
    basis = rng.normal(size=(5, 6, 4))
    lever = np.array([1, 1, 1, unit, unit, unit])
    scaled = minimisers(H / np.outer(lever, lever), g / lever, basis * lever[:, None])
    assert np.allclose(scaled / lever, minimisers(H, g, basis), rtol=1e-8, atol=1e-13)


@pytest.mark.parametrize("weight", [1e-12, 1e9])
def test_no_common_weight_matters(rng, weight):
    _, _, H, g = problems(rng)
    basis = rng.normal(size=(5, 6, 4))
    assert np.allclose(minimisers(weight * H, weight * g, basis), minimisers(H, g, basis), rtol=1e-9)


# ------------------------------------------------------------------------------------------------------------- steps


@pytest.fixture
def poses(any_motion, rng):
    return np.stack([any_motion(rng, 2.0) for _ in range(5)])


def all_free(poses):
    return Remaining(np.eye(6), None)


def test_with_all_free_the_step_is_the_cores(poses, rng):
    _, _, H, g = problems(rng)
    stretch = rng.uniform(1, 1.6, 5)
    twists, moved = take_steps(poses, H, g, stretch, None)
    again, moved_again = take_steps(poses, H, g, stretch, all_free(poses))
    assert np.allclose(twists, again, rtol=0, atol=1e-12)
    assert np.allclose(moved, moved_again, rtol=0, atol=1e-12)


def test_a_step_is_as_long_as_it_is_stretched(poses, rng):
    _, _, H, g = problems(rng)
    g *= 0.1
    plain, _ = take_steps(poses, H, g, np.ones(5), all_free(poses))
    longer, _ = take_steps(poses, H, g, np.full(5, 1.5), all_free(poses))
    assert np.linalg.norm(longer[:, :3], axis=1).max() < LARGEST_TURN
    assert np.allclose(longer, 1.5 * plain)


@pytest.mark.parametrize("allowed", [None, Remaining(np.eye(6), None)], ids=["the core", "Python"])
def test_no_step_turns_by_more_than_the_limit(poses, rng, allowed):
    """It is shortened as a whole, the shift with the turn; a long shift alone is not."""
    _, _, H, g = problems(rng)
    full = -np.linalg.solve(H, 100 * g[..., None])[..., 0]
    assert np.linalg.norm(full[:, :3], axis=1).min() > LARGEST_TURN
    twists, moved = take_steps(poses, H, 100 * g, np.ones(5), allowed)
    assert np.allclose(np.linalg.norm(twists[:, :3], axis=1), LARGEST_TURN)
    shares = LARGEST_TURN / np.linalg.norm(full[:, :3], axis=1)
    assert np.allclose(twists, full * shares[:, None], rtol=1e-9)
    assert np.allclose(moved, [exp_twist(x) @ G for x, G in zip(twists, poses, strict=True)], atol=1e-12)
    shift, _ = take_steps(poses, np.stack(5 * [np.eye(6)]), np.tile([0, 0, 0, 9.0, 0, 0], (5, 1)), np.ones(5), allowed)
    assert np.allclose(shift, np.tile([0, 0, 0, -9.0, 0, 0], (5, 1)))


def test_a_step_with_a_dof_stays_allowed_and_goes_downhill(poses, any_motion, rng):
    _, _, H, g = problems(rng)
    for free in ("yaw", "rx ry", "levelled", "rx rz y", "translation"):
        allowed = Allowed(fa.Dof(free), any_motion(rng, 1.0), any_motion(rng, 1.0), inverted=False)
        start = allowed.nearest(poses)
        twists, moved = take_steps(start, H, g, np.ones(5), allowed)
        assert np.allclose(allowed.nearest(moved), moved, rtol=0, atol=1e-13)
        assert ((twists * g).sum(axis=1) < 0).all()
        for x, basis in zip(twists, allowed.twists(start), strict=True):
            assert np.linalg.matrix_rank(np.c_[basis, x], tol=1e-9) == len(fa.Dof(free).free)
