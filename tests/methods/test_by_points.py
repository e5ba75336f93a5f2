"""Clouds that show no surface: too few points, or too much noise."""

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.evaluation import rotation_error, translation_error
from fieldalign.methods.by_points import Points, _turns
from fieldalign.methods.pair import Pair
from fieldalign.motions import angles_between, apply, growth
from fieldalign.settings import PRESETS

PRIOR = {"init": np.eye(4), "search_angle": 50}


def shape(count: int, seed: int = 0) -> np.ndarray:
    """Points on the surface of a body like no turned one of itself, 1 across."""
    rng = np.random.default_rng(seed)
    d = rng.normal(size=(count, 3))
    d /= np.linalg.norm(d, axis=1)[:, None]
    x, y, z = d.T
    r = 1 + 0.5 * x * y + 0.4 * z**3 + 0.5 * np.exp(-8 * ((x - 0.7) ** 2 + (y + 0.6) ** 2)) + 0.3 * y**3
    return 0.35 * r[:, None] * d * [1.0, 0.7, 0.5]


@pytest.fixture
def T(rng, motion):
    return motion(rng, 40, 0.5)


@pytest.mark.parametrize("count", [300, 1000])
def test_copies_of_few_points_meet(T, count):
    source = shape(count)
    result = fa.register(source, apply(T, source), **PRIOR)
    assert rotation_error(result.T_target_source, T) < 1e-6
    assert translation_error(result.T_target_source, T) < 1e-8


def test_copies_of_few_points_meet_from_any_pose(rng, motion):
    source, T = shape(400), motion(rng, 170, 2)
    assert rotation_error(fa.register(source, apply(T, source)).T_target_source, T) < 1e-6


def test_a_few_points_find_their_place_on_a_dense_cloud(T):
    dense = shape(50_000)
    result = fa.register(dense[::150], apply(T, dense), **PRIOR)
    assert rotation_error(result.T_target_source, T) < 2
    assert translation_error(result.T_target_source, T) < 0.02


def test_a_few_points_of_a_dense_cloud_meet_themselves(T):
    dense = shape(50_000)
    result = fa.register(dense[::200], apply(T, dense), **PRIOR)
    assert rotation_error(result.T_target_source, T) < 1e-6
    back = fa.register(apply(T, dense), dense[::200], **PRIOR)
    assert rotation_error(np.linalg.inv(back.T_target_source), T) < 1e-6


def test_noise_of_a_tenth_of_the_size(rng, T):
    clean = shape(10_000)
    source, target = (cloud + rng.normal(0, 0.1, cloud.shape) for cloud in (clean, apply(T, clean)))
    result = fa.register(source, target, **PRIOR)
    by_paper = fa.register(source, target, method="paper", settings="object")
    assert rotation_error(result.T_target_source, T) < min(8, rotation_error(by_paper.T_target_source, T))
    assert not result.accepted


def test_the_answer_stays_within_the_angle(T):
    """Of a flat box, which is itself after half a turn."""
    rng = np.random.default_rng(3)
    box = rng.uniform(-1, 1, (200, 3)) * [1, 0.6, 0.3]
    box = np.concatenate([box, box * [-1, -1, 1]])
    result = fa.register(box, apply(T, box), **PRIOR)
    assert np.degrees(angles_between(result.T_target_source, np.eye(4))) < 53
    assert rotation_error(result.T_target_source, T) < 1e-6


def test_a_guess_of_another_size_turns_as_it_does(T):
    source = fa.prepare(shape(400))
    pair = Pair(source, source, 0.1, guess=T @ growth(2.0), grows=True)
    assert pair.is_within(np.radians(5), T)
    assert not pair.is_within(np.radians(5), np.eye(4))


def test_same_seed_same_bits_at_any_number_of_threads(T):
    source, target = shape(600), apply(T, shape(600, seed=1))
    poses = [fa.register(source, target, threads=threads, **PRIOR).T_target_source for threads in (1, 2, 3)]
    assert np.array_equal(poses[0], poses[1])
    assert np.array_equal(poses[0], poses[2])


def test_turns_reach_every_rotation():
    turns = np.stack(list(_turns(np.pi)))
    assert len(turns) == 60
    everywhere = np.stack([np.eye(4)] * 500)
    everywhere[:, :3, :3] = np.linalg.qr(np.random.default_rng(0).normal(size=(500, 3, 3)))[0]
    everywhere[:, :3, :3] *= np.linalg.det(everywhere[:, :3, :3])[:, None, None]
    away = angles_between(everywhere[:, None], turns[None]).min(axis=1)
    assert np.degrees(away.max()) < 45


def test_turns_around_a_guess_stay_within_the_angle():
    sizes = [float(angles_between(turn, np.eye(4))) for turn in _turns(np.radians(50))]
    assert len(sizes) == 13
    assert sizes[0] == 0
    assert np.allclose(sizes[1:], np.radians(30))


def test_misfit_is_nothing_where_points_meet_and_grows_from_there(T):
    source = shape(500)
    points = Points(fa.prepare(source), fa.prepare(apply(T, source)), 1)
    assert points.misfit(T) < 1e-12
    near = T.copy()
    near[:3, 3] += 0.01
    far = T.copy()
    far[:3, 3] += 0.1
    assert 0 < points.misfit(near) < points.misfit(far)


def test_the_settings_have_the_size_of_the_target_wherever_it_lies(T):
    """What the paper says of objects of unit size, times the longest edge of the target's box."""
    target = shape(500) * [1.0, 2.0, 0.5]
    for offset in ([0, 0, 0], [100.0, -20, 7]):
        found = Points(fa.prepare(shape(500)), fa.prepare(target + offset), 1)._settings(77)
        edge = np.ptp(target, axis=0).max()
        assert found.half_width == pytest.approx(PRESETS["object"].half_width * edge)
        assert found.unit == pytest.approx(edge)
        assert found.pseudo_count == 77
