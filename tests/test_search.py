"""Hypotheses of pose: from any pose, near a guess, and none where nothing can be known."""

from functools import lru_cache

import numpy as np
import pytest

from fieldalign import _core
from fieldalign.clouds.simulated import simulate_pair
from fieldalign.evaluation import rotation_error
from fieldalign.motions import apply, exp_twist, inverse, translation
from fieldalign.search import Confinement, search
from fieldalign.surface import Surface

VOXEL = 0.15


@lru_cache
def scans(seed):
    pair = simulate_pair(seed, 20_000)
    return pair.source.points, pair.target.points, pair.T_target_source


@lru_cache
def room(seed, pose=0):
    """Held and moving surface of a room's two scans, the target moved anywhere, and the pose G between them."""
    source, target, T = scans(seed)
    rng = np.random.default_rng(pose)
    W = exp_twist(np.r_[rng.normal(size=3) * 2, 5 * rng.normal(size=3)])
    held, moving = Surface(source, VOXEL, 2), Surface(apply(W, target), VOXEL, 2)
    G = translation(-held.origin) @ inverse(T) @ inverse(W) @ translation(moving.origin)
    return held, moving, G


def off(poses, G, moving):
    """How far poses (B, 4, 4) are from the truth: degrees, and the distance at the middle."""
    middle = moving.places.mean(axis=0)[None]
    degrees = np.array([rotation_error(pose, G) for pose in poses])
    return degrees, np.array([np.linalg.norm(apply(pose, middle) - apply(G, middle)) for pose in poses])


# --------------------------------------------------------------------------------------------------------- any pose


@pytest.mark.parametrize("scene", [0, 3, 5, 6, 9])
@pytest.mark.parametrize("pose", [0, 1, 2])
def test_the_pose_of_two_scans_of_a_room_is_among_the_candidates(scene, pose):
    held, moving, G = room(scene, pose)
    poses, scores, tested = search(held, moving, pose, 2)
    degrees, apart = off(poses, G, moving)
    assert ((degrees < 10) & (apart < 3 * VOXEL)).any()
    assert tested > 1000
    assert (scores <= 1).all()
    assert (scores > 0).all()


def test_candidates_are_motions_best_first_and_few():
    poses, scores, _ = search(*room(3)[:2], 0, 2)
    assert 1 < len(poses) <= 60
    assert (np.diff(scores) <= 0).all()
    for pose in poses:
        assert np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-5)  # of single precision
        assert np.linalg.det(pose[:3, :3]) == pytest.approx(1, abs=1e-5)
        assert np.array_equal(pose[3], [0, 0, 0, 1])


@pytest.mark.parametrize("scene", [3, 6])
def test_candidates_differ(scene):
    """By 18 degrees, or by three voxels at the middle of the probes, which is about that of the surfels."""
    held, moving, _ = room(scene)
    poses, _, _ = search(held, moving, 0, 2)
    for k, pose in enumerate(poses):
        degrees, apart = off(poses[:k], pose, moving)
        assert ((degrees > 18) | (apart > 2.5 * VOXEL)).all()


def test_the_seed_and_nothing_else_decides():
    held, moving, _ = room(3)
    first = search(held, moving, 0, 1)
    for threads in (1, 2, 3, 8):
        again = search(held, moving, 0, threads)
        assert np.array_equal(again[0], first[0])
        assert np.array_equal(again[1], first[1])
        assert again[2] == first[2]
    assert not np.array_equal(search(held, moving, 1, 1)[0], first[0])


@pytest.mark.parametrize("seed", range(3))
def test_scores_are_of_probes_on_the_surface(seed):
    """One on the held surface where all probes lie, less a fifth near it, nothing far from it. A hypothesis is no
    exact pose, so that small things, which are probed much, are missed by some."""
    held, _, _ = room(3)
    poses, scores, _ = search(held, held, seed, 2)
    degrees, apart = off(poses[:1], np.eye(4), held)
    assert degrees < 5
    assert apart < VOXEL
    assert 0.5 < scores[0] <= 0.8 + 1e-6  # 1 - 0.2, if the hypothesis is exact
    assert scores[0] > 1.5 * scores[1]


# ------------------------------------------------------------------------------------------------------ near a guess


@pytest.mark.parametrize(("radius", "angle"), [(0.3, 20), (1.0, 45), (0.5, 180), (np.inf, 10), (1e-3, 1)])
def test_a_confined_search_stays_where_it_may(radius, angle):
    held, moving, G = room(3)
    guess = exp_twist(np.radians([3, -3, 2, 0, 0, 0])) @ G
    poses, _, tested = search(held, moving, 0, 2, Confinement(guess, radius, np.radians(angle)))
    degrees, apart = off(poses, guess, moving)
    slack = 0.2  # the middle of the probes is not quite that of the surfels
    assert (degrees <= angle + 0.1).all()
    assert (apart <= radius + 2 * slack * np.sin(np.radians(min(angle, 180)) / 2) + 1e-3).all()
    if radius > 0.2 and angle >= 10:
        near, close = off(poses, G, moving)
        assert ((near < 10) & (close < 3 * VOXEL)).any()
    assert tested < search(held, moving, 0, 2)[2] or not np.isfinite(radius) or angle == 180


def test_half_a_turn_is_any_turn():
    """Also for poses that are just that far from the guess, where rounding could leave them out."""
    held, moving, G = room(3)
    for axis in np.eye(3):
        guess = G @ exp_twist(np.r_[np.pi * axis, 0, 0, 0])
        poses, _, _ = search(held, moving, 0, 2, Confinement(guess, np.inf, np.pi))
        free, _, _ = search(held, moving, 0, 2)
        assert np.array_equal(poses, free)


# --------------------------------------------------------------------------------------------------- nothing to know


@pytest.mark.parametrize("shape", ["plane", "line", "two parallel planes"])
def test_what_slides_has_no_candidates(rng, shape):
    points = rng.uniform(0, 6, (20_000, 3))
    points[:, 2] = rng.integers(0, 2, 20_000) if shape == "two parallel planes" else 0
    if shape == "line":
        points[:, 1] = 0
    surface = Surface(points, VOXEL, 1)
    assert len(surface.pairs) == 0
    poses, scores, tested = search(surface, surface, 0, 2)
    assert poses.shape == (0, 4, 4)
    assert len(scores) == tested == 0


@pytest.mark.parametrize("n", [3, 4, 10])
def test_few_points_have_none_and_do_not_fail(rng, n):
    surface = Surface(rng.random((n, 3)), 0.3, 1)
    poses, scores, _ = search(surface, surface, 0, 2)
    assert poses.shape[1:] == (4, 4)
    assert len(poses) == len(scores)


# ---------------------------------------------------------------------------------------------------------- the table

SETTINGS = {"seed": 1, "drift_cosine": 0.97, "drift_distance": 0.5,
            "rounds": 2, "draws": 64, "matches": 60, "tolerance": 0.05, "min_cosine": 0.95, "penalty": 0.2,
            "doubt": 1.0, "keep": 10, "apart_cosine": 0.99, "apart_distance": 0.1, "enough_hits": 8, "distinct": 0.6,
            "alike": 0.85, "facing": False}


def good(a, n, b, m):
    """Whether a pair of surfels is taken, by NumPy: distance, normals not parallel, the steeper one neither flat nor
    upright on the axis."""
    away = b - a
    distance = np.linalg.norm(away)
    one, other = abs(n @ away) / distance, abs(m @ away) / distance
    return 1 <= distance <= 4 and abs(n @ m) <= 0.93 and 0.12 <= max(one, other) <= 0.98


def test_the_table_holds_each_good_pair_once(rng):
    means = rng.uniform(0, 4, (70, 3)).astype(np.float32).astype(float)
    normals = rng.normal(size=(70, 3))
    normals = (normals / np.linalg.norm(normals, axis=1)[:, None]).astype(np.float32).astype(float)
    expected = sum(good(means[i], normals[i], means[j], normals[j]) for i in range(70) for j in range(i))
    for threads in (1, 2, 8):
        assert abs(len(_core.PairTable(means, normals, 1, 4, threads)) - expected) <= 2  # single precision at the edges


def test_pairs_are_found_again_after_any_motion_and_turned_normals(rng, any_motion):
    """A handful of surfels: every drawn pair has its like, and one hypothesis is the motion itself."""
    means = rng.uniform(0, 4, (40, 3))
    normals = rng.normal(size=(40, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    grid, table = _core.ClosestGrid(means, normals, 0.2, 0.6), _core.PairTable(means, normals, 1, 4, 1)
    for _ in range(10):
        T = any_motion(rng, 5.0)
        signs = rng.choice([-1.0, 1.0], (40, 1))
        moved, turned = apply(inverse(T), means), signs * (normals @ T[:3, :3])
        poses, scores, _ = _core.search(grid, table, moved, turned, moved, turned, None, None, SETTINGS, 1)
        assert rotation_error(poses[0], T) < 0.01
        assert np.abs(poses[0][:3, 3] - T[:3, 3]).max() < 1e-3
        assert scores[0] == pytest.approx(0.8, abs=0.03)


def test_a_normals_sign_changes_no_bit(rng):
    """Neither of those that are drawn and probed nor of those in the table and the grid."""
    held, moving, _ = room(3)

    def found(held_signs, moving_signs):
        normals, turned = held_signs[:, None] * held.normals, moving_signs[:, None] * moving.normals
        grid = _core.ClosestGrid(held.places, normals, 2 * VOXEL, 6 * VOXEL)
        table = _core.PairTable(held.places[held.sparse], normals[held.sparse], 6 * VOXEL, 45 * VOXEL, 1)
        rows = moving.sparse
        surfels = moving.places[rows], turned[rows]
        return _core.search(grid, table, *surfels, *surfels, None, None, SETTINGS | {"tolerance": VOXEL}, 1)

    plain = found(np.ones(len(held)), np.ones(len(moving)))
    flipped = found(rng.choice([-1.0, 1.0], len(held)), rng.choice([-1.0, 1.0], len(moving)))
    assert plain[2] == flipped[2] > 100
    assert np.array_equal(plain[0], flipped[0])
    assert np.array_equal(plain[1], flipped[1])


def test_searching_with_nothing_is_refused():
    grid, table = _core.ClosestGrid(np.eye(3), np.eye(3), 1, 1), _core.PairTable(np.eye(3), np.eye(3), 1, 2, 1)
    with pytest.raises(ValueError, match="surfels to draw and to probe"):
        _core.search(grid, table, np.zeros((0, 3)), np.zeros((0, 3)), np.eye(3), np.eye(3), None, None, {}, 1)
    with pytest.raises(ValueError, match="length"):
        _core.PairTable(np.eye(3), np.eye(3)[:2], 1, 2, 1)
