"""Two copies of one cloud, moved apart, are brought together to the last digits."""

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fieldalign as fa
from fieldalign.clouds.simulated import simulate_pair
from fieldalign.evaluation import rotation_error, translation_error
from fieldalign.motions import apply, translation

by_paper = partial(fa.register, method="paper")


@pytest.mark.parametrize("preset", ["object", "indoor", "indoor-dense"])
@pytest.mark.parametrize("degrees", [1, 15, 30])
def test_copies_by_the_papers_method(corner, rng, motion, preset, degrees):
    T = motion(rng, degrees, 0.5)
    result = by_paper(corner, apply(T, corner), settings=fa.PRESETS[preset].scaled(0.7))
    assert met(result, T)
    assert result.overlap == result.overlap_target == 1


def test_identical_clouds_stay(register, corner):
    result = register(corner, corner)
    assert np.abs(result.T_target_source - np.eye(4)).max() < 1e-12
    assert result.accepted


def met(result, T, unit=1.0):
    """Whether a pose is accepted and exact, in a scene of some metres."""
    found = result.T_target_source
    return result.accepted and rotation_error(found, T) < 1e-6 and translation_error(found, T) < 1e-8 * unit


# ------------------------------------------------------------------------------------------------- from any pose


@pytest.mark.slow
@settings(max_examples=20, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), far=st.sampled_from([0.0, 1.0, 1e3]))
def test_any_motion(corner, any_motion, seed, far):
    T = any_motion(np.random.default_rng(seed), far)
    assert met(fa.register(corner, apply(T, corner), seed=seed % 5), T, 1 + far)


@pytest.mark.parametrize("degrees", [1e-7, 1e-3, 1, 90, 179.9999, 180])
def test_small_turns_and_half_turns(corner, motion, rng, degrees):
    T = motion(rng, degrees, 0.5)
    assert met(fa.register(corner, apply(T, corner)), T)


def test_copies_in_another_order(corner, any_motion, rng):
    T = any_motion(rng, 5.0)
    assert met(fa.register(rng.permutation(corner), apply(T, corner)), T)


def test_scans_of_a_room(scans, any_motion, rng):
    T = any_motion(rng, 5.0)
    assert met(fa.register(scans[0], rng.permutation(apply(T, scans[0]))), T)


@pytest.mark.parametrize("unit", [1.0, 1000.0])
def test_a_hundred_thousand_points(any_motion, rng, unit):
    """More than the last level looks at: those that it thins away must meet too."""
    points = unit * simulate_pair(2, 100_000).source.points
    T = any_motion(rng, 5.0 * unit)
    assert met(fa.register(rng.permutation(points), apply(T, points)), T, unit)


def test_far_from_the_origin(corner, any_motion, rng):
    """At UTM size float64 has steps of a nanometre; the copies differ by as much, and some such steps add up."""
    here, there = translation([5e6, 4e5, 100]), translation([-2e6, 7e6, 0])
    T = any_motion(rng, 5.0)
    source, target = apply(here, corner), apply(there @ T, corner)
    found = translation([2e6, -7e6, 0]) @ fa.register(source, target).T_target_source @ here
    assert rotation_error(found, T) < 1e-6
    assert np.abs(apply(found, corner) - apply(T, corner)).max() < 5e-8


def test_single_precision_is_met_as_far_as_it_goes(corner, any_motion, rng):
    T = any_motion(rng, 1.0)
    result = fa.register(corner.astype(np.float32), apply(T, corner).astype(np.float32))
    assert rotation_error(result.T_target_source, T) < 1e-5
    assert np.abs(apply(result.T_target_source, corner) - apply(T, corner)).max() < 1e-6


def test_doubled_points_are_copies_as_well(corner, any_motion, rng):
    doubled = np.repeat(corner, 2, axis=0)
    T = any_motion(rng, 5.0)
    assert met(fa.register(doubled, apply(T, doubled)), T)


def test_clouds_that_are_hardly_copies_are_not_taken_for_such(corner, any_motion, rng):
    """As many points with nearly the same moments, but each noisy: the answer is that of the noise."""
    T = any_motion(rng, 1.0)
    result = fa.register(corner, apply(T, corner + rng.normal(0, 1e-3, corner.shape)))
    assert result.accepted
    assert 1e-6 < rotation_error(result.T_target_source, T) < 0.02
    assert result.rmse > 1e-4
