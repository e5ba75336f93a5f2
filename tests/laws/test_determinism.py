"""The same seed gives the same bits: at any number of threads, on repeated calls, beside other work."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import fieldalign as fa


def bits(result: fa.RegistrationResult) -> list[bytes]:
    arrays = (result.T_target_source, result.information, result.covariance, result.reference_point)
    numbers = np.array([result.overlap, result.overlap_target, result.rmse, result.iterations])
    return [array.tobytes() for array in (*arrays, numbers)] + [step.increment.tobytes() for step in result.history]


@pytest.mark.parametrize("preset", ["indoor", "object", "indoor-dense"])
def test_any_number_of_threads(scans, preset):
    one = bits(fa.register(*scans, settings=preset, threads=1))
    for threads in (2, 3, 8, None):
        assert bits(fa.register(*scans, settings=preset, threads=threads)) == one


def test_keypoints_at_any_number_of_threads(scans):
    settings = fa.Settings("keypoints", sigma=0.3)
    one, four = (fa.register(*scans, settings=settings, threads=threads) for threads in (1, 4))
    assert bits(one) == bits(four)


def test_repeated_and_prepared(scans):
    source, target = scans
    first = bits(fa.register(source, target))
    prepared = fa.prepare(target)
    for _ in range(3):
        assert bits(fa.register(source, target)) == first
        assert bits(fa.register(source, prepared)) == first
        assert bits(fa.register(fa.prepare(source), prepared)) == first


def test_beside_other_registrations(scans):
    source, target = scans
    alone = [bits(fa.register(source, target, seed=seed)) for seed in range(4)]
    prepared = fa.prepare(target)
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda seed: bits(fa.register(source, prepared, seed=seed)), range(4)))
    assert together == alone


def test_another_seed_gives_other_pseudo_points(scans):
    assert bits(fa.register(*scans, seed=0)) != bits(fa.register(*scans, seed=1))
