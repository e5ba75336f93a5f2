"""From refined poses to results: what is compared with what, what a sensor contradicts, and what nothing holds."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.clouds.simulated import simulate_pair
from fieldalign.methods import judged as judging
from fieldalign.methods.judged import CLEARLY_OTHER, Contest
from fieldalign.methods.pair import Pair
from fieldalign.motions import angles_between, apply, exp_twist, inverse, log_motion, translation
from fieldalign.verdict.evidence import MAX_SEEN_THROUGH, MIN_HOLD


@pytest.fixture(scope="module")
def scans():
    return simulate_pair(0, 20_000)


# --------------------------------------------------------------------------------------------------------- the margin


def test_the_margin_is_over_the_best_pose_that_is_clearly_another(scans):
    pair = Pair(fa.prepare(scans.source), fa.prepare(scans.target), 0.1)
    about = translation(pair.middle)
    near, turned, shifted, far = (
        about @ exp_twist(np.array(twist)) @ inverse(about)
        for twist in ([0.1, 0, 0, 0.2, 0, 0], [0, 0.4, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0.7], [2.0, 0, 0, 3, 0, 0])
    )
    poses, scores = np.stack([np.eye(4), near, turned, shifted, far]), np.array([0.8, 0.7, 0.2, 0.3, 0.1])
    others = CLEARLY_OTHER.differ(poses, np.eye(4), pair.middle, pair.voxel)
    assert others.tolist() == [False, False, True, True, True]
    assert Contest(poses, scores, True).margin(np.eye(4), 0.6, pair) == pytest.approx(0.6 / 0.3)
    assert Contest(poses, scores, True).margin(shifted, 0.3, pair) == pytest.approx(0.3 / 0.8)
    alone = Contest(poses[:2], scores[:2], True).margin(np.eye(4), 0.6, pair)
    assert np.isfinite(alone)
    assert alone > 1e6


def test_at_the_scale_of_the_noise_the_misfit_is_a_share_of_what_nearly_all_keep_to():
    """Three deviations, or the distance that 95 of 100 places keep to; what lies further, or nowhere, counts as one."""
    nothing = Contest(np.empty((0, 4, 4)), np.empty(0), True)
    pair = SimpleNamespace(middle=np.zeros(3), voxel=1.0)

    def against_chance(distances, scale):
        last = SimpleNamespace(distances=lambda G: np.array(distances), scale=scale)
        return nothing.at_the_noise(SimpleNamespace(last=last, G=np.eye(4)), pair)

    assert against_chance([0.1] * 10, scale=0.4) == pytest.approx(4)  # a half of three deviations: 0.2
    assert against_chance([0.1, 0.2, 0.9, np.inf], scale=0.4) == pytest.approx(4 / np.sum((np.array(
        [0.1, 0.2, np.quantile([0.1, 0.2, 0.9], 0.95), 9]) / np.quantile([0.1, 0.2, 0.9], 0.95)).clip(max=1) ** 2))
    assert against_chance([np.inf, np.inf], scale=0.4) == 0


def test_of_equally_good_poses_the_one_that_turns_least_from_the_guess_comes_first(any_motion, rng, monkeypatch):
    """A box of three sizes lies on itself in four ways, here point on point; searched for in all poses."""
    half_a_turn = [np.zeros(3), *(np.pi * np.eye(3))]
    quarter, T = sides((1, 2, 3), 2000, rng), any_motion(rng, 3.0)
    box = np.vstack([apply(exp_twist(np.r_[turn, 0, 0, 0]), quarter) for turn in half_a_turn])
    ways = [T @ exp_twist(np.r_[turn, 0, 0, 0]) for turn in half_a_turn]
    clouds = fa.prepare(box), fa.prepare(apply(T, box))

    def first_from(way):
        guess = exp_twist(np.r_[0.2, -0.3, 0.2, 0.1, 0, 0]) @ way
        result = fa.register(*clouds, init=guess, search=True)
        assert len(result.alternatives) >= 1
        return int(np.argmin(angles_between(result.T_target_source, np.stack(ways))))

    monkeypatch.setattr(judging, "_EQUAL", judging.RIVAL)  # which surfels there are makes scores differ
    assert [first_from(way) for way in ways[:3]] == [0, 1, 2]
    monkeypatch.setattr(judging, "_EQUAL", 1.0)
    assert len({first_from(way) for way in ways[:2]}) == 1


def test_points_that_meet_tell_a_box_from_itself_turned(any_motion, rng):
    """Its surface lies on itself in four ways, its points in one."""
    T, box = any_motion(rng, 3.0), sides((1, 2, 3), 8000, rng)
    result = fa.register(box, apply(T, box))
    assert result.accepted
    assert result.alternatives == ()
    assert angles_between(result.T_target_source, T) < 1e-8


@pytest.mark.parametrize("search", [True, False])
def test_the_evidence_is_in_its_bounds(scans, search):
    result = fa.register(scans.source, scans.target, init=scans.T_target_source, search=search)
    evidence = result.evidence
    assert evidence.searched is search
    assert result.reason is evidence.reason is (fa.Reason.ACCEPTED if search else fa.Reason.ACCEPTED_NEAR_INIT)
    assert result.accepted
    for share in (evidence.met, evidence.agreeing, evidence.hold):
        assert type(share) is float
        assert 0 < share <= 1 + 1e-12
    assert 0 <= evidence.seen_through < MAX_SEEN_THROUGH
    assert result.verdict == f"{result.reason} {evidence}"


@pytest.mark.parametrize("confined", [{"search_radius": 1.0}, {"search_angle": 30.0}], ids=str)
def test_where_a_search_was_confined_other_poses_are_not_known(scans, confined):
    result = fa.register(scans.source, scans.target, init=scans.T_target_source, **confined)
    assert result.evidence.searched is False
    assert result.reason is fa.Reason.ACCEPTED_NEAR_INIT


def test_the_papers_method_has_no_evidence(scans):
    result = fa.register(scans.source, scans.target, method="paper")
    assert result.evidence is None
    assert result.verdict == str(result.reason)
    assert result.to_dict()["evidence"] is None


# -------------------------------------------------------------------------------------------- what was looked through


def sides(edges, n, rng):
    """The surface of a box about the origin."""
    places = rng.uniform(-1, 1, (n, 3))
    sizes = np.array(edges) / 2
    areas = np.prod(sizes) / sizes
    rows = rng.choice(3, n, p=areas / areas.sum())
    places[np.arange(n), rows] = np.sign(places[np.arange(n), rows])
    return places * sizes


def with_a_screen(scans, behind):
    """The target with a screen of 2 x 2 m, a metre and a bit before the source's sensor, or as far behind it."""
    towards = scans.source.points.mean(axis=0)
    towards *= (-1.2 if behind else 1.2) / np.linalg.norm(towards)
    across = np.linalg.svd(towards[None])[2][1:]
    screen = towards + np.random.default_rng(0).uniform(-1, 1, (4000, 2)) @ across
    points = np.vstack([scans.target.points, apply(scans.T_target_source, screen)])
    return fa.PointCloud(points, viewpoint=scans.target.viewpoint)


def test_a_screen_that_the_other_sensor_looked_through_contradicts(scans):
    target = with_a_screen(scans, behind=False)
    for result in (fa.register(scans.source, target), fa.verify(scans.source, target, scans.T_target_source)):
        assert result.reason is fa.Reason.CONTRADICTED
        assert result.evidence.seen_through > MAX_SEEN_THROUGH
    back = fa.verify(target, scans.source, inverse(scans.T_target_source), search=False)
    assert back.reason is fa.Reason.CONTRADICTED
    assert back.evidence.seen_through == pytest.approx(result.evidence.seen_through)


def test_a_screen_that_it_did_not_see_contradicts_nothing(scans):
    """Behind the sensor; and where it is not known where the sensor stood, nothing is known."""
    unseen = fa.verify(scans.source, with_a_screen(scans, behind=True), scans.T_target_source, search=False)
    assert unseen.evidence.seen_through < MAX_SEEN_THROUGH
    assert unseen.accepted
    unknown = fa.PointCloud(scans.source.points), with_a_screen(scans, behind=False)
    result = fa.verify(*unknown, scans.T_target_source, search=False)
    assert result.evidence.seen_through < MAX_SEEN_THROUGH  # the target's own sensor saw the screen
    assert result.accepted


def test_the_frame_of_the_scan_does_not_matter_to_what_was_looked_through(scans, any_motion, rng):
    W = any_motion(rng, 5.0)
    target = with_a_screen(scans, behind=False)
    here = fa.verify(scans.source, target, scans.T_target_source, search=False)
    there = fa.verify(scans.source.transformed(W), target, scans.T_target_source @ inverse(W), search=False)
    assert there.reason is here.reason is fa.Reason.CONTRADICTED
    assert there.evidence.seen_through == pytest.approx(here.evidence.seen_through, rel=0.1)


# --------------------------------------------------------------------------------- what nothing holds, and a guess


def sheet(n, rng):
    return np.c_[rng.uniform(0, 3, (n, 2)), np.zeros(n)]


def tube(n, rng):
    around = rng.uniform(0, 2 * np.pi, n)
    return np.c_[0.5 * np.cos(around), 0.5 * np.sin(around), rng.uniform(0, 3, n)]


def corridor(n, rng):
    """Floor, ceiling and both walls, 2 m wide and 2.4 m high, along z."""
    walls, across = rng.integers(0, 4, n), rng.uniform(0, 1, n)
    x = np.choose(walls, [2 * across, 2 * across, 0 * across, 0 * across + 2])
    y = np.choose(walls, [0 * across, 0 * across + 2.4, 2.4 * across, 2.4 * across])
    return np.c_[x, y, rng.uniform(0, 6, n)]


SLIDES = {sheet: ["slide", "slide", "turn"], tube: ["slide", "turn"], corridor: ["slide"]}


@pytest.mark.parametrize("shape", SLIDES, ids=lambda shape: shape.__name__)
@pytest.mark.parametrize("noise", [0.0, 0.003])
def test_of_a_degenerate_pair_the_held_part_is_right_and_the_rest_is_the_guess(any_motion, rng, shape, noise):
    """Solution remapping; a twist between two poses falls into both parts to first order."""
    T, source, target = any_motion(rng, 3.0), shape(8000, rng), shape(8000, rng)
    source, target = (cloud + noise * rng.normal(size=cloud.shape) for cloud in (source, target))
    middle = source.mean(axis=0)
    off = exp_twist(np.r_[0.03, -0.02, 0.04, 0.04, 0.03, 0.05])
    init = T @ translation(middle) @ off @ translation(-middle)
    result = fa.register(source, apply(T, target), init=init)
    assert result.reason is fa.Reason.DEGENERATE
    assert sorted(freedom.kind for freedom in result.freedoms) == SLIDES[shape]
    assert result.evidence.hold < MIN_HOLD

    about = translation(-result.reference_point)
    from_truth, from_guess, guess = (
        log_motion(about @ a @ inverse(b) @ inverse(about))
        for a, b in ((result.T_target_source, T), (result.T_target_source, init), (init, T))
    )
    open_part = result.unobservable @ result.unobservable.T
    held_part = np.eye(6) - open_part
    assert np.linalg.norm(held_part @ guess) > 0.02  # there is something to right, and something to leave
    assert np.linalg.norm(open_part @ guess) > 0.02
    assert np.linalg.norm(held_part @ from_truth) < (1e-3 if noise else 1e-4)
    assert np.linalg.norm(open_part @ from_guess) < 0.03 * np.linalg.norm(open_part @ guess)


def test_along_what_is_open_nothing_is_known(any_motion, rng):
    T = any_motion(rng, 3.0)
    result = fa.register(corridor(8000, rng), apply(T, corridor(8000, rng)), init=T)
    (slide,) = result.freedoms
    assert abs(slide.axis @ T[:3, 2]) == pytest.approx(1, abs=1e-4)
    along = np.r_[np.zeros(3), slide.axis]
    for matrix in (result.information, result.covariance):
        assert np.abs(matrix @ along).max() < 1e-9 * np.abs(matrix).max()
        assert np.linalg.matrix_rank(matrix, tol=1e-9 * np.abs(matrix).max()) == 5
    plain = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert plain["freedoms"] == [{"kind": "slide", "axis": slide.axis.tolist(), "point": slide.point.tolist()}]
    assert f"It may {slide}." in result.verdict
