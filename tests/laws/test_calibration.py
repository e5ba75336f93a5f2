"""The stated covariance is that of the errors, in simulation with known noise."""

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.clouds.simulated import simulate_pair
from fieldalign.motions import inverse, log_motion, translation


def squared_error(result, truth):
    """The error in units of the stated covariance, squared: chi^2 with six degrees of freedom where that is right."""
    about = translation(-result.reference_point)
    x = log_motion(about @ truth @ inverse(result.T_target_source) @ inverse(about))
    return float(x @ result.information @ x)


@pytest.mark.slow
def test_errors_are_as_large_as_the_covariance_says():
    """24 rooms: the mean of so many chi^2 is 6, give or take 0.7, so that a factor of 1.5 is seen."""
    errors = []
    for seed in range(100, 124):
        pair = simulate_pair(seed, 20_000)
        result = fa.register(pair.source, pair.target, init=pair.T_target_source)
        assert result.unobservable.shape == (6, 0)
        errors.append(squared_error(result, pair.T_target_source))
    assert 3 < np.mean(errors) < 9
    assert 2 < np.median(errors) < 9
    assert max(errors) < 40


def test_more_noise_is_less_information():
    """The same rooms and sensors with three times the noise."""
    for seed in (3, 6):
        little, much = (simulate_pair(seed, 20_000, noise=noise) for noise in (0.003, 0.009))
        spread = [np.diag(fa.register(pair.source, pair.target, init=pair.T_target_source).covariance)
                  for pair in (little, much)]
        ratio = np.sqrt(spread[1] / spread[0])
        assert (ratio > 1.5).all()
        assert (ratio < 8).all()


@pytest.mark.parametrize("unit", [1e-3, 1000.0])
def test_another_unit_is_another_scale_of_the_shifts(register, scans, unit):
    source, target = scans
    init = register(source, target).T_target_source
    scaled = init.copy()
    scaled[:3, 3] *= unit
    options = {"settings": fa.PRESETS["indoor"].scaled(unit)} if register.keywords["method"] == "paper" else {}
    here, there = register(source, target, init=init), register(unit * source, unit * target, init=scaled, **options)
    lever = np.array([1, 1, 1, unit, unit, unit])
    size = np.sqrt(np.outer(*2 * [np.diag(here.information)]))
    assert np.abs((there.information * np.outer(lever, lever) - here.information) / size).max() < 1e-3
    assert np.allclose(there.reference_point / unit, here.reference_point, atol=1e-4)
    if here.evidence:
        assert there.evidence.hold == pytest.approx(here.evidence.hold, rel=1e-3)
        assert there.reason is here.reason
        # Rivals around a guess start hopelessly and end where rounding leads them: only their best is alike, roughly.
        assert 0.4 < there.evidence.margin / here.evidence.margin < 2.5
        assert there.evidence.seen_through is None
