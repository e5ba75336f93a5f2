"""The world's place, turn and unit change nothing: where the pseudo points are handed in and move along, to 1e-9 of the
extent; in the robust method, which draws the same random numbers, as far as single precision goes in its search."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.motions import apply, exp_twist, inverse, translation

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


def centroid_guess(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    T = np.eye(4)
    T[:3, 3] = target.mean(axis=0) - source.mean(axis=0)
    return T


def apply_to_pose(W_target: np.ndarray, T: np.ndarray, W_source: np.ndarray) -> np.ndarray:
    return W_target @ T @ inverse(W_source)
