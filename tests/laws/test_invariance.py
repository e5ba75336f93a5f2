"""The world's place, turn and unit change nothing: where the pseudo points are handed in and move along, to 1e-9 of the
extent; in the robust method, which draws the same random numbers, as far as single precision goes in its search."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.motions import apply, exp_twist, growth, inverse, translation

INDOOR = fa.PRESETS["indoor"]
by_paper = partial(fa.register, method="paper")


@pytest.fixture
def handed(scans):
    """Source, target and settings with pseudo points of the target's own."""
    source, target = scans
    pseudo, _ = fa.prepare(target).features(INDOOR, 0, None)
    return source, target, pseudo


def extent(points: np.ndarray) -> float:
    return float(np.linalg.norm(np.ptp(points, axis=0)))


@pytest.mark.parametrize("twist", [[0, 0, 0, 30, -20, 5], [1.0, -2.0, 0.5, 0, 0, 0], [0.3, 2.0, -1.0, 7, 8, -9]])
def test_move_either_world(handed, twist):
    source, target, pseudo = handed
    before = by_paper(source, target, settings=replace(INDOOR, pseudo_points=pseudo)).T_target_source
    W_source, W_target = exp_twist(np.array(twist, float)), exp_twist(-0.7 * np.array(twist, float))
    init = apply_to_pose(W_target, centroid_guess(source, target), W_source)
    moved = by_paper(
        apply(W_source, source),
        apply(W_target, target),
        init=init,
        settings=replace(INDOOR, pseudo_points=apply(W_target, pseudo)),
    ).T_target_source
    again = apply(inverse(W_target) @ moved @ W_source, source)
    assert np.abs(again - apply(before, source)).max() < 1e-9 * extent(source)


@pytest.mark.parametrize("factor", [1000.0, 1e-3, 0.3048])
def test_change_the_unit(handed, factor):
    source, target, pseudo = handed
    settings = replace(INDOOR, pseudo_points=pseudo)
    before = by_paper(source, target, settings=settings).T_target_source
    after = by_paper(factor * source, factor * target, settings=settings.scaled(factor)).T_target_source
    assert np.abs(after[:3, :3] - before[:3, :3]).max() < 1e-9
    assert np.abs(after[:3, 3] / factor - before[:3, 3]).max() < 1e-9 * extent(source)


@pytest.mark.parametrize("factor", [1000.0, 1e-3, 0.3048, 1 / 0.3048, 1e-9, 1e9])
def test_no_unit_has_to_be_said(scans, factor):
    """Millimetres and feet: the poses that the last level starts from differ by the rounding of a float32."""
    source, target = scans
    before, after = fa.register(source, target), fa.register(factor * source, factor * target)
    assert np.abs(after.T_target_source[:3, :3] - before.T_target_source[:3, :3]).max() < 1e-6
    shift = after.T_target_source[:3, 3] / factor
    assert np.abs(shift - before.T_target_source[:3, 3]).max() < 1e-6 * extent(source)
    assert after.reason is before.reason
    assert after.overlap == pytest.approx(before.overlap, abs=0.002)
    assert after.rmse / factor == pytest.approx(before.rmse, rel=1e-3)
    lever = np.array([1, 1, 1, factor, factor, factor])
    assert np.allclose(after.information * np.outer(lever, lever), before.information, rtol=1e-2,
                       atol=1e-3 * np.abs(before.information).max())


def test_a_power_of_two_changes_no_digit(scans):
    source, target = scans
    before, after = fa.register(source, target), fa.register(1024 * source, 1024 * target)
    assert np.array_equal(after.T_target_source[:3, :3], before.T_target_source[:3, :3])
    assert np.array_equal(after.T_target_source[:3, 3], 1024 * before.T_target_source[:3, 3])
    assert (after.overlap, after.iterations) == (before.overlap, before.iterations)


def test_shifted_worlds_are_thinned_alike(scans):
    """The lattice of the voxels begins at the cloud's own corner."""
    source, target = scans
    here, there = np.array([3.0, -20, 5]), np.array([100.0, 200, 300])
    before = fa.register(source, target).T_target_source
    after = fa.register(source + here, target + there).T_target_source
    again = apply(inverse(translation(there)) @ after @ translation(here), source)
    assert np.abs(again - apply(before, source)).max() < 1e-9 * extent(source)


# ------------------------------------------------------------------------------------------------- with other freedoms


@pytest.fixture(params=["levelled", "rz x z", "rotation"])
def freed(request, smaller_scans):
    """Source, target, and a dof that allows the motion between them."""
    source, target, truth = smaller_scans
    dof = fa.Dof(request.param, axis=[0.2, -0.1, 1], centre=[1.0, 0.5, 2])
    D = exp_twist(np.r_[np.array([0.3, -0.2, 0.5]) * dof.mask[:3], 0, 0, 0])
    D[:3, 3] = np.array([2.0, -1, 0.5]) * dof.mask[3:]
    T = dof.frame @ D @ inverse(dof.frame)
    return apply(inverse(T) @ truth, source), target, dof


@pytest.mark.parametrize("factor", [1000.0, 1e-3, 0.3048])
def test_no_unit_has_to_be_said_with_a_dof(freed, factor):
    """Its centre is given in the unit, too."""
    source, target, dof = freed
    before = fa.register(source, target, dof=dof)
    after = fa.register(factor * source, factor * target, dof=fa.Dof(dof.free, dof.axis, factor * dof.centre))
    assert np.abs(after.T_target_source[:3, :3] - before.T_target_source[:3, :3]).max() < 1e-6
    shift = after.T_target_source[:3, 3] / factor
    assert np.abs(shift - before.T_target_source[:3, 3]).max() < 1e-6 * extent(source)
    assert after.reason is before.reason


@pytest.mark.parametrize("factor", [1000.0, 0.3048])
@pytest.mark.parametrize("dof", [None, "levelled"])
def test_no_unit_has_to_be_said_with_a_scale(smaller_scans, dof, factor):
    """Nor the same one for both: the source's is another."""
    source, target, init = smaller_scans
    options = {"scale": True, "dof": dof}
    before = fa.register(source, target, init=init, **options)
    after = fa.register(source / factor, 3 * target, init=growth(3) @ init @ growth(factor), **options)
    there = growth(1 / 3) @ after.T_target_source @ growth(1 / factor)
    assert np.abs(there[:3, :3] - before.T_target_source[:3, :3]).max() < 1e-6
    assert np.abs(there[:3, 3] - before.T_target_source[:3, 3]).max() < 1e-6 * extent(source)
    assert after.reason is before.reason
    assert np.allclose(after.covariance[6, 6], before.covariance[6, 6], rtol=0.01)


def test_where_the_world_is_shifted_the_dof_goes_with_it(freed):
    (source, target, dof), far = freed, translation([100.0, 200, 300])
    before = fa.register(source, target, dof=dof).T_target_source
    shifted = fa.Dof(dof.free, dof.axis, dof.centre + far[:3, 3])
    moved = fa.register(apply(far, source), apply(far, target), dof=shifted)
    again = apply(inverse(far) @ moved.T_target_source @ far, source)
    assert np.abs(again - apply(before, source)).max() < 1e-9 * extent(source)


def test_either_world_may_be_shifted_with_a_scale(smaller_scans):
    source, target, init = smaller_scans
    here, there = translation([3.0, -20, 5]), translation([100.0, 200, 300])
    before = fa.register(source, target, scale=True, init=init).T_target_source
    after = fa.register(apply(here, source), apply(there, target), scale=True, init=there @ init @ inverse(here))
    again = inverse(there) @ after.T_target_source @ here
    assert np.abs(again - before).max() < 1e-9 * extent(source)


def centroid_guess(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    T = np.eye(4)
    T[:3, 3] = target.mean(axis=0) - source.mean(axis=0)
    return T


def apply_to_pose(W_target: np.ndarray, T: np.ndarray, W_source: np.ndarray) -> np.ndarray:
    return W_target @ T @ inverse(W_source)
