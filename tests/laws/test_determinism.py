"""The same seed gives the same bits: at any number of threads, on repeated calls, beside other work."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import trimesh

import fieldalign as fa
from fieldalign.clouds.simulated import simulate_pair
from fieldalign.fields import spread_over
from fieldalign.motions import apply, exp_twist

METHODS = {
    "robust": {},
    "robust, confined": {"init": np.eye(4), "search_radius": 2.0, "search_angle": 60.0},
    "robust, from a guess": {"init": np.eye(4)},
    "indoor": {"method": "paper"},
    "object": {"method": "paper", "settings": "object"},
    "indoor-dense": {"method": "paper", "settings": "indoor-dense"},
    "keypoints": {"method": "paper", "settings": fa.Settings("keypoints", sigma=0.3)},
}
FREEDOMS = {
    "levelled": {"dof": "levelled"},
    "levelled, from a guess": {"dof": "levelled", "init": np.eye(4)},
    "about a tilted axis": {"dof": fa.Dof("rz x y", axis=[0.1, -0.2, 1], centre=[1, 2, 3])},
    "levelled, by the paper": {"dof": "levelled", "method": "paper"},
    "scale, from a guess": {"scale": True, "init": np.eye(4)},
    "levelled with a scale, from a guess": {"scale": True, "dof": "levelled", "init": np.eye(4)},
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


@pytest.mark.parametrize("options", FREEDOMS.values(), ids=FREEDOMS)
def test_other_freedoms_at_any_number_of_threads_repeated_and_prepared(smaller_scans, options):
    source, target, _ = smaller_scans
    one, prepared = bits(fa.register(source, target, **options, threads=1)), fa.prepare(target)
    for threads in (2, 3, 8):
        assert bits(fa.register(source, prepared, **options, threads=threads)) == one
    assert bits(fa.register(fa.prepare(source), target, **options)) == one


@pytest.mark.slow
@pytest.mark.parametrize(("dof", "numbers"), [(None, (8,)), ("levelled", (2, 3))])
def test_a_scale_that_is_sought(dof, numbers):
    pair = simulate_pair(3, 3000)
    source, target = 0.2 * pair.source.points, fa.prepare(pair.target)
    one = bits(fa.register(source, target, scale=True, dof=dof, threads=1))
    for threads in numbers:
        assert bits(fa.register(source, target, scale=True, dof=dof, threads=threads)) == one


def solid(x):
    """The distance to two boxes and a ball, of which no turn makes the same."""
    found = [np.linalg.norm(x - [-0.8, -0.3, 0.4], axis=-1) - 0.35]
    for centre, half in (([0, 0, 0], [1, 0.6, 0.3]), ([0.5, 0.2, 0.6], [0.25, 0.3, 0.45])):
        outside = np.abs(x - np.array(centre)) - half
        found.append(np.linalg.norm(np.maximum(outside, 0), axis=-1) + np.minimum(outside.max(axis=-1), 0))
    return np.min(found, axis=0)


def exact_target(kind):
    """A solid as a field, each time another object."""
    if kind == "formula":
        return fa.fields.CallableField(solid, [[-1.5] * 3, [1.5] * 3])
    if kind == "volume":
        nodes = np.stack(np.meshgrid(*3 * [np.linspace(-1.5, 1.5, 48)], indexing="ij"), axis=-1)
        return fa.fields.VolumeField(solid(nodes), np.full(3, -1.5), 3 / 47)
    pytest.importorskip("igl")
    boxes = [trimesh.creation.box(size) for size in ([2, 1.2, 0.6], [0.5, 0.6, 0.9])]
    ball = trimesh.creation.icosphere(2, 0.35)
    boxes[1].apply_translation([0.5, 0.2, 0.6])
    ball.apply_translation([-0.8, -0.3, 0.4])
    whole = trimesh.util.concatenate([*boxes, ball])
    return fa.fields.MeshField(np.asarray(whole.vertices), np.asarray(whole.faces))


@pytest.mark.parametrize("kind", ["mesh", "volume", "formula"])
@pytest.mark.parametrize("options", [{}, {"dof": "levelled"}, {"scale": True, "init": np.eye(4)}],
                         ids=["all free", "levelled", "scale"])
def test_surfaces_that_are_known_exactly(kind, options):
    T = exp_twist(np.array([0, 0, 0.1, 0.05, 0.1, 0.02]))
    points = apply(T, spread_over(exact_target("formula"), 2500))
    one = bits(fa.register(points, exact_target(kind), threads=1, **options))
    for threads in (2, 8):
        assert bits(fa.register(points, exact_target(kind), threads=threads, **options)) == one


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
