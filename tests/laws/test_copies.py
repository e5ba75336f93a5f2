"""Two copies of one cloud, moved apart, are brought together to the last digits."""

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.evaluation import rotation_error, translation_error
from fieldalign.motions import apply


@pytest.mark.parametrize("preset", ["object", "indoor", "indoor-dense"])
@pytest.mark.parametrize("degrees", [1, 15, 30])
def test_copies(corner, rng, motion, preset, degrees):
    T = motion(rng, degrees, 0.5)
    settings = fa.PRESETS[preset].scaled(0.7)
    result = fa.register(corner, apply(T, corner), settings=settings)
    assert rotation_error(result.T_target_source, T) < 1e-6
    assert translation_error(result.T_target_source, T) < 1e-8
    assert result.accepted
    assert result.overlap == result.overlap_target == 1


def test_identical_clouds_stay(corner):
    result = fa.register(corner, corner)
    assert np.abs(result.T_target_source - np.eye(4)).max() < 1e-12
    assert result.accepted
