"""The levels of the robust alignment: each brings poses nearer, and what is said of them is the truth."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from scipy.spatial import cKDTree

import fieldalign as fa
from fieldalign import _core
from fieldalign.alignment import descend
from fieldalign.alignment.agreement import both_ways, mutual_score
from fieldalign.alignment.robust import _FEW, LEVELS, FieldStage, GridStage, _spread, anneal
from fieldalign.clouds.simulated import simulate_pair
from fieldalign.dof import Allowed
from fieldalign.evaluation import rotation_error, translation_error
from fieldalign.fields import PointField
from fieldalign.fields.protocol import Planes, planes_near
from fieldalign.motions import apply, exp_twist, inverse, rotate, translation
from fieldalign.surface import Surface

VOXEL = 0.15


@lru_cache
def room(seed=3):
    """Two surfaces and their fields, and the true pose G of the moving one in the held one, about the origins."""
    pair = simulate_pair(seed, 20_000)
    held, moving = (Surface(cloud.points, VOXEL, 2) for cloud in (pair.source, pair.target))
    G = translation(-held.origin) @ inverse(pair.T_target_source) @ translation(moving.origin)
    return held, moving, PointField(pair.source.points), PointField(pair.target.points), G


def near(G, rng, degrees, shift, n=1):
    """Poses (n, 4, 4) so far off G."""
    w, v = rng.normal(size=(2, n, 3))
    w *= np.radians(degrees) / np.linalg.norm(w, axis=1)[:, None]
    v *= shift / np.linalg.norm(v, axis=1)[:, None]
    return np.stack([exp_twist(np.r_[a, b]) @ G for a, b in zip(w, v, strict=True)])


def degrees_off(poses, G):
    return np.array([rotation_error(pose, G) for pose in poses])


# ------------------------------------------------------------------------------------------------------ coarse levels


@pytest.mark.parametrize(("level", "degrees", "shift"), [(0, 12, 0.3), (1, 2, 0.1), (2, 1, 0.04)])
def test_each_level_brings_poses_nearer(rng, level, degrees, shift):
    held, moving, _, _, G = room()
    start = near(G, rng, degrees, shift, 20)
    stage = GridStage(held, moving, LEVELS[level], rng, 2)
    found, steps = descend(stage, start)
    assert len(steps) == LEVELS[level].iterations
    assert np.median(degrees_off(found, G)) < degrees / 3
    assert (degrees_off(found, G) < degrees_off(start, G)).mean() >= 0.9


def test_a_stage_moves_each_pose_alone(rng):
    held, moving, _, _, G = room()
    start = near(G, rng, 5, 0.1, 4)
    stage = GridStage(held, moving, LEVELS[1], rng, 2)
    together, _ = stage.step(start)
    for k in range(4):
        alone, step = stage.step(start[k : k + 1])
        assert np.array_equal(alone[0], together[k])
        assert np.allclose(exp_twist(step.increment) @ start[k], alone[0], atol=1e-12)
        assert 0 < step.kept <= LEVELS[1].count


def test_pseudo_points_lie_along_the_normals(rng):
    held, moving, _, _, _ = room()
    stage = GridStage(held, moving, LEVELS[0], rng, 1)
    feet = stage.places - stage.offsets[:, None] * stage.normals
    assert cKDTree(moving.places).query(feet)[0].max() < 1e-12
    assert len(stage.places) == LEVELS[0].count
    assert stage.offsets.std() == pytest.approx(LEVELS[0].spread * VOXEL, rel=0.2)
    assert abs(stage.offsets.mean()) < 0.3 * stage.offsets.std()


def test_annealing_finds_the_right_one_among_wrong_poses(rng):
    held, moving, _, _, G = room()
    wrong = np.stack([exp_twist(np.r_[2 * rng.normal(size=3), rng.normal(size=3)]) for _ in range(30)])
    poses, scores = anneal(held, moving, np.concatenate([wrong, near(G, rng, 8, 0.2, 2)]), 0, 2)
    assert rotation_error(poses[0], G) < 0.5
    assert translation_error(poses[0], G) < 0.05
    assert (np.diff(scores) <= 0).all()
    assert len(poses) <= LEVELS[-1].keep
    assert np.array_equal(scores, mutual_score(*both_ways(held, moving, poses, 2)))


def test_poses_that_come_to_one_place_are_one(rng):
    """Of many starts near the truth a single pose is left of those within 3 degrees and a voxel of it."""
    held, moving, _, _, G = room()
    poses, _ = anneal(held, moving, near(G, rng, 5, 0.1, 30), 0, 2)
    same = (degrees_off(poses, G) < 1.5) & (np.linalg.norm(poses[:, :3, 3] - G[:3, 3], axis=1) < 0.3 * VOXEL)
    assert same.sum() == 1


def test_annealing_has_the_same_bits_at_any_number_of_threads(rng):
    held, moving, _, _, G = room()
    start = near(G, rng, 8, 0.2, 10)
    one = anneal(held, moving, start, 0, 1)
    for threads in (2, 3, 8):
        again = anneal(held, moving, start, 0, threads)
        assert np.array_equal(again[0], one[0])
        assert np.array_equal(again[1], one[1])


# --------------------------------------------------------------------------------------------------------- last level


def last_level(rng, iterations=30, patience=0.0, neighbours=10):
    held, moving, held_field, moving_field, _ = room()
    planes = planes_near(moving_field, moving_field.spread(3000), neighbours).about(moving.origin)
    stage = FieldStage(held_field, held.origin, planes, neighbours, 0.6 * VOXEL, held.extent, 3.0)
    return stage.take(np.inf, iterations, patience)


def test_the_last_level_is_far_finer_than_a_voxel(rng):
    *_, G = room()
    for start in near(G, rng, 0.8, 0.03, 5):
        (found,), _ = descend(last_level(rng), start[None])
        assert rotation_error(found, G) < 0.05
        assert translation_error(found, G) < VOXEL / 50


def test_it_ends_where_it_began_when_it_is_there(rng):
    *_, G = room()
    (there,), _ = descend(last_level(rng, 60), G[None])
    (again,), steps = descend(last_level(rng, 60), there[None])
    assert np.abs(again - there).max() < 1e-6
    assert np.linalg.norm(steps[0].increment) < 1e-6


def test_patience_is_in_standard_errors(rng):
    *_, G = room()
    start = near(G, rng, 0.8, 0.03)
    lengths = [len(descend(last_level(rng, 40, patience), start)[1]) for patience in (10.0, 1.0, 0.1, 1e-3)]
    assert lengths == sorted(lengths)
    assert lengths[0] < lengths[-1]


def test_what_the_last_level_saw_is_told(rng):
    held, _, held_field, _, G = room()
    stage = last_level(rng)
    (found,), steps = descend(stage, G[None])
    assert stage.rmse == steps[-1].cost
    assert 0.0005 < stage.rmse < 0.01  # the scans have 5 mm of noise, planes through ten points less
    assert np.allclose(stage.H, stage.H.T)
    assert np.linalg.eigvalsh(stage.H).min() > 0
    centroid = stage.overlap(found)
    assert cKDTree(held_field.points - held.origin).query(centroid)[0] < 3
    low, high = held.places.min(axis=0), held.places.max(axis=0)
    assert (low < centroid).all()
    assert (centroid < high).all()


def test_where_nothing_is_near_the_last_level_stays(rng):
    *_, G = room()
    away = translation([1e3, 0, 0]) @ G
    stage = last_level(rng)
    (found,), steps = descend(stage, away[None])
    assert np.array_equal(found, away)
    assert (steps[-1].kept, stage.rmse) == (0, 0)
    assert np.allclose(stage.overlap(away), apply(away, stage.planes.mean).mean(axis=0))


class Box:
    """The signed field of a box about the origin, as a user may write it."""

    signed = True
    half = np.array([1.0, 0.7, 0.4])
    bounds = np.stack([-half, half])

    def sample(self, x):
        outside = np.abs(x) - self.half
        beyond = np.maximum(outside, 0)
        value = np.linalg.norm(beyond, axis=1) + np.minimum(outside.max(axis=1), 0)
        direction = np.where(value[:, None] > 0, beyond, np.eye(3)[outside.argmax(axis=1)]) * np.where(x < 0, -1, 1)
        gradient = direction / np.linalg.norm(direction, axis=1, keepdims=True)
        return value, gradient, x - value[:, None] * gradient, gradient


def test_a_formula_is_met_to_the_last_digits(rng):
    places = Box().sample(rng.uniform(-1.1, 1.1, (3000, 3)))[2]
    G = exp_twist(np.r_[0.02 * rng.normal(size=3), 0.01 * rng.normal(size=3)])
    own = planes_near(Box(), places, 10)
    moved = replace(own, mean=apply(inverse(G), own.mean), normal=rotate(inverse(G)[:3, :3], own.normal))
    stage = FieldStage(Box(), np.zeros(3), moved, 10, 0.3, 2.6, 3.0).take(np.inf, 40, 0)
    (found,), _ = descend(stage, np.eye(4)[None])
    assert np.abs(found - G).max() < 1e-9


# ----------------------------------------------------------------------------------------- a growth, and fewer freedoms


def box_stage(T, grown=1.0, **options):
    """The box held, and points of it that T and then a growth bring back onto it."""
    places = Box().sample(np.random.default_rng(4).uniform(-1.1, 1.1, (3000, 3)))[2]
    own = planes_near(Box(), places, 10)
    back = inverse(T)
    moved = replace(own, mean=apply(back, own.mean) / grown, normal=rotate(back[:3, :3], own.normal))
    return FieldStage(Box(), np.zeros(3), moved, 10, 0.3, 2.6, 3.0, **options).take(np.inf, 40, 0)


@pytest.mark.parametrize("grown", [0.95, 1.0, 1.04])
def test_what_grows_is_met_to_the_last_digits(rng, grown):
    """The pose is that of what has grown: its places times the growth, then moved."""
    G = exp_twist(np.r_[0.02 * rng.normal(size=3), 0.01 * rng.normal(size=3)])
    stage = box_stage(G, grown, grows=True)
    (found,), steps = descend(stage, np.eye(4)[None])
    assert stage.growth == pytest.approx(grown, abs=1e-9)
    assert np.abs(found - G).max() < 1e-9
    assert all(step.increment.shape == (7,) for step in steps)


def test_what_may_not_grow_does_not():
    stage = box_stage(np.eye(4), 1.03)
    _, steps = descend(stage, np.eye(4)[None])
    assert stage.growth == 1
    assert stage.increment[6] == 0
    assert all(step.increment.shape == (6,) for step in steps)
    assert stage.rmse > 1e-3


# ------------------------------------------------------------------------------------------------- what is told of it


def planes(thickness, width):
    nowhere = np.zeros((len(thickness), 3))
    return Planes(nowhere, nowhere, np.array(thickness, float), np.array(width, float))


def test_the_spread_counts_both_thicknesses_and_the_sparser_side_more():
    own, other = planes([1, 2, 1, 1], [1, 0.5, 10, 0]), planes([3, 1, 2, 2], [2, 0.5, 1, 5])
    variance = np.array([1 + 4 * 9, 4 + 1, 1 + 0.1 * 4, 1 + 4])  # widths in the ratios 2, 1, 0.1 and none
    typical = np.median(variance)
    found = _spread(own, other)
    assert np.allclose(found**2 - variance / typical, (found**2 - variance / typical)[0])  # a floor, the same for all
    assert 0 < (found**2 - variance / typical)[0] < 0.5
    assert np.array_equal(_spread(planes([0, 0], [1, 1]), planes([0, 0], [1, np.inf])), [1, 1])


def test_roughness_is_of_both_clouds():
    stage = box_stage(np.eye(4))
    stage.taken, stage.partners = planes([0.1, 0.2, 9], [1, 2, 1]), planes([0.3, 0.6, 0], [1, 2, 0])
    assert stage.roughness == pytest.approx(np.sqrt((0.1**2 + 0.3**2) / 2))


def test_scatter_is_that_of_runs_or_where_they_are_few_of_each_point_alone():
    stage = box_stage(np.eye(4), 1.03)
    descend(stage, np.eye(4)[None])
    shrunk = _core.stretch(stage.totals[None])
    alone = (stage.rmse**2 + (1e-12 * stage.extent) ** 2) / shrunk**2 * stage.H
    kept = stage.totals[3]
    stage.scatter = 2 * alone
    share = (stage.gradient_scatter / alone)[0, 0] - 1  # of the runs' in the mixture
    assert 0.5 < share < 1
    assert np.allclose(stage.gradient_scatter, (1 + share) * alone)
    stage.totals = np.r_[stage.totals[:3], 0.0]
    assert np.allclose(stage.gradient_scatter, alone)  # no run at all
    assert share / (1 - share) == pytest.approx(kept / _core.RUN / _FEW)


def test_distances_are_to_planes_and_infinite_where_none_agrees():
    """Places that lie a tenth above the top of the box; further than the reach; and such as face aside."""
    stage = box_stage(np.eye(4))
    x = np.random.default_rng(5).uniform(-0.3, 0.3, (30, 2))
    up = np.tile([0.0, 0, 1], (30, 1))
    top = np.c_[x, np.full(30, 0.4)]
    stage.taken = Planes(top + 0.1 * up, up, np.full(30, 0.01), np.full(30, 0.1))
    assert np.allclose(stage.distances(np.eye(4)), 0.1, atol=1e-12)
    assert np.allclose(stage.distances(translation([0, 0, -0.05])), 0.05, atol=1e-12)
    assert np.isinf(stage.distances(translation([0, 0, 0.25]))).all()  # 0.35 away, with a reach of 0.3
    stage.taken = Planes(top, np.roll(up, 1, axis=1), np.full(30, 0.01), np.full(30, 0.1))
    assert np.isinf(stage.distances(np.eye(4))).all()


@pytest.mark.parametrize("free", ["levelled", "rx ry", "rz x", "yaw", "translation"])
@pytest.mark.parametrize("grows", [False, True])
def test_the_last_level_stays_among_what_is_allowed(rng, any_motion, free, grows):
    allowed = Allowed(fa.Dof(free), any_motion(rng, 1.0), any_motion(rng, 1.0), inverted=False)
    (start,) = allowed.nearest(np.eye(4)[None])
    stage = box_stage(start, 1.02 if grows else 1.0, allowed=allowed, grows=grows)
    off = allowed.twists(start[None])[0] @ (0.01 * rng.normal(size=6))
    (found,), _ = descend(stage, allowed.nearest(exp_twist(off)[None] @ start))
    assert np.abs(allowed.grown(stage.growth).nearest(found[None]) - found).max() < 1e-12
    assert grows or np.abs(found - start).max() < 1e-9


@pytest.mark.parametrize("free", ["levelled", "rx ry", "rz x", "yaw", "translation", "rx ry rz x y z"])
@pytest.mark.parametrize("growth", [1.0, 1.3])
def test_the_basis_says_what_a_pose_and_a_growth_may_do(rng, any_motion, free, growth):
    """A step of e along it, the twist and then the growth, is allowed to e^2; there is one more than what is free."""
    allowed = Allowed(fa.Dof(free), any_motion(rng, 1.0), any_motion(rng, 1.0), inverted=False)
    stage = box_stage(np.eye(4), allowed=allowed, grows=True)
    stage.growth = growth
    (G,) = allowed.grown(growth).nearest(any_motion(rng, 1.0)[None])
    basis = stage.basis(G[None])
    assert basis.shape == (7, 7)
    assert np.linalg.matrix_rank(basis, tol=1e-6) == len(fa.Dof(free).free) + 1
    for e in (1e-3, 1e-5):
        x = e * basis @ rng.normal(size=7)
        moved = exp_twist(x[:6]) @ G
        moved[:3, 3] *= np.exp(x[6])
        (nearest,) = allowed.grown(growth * np.exp(x[6])).nearest(moved[None])
        assert np.abs(nearest - moved).max() < 300 * e**2 + 1e-13


def test_with_all_free_the_basis_is_all():
    assert np.array_equal(box_stage(np.eye(4)).basis(np.eye(4)[None]), np.eye(7)[:, :6])
    assert np.array_equal(box_stage(np.eye(4), grows=True).basis(np.eye(4)[None]), np.eye(7))
