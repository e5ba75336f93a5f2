"""The paper's method: it finds motions of the paper's range, with every option, and refuses what it cannot do."""

import subprocess
import sys
from functools import partial

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.evaluation import rotation_error, translation_error
from fieldalign.motions import apply, translation

register = partial(fa.register, method="paper")


# ------------------------------------------------------------------------------------------- motions that are known

@pytest.mark.parametrize("degrees", [1e-5, 5, 20, 30, 40])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_copies_are_brought_onto_each_other(corner, motion, degrees, seed):
    T = motion(np.random.default_rng(seed), degrees, 0.8)
    result = register(corner, apply(T, corner))
    assert rotation_error(result.T_target_source, T) < 1e-6
    assert translation_error(result.T_target_source, T) < 1e-8
    assert result.accepted
    assert result.reason is fa.Reason.ACCEPTED
    assert (result.overlap, result.overlap_target) == (1, 1)
    assert result.rmse < 1e-8


@pytest.mark.parametrize("degrees", [20, 30, 40])
def test_different_points_of_one_surface(corner, motion, rng, degrees):
    """No point has a partner; the points are 4 to 5 cm apart."""
    T = motion(rng, degrees, 0.8)
    result = register(corner[::2], apply(T, corner[1::2]))
    assert result.accepted
    assert rotation_error(result.T_target_source, T) < 0.15
    assert translation_error(result.T_target_source, T) < 0.008
    assert 0.004 < result.rmse < 0.04


def test_parts_that_overlap_by_two_thirds(corner, motion, rng):
    source, target = corner[corner[:, 0] < 2.4], corner[corner[:, 0] > 0.4]
    T = motion(rng, 10, 0.1)
    result = register(source, apply(T, target), init=T @ motion(rng, 8, 0.15))
    assert result.accepted
    assert rotation_error(result.T_target_source, T) < 0.1
    assert translation_error(result.T_target_source, T) < 0.005
    in_target = (source[:, 0] > 0.4).mean()
    assert result.overlap == pytest.approx(in_target, abs=0.1)


def test_identical_clouds_stay_where_they_are(corner):
    result = register(corner, corner)
    assert np.abs(result.T_target_source - np.eye(4)).max() < 1e-9
    assert result.accepted
    assert result.iterations == 1


def test_the_mean_of_five_neighbours_stands_noise(corner, motion):
    """The paper's table: with noise, the mean feature is the better one (Sec. V-G.2)."""
    errors = {1: [], 5: []}
    for seed in range(4):
        rng = np.random.default_rng(seed)
        T = motion(rng, 20, 0.3)
        clouds = [corner[seed % 2 :: 2], apply(T, corner[1 - seed % 2 :: 2])]
        source, target = (cloud + rng.normal(0, 0.02, cloud.shape) for cloud in clouds)
        for k, kept in errors.items():
            result = register(source, target, settings=fa.Settings(neighbours=k))
            kept.append(rotation_error(result.T_target_source, T))
            assert result.accepted
    assert max(errors[5]) < 0.5
    assert np.mean(errors[5]) < np.mean(errors[1])


@pytest.mark.parametrize("name", fa.PRESETS)
def test_every_preset_runs_and_finds_a_small_motion(corner, motion, rng, name):
    T = motion(rng, 15, 0.2)
    result = register(corner, apply(T, corner), settings=name)
    assert result.accepted
    assert rotation_error(result.T_target_source, T) < 1e-5
    assert result.iterations <= fa.PRESETS[name].max_iterations
    assert result.T_target_source.tobytes() == register(
        corner, apply(T, corner), settings=fa.PRESETS[name]
    ).T_target_source.tobytes()


@pytest.mark.parametrize(
    "options",
    [
        {"irls": False},
        {"irls_steps": 1},
        {"irls_distance": 1e-3},
        {"irls_tolerance": 1e-8},
        {"direction": "normals"},
        {"direction": "none"},
        {"direction": "none", "share_limit": None},
        {"share_limit": 1},
        {"min_cosine": 0.5},
        {"min_kept": 100},
        {"pseudo_set": "uniform"},
        {"pseudo_set": "keypoints", "sigma": 0.1},
        {"pseudo_count": 300},
        {"half_width": 1.0},
        {"sigma": 0.2},
        {"neighbours": 8},
        {"normal_neighbours": 25},
        {"max_iterations": 100},
        {"tolerance": 1e-10},
        {"unit": 10.0},
    ],
    ids=str,
)
def test_every_option_runs_and_finds_a_small_motion(corner, motion, rng, options):
    T = motion(rng, 15, 0.2)
    result = register(corner, apply(T, corner), settings=fa.Settings(**options))
    assert result.accepted
    assert rotation_error(result.T_target_source, T) < 1e-4


def test_handed_in_pseudo_points_lead_there_too(corner, pair, rng):
    source, target, T = pair
    near = target[:800] + rng.normal(0, 0.3, (800, 3))
    result = register(source, target, settings=fa.Settings(pseudo_points=near))
    assert result.accepted
    assert rotation_error(result.T_target_source, T) < 1e-6


def test_pseudo_points_of_a_target_serve_many_sources(corner, motion, rng):
    target = fa.prepare(corner)
    for degrees in (10, 20, 30):
        T = motion(rng, degrees, 0.4)
        assert register((corner - T[:3, 3]) @ T[:3, :3], target).accepted
    assert len(target._features) == 1


# ----------------------------------------------------------------------------------------------------- the first guess
def test_without_a_guess_the_centroids_are_laid_on_each_other(corner):
    far = translation([5e3, -2e3, 8e3])
    result = register(corner, apply(far, corner))
    assert np.abs(result.T_target_source - far).max() < 1e-8
    assert result.iterations == 1  # it was there from the start


def test_an_exact_guess_is_there_at_once(corner, motion, rng):
    """170 degrees and far off: no other way leads there, and the guess is one of the frames as they are given."""
    T = translation([100, 200, 300]) @ motion(rng, 170, 3.0)
    target = apply(T, corner)
    result = register(corner, target, init=T)
    assert result.iterations == 1
    assert np.abs(result.T_target_source - T).max() < 1e-9
    assert result.accepted
    assert rotation_error(register(corner, target).T_target_source, T) > 5


def test_a_guess_nearby_is_enough(corner, motion, rng):
    T = translation([100, 200, 300]) @ motion(rng, 170, 3.0)
    turned_in_place = translation(corner.mean(axis=0)) @ motion(rng, 30, 0.3) @ translation(-corner.mean(axis=0))
    result = register(corner, apply(T, corner), init=T @ turned_in_place)
    assert result.accepted
    assert rotation_error(result.T_target_source, T) < 1e-6
    assert translation_error(result.T_target_source, T) < 1e-8


# ------------------------------------------------------------------------------------------------------ when it stops


@pytest.mark.parametrize("unit", [0.3, 1.0, 1000.0])
def test_it_stops_at_the_first_increment_below_the_tolerance(corner, unit):
    """A shift alone: where 1000 is the unit, its first increment is small already."""
    settings = fa.Settings(tolerance=0.01, unit=unit)
    start = translation([0.2, -0.1, 0.15])
    history = register(corner[::2], corner[1::2], init=start, settings=settings).history
    sizes = [np.linalg.norm(step.increment / [1, 1, 1, unit, unit, unit]) for step in history]
    assert sizes[-1] < 0.01
    assert min([np.inf, *sizes[:-1]]) >= 0.01
    assert (len(sizes) == 1) is (unit == 1000)


def test_the_stages_and_the_history_are_told(corner):
    result = register(corner[:4000], corner[2000:] + [0.2, -0.1, 0.3])
    assert list(result.seconds) == ["prepare", "pseudo points", "align", "judge"]
    assert result.iterations <= fa.PRESETS["indoor"].max_iterations
    assert all(10 <= step.kept <= 1000 for step in result.history)
    assert result.history[-1].cost < 0.3 * result.history[0].cost


# ------------------------------------------------------------------------------------------------------- not accepted


def line_bundle(rng):
    return np.c_[rng.normal(0, 0.01, (3000, 2)), rng.uniform(0, 30, 3000)]


def shell(rng):
    away = rng.normal(size=(3000, 3))
    return 0.5 * away / np.linalg.norm(away, axis=1)[:, None]


@pytest.mark.parametrize("seed", range(3))
def test_a_line_is_no_shell(seed):
    rng = np.random.default_rng(seed)
    line, ball = line_bundle(rng), shell(rng)
    for result in (register(line, ball, seed=seed), register(ball, line, seed=seed)):
        assert not result.accepted
        assert result.reason is not fa.Reason.ACCEPTED
        assert min(result.overlap, result.overlap_target) < 0.1


@pytest.mark.parametrize("factor", [0.01, 30])
def test_a_cloud_of_quite_another_size_is_not_accepted(corner, factor):
    result = register(corner, factor * corner)
    assert not result.accepted
    assert max(result.overlap, result.overlap_target) < 0.1


def test_a_corner_is_no_line(corner):
    for seed in (30, 42, 50, 73, 76, 95, 99):  # of 150, these and a few more are accepted
        result = register(corner, line_bundle(np.random.default_rng(seed)))
        assert max(result.overlap, result.overlap_target) < 0.2
        assert not result.accepted


def test_a_large_last_step_is_not_accepted(pair):
    source, target, T = pair
    result = register(source, target, settings=fa.Settings(max_iterations=1))
    assert result.iterations == 1
    assert result.reason is fa.Reason.NOT_CONVERGED
    assert not result.accepted
    assert rotation_error(result.T_target_source, T) > 1


def test_too_few_pseudo_points_are_not_accepted(corner, pair):
    source, target, _ = pair
    result = register(source, target, settings=fa.Settings(min_kept=1000))
    assert result.reason is fa.Reason.LOW_OVERLAP
    assert not result.accepted


FEW_POINTS = """
import numpy as np, fieldalign as fa
few = np.random.default_rng(0).random(({n}, 3))
settings = fa.Settings("uniform", neighbours={k}, direction={rule!r})
print(len(fa.register(few, few, method="paper", settings=settings).T_target_source))
"""


@pytest.mark.parametrize(("n", "k", "rule"), [(9, 1, "normals"), (3, 5, "feet")])
def test_a_cloud_of_few_points_is_answered(n, k, rule):
    """In a process of its own, since it takes the whole process with it."""
    program = FEW_POINTS.format(n=n, k=k, rule=rule)
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert (ran.returncode, ran.stdout) == (0, "4\n")
