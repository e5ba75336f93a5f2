"""Which motions are allowed: names, the nearest allowed pose, and the steps that stay allowed."""

from itertools import combinations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fieldalign as fa
from fieldalign import _core
from fieldalign.clouds.simulated import simulate_pair
from fieldalign.dof import NAMES, WORDS, Allowed, Remaining, allowed_poses, as_dof
from fieldalign.errors import ArgumentError
from fieldalign.evaluation import rotation_error
from fieldalign.motions import apply, exp_twist, inverse, rotations_of, translation
from fieldalign.search import search
from fieldalign.surface import Surface

SUBSETS = [names for n in range(1, 7) for names in combinations(NAMES, n)]
SOME = [("rz",), ("rx", "ry"), ("rx", "rz", "y"), ("rz", "x", "y", "z"), ("x", "z"), ("rx", "ry", "rz"), NAMES]
BOTH_WAYS = pytest.mark.parametrize("inverted", [False, True], ids=["as it is", "inverted"])


# -------------------------------------------------------------------------------------------------------------- names


@pytest.mark.parametrize(("word", "names"), WORDS.items())
def test_a_word_stands_for_some_names(word, names):
    assert fa.Dof(word).free == fa.Dof(" ".join(names)).free == names


@pytest.mark.parametrize("free", ["z rx", "rx,z", "rx, z", ["z", "rx"], ("rx", "z", "rx"), iter(["rx", "z"])])
def test_the_names_come_in_any_form_and_order(free):
    assert fa.Dof(free).free == ("rx", "z")


def test_words_and_names_can_be_mixed():
    assert fa.Dof("yaw translation").free == fa.Dof(["levelled"]).free == fa.Dof("planar z yaw").free


@pytest.mark.parametrize("names", SUBSETS, ids=" ".join)
def test_the_mask_is_one_where_something_is_free(names):
    assert np.array_equal(fa.Dof(names).mask, [name in names for name in NAMES])


@pytest.mark.parametrize("free", ["", "  ", ",", [], (), "roll", "RX", "rx roll", ["rx", ""], ["rx", 4], "6"])
def test_what_names_no_freedom_is_refused_with_all_that_are_allowed(free):
    with pytest.raises(ArgumentError, match=r"^dof must name freedoms among rx, ry, rz, x, y, z, yaw, .*, but is"):
        fa.Dof(free)


@pytest.mark.parametrize("free", [4, None, True, [["x"]], ["x", 4], np.eye(3)], ids=str)
def test_names_that_are_no_strings_are_refused(free):
    with pytest.raises(ArgumentError, match=r"^dof must name freedoms"):
        fa.Dof(free)


@pytest.mark.parametrize("dof", [4, 1.5, True, object()], ids=str)
def test_what_is_no_dof_is_refused(dof):
    with pytest.raises(ArgumentError, match=r"^dof must be names of freedoms, or fa\.Dof"):
        as_dof(dof)


def test_all_six_are_no_restriction():
    assert as_dof(None) is as_dof(NAMES) is as_dof("rotation translation") is as_dof(fa.Dof(NAMES, [0, 1, 1])) is None


def test_a_dof_stays_the_one_that_it_is():
    dof = fa.Dof("yaw", centre=[1, 2, 3])
    assert as_dof(dof) is dof
    assert as_dof("yaw").free == dof.free
    with pytest.raises(AttributeError):
        dof.free = ("x",)


# --------------------------------------------------------------------------------------------------- axis and centre


@pytest.mark.parametrize("name", ["axis", "centre"])
@pytest.mark.parametrize("value", [[1, 2], np.eye(3), [0, 0, np.nan], [0, np.inf, 1], "up", [1, 2, None], 3])
def test_an_axis_and_a_centre_are_vectors(name, value):
    with pytest.raises(ArgumentError, match=f"^{name} of dof must be three"):
        fa.Dof("yaw", **{name: value})


def test_an_axis_has_a_direction():
    with pytest.raises(ArgumentError, match=r"^axis of dof must have a direction"):
        fa.Dof("yaw", axis=[0, 0, 0])


def test_without_axis_and_centre_the_frame_is_the_targets():
    assert np.array_equal(fa.Dof("yaw").frame, np.eye(4))


@pytest.mark.parametrize("axis", [[0, 0, 2], [0, 0, -1], [1, 0, 0], [0.3, -0.5, 1], [0, 1e-100, 0], [1e9, 0, 1e9]])
def test_the_frames_z_is_the_axis_and_its_origin_the_centre(axis):
    frame = fa.Dof("yaw", axis=axis, centre=(4, 5, 6)).frame
    assert np.allclose(frame[:3, 2], np.array(axis) / np.linalg.norm(axis))
    assert np.array_equal(frame[:, 3], [4, 5, 6, 1])
    assert np.allclose(frame[:3, :3].T @ frame[:3, :3], np.eye(3), atol=1e-14)
    assert np.linalg.det(frame[:3, :3]) == pytest.approx(1)


def test_what_was_handed_in_is_not_kept():
    centre = np.array([1.0, 2, 3])
    dof = fa.Dof("yaw", centre=centre)
    centre[:] = 0
    assert np.array_equal(dof.frame[:3, 3], [1, 2, 3])


# ------------------------------------------------------------------------------------------------------ allowed poses


def allowed_of(names, inverted, any_motion, rng):
    """Some allowed poses between ends anywhere."""
    return Allowed(fa.Dof(names), any_motion(rng, 3.0), any_motion(rng, 3.0), inverted)


def since(allowed, poses):
    """The motions D since the guess: quaternions (B, 4), scalar first, by SciPy, and shifts (B, 3)."""
    E = allowed.left @ poses @ allowed.right
    D = np.linalg.inv(E) if allowed.inverted else E
    return Rotation.from_matrix(D[:, :3, :3]).as_quat(scalar_first=True), D[:, :3, 3]


def pose_of(allowed, q, t):
    """The poses whose motion since the guess has quaternions (B, 4) and shifts (B, 3)."""
    D = np.tile(np.eye(4), (len(q), 1, 1))
    D[:, :3, :3], D[:, :3, 3] = rotations_of(q / np.linalg.norm(q, axis=1)[:, None]), t
    return inverse(allowed.left) @ (inverse(D) if allowed.inverted else D) @ inverse(allowed.right)


def any_allowed(allowed, rng, count=6, half_a_turn=False):
    q = rng.normal(size=(count, 4)) * np.r_[1, allowed.turns]
    if half_a_turn and allowed.turns.any():
        q[:, 0] = np.array([0, 1e-12, -1e-12, 1e-6, -1e-6, 1e-3])[:count]
    return pose_of(allowed, q, rng.normal(size=(count, 3)) * allowed.shifts)


@BOTH_WAYS
@pytest.mark.parametrize("names", SUBSETS, ids=" ".join)
def test_the_nearest_allowed_pose_is_allowed_and_none_is_nearer(names, inverted, any_motion, rng):
    allowed = allowed_of(names, inverted, any_motion, rng)
    poses = np.stack([any_motion(rng, 2.0) for _ in range(4)])
    nearest = allowed.nearest(poses)
    assert np.allclose(allowed.nearest(nearest), nearest, rtol=0, atol=1e-13)
    (q, t), (q_nearest, t_nearest) = since(allowed, poses), since(allowed, nearest)
    assert np.abs(q_nearest[:, 1:] * (1 - allowed.turns)).max() < 1e-14
    assert np.abs(t_nearest * (1 - allowed.shifts)).max() < 1e-13
    closeness, away = np.abs((q * q_nearest).sum(axis=1)), np.linalg.norm(t - t_nearest, axis=1)
    for spread in (1e-3, 0.1, 1.0, 10.0):
        others = (q_nearest + spread * rng.normal(size=(50, 4, 4))) * np.r_[1, allowed.turns]
        others /= np.linalg.norm(others, axis=-1, keepdims=True)
        assert (np.abs((others * q).sum(axis=-1)) <= closeness + 1e-12).all()
        shifts = (t_nearest + spread * rng.normal(size=(50, 4, 3))) * allowed.shifts
        assert (np.linalg.norm(shifts - t, axis=-1) >= away - 1e-12).all()


@BOTH_WAYS
@pytest.mark.parametrize("half_a_turn", [False, True], ids=["any turn", "near half a turn"])
@pytest.mark.parametrize("names", SUBSETS, ids=" ".join)
def test_the_twists_lead_along_the_allowed_poses_and_are_as_many_as_the_freedoms(
    names, inverted, half_a_turn, any_motion, rng
):
    """A step of e stays allowed to e^2, and the twists span as many directions as are free."""
    allowed = allowed_of(names, inverted, any_motion, rng)
    poses = any_allowed(allowed, rng, half_a_turn=half_a_turn)
    twists = allowed.twists(poses)
    assert np.array_equal(twists.any(axis=(0, 1)), fa.Dof(names).mask)
    assert np.array_equal(np.linalg.matrix_rank(twists, tol=1e-3), np.full(len(poses), len(names)))
    for e in (1e-3, 1e-5):
        steps = e * twists @ rng.normal(size=6)
        moved = np.stack([exp_twist(x) for x in steps]) @ poses
        assert np.abs(allowed.nearest(moved) - moved).max() < 300 * e**2 + 1e-13
        assert np.abs(moved - poses).max() > e / 100


@BOTH_WAYS
@pytest.mark.parametrize("names", SUBSETS[::3], ids=" ".join)
def test_turns_leave_the_centre_where_it_is(names, inverted, any_motion, rng):
    allowed = allowed_of(names, inverted, any_motion, rng)
    poses = any_allowed(allowed, rng)
    for twists, centre in zip(allowed.twists(poses), allowed.centres(poses), strict=True):
        for turn in twists[:, :3].T:
            assert np.allclose(apply(exp_twist(0.7 * turn), centre[None])[0], centre, rtol=0, atol=1e-12)


def test_the_centre_is_where_the_poses_lay_it(any_motion, rng):
    """As it is, D lays the origin at its shift; inverted, the pose leads to where the origin is."""
    poses = np.stack([any_motion(rng, 2.0) for _ in range(3)])
    plain, inverted = (allowed_of(NAMES, way, any_motion, rng) for way in (False, True))
    assert np.allclose(plain.centres(poses), [apply(G, plain.right[None, :3, 3])[0] for G in poses])
    assert np.allclose(inverted.centres(poses), inverse(inverted.left)[:3, 3])


@pytest.mark.parametrize("names", SOME, ids=" ".join)
def test_of_what_has_grown_the_centre_has_moved(names, any_motion, rng):
    """Its place on what moves is as many times as far from the origin; the dof is the same."""
    allowed, poses = allowed_of(names, False, any_motion, rng), np.stack([any_motion(rng, 2.0) for _ in range(3)])
    before, grown = allowed.nearest(poses), allowed.grown(2.5)
    assert np.array_equal(allowed.nearest(poses), before)
    assert np.allclose(grown.centres(poses), [apply(G, 2.5 * allowed.right[None, :3, 3])[0] for G in poses])
    q, t = since(grown, grown.nearest(poses))
    assert np.abs(q[:, 1:] * (1 - allowed.turns)).max() < 1e-14
    assert np.abs(t * (1 - allowed.shifts)).max() < 1e-13
    assert np.allclose(allowed.grown(1.0).nearest(poses), before, rtol=0, atol=1e-14)


def test_what_turns_by_nothing_that_is_free_does_not_turn():
    """Half a turn about x is as far from all turns about z: any of them is as near."""
    allowed = Allowed(fa.Dof("yaw"), np.eye(4), np.eye(4), False)
    G = exp_twist(np.array([np.pi, 0, 0, 1, 2, 3]))
    (found,) = allowed.nearest(G[None])
    assert np.allclose(found @ inverse(found), np.eye(4), atol=1e-12)
    assert np.allclose(found[2], [0, 0, 1, 0], atol=1e-12)


@pytest.mark.parametrize("target_is_held", [True, False])
@pytest.mark.parametrize("dof", [
    fa.Dof("yaw"), fa.Dof("levelled", axis=[1, -2, 0.5]), fa.Dof("rx rz y", axis=[0, 1, 0], centre=[4, 5, 6]),
    fa.Dof("rotation", centre=[-3, 0, 9]), fa.Dof("x z"),
], ids=lambda dof: " ".join(dof.free))
@pytest.mark.parametrize("guessed", [True, False])
def test_what_is_free_is_counted_from_the_guess_in_the_frame_of_the_dof(
    dof, target_is_held, guessed, any_motion, rng
):
    held, moving = 10 * rng.normal(size=(2, 3))
    guess = any_motion(rng, 5.0) if guessed else None
    allowed = allowed_poses(dof, guess, held, moving, target_is_held)
    for _ in range(5):
        (G,) = allowed.nearest(any_motion(rng, 5.0)[None])
        whole = translation(held) @ G @ translation(-moving)
        T = whole if target_is_held else inverse(whole)
        D = inverse(dof.frame) @ T @ (inverse(guess) if guessed else np.eye(4)) @ dof.frame
        turn = Rotation.from_matrix(D[:3, :3]).as_rotvec()
        assert np.abs(np.r_[turn, D[:3, 3]][dof.mask == 0]).max(initial=0) < 1e-12


def test_what_is_left_of_the_twists_is_the_same_everywhere(any_motion, rng):
    basis, poses = rng.normal(size=(6, 2)), np.stack([any_motion(rng, 2.0) for _ in range(3)])
    among = allowed_of(("rz", "x"), False, any_motion, rng)
    assert np.array_equal(Remaining(basis, None).nearest(poses), poses)
    assert np.array_equal(Remaining(basis, among).nearest(poses), among.nearest(poses))
    assert np.array_equal(Remaining(basis, among).twists(poses), np.stack(3 * [basis]))


# ------------------------------------------------------------------------------------------------------- in the core


@BOTH_WAYS
@pytest.mark.parametrize("names", SOME, ids=" ".join)
def test_the_search_finds_the_allowed_pose_next_to_the_true_one(names, inverted, any_motion, motion, rng):
    """Of a handful of surfels each hypothesis is the motion itself: the core takes the nearest one, as Python does."""
    means, normals = rng.uniform(0, 4, (40, 3)), rng.normal(size=(40, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    grid, table = _core.ClosestGrid(means, normals, 0.2, 0.6), _core.PairTable(means, normals, 1, 4, 1)
    settings = {"seed": 1, "drift_cosine": 0.99, "drift_distance": 0.3, "rounds": 2, "draws": 64, "matches": 60,
                "tolerance": 0.1, "min_cosine": 0.9, "penalty": 0.2, "doubt": 1.0, "keep": 10, "apart_cosine": 0.99,
                "apart_distance": 0.1, "enough_hits": 8, "distinct": 0.6, "alike": 0.85, "facing": False}
    for _ in range(5):
        allowed = allowed_of(names, inverted, any_motion, rng)
        T = any_allowed(allowed, rng, 1)[0] @ motion(rng, 0.5, 0.01)
        surfels = apply(inverse(T), means), normals @ T[:3, :3]
        poses, *_ = _core.search(grid, table, *surfels, *surfels, None, allowed.packed, settings, 1)
        (expected,) = allowed.nearest(T[None])
        assert rotation_error(poses[0], expected) < 0.01
        assert np.abs(poses[0] - expected).max() < 1e-3


@pytest.fixture(scope="module")
def surfaces():
    pair = simulate_pair(3, 8000)
    return Surface(pair.source.points, 0.2, 1), Surface(pair.target.points, 0.2, 1), inverse(pair.T_target_source)


@BOTH_WAYS
@pytest.mark.parametrize("names", SOME, ids=" ".join)
def test_every_pose_of_a_search_is_allowed(names, inverted, surfaces, any_motion, rng):
    held, moving, T = surfaces
    true = translation(-held.origin) @ T @ translation(moving.origin)
    left = any_motion(rng, 3.0)
    D = any_allowed(Allowed(fa.Dof(names), np.eye(4), np.eye(4), False), rng, 1)[0]
    allowed = Allowed(fa.Dof(names), left, inverse(left @ true) @ (inverse(D) if inverted else D), inverted)
    poses, *_ = search(held, moving, 0, 1, allowed=allowed, rounds=3)
    assert len(poses) > 0
    assert np.abs(allowed.nearest(poses) - poses).max() < 1e-5
    assert rotation_error(poses[0], true) < 10
