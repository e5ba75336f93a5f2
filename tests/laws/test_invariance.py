"""Where the pseudo points are handed in and move along, the world's place, turn and unit change nothing."""

from dataclasses import replace

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.motions import apply, exp_twist, inverse

INDOOR = fa.PRESETS["indoor"]


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
    before = fa.register(source, target, settings=replace(INDOOR, pseudo_points=pseudo)).T_target_source
    W_source, W_target = exp_twist(np.array(twist, float)), exp_twist(-0.7 * np.array(twist, float))
    init = apply_to_pose(W_target, centroid_guess(source, target), W_source)
    moved = fa.register(
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
    before = fa.register(source, target, settings=settings).T_target_source
    after = fa.register(factor * source, factor * target, settings=settings.scaled(factor)).T_target_source
    assert np.abs(after[:3, :3] - before[:3, :3]).max() < 1e-9
    assert np.abs(after[:3, 3] / factor - before[:3, 3]).max() < 1e-9 * extent(source)


def centroid_guess(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    T = np.eye(4)
    T[:3, 3] = target.mean(axis=0) - source.mean(axis=0)
    return T


def apply_to_pose(W_target: np.ndarray, T: np.ndarray, W_source: np.ndarray) -> np.ndarray:
    return W_target @ T @ inverse(W_source)
