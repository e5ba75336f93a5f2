"""What changes the pseudo points or the data's order moves the answer by no more than its covariance says."""

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.motions import apply, exp_twist, inverse, translation

UTM = translation([5e6, 4e5, 100])


def test_swapped_clouds_give_the_inverse(register, scans, within_three_sigma):
    source, target = scans
    back = register(target, source)
    assert within_three_sigma(register(source, target), inverse(back.T_target_source))


def test_permuted_points(register, scans, within_three_sigma, rng):
    source, target = scans
    permuted = register(rng.permutation(source), rng.permutation(target))
    assert within_three_sigma(register(source, target), permuted.T_target_source)


def test_duplicated_points(register, scans, within_three_sigma):
    source, target = scans
    doubled = register(np.vstack([source, source]), np.vstack([target, target]))
    assert within_three_sigma(register(source, target), doubled.T_target_source)


def test_coordinates_of_utm_size(register, scans, within_three_sigma):
    source, target = scans
    far = register(source + UTM[:3, 3], target + UTM[:3, 3])
    here = inverse(UTM) @ far.T_target_source @ UTM
    assert within_three_sigma(register(source, target), here)
    assert np.abs(here - register(source, target).T_target_source).max() < 1e-6


def test_another_seed(register, scans, within_three_sigma):
    first = register(*scans, seed=0)
    close = [within_three_sigma(first, register(*scans, seed=seed).T_target_source) for seed in range(1, 9)]
    assert sum(close) >= 7


@pytest.mark.parametrize("seed", range(3))
def test_any_pose_of_either_world(scans, within_three_sigma, any_motion, seed):
    """Turned clouds have other voxels, and so other surfels and pseudo points."""
    source, target = scans
    rng = np.random.default_rng(seed)
    W_source, W_target = any_motion(rng, 20.0), any_motion(rng, 20.0)
    moved = fa.register(apply(W_source, source), apply(W_target, target), seed=seed).T_target_source
    assert within_three_sigma(fa.register(source, target), inverse(W_target) @ moved @ W_source)


# ------------------------------------------------------------------------------------------------- with other freedoms


@pytest.fixture(params=[{"dof": "levelled"}, {"dof": "levelled", "method": "paper"}, {"scale": True},
                        {"scale": True, "dof": "levelled"}], ids=lambda options: ", ".join(map(str, options.values())))
def levelled(request, smaller_scans):
    """Registration with fewer freedoms, or more, from a guess that is not tilted; and scans that are levelled."""
    source, target, T = smaller_scans
    source, guess = apply(T, source), exp_twist(np.array([0, 0, 0.02, 0.05, 0.03, 0.01]))

    def register(source, target, init=guess):
        return fa.register(source, target, init=init, **request.param)

    return register, source, target, guess


def test_swapped_clouds_give_the_inverse_with_other_freedoms(levelled, within_three_sigma):
    register, source, target, guess = levelled
    there, back = register(source, target), register(target, source, inverse(guess))
    assert within_three_sigma(there, np.linalg.inv(back.T_target_source))


def test_permuted_points_with_other_freedoms(levelled, within_three_sigma, rng):
    register, source, target, _ = levelled
    permuted = register(rng.permutation(source), rng.permutation(target))
    assert within_three_sigma(register(source, target), permuted.T_target_source)


def test_duplicated_points_with_other_freedoms(levelled, within_three_sigma):
    register, source, target, _ = levelled
    doubled = register(np.vstack([source, source]), np.vstack([target, target]))
    assert within_three_sigma(register(source, target), doubled.T_target_source)


def test_turned_worlds_with_an_axis_that_turns_along(levelled, any_motion, within_three_sigma, rng):
    """Levelled about what was up before."""
    _, source, target, guess = levelled
    W, V = any_motion(rng, 5.0), any_motion(rng, 5.0)
    before = fa.register(source, target, dof="levelled", init=guess)
    dof = fa.Dof("levelled", axis=W[:3, 2], centre=W[:3, 3])
    after = fa.register(apply(V, source), apply(W, target), dof=dof, init=W @ guess @ inverse(V))
    assert within_three_sigma(before, inverse(W) @ after.T_target_source @ V)
