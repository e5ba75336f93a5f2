"""How well surfaces agree: shares of weights, both ways, and which poses are others."""

from functools import lru_cache

import numpy as np
import pytest

from fieldalign.alignment.agreement import MIN_COSINE, Apart, agreement, best_distinct, both_ways, mutual_score
from fieldalign.clouds.simulated import simulate_pair
from fieldalign.motions import apply, exp_twist, inverse, translation
from fieldalign.surface import Surface

VOXEL = 0.15


@lru_cache
def room():
    """Two surfaces of a room, and the true pose G of the moving one in the held one, about the origins."""
    pair = simulate_pair(3, 20_000)
    held, moving = (Surface(cloud.points, VOXEL, 2) for cloud in (pair.source, pair.target))
    return held, moving, translation(-held.origin) @ inverse(pair.T_target_source) @ translation(moving.origin)


def near(G, rng, degrees, shift, n):
    """Poses (n, 4, 4) so far off G."""
    w, v = rng.normal(size=(2, n, 3))
    w *= np.radians(degrees) / np.linalg.norm(w, axis=1)[:, None]
    v *= shift / np.linalg.norm(v, axis=1)[:, None]
    return np.stack([exp_twist(np.r_[a, b]) @ G for a, b in zip(w, v, strict=True)])


def test_a_surface_agrees_with_itself():
    held, *_ = room()
    itself = agreement(held, held, np.eye(4)[None], 1)
    assert itself.met[0] == pytest.approx(1)
    assert itself.on[0] > 0.97
    assert 0.7 < itself.agreeing[0] <= 1 + 1e-12  # small things count much, and a cell holds one surfel only
    assert itself.purity[0] == pytest.approx(itself.agreeing[0])
    assert itself.score[0] == pytest.approx(itself.agreeing[0] ** 2)


def test_shares_are_shares_and_ordered(rng):
    held, moving, G = room()
    poses = np.concatenate([near(G, rng, angle, shift, 5) for angle, shift in ((0.1, 0), (5, 0.1), (90, 1), (9, 50))])
    found = agreement(held, moving, poses, 2)
    for shares in (found.agreeing, found.on, found.met, found.purity, found.score):
        assert shares.shape == (20,)
        assert (shares >= 0).all()
        assert (shares <= 1).all()
    assert (found.agreeing <= found.met).all()
    assert found.score[:5].min() > 2 * found.score[5:].max()
    assert not found.met[15:].any()
    assert not found.score[15:].any()  # and no division by nothing
    assert np.array_equal(found.of(3).agreeing, found.agreeing[3:4])


def weighed(weights, poses):
    """What the moving surfels add up to if they count for so much."""
    held, moving, _ = room()
    grid = held.coarse_grid
    return grid.agreement(moving.places, moving.normals, weights, poses, VOXEL, MIN_COSINE, 3 * VOXEL, False, 2)


def test_each_surfel_counts_for_its_weight(rng):
    """Sums are linear in the weights, and those of weights that are all equal are shares of the number."""
    _, moving, G = room()
    poses, (one, other) = near(G, rng, 3, 0.1, 3), rng.uniform(0, 1, (2, len(moving)))
    parts, whole = weighed(one, poses) + weighed(other, poses), weighed(one + other, poses)
    assert np.allclose(parts[:, :2], whole[:, :2], rtol=1e-12)
    alike = weighed(np.full(len(moving), 1 / len(moving)), poses)
    assert np.array_equal(alike[:, 2], whole[:, 2])
    assert (alike[:, 2] <= alike[:, 1] + 1e-12).all()  # what is on the surface is near it
    assert (alike[:, 0] <= alike[:, 1]).all()


def test_the_weights_are_the_surfaces(rng):
    held, moving, G = room()
    poses = near(G, rng, 3, 0.1, 3)
    found = agreement(held, moving, poses, 2)
    assert np.allclose(np.c_[found.agreeing, found.met, found.on], weighed(moving.weights, poses), rtol=1e-12)
    rows = rng.integers(0, len(moving), 500)
    some, share = agreement(held, moving, poses, 2, rows), np.bincount(rows, minlength=len(moving)) * moving.weights
    assert np.allclose(np.c_[some.agreeing, some.met], weighed(share / share.sum(), poses)[:, :2], rtol=1e-9)


def test_a_detail_is_wholly_on_the_whole_and_not_the_reverse():
    held, *_ = room()
    points = simulate_pair(3, 20_000).source.points
    part = Surface(points[np.linalg.norm(points - points[0], axis=1) < 1.5], VOXEL, 1)
    G = translation(part.origin - held.origin)
    assert agreement(held, part, G[None], 1).on[0] > 0.95
    share = len(part) / len(held)
    assert agreement(part, held, inverse(G)[None], 1).on[0] == pytest.approx(share, abs=0.3 * share)


def test_some_rows_stand_for_all(rng):
    held, moving, G = room()
    all_of_them = agreement(held, moving, G[None], 1)
    some = agreement(held, moving, G[None], 1, rng.integers(0, len(moving), 2000))
    assert some.agreeing[0] == pytest.approx(all_of_them.agreeing[0], abs=0.05)


def test_a_shifted_sheet_agrees_less_and_less():
    """A plane on a plane, raised: on it up to a voxel, met further up, and its weight is Geman and McClure's."""
    u, v = np.meshgrid(np.arange(0, 4, 0.02), np.arange(0, 4, 0.02))
    sheet = Surface(np.c_[u.ravel(), v.ravel(), 0 * u.ravel()], 0.2, 1)
    heights = np.array([0.0, 0.05, 0.15, 0.25, 0.45, 2.0])
    poses = np.stack([translation([0, 0, height]) for height in heights])
    found = agreement(sheet, sheet, poses, 1)
    assert np.allclose(found.agreeing[:4], 1 / (1 + (heights[:4] / 0.2) ** 2) ** 2, atol=0.01)
    assert np.allclose(found.on, heights < 0.2, atol=0.05)
    assert np.allclose(found.met[:5], 1)
    assert found.met[5] == 0


def test_both_clouds_are_asked_and_neither_is_the_first(rng):
    held, moving, G = room()
    poses = near(G, rng, 4, 0.1, 4)
    there, back = both_ways(held, moving, poses, 2)
    assert np.array_equal(there.score, agreement(held, moving, poses, 2).score)
    assert np.array_equal(back.score, agreement(moving, held, np.stack([inverse(p) for p in poses]), 2).score)
    score = mutual_score(*both_ways(held, moving, poses, 2))
    assert np.allclose(score**2, there.score * back.score)
    swapped = both_ways(moving, held, np.stack([inverse(p) for p in poses]), 2)
    assert np.allclose(score, mutual_score(*swapped), atol=1e-6)


# -------------------------------------------------------------------------------------------------------- other poses

APART = Apart(cosine=np.cos(np.radians(15)), voxels=5.0)


def turned_about(middle, degrees):
    return translation(middle) @ exp_twist(np.r_[np.radians(degrees), np.zeros(5)]) @ translation(-middle)


@pytest.mark.parametrize(
    ("change", "differs"),
    [
        (lambda middle: np.eye(4), False),
        (lambda middle: turned_about(middle, 14), False),
        (lambda middle: turned_about(middle, 16), True),
        (lambda middle: turned_about(middle, 180), True),
        (lambda middle: translation([0, 4.9 * VOXEL, 0]), False),
        (lambda middle: translation([0, 0, 5.1 * VOXEL]), True),
        (lambda middle: turned_about(middle + [0, 10 * VOXEL, 0], 14), False),
        (lambda middle: turned_about(middle + [0, 100 * VOXEL, 0], 14), True),  # a small turn about a place far away
    ],
)
def test_poses_differ_by_what_they_do_to_the_middle_and_by_the_turn(any_motion, rng, change, differs):
    G, middle = any_motion(rng, 3.0), np.array([3.0, -1, 2])
    poses = np.stack([change(apply(G, middle[None])[0]) @ G, G])
    assert APART.differ(poses, G, middle, VOXEL).tolist() == [differs, False]


def test_the_best_that_differ_are_kept(rng):
    """Against the rule in plain words: one after the other, best first, those that differ from all kept ones."""
    middle = np.array([1.0, 2, 3])
    poses, found = near(np.eye(4), rng, 20, 0.3, 60), rng.uniform(0, 1, 60)
    kept = []
    for k in sorted(range(60), key=lambda k: -found[k]):
        if all(APART.differ(poses[k : k + 1], poses[other], middle, VOXEL)[0] for other in kept):
            kept.append(k)
    assert 5 < len(kept) < 60
    assert best_distinct(poses, found, middle, APART, VOXEL, 60) == kept
    assert best_distinct(poses, found, middle, APART, VOXEL, 3) == kept[:3]
    assert best_distinct(poses[:0], found[:0], middle, APART, VOXEL, 3) == []


def test_the_two_sides_of_a_wall_are_told_apart_where_both_sensors_are_known(rng):
    """A corner seen from within, and the same one from without: there it faces the other way."""
    points = np.vstack([rng.uniform(0, 4, (9000, 3)) * (1 - axis) for axis in np.eye(3)])
    within, without = np.array([2.0, 2, 2]), np.array([-2.0, -2, -2])
    inner, same, outer = (Surface(points, VOXEL, 1, eye) for eye in (within, within + 0.5, without))
    sides = np.eye(4)[None]
    assert agreement(inner, same, sides, 1).score[0] > 0.9
    assert agreement(inner, outer, sides, 1).agreeing[0] < 0.01
    assert agreement(inner, outer, sides, 1).met[0] > 0.99
    assert agreement(inner, Surface(points, VOXEL, 1), sides, 1).score[0] > 0.9  # of one nobody knows
