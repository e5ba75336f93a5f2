"""Registration where not all six are free: the truth is found, the rest stays, and has no variance."""

from functools import lru_cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fieldalign as fa
from fieldalign.clouds.simulated import simulate_pair
from fieldalign.dof import allowed_poses
from fieldalign.evaluation import rotation_error
from fieldalign.motions import apply, exp_twist, inverse, rotation_between, translation

CENTRE = np.array([1.0, 2, 0.5])
TILTED = np.array([0.3, -0.5, 1])
FREE = {
    "levelled": "levelled",
    "planar": "planar",
    "yaw": "yaw",
    "rotation": "rotation",
    "rotation about a centre": fa.Dof("rotation", centre=CENTRE),
    "yaw about a centre": fa.Dof("yaw", centre=CENTRE),
    "translation": "translation",
    "two turns": "rx ry",
    "two turns, two shifts": "rx rz x y",
    "levelled about a tilted axis": fa.Dof("levelled", axis=TILTED),
    "turn and slide about a tilted line": fa.Dof("rz z", axis=TILTED, centre=CENTRE),
    "a slide": "x",
}
free = pytest.mark.parametrize("dof", FREE.values(), ids=FREE)


@lru_cache
def scans(seed=3, points=8000):
    pair = simulate_pair(seed, points)
    return pair.source.points, pair.target.points, pair.T_target_source


def any_of(dof, rng, turn=2.5, shift=8.0):
    """A motion that a dof allows: in its frame a rotation vector, and a shift, of what is free."""
    dof = fa.Dof(dof) if isinstance(dof, str) else dof
    w, v = rng.normal(size=(2, 3)) * dof.mask.reshape(2, 3)
    D = exp_twist(np.r_[turn * w / max(np.linalg.norm(w), 1e-9), 0, 0, 0])
    D[:3, 3] = shift * v / max(np.linalg.norm(v), 1e-9)
    return dof.frame @ D @ inverse(dof.frame)


def posed(T, seed=3, points=8000):
    """The pair, its source moved so that the true motion is T."""
    source, target, truth = scans(seed, points)
    return apply(inverse(T) @ truth, source), target


def locked_parts(dof, T, init=None):
    """Of the motion since the guess: the parts of rotation vector and shift that are not free."""
    dof = fa.Dof(dof) if isinstance(dof, str) else dof
    D = inverse(dof.frame) @ T @ (np.eye(4) if init is None else inverse(init)) @ dof.frame
    twist = np.r_[Rotation.from_matrix(D[:3, :3]).as_rotvec(), D[:3, 3]]
    return twist[dof.mask == 0]


def is_right(result, T, degrees=0.06, metres=0.006):
    found, at = result.T_target_source, result.reference_point[None]
    away = np.linalg.norm(apply(inverse(T), at) - apply(inverse(found), at))
    return result.accepted and rotation_error(found, T) < degrees and away < metres


def assert_certain_of_what_is_free(result, dof, init=None):
    """The covariance is zero across the free twists, and of full rank among them."""
    dof = fa.Dof(dof) if isinstance(dof, str) else dof
    at = result.reference_point
    allowed = allowed_poses(dof, init, at, np.zeros(3), target_is_held=True)
    twists = allowed.twists(translation(-at)[None] @ result.T_target_source)[0]
    Q = np.linalg.qr(twists[:, dof.mask > 0])[0]
    size = np.abs(result.covariance).max()
    assert np.abs(result.covariance - Q @ (Q.T @ result.covariance)).max() < 1e-9 * size
    assert np.linalg.matrix_rank(result.covariance, tol=1e-8 * size) == len(dof.free)
    assert np.linalg.matrix_rank(result.information, tol=1e-9 * np.abs(result.information).max()) == len(dof.free)
    assert result.unobservable.shape == (6, 0)


# ----------------------------------------------------------------------------------------------------------- the truth


@free
@pytest.mark.parametrize("seed", [3, 11])
def test_the_truth_is_found_from_far_and_the_rest_stays(dof, seed):
    T = any_of(dof, np.random.default_rng(seed))
    result = fa.register(*posed(T, seed), dof=dof)
    assert is_right(result, T)
    assert result.reason is fa.Reason.ACCEPTED
    R = result.T_target_source[:3, :3]
    assert np.abs(R @ R.T - np.eye(3)).max() < 1e-14
    assert np.abs(locked_parts(dof, result.T_target_source)).max() < 1e-9
    assert_certain_of_what_is_free(result, dof)


@free
def test_the_truth_is_found_from_a_guess_and_its_rest_stays(dof, any_motion, rng):
    """The guess is anywhere, tilted too: what is free is counted from it."""
    init = any_motion(rng, 4.0)
    T = any_of(dof, rng, 0.1, 0.1) @ init
    result = fa.register(*posed(T), dof=dof, init=init)
    assert is_right(result, T)
    assert result.reason is fa.Reason.ACCEPTED_NEAR_INIT
    assert np.abs(locked_parts(dof, result.T_target_source, init)).max() < 1e-9
    assert_certain_of_what_is_free(result, dof, init)


@pytest.mark.parametrize("dof", list(FREE.values())[4::3], ids=list(FREE)[4::3])
def test_far_from_a_guess_it_is_searched_for(dof, any_motion, rng):
    init = any_motion(rng, 4.0)
    T = any_of(dof, rng) @ init
    result = fa.register(*posed(T), dof=dof, init=init, search=True)
    assert is_right(result, T)
    assert np.abs(locked_parts(dof, result.T_target_source, init)).max() < 1e-9


def test_a_confined_search_stays_within_both(rng):
    init = any_of("levelled", rng)
    T = any_of("levelled", rng, 0.4, 1.0) @ init
    near = fa.register(*posed(T), dof="levelled", init=init, search_radius=20.0, search_angle=40.0)
    assert is_right(near, T)
    assert np.abs(locked_parts("levelled", near.T_target_source, init)).max() < 1e-9


@pytest.mark.parametrize("dof", ["levelled", fa.Dof("rotation", centre=CENTRE), "rx ry"], ids=lambda dof: str(dof)[:8])
def test_of_a_small_source_it_is_the_target_that_is_held(dof, rng):
    """The other way round the motion since the guess is the pose itself, not its inverse."""
    T = any_of(dof, rng)
    source, target = posed(T)
    near = np.linalg.norm(source - np.median(source, axis=0), axis=1)
    small = source[near < np.quantile(near, 0.35)]
    result = fa.register(small, target, dof=dof)
    assert rotation_error(result.T_target_source, T) < 0.2
    assert np.abs(locked_parts(dof, result.T_target_source)).max() < 1e-9


def test_less_freedom_is_no_more_variance(rng):
    """As far as it is estimated; where the middle cannot shift, the turn is known much better."""
    T = any_of("yaw", rng)
    words, clouds = (None, "levelled", "planar", "yaw"), posed(T)
    spread = np.array([fa.register(*clouds, dof=word, init=T).covariance[2, 2] for word in words])
    assert (spread[1:] < 1.2 * spread[:-1]).all()
    assert spread[-1] < 0.5 * spread[0]


def test_what_is_locked_is_not_rounded(rng):
    """Without a turn the rotation is the guess's to the last bits, and without a shift the centre stays."""
    init = translation([1, 2, 3])
    init[:3, :3] = rotation_between(np.array([0, 0, 1.0]), TILTED)
    source, target = posed(any_of("translation", rng, shift=0.1) @ init)
    slid = fa.register(source, target, dof="translation", init=init).T_target_source
    assert np.abs(slid[:3, :3] - init[:3, :3]).max() < 1e-15
    turned = fa.register(source, target, dof=fa.Dof("rotation", centre=CENTRE), init=init).T_target_source
    assert np.abs(apply(turned @ inverse(init), CENTRE[None]) - CENTRE).max() < 1e-14


def test_names_and_a_dof_of_these_names_are_one(rng):
    source, target = posed(any_of("levelled", rng))
    words = ("levelled", "rz x y z", ["z", "rz", "y", "x"], fa.Dof("levelled"), fa.Dof("levelled", axis=[0, 0, 5]))
    first, *others = (fa.register(source, target, dof=dof) for dof in words)
    for other in others:
        assert np.array_equal(other.T_target_source, first.T_target_source)
        assert np.array_equal(other.covariance, first.covariance)


def test_all_six_are_as_none(rng):
    source, target = posed(any_of("levelled", rng))
    free = fa.register(source, target)
    for dof in ("rx ry rz x y z", fa.Dof("rotation translation", axis=TILTED, centre=CENTRE)):
        assert np.array_equal(fa.register(source, target, dof=dof).T_target_source, free.T_target_source)


def test_copies_meet_where_they_may(corner, rng):
    T = any_of("levelled", rng)
    result = fa.register(corner, apply(T, corner), dof="levelled")
    assert result.accepted
    assert rotation_error(result.T_target_source, T) < 1e-6
    assert np.abs(locked_parts("levelled", result.T_target_source)).max() < 1e-9


def test_copies_that_may_not_meet_come_as_near_as_they_may(corner):
    """The copy is tilted by a degree and lifted by a hand: neither is undone."""
    T = exp_twist(np.r_[np.radians([1, 0, 20]), 0.3, 0.1, 0.1])
    result = fa.register(corner, apply(T, corner), dof="planar")
    assert np.abs(locked_parts("planar", result.T_target_source)).max() < 1e-9
    assert 0.5 < rotation_error(result.T_target_source, T) < 2


# ------------------------------------------------------------------------------------------------------- what is open


def pole(rng, n=2000, floor=True):
    """A cylinder, with a disc of floor around it."""
    round_it = np.exp(1j * rng.uniform(0, 2 * np.pi, n))
    away, up = np.c_[round_it.real, round_it.imag, np.zeros(n)], np.array([0, 0, 1.0])
    post = 0.3 * away + rng.uniform(0, 3, (n, 1)) * up
    disc = 2 * np.sqrt(rng.uniform(0.03, 1, (n, 1))) * away
    points = np.r_[post, disc] if floor else post
    return points + rng.normal(0, 0.003, points.shape)


def corridor(rng, n=2500):
    walls = np.c_[rng.uniform(-6, 6, n), rng.choice([-1.0, 1], n), rng.uniform(0, 2.5, n)]
    floors = np.c_[rng.uniform(-6, 6, n), rng.uniform(-1, 1, n), rng.choice([0, 2.5], n)]
    return np.r_[walls, floors] + rng.normal(0, 0.003, (2 * n, 3))


@pytest.mark.parametrize("dof", ["yaw", "planar", "levelled"])
def test_a_pole_turns_about_itself(dof, rng):
    result = fa.register(pole(rng), pole(rng), dof=dof)
    assert result.reason is fa.Reason.DEGENERATE
    (freedom,) = result.freedoms
    assert freedom.kind == "turn"
    assert abs(freedom.axis[2]) == pytest.approx(1)
    assert np.abs(freedom.point[:2]).max() < 0.01
    assert result.unobservable.shape == (6, 1)
    assert np.abs(result.information @ result.unobservable).max() < 1e-9 * max(np.abs(result.information).max(), 1)


def test_a_bare_pole_slides_too_where_it_may(rng):
    expected = {"yaw": ["turn"], "planar": ["turn"], "translation": ["slide"], "levelled": ["slide", "turn"], "x y": []}
    for dof, kinds in expected.items():
        result = fa.register(pole(rng, floor=False), pole(rng, floor=False), dof=dof)
        assert sorted(freedom.kind for freedom in result.freedoms) == kinds


@pytest.mark.parametrize("dof", ["x", "planar", "levelled", "translation"])
def test_a_corridor_slides_along_itself_where_it_may(dof, rng):
    result = fa.register(corridor(rng), corridor(rng), dof=dof)
    assert result.reason is fa.Reason.DEGENERATE
    (freedom,) = result.freedoms
    assert freedom.kind == "slide"
    assert abs(freedom.axis[0]) == pytest.approx(1, abs=1e-5)


@pytest.mark.parametrize("dof", ["y", "z", "rotation", "y z"])
def test_a_corridor_that_may_not_slide_is_not_degenerate(dof, rng):
    result = fa.register(corridor(rng), corridor(rng), dof=dof)
    assert result.unobservable.shape == (6, 0)
    assert result.reason is not fa.Reason.DEGENERATE
    assert np.abs(result.T_target_source - np.eye(4)).max() < 0.005


def test_a_pole_stays_turned_as_in_the_guess_where_nothing_else_is_free(rng):
    init = exp_twist(np.array([0, 0, 0.7, 0, 0, 0]))
    result = fa.register(pole(rng), pole(rng), dof="yaw", init=init)
    assert result.reason is fa.Reason.DEGENERATE
    assert np.abs(result.T_target_source - init).max() < 1e-12


@pytest.mark.parametrize("dof", ["planar", "levelled"])
def test_what_is_open_stays_as_in_the_guess_and_the_rest_is_found(dof, rng):
    T = exp_twist(np.array([0, 0, 0.7, 0, 0, 0])) @ translation([0.3, -0.2, 0])
    init = translation([0.05, 0.04, 0]) @ T
    result = fa.register(apply(inverse(T), pole(rng)), pole(rng), dof=dof, init=init)
    assert result.reason is fa.Reason.DEGENERATE
    assert rotation_error(result.T_target_source, init) < 0.01
    assert np.abs(result.T_target_source - T).max() < 0.005


# -------------------------------------------------------------------------------------------------- what is not right


@pytest.mark.parametrize("dof", ["levelled", "yaw", "rotation", "translation", "x", "rx ry"])
def test_two_rooms_are_not_one(dof):
    assert not fa.register(scans(3)[0], scans(6)[1], dof=dof).accepted


def test_what_needs_another_freedom_is_not_accepted(rng):
    """The truth is tilted by 20 degrees: no levelled pose is right."""
    T = any_of("levelled", rng) @ exp_twist(np.array([0.35, 0, 0, 0, 0, 0]))
    for dof in ("levelled", "planar", "translation"):
        assert not fa.register(*posed(T), dof=dof).accepted


# ------------------------------------------------------------------------------------------------------ far away


@pytest.mark.parametrize("dof", ["levelled", "planar"])
@pytest.mark.parametrize("guessed", [False, True], ids=["searched", "from a guess"])
def test_coordinates_of_utm_size_with_the_centre_among_them(dof, guessed, rng):
    far = translation([5e6, 4e5, 100])
    T = any_of(dof, rng)
    source, target = posed(T)
    init = far @ any_of(dof, rng, 0.05, 0.1) @ T @ inverse(far) if guessed else None
    centred = fa.Dof(dof, centre=far[:3, 3])
    result = fa.register(apply(far, source), apply(far, target), dof=centred, init=init)
    found = inverse(far) @ result.T_target_source @ far
    assert result.accepted
    assert rotation_error(found, T) < 0.06
    assert np.abs(found - T).max() < 0.006
    assert np.abs(locked_parts(dof, found)).max() < 1e-8


@pytest.mark.parametrize("dof", ["levelled", "planar"])
def test_far_from_the_origin_as_much_is_known(dof, rng):
    """From 5e4 on, a fiftieth of what UTM coordinates are."""
    T, far = any_of(dof, rng), translation([1e5, 8e3, 100])
    source, target = posed(T)
    here = fa.register(source, target, dof=dof, init=T)
    there = fa.register(apply(far, source), apply(far, target), dof=dof, init=far @ T @ inverse(far))
    assert np.allclose(there.covariance, here.covariance, rtol=0.01, atol=0.01 * here.covariance.max())


@pytest.mark.parametrize("dof", ["levelled", "planar"])
@pytest.mark.parametrize("guessed", [False, True], ids=["searched", "from a guess"])
def test_coordinates_of_utm_size_without_a_centre(dof, guessed, rng):
    """Levelled is levelled about any centre."""
    far = translation([5e6, 4e5, 100])
    T = any_of(dof, rng)
    source, target = posed(T)
    init = far @ any_of(dof, rng, 0.05, 0.1) @ T @ inverse(far) if guessed else None
    result = fa.register(apply(far, source), apply(far, target), dof=dof, init=init)
    found = inverse(far) @ result.T_target_source @ far
    assert rotation_error(found, T) < 0.06
    assert np.abs(found - T).max() < 0.006


# --------------------------------------------------------------------------------------------------- the paper's method


@free
def test_the_papers_method_keeps_to_the_dof(dof, any_motion, rng):
    init = any_motion(rng, 4.0)
    T = any_of(dof, rng, 0.15, 0.15) @ init
    result = fa.register(*posed(T), dof=dof, init=init, method="paper")
    assert result.accepted
    assert rotation_error(result.T_target_source, T) < 0.3
    assert np.abs(locked_parts(dof, result.T_target_source, init)).max() < 1e-9
    assert_certain_of_what_is_free(result, dof, init)


def test_the_papers_method_starts_at_the_nearest_allowed_pose_to_the_centroids(rng):
    T = any_of("levelled", rng, 0.3, 0.5)
    result = fa.register(*posed(T), dof="levelled", method="paper")
    assert np.abs(locked_parts("levelled", result.T_target_source)).max() < 1e-9
    assert rotation_error(result.T_target_source, T) < 0.3


# --------------------------------------------------------------------------------------------------------- errors


@pytest.mark.parametrize("method", ["robust", "paper"])
@pytest.mark.parametrize(("dof", "word"), [("roll", "dof must name freedoms among"), (3, "dof must be names")])
def test_a_dof_that_cannot_be_is_refused(method, dof, word, corner):
    with pytest.raises(fa.FieldalignError, match=f"^{word}"):
        fa.register(corner, corner, dof=dof, method=method)
