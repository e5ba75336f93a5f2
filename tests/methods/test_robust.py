"""The robust method: any pose of what users have, and the truth about what cannot be known."""

import json
from itertools import permutations, product

import numpy as np
import pytest
from scipy.spatial import cKDTree

import fieldalign as fa
from fieldalign import _core, prepared
from fieldalign.clouds.simulated import simulate_pair
from fieldalign.evaluation import rotation_error, translation_error
from fieldalign.methods.robust import Pair
from fieldalign.motions import apply, exp_twist, inverse, translation

STAGES = ["scale", "surfels", "lookups", "search", "anneal", "refine", "judge"]


class Scans:
    """Two scans of a simulated room, 20,000 points each, 5 mm of noise, one of them anywhere."""

    def __init__(self, seed, pose=0, points=20_000):
        pair = simulate_pair(seed, points)
        rng = np.random.default_rng(pose)
        self.W = exp_twist(np.r_[2 * rng.normal(size=3), 5 * rng.normal(size=3)])
        self.source, self.target = apply(self.W, pair.source.points), pair.target.points
        self.truth, self.overlap = pair.T_target_source @ inverse(self.W), pair.overlap


@pytest.fixture(scope="module")
def scans():
    return Scans(3)


def is_right(result, truth, degrees=0.1, metres=0.01):
    """Accepted, and as near the truth as that; measured at the source's frame of some metres."""
    near = rotation_error(result.T_target_source, truth) < degrees
    return result.accepted and near and translation_error(result.T_target_source, truth) < metres


# ----------------------------------------------------------------------------------------------------- from any pose


@pytest.mark.parametrize("scene", [0, 1, 2, 5, 6, 8, 9])
def test_two_scans_of_a_room_in_any_pose(scene):
    scans = Scans(scene, pose=scene + 1)
    result = fa.register(scans.source, scans.target)
    assert is_right(result, scans.truth, 0.05, 0.006)
    assert result.overlap == pytest.approx(scans.overlap, abs=0.2)
    assert result.rmse < 0.005
    assert result.alternatives == ()


@pytest.mark.parametrize("pose", range(4))
def test_the_answer_moves_along_with_the_scans(pose):
    scans = Scans(3, pose)
    assert is_right(fa.register(scans.source, scans.target, seed=pose), scans.truth, 0.05, 0.006)


@pytest.mark.parametrize("seed", range(4))
def test_different_points_of_one_surface(corner, any_motion, seed):
    """Without noise; no point has a partner."""
    T = any_motion(np.random.default_rng(seed), 3.0)
    result = fa.register(corner[::2], apply(T, corner[1::2]), seed=seed)
    assert is_right(result, T, 0.1, 0.006)


def test_a_denser_scan_is_hardly_slower_and_more_exact():
    """Five times the points; beyond thinning the work is the same."""
    scans = Scans(6, points=100_000)
    result = fa.register(scans.source, scans.target)
    assert is_right(result, scans.truth, 0.02, 0.003)


@pytest.mark.parametrize("side", ["source", "target"])
def test_one_point_in_twenty(scans, side):
    """A thousand points are found, though they are too few to be sure of it."""
    sparse = {"source": scans.source, "target": scans.target}
    sparse[side] = sparse[side][::20]
    T = fa.register(**sparse).T_target_source
    assert rotation_error(T, scans.truth) < 0.5
    assert translation_error(T, scans.truth) < 0.03


@pytest.mark.parametrize("scene", [3, 4, 9])
def test_three_points_in_ten_scattered(scene, rng):
    scans = Scans(scene, points=14_000)
    littered = [np.vstack([cloud, rng.uniform(cloud.min(axis=0), cloud.max(axis=0), (6_000, 3))])
                for cloud in (scans.source, scans.target)]
    assert is_right(fa.register(*littered), scans.truth, 0.1, 0.006)


@pytest.mark.parametrize("away", [1e4, 1e8, 1e12])
@pytest.mark.parametrize("sides", [(1, 0), (0, 1), (1, 1)], ids=["source", "target", "both"])
def test_far_outliers_change_nothing(scans, away, sides):
    spoilt = [np.vstack([cloud, away * np.array([[1, 0, 0], [0, -1, 1], [0.3, 0.2, -1]])]) if is_spoilt else cloud
              for cloud, is_spoilt in zip((scans.source, scans.target), sides, strict=True)]
    assert is_right(fa.register(*spoilt), scans.truth, 0.05, 0.006)


def test_missing_returns_change_no_bit(scans, rng):
    gaps = np.vstack([scans.source, np.full((500, 3), np.nan)])
    gaps[:500] = np.nan
    result = fa.register(gaps, scans.target)
    assert result.dropped == (1000, 0)
    plain = fa.register(scans.source[500:], scans.target)
    assert np.array_equal(result.T_target_source, plain.T_target_source)


@pytest.mark.parametrize("unit", [1e-3, 1000.0, 1e7])
def test_no_unit_is_asked_for(scans, unit):
    result = fa.register(unit * scans.source, unit * scans.target)
    assert result.accepted
    assert rotation_error(result.T_target_source, scans.truth) < 0.05
    assert np.linalg.norm(result.T_target_source[:3, 3] / unit - scans.truth[:3, 3]) < 0.006


def test_a_detail_is_found_in_a_whole_room_both_ways(scans):
    """A part of a metre and a half around a piece of furniture, a twentieth of the points."""
    room = simulate_pair(3, 60_000).target.points
    detail, truth = apply(scans.W, room[furniture_around(room, 1.2)]), inverse(scans.W)
    forth, back = fa.register(detail, room), fa.register(room, detail)
    for result, T in ((forth, truth), (back, inverse(truth))):
        assert rotation_error(result.T_target_source, T) < 0.2
        assert translation_error(result.T_target_source, T) < 0.02
    assert forth.overlap > 0.9 > 0.3 > forth.overlap_target
    assert back.overlap_target > 0.9 > 0.3 > back.overlap


def furniture_around(points, radius):
    """Which points lie within a radius of a place whose surroundings face in many directions."""
    field = fa.fields.PointField(points)
    normals, rows = field.normals(points), np.arange(0, len(points), 100)
    around = normals[field.nearest(points[rows], 64)[1]]
    variety = np.linalg.eigvalsh(np.einsum("nki,nkj->nij", around, around))[:, 0]
    return np.linalg.norm(points - points[rows[variety.argmax()]], axis=1) < radius


@pytest.mark.parametrize("small", ["source", "target", "neither"])
def test_of_a_detail_and_a_whole_the_whole_is_held(scans, any_motion, small):
    """Else, as in the paper, the source. A pose between the origins and T_target_source say the same."""
    clouds = {"source": scans.source, "target": scans.target}
    if small != "neither":
        clouds[small] = clouds[small][furniture_around(clouds[small], 1.2)]
    source, target = (fa.prepare(cloud) for cloud in clouds.values())
    pair = Pair(source, target, 0.1)
    assert pair.held is (target if small == "source" else source)
    assert pair.moving is (source if small == "source" else target)
    T = any_motion(np.random.default_rng(0), 5.0)
    assert np.allclose(pair.motion(pair.pose(T)), T, atol=1e-12)
    held, moving = pair.surfaces()
    on_held = apply(pair.pose(T), moving.places) + held.origin
    expected = apply(T if small == "source" else inverse(T), moving.places + moving.origin)
    assert np.allclose(on_held, expected, atol=1e-11)


# --------------------------------------------------------------------------------------------------- from a guess


def test_a_guess_skips_the_search(scans, monkeypatch):
    monkeypatch.setattr("fieldalign.methods.robust.search", None)
    guess = exp_twist(np.radians([3, -2, 4, 0, 0, 0])) @ scans.truth
    assert is_right(fa.register(scans.source, scans.target, init=guess), scans.truth, 0.05, 0.006)
    assert is_right(fa.register(scans.source, scans.target, init=guess, search=False), scans.truth, 0.05, 0.006)


def test_a_wrong_guess_does_no_harm_where_the_search_is_asked_for(scans):
    wrong = scans.truth @ exp_twist(np.r_[2.0, 1, -1, 3, 0, 0])
    assert is_right(fa.register(scans.source, scans.target, init=wrong, search=True), scans.truth, 0.05, 0.006)


@pytest.mark.parametrize("confined", [{"search_radius": 2.0}, {"search_angle": 60.0},
                                      {"search_radius": 2.0, "search_angle": 60.0}], ids=str)
def test_a_guess_confines_the_search(scans, confined):
    centre = scans.source.mean(axis=0)
    off = translation(centre) @ exp_twist(np.r_[0.5, -0.4, 0.4, 0.8, -0.5, 0.3]) @ translation(-centre)
    result = fa.register(scans.source, scans.target, init=scans.truth @ off, **confined)
    assert is_right(result, scans.truth, 0.05, 0.006)


def test_the_papers_setting_from_the_centroids(corner, motion):
    """Up to 45 degrees and 0.8 m, from the centroids laid on each other."""
    for seed in range(5):
        rng = np.random.default_rng(seed)
        T = motion(rng, 45, 0.8)
        source, target = corner[::2], apply(T, corner[1::2])
        guess = translation(target.mean(axis=0) - source.mean(axis=0))
        result = fa.register(source, target, init=guess, search_radius=0.5, search_angle=50)
        assert rotation_error(result.T_target_source, T) < 0.2


# ------------------------------------------------------------------------------------------- what fits in many ways


def sides(edges, n, rng):
    """Points on the six sides of a box about the origin, n of them."""
    edges = np.asarray(edges, float)
    areas = edges.prod() / edges
    axis = rng.choice(3, n, p=areas / areas.sum())
    points = rng.random((n, 3))
    points[np.arange(n), axis] = rng.integers(0, 2, n)
    return (points - 0.5) * edges


def symmetries(edges):
    """The rotations (k, 3, 3) that lay a box on itself."""
    signed = [np.array(signs)[:, None] * np.eye(3)[list(order)]
              for order in permutations(range(3)) for signs in product((1, -1), repeat=3)]
    return [R for R in signed if np.linalg.det(R) > 0 and np.allclose(np.abs(R) @ edges, edges)]


@pytest.mark.parametrize(("edges", "ways"), [((1, 1, 1), 24), ((1, 2, 3), 4), ((1, 1, 2), 8)], ids=str)
def test_a_box_is_ambiguous_and_each_answer_is_one_of_its_symmetries(any_motion, rng, edges, ways):
    assert len(symmetries(edges)) == ways
    T = any_motion(rng, 5.0)
    result = fa.register(sides(edges, 8000, rng), apply(T, sides(edges, 8000, rng)))
    assert not result.accepted
    assert result.reason is fa.Reason.AMBIGUOUS
    assert 2 <= 1 + len(result.alternatives) <= ways
    answers = [result, *result.alternatives]
    turns = [inverse(T) @ answer.T_target_source for answer in answers]
    for answer, turn in zip(answers, turns, strict=True):
        nearest = min(rotation_error(turn, as_motion(R)) for R in symmetries(edges))
        assert nearest < 0.5
        assert np.linalg.norm(turn[:3, 3]) < 0.01
        assert not answer.accepted
        assert answer.reason is fa.Reason.AMBIGUOUS
        assert answer.overlap > 0.9
    apart = [rotation_error(a, b) for k, a in enumerate(turns) for b in turns[:k]]
    assert min(apart) > 80


def as_motion(R):
    T = np.eye(4)
    T[:3, :3] = R
    return T


def test_alternatives_are_whole_results(rng):
    result = fa.register(sides((1, 2, 3), 6000, rng), sides((1, 2, 3), 6000, rng))
    plain = json.loads(json.dumps(result.to_dict()))
    assert len(plain["alternatives"]) == len(result.alternatives) > 0
    for other, told in zip(result.alternatives, plain["alternatives"], strict=True):
        assert other.alternatives == ()
        assert np.array_equal(told["T_target_source"], other.T_target_source)
        assert told["reason"] == "ambiguous"
        assert told["accepted"] is False
        assert np.array_equal(told["information"], other.information)
        assert len(other.history) == other.iterations == told["iterations"]


def test_one_odd_thing_settles_it(any_motion, rng):
    """A box with a small box on one corner of a side fits in one way."""
    small = sides((0.5, 0.5, 0.5), 1500, rng) + [0.2, 0.6, 1.7]
    odd = np.vstack([sides((1, 2, 3), 8000, rng), small])
    other = np.vstack([sides((1, 2, 3), 8000, rng), sides((0.5, 0.5, 0.5), 1500, rng) + [0.2, 0.6, 1.7]])
    T = any_motion(rng, 5.0)
    result = fa.register(odd, apply(T, other))
    assert rotation_error(result.T_target_source, T) < 0.5


# ----------------------------------------------------------------------------------------------- what slides or turns


def ball(n, rng):
    away = rng.normal(size=(n, 3))
    return away / np.linalg.norm(away, axis=1)[:, None]


def tube(n, rng):
    around = rng.uniform(0, 2 * np.pi, n)
    return np.c_[0.5 * np.cos(around), 0.5 * np.sin(around), rng.uniform(0, 3, n)]


def sheet(n, rng):
    return np.c_[rng.uniform(0, 3, (n, 2)), np.zeros(n)]


def wire(n, rng):
    return np.c_[rng.uniform(0, 3, n), np.zeros((n, 2))]


@pytest.mark.parametrize("shape", [ball, tube, sheet, wire], ids=lambda shape: shape.__name__)
@pytest.mark.parametrize("noise", [0.0, 0.003])
def test_what_slides_or_turns_is_degenerate(any_motion, rng, shape, noise):
    T = any_motion(rng, 5.0)
    source, target = (cloud + noise * rng.normal(size=cloud.shape) for cloud in (shape(5000, rng), shape(5000, rng)))
    result = fa.register(source, apply(T, target))
    assert not result.accepted
    if shape is not wire:  # one that is rough is no surface at all
        assert result.reason is fa.Reason.DEGENERATE
    assert result.unobservable.shape[1] >= 1
    assert np.isfinite(result.T_target_source).all()
    assert np.isfinite(result.covariance).all()
    size = np.abs(result.information).max()
    assert np.abs(result.information @ result.unobservable).max() <= 1e-6 * size


def test_a_sheet_lies_on_a_sheet_all_the_same(any_motion, rng):
    """The three freedoms that are seen are right."""
    T = any_motion(rng, 2.0)
    result = fa.register(sheet(5000, rng), apply(T, sheet(5000, rng)))
    moved = apply(inverse(T) @ result.T_target_source, sheet(100, rng))
    assert np.abs(moved[:, 2]).max() < 1e-6
    free = result.unobservable
    assert free.shape == (6, 3)
    assert np.abs(free[:3].T @ T[:3, :2]).max() < 1e-6  # it turns about its normal only,
    assert np.abs(T[:3, 2] @ free[3:]).max() < 2  # and slides


def test_a_tube_turns_and_slides_about_its_axis(any_motion, rng):
    T = any_motion(rng, 2.0)
    result = fa.register(tube(5000, rng), apply(T, tube(5000, rng)))
    turn = inverse(T) @ result.T_target_source
    assert abs(turn[2, 2]) > 0.999  # axis on axis
    assert np.linalg.norm(turn[:2, 3]) < 0.02


# ----------------------------------------------------------------------------------------------------- hopeless pairs


@pytest.mark.parametrize("n", [3, 4, 5, 10, 50, 200])
@pytest.mark.parametrize("seed", range(3))
def test_tiny_clouds_are_answered(any_motion, n, seed):
    """Too few for a surface: an answer, of the right form, and rather none than a wrong one."""
    rng = np.random.default_rng(seed)
    few, T = rng.random((n, 3)), any_motion(rng, 1.0)
    for source, target in ((few, apply(T, few)), (few, rng.random((n, 3)))):
        result = fa.register(source, target)
        assert np.isfinite(result.T_target_source).all()
        assert np.allclose(result.T_target_source[:3, :3] @ result.T_target_source[:3, :3].T, np.eye(3), atol=1e-9)
        assert np.isfinite(result.information).all()
        assert np.isfinite(result.covariance).all()
        assert 0 <= result.overlap <= 1
        assert not result.accepted or np.abs(result.T_target_source - T).max() < 1e-6
        json.dumps(result.to_dict(), allow_nan=False)


@pytest.mark.parametrize(("seed", "n", "init"), [(176, 3, None), (278, 3, None), (94, 50, np.eye(4)),
                                                (144, 50, np.eye(4)), (0, 50, None)])
def test_tiny_clouds_that_lie_on_each_other_are_answered(seed, n, init):
    """Seeds for which most residuals are zero to the last bit, and others are not."""
    few = np.random.default_rng(seed).random((n, 3))
    result = fa.register(few, few, init=init)
    assert np.isfinite(result.T_target_source).all()
    json.dumps(result.to_dict(), allow_nan=False)


@pytest.mark.parametrize("n", [3, 10, 50])
def test_a_tiny_cloud_against_a_room(scans, rng, n):
    for pair in ((rng.random((n, 3)), scans.target), (scans.source, rng.random((n, 3)))):
        assert not fa.register(*pair).accepted


def test_most_points_in_one_place(scans, rng):
    """A sensor that writes zeros where it saw nothing."""
    zeros = np.zeros((15_000, 3))
    result = fa.register(np.vstack([scans.source, zeros]), np.vstack([scans.target, zeros]))
    assert rotation_error(result.T_target_source, scans.truth) < 0.2
    hopeless = np.vstack([np.zeros((1000, 3)), np.eye(3)])
    assert not fa.register(hopeless, hopeless + 1).accepted


HOPELESS = {
    "ball and wire": lambda room, rng: (ball(4000, rng), wire(4000, rng)),
    "sheet and ball": lambda room, rng: (sheet(4000, rng), ball(4000, rng)),
    "room and noise": lambda room, rng: (room, rng.random((20_000, 3))),
    "noise and noise": lambda room, rng: (rng.random((20_000, 3)), rng.random((20_000, 3))),
    "room and a room of a millionth": lambda room, rng: (room, 1e-6 * room),
    "room and a room of thirty times the size": lambda room, rng: (room, 30 * room),
}


@pytest.mark.parametrize("name", HOPELESS)
def test_what_does_not_fit_is_not_accepted(scans, rng, name):
    source, target = HOPELESS[name](scans.target, rng)
    for pair in ((source, target), (target, source)):
        result = fa.register(*pair)
        assert not result.accepted
        assert np.isfinite(result.T_target_source).all()


def test_scans_without_any_overlap_are_answered(rng):
    """Two opposite corners of a room, back to back: what is said of them is a matter of the verdict."""
    scene = simulate_pair(3, 40_000).source.points
    axis = np.argmax(np.ptp(scene, axis=0))
    order = np.argsort(scene[:, axis])
    result = fa.register(scene[order[:12_000]], scene[order[-12_000:]])
    assert np.isfinite(result.T_target_source).all()


# ----------------------------------------------------------------------------------------------------- other surfaces


class Thing:
    """The signed field of a box with a ball on it, by formula: a unique pose."""

    signed = True
    half, centre, radius = np.array([1.0, 0.7, 0.4]), np.array([0.5, 0.2, 0.6]), 0.4
    bounds = np.array([[-1, -0.7, -0.4], [1, 0.7, 1.0]])

    def sample(self, x):
        outside = np.abs(x) - self.half
        beyond = np.maximum(outside, 0)
        value = np.linalg.norm(beyond, axis=1) + np.minimum(outside.max(axis=1), 0)
        direction = np.where(value[:, None] > 0, beyond, np.eye(3)[outside.argmax(axis=1)]) * np.where(x < 0, -1, 1)
        gradient = direction / np.linalg.norm(direction, axis=1, keepdims=True)
        away = x - self.centre
        distance = np.linalg.norm(away, axis=1)
        is_ball = distance - self.radius < value
        value = np.where(is_ball, distance - self.radius, value)
        gradient = np.where(is_ball[:, None], away / distance[:, None], gradient)
        return value, gradient, x - value[:, None] * gradient, gradient


@pytest.fixture
def scanned(rng):
    """Points of the thing's outer surface, each seen from outside."""
    x = rng.uniform(-2, 2, (200_000, 3))
    value, _, foot, _ = Thing().sample(x)
    return foot[value > 0][:12_000]


@pytest.mark.parametrize("side", ["source", "target"])
def test_a_formula_is_a_surface_too(scanned, any_motion, rng, side):
    T = any_motion(rng, 3.0)
    scan = apply(T, scanned)
    result = fa.register(Thing(), scan) if side == "source" else fa.register(scan, Thing())
    truth = T if side == "source" else inverse(T)
    assert rotation_error(result.T_target_source, truth) < 0.05
    assert translation_error(result.T_target_source, truth) < 0.005


def test_two_formulas():
    """Where both sides are exact, so is the pose."""
    result = fa.register(Thing(), Thing())
    assert rotation_error(result.T_target_source, np.eye(4)) < 0.01
    assert translation_error(result.T_target_source, np.eye(4)) < 0.001


# --------------------------------------------------------------------------------------------------------- the answer


def test_the_stages_are_told(scans):
    result = fa.register(scans.source, scans.target)
    assert list(result.seconds) == STAGES
    again = fa.register(fa.prepare(scans.source), scans.target, init=scans.truth)
    assert list(again.seconds) == STAGES


def test_information_is_that_of_a_left_perturbation_about_the_reference_point(scans):
    """A pose moved by a few sigma along a direction is off by as many; and the errors are as large as it says."""
    result = fa.register(scans.source, scans.target)
    assert result.unobservable.shape == (6, 0)
    assert np.allclose(result.covariance @ result.information, np.eye(6), atol=1e-6)
    about = translation(-result.reference_point)
    error = about @ scans.truth @ inverse(result.T_target_source) @ inverse(about)
    assert np.linalg.norm(error[:3, 3]) < 10 * np.sqrt(np.trace(result.covariance[3:, 3:]))
    assert np.radians(rotation_error(error, np.eye(4))) < 10 * np.sqrt(np.trace(result.covariance[:3, :3]))
    low, high = scans.target.min(axis=0), scans.target.max(axis=0)
    assert ((low < result.reference_point) & (result.reference_point < high)).all()


@pytest.mark.parametrize("detail", [False, True])
def test_information_turns_with_the_targets_frame_and_not_with_the_sources(scans, any_motion, detail):
    """Whichever cloud is held; other frames have other voxels and other runs of neighbours, of which some hundred tell
    the scatter: so to a half or so."""
    source = scans.source[furniture_around(scans.source, 1.5)] if detail else scans.source
    W = any_motion(np.random.default_rng(8), 5.0)
    plain = fa.register(source, scans.target, init=scans.truth)
    turned = fa.register(source, apply(W, scans.target), init=W @ scans.truth)
    other = fa.register(apply(W, source), scans.target, init=scans.truth @ inverse(W))
    block = np.kron(np.eye(2), W[:3, :3])
    size = np.sqrt(np.outer(*2 * [np.diag(plain.information)]))
    for got, expected in ((turned.information, block @ plain.information @ block.T),
                          (other.information, plain.information)):
        back = block.T if got is turned.information else np.eye(6)
        assert np.abs(back @ (got - expected) @ back.T / size).max() < 0.5
    assert np.linalg.norm(apply(W, plain.reference_point[None])[0] - turned.reference_point) < 0.1
    assert np.linalg.norm(plain.reference_point - other.reference_point) < 0.1
    assert np.abs(block @ plain.information @ block.T - plain.information).max() > 0.5 * size.max()


def test_the_overlap_is_of_each_cloud(scans):
    """Against SciPy: the share of points with the other cloud near, at the answer."""
    part = scans.source[: len(scans.source) // 2]
    result = fa.register(part, scans.target)
    moved = apply(result.T_target_source, part)
    near = 0.15
    forth = (cKDTree(scans.target).query(moved)[0] < near).mean()
    back = (cKDTree(moved).query(scans.target)[0] < near).mean()
    assert result.overlap == pytest.approx(forth, abs=0.25)
    assert result.overlap_target == pytest.approx(back, abs=0.25)


# ------------------------------------------------------------------------------------------------------- what is kept


def test_what_is_prepared_is_not_made_again(scans, monkeypatch):
    """One scan against several prepared ones: surfels, tables and trees of each are made once."""
    made = []

    def counting(name, make):
        def wrapped(*args, **kwargs):
            made.append(name)
            return make(*args, **kwargs)

        return wrapped

    for owner, names in ((prepared, ("Surface", "scale_of", "planes_near")), (_core, ("PairTable", "ClosestGrid"))):
        for name in names:
            monkeypatch.setattr(owner, name, counting(name, getattr(owner, name)))
    source = fa.prepare(scans.source)
    partners = [fa.prepare(scans.target), fa.prepare(scans.target[::2]), fa.prepare(scans.target[1::2])]
    first = [fa.register(source, partner) for partner in partners]
    assert {"Surface", "scale_of", "planes_near", "PairTable", "ClosestGrid"} == set(made)
    made.clear()
    again = [fa.register(source, partner) for partner in partners]
    assert made == []
    for one, other in zip(first, again, strict=True):
        assert np.array_equal(one.T_target_source, other.T_target_source)


def test_partners_of_one_scale_share_its_surfels(scans):
    """A scan that is registered with several of its like has one set of surfels."""
    source = fa.prepare(scans.source)
    for partner in (scans.target, scans.target[::2], scans.target[1::2]):
        assert fa.register(source, partner).accepted
    assert len(source._surfaces) <= 2
