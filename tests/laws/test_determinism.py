"""The same seed gives the same bits: at any number of threads, on repeated calls, beside other work."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import fieldalign as fa

METHODS = {
    "robust": {},
    "robust, confined": {"init": np.eye(4), "search_radius": 2.0, "search_angle": 60.0},
    "robust, from a guess": {"init": np.eye(4)},
    "indoor": {"method": "paper"},
    "object": {"method": "paper", "settings": "object"},
    "indoor-dense": {"method": "paper", "settings": "indoor-dense"},
    "keypoints": {"method": "paper", "settings": fa.Settings("keypoints", sigma=0.3)},
}


def bits(result: fa.RegistrationResult) -> list[bytes]:
    arrays = (result.T_target_source, result.information, result.covariance, result.reference_point)
    numbers = np.array([result.overlap, result.overlap_target, result.rmse, result.iterations])
    steps = [step.increment for step in result.history]
    others = [part for other in result.alternatives for part in bits(other)]
    verdict = result.verdict.encode(), repr(result.evidence).encode(), result.covariance.tobytes()
    return [array.tobytes() for array in (*arrays, numbers, *steps)] + [*verdict, *others]


@pytest.mark.parametrize("options", METHODS.values(), ids=METHODS)
def test_any_number_of_threads(scans, options):
    one = bits(fa.register(*scans, **options, threads=1))
    for threads in (2, 3, 8, None):
        assert bits(fa.register(*scans, **options, threads=threads)) == one


def test_any_number_of_threads_where_several_poses_agree(box):
    """Equal scores are where an order could depend on who came first."""
    results = [fa.register(box[::2], box[1::2], threads=threads) for threads in (1, 2, 3, 8)]
    assert len(results[0].alternatives) > 0
    assert all(bits(result) == bits(results[0]) for result in results)


def test_repeated_and_prepared(register, scans):
    source, target = scans
    first = bits(register(source, target))
    prepared = fa.prepare(target)
    for _ in range(3):
        assert bits(register(source, target)) == first
        assert bits(register(source, prepared)) == first
        assert bits(register(fa.prepare(source), prepared)) == first


def test_what_a_cloud_was_used_for_before_leaves_no_trace(register, scans, corner):
    """Other partners, of other sizes and on the other side, make other surfels of it."""
    source, target = (fa.prepare(cloud) for cloud in scans)
    fresh = bits(register(*scans))
    for partner in (0.2 * corner, 3 * corner, corner[::10]):
        register(source, partner)
        register(partner, target)
        register(target, partner)
    assert bits(register(source, target)) == fresh


def test_beside_other_registrations(register, scans):
    source, target = scans
    alone = [bits(register(source, target, seed=seed)) for seed in range(4)]
    prepared = fa.prepare(target)
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda seed: bits(register(source, prepared, seed=seed)), range(4)))
    assert together == alone


def test_another_seed_gives_other_pseudo_points(register, scans):
    assert bits(register(*scans, seed=0)) != bits(register(*scans, seed=1))
