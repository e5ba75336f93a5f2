"""The verdict on a pose that any tool has found: the one that registering gives, and the pose stays as it is."""

import json

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.clouds.simulated import simulate_pair
from fieldalign.errors import ArgumentError, CloudFileError
from fieldalign.evaluation import rotation_error, translation_error
from fieldalign.motions import exp_twist, inverse, translation


@pytest.fixture(scope="module")
def pair():
    return simulate_pair(0, 20_000)


@pytest.fixture(scope="module")
def clouds(pair):
    """Source and target, prepared once."""
    return fa.prepare(pair.source), fa.prepare(pair.target)


@pytest.fixture(scope="module")
def found(clouds):
    return fa.register(*clouds)


@pytest.fixture(scope="module")
def verified(clouds, found):
    return fa.verify(*clouds, found.T_target_source)


def pushed(T, target, rng, degrees, shift):
    """A pose turned so far about the middle of the target, and shifted."""
    middle, (w, v) = target.points.mean(axis=0), rng.normal(size=(2, 3))
    twist = np.r_[np.radians(degrees) * w / np.linalg.norm(w), shift * v / np.linalg.norm(v)]
    return translation(middle) @ exp_twist(twist) @ translation(-middle) @ T


# -------------------------------------------------------------------------------------------------------- the verdict


def test_the_answer_of_register_gets_the_same_verdict(found, verified):
    assert found.reason is verified.reason is fa.Reason.ACCEPTED
    for name in ("met", "agreeing", "seen_through"):
        assert getattr(verified.evidence, name) == pytest.approx(getattr(found.evidence, name), rel=1e-6)
    assert verified.evidence.hold == pytest.approx(found.evidence.hold, rel=0.02)
    assert verified.evidence.margin <= found.evidence.margin * (1 + 1e-6)  # compared with more poses
    assert verified.evidence.off < 0.01
    size = np.sqrt(np.outer(*2 * [np.diag(found.covariance)]))
    assert np.abs((verified.covariance - found.covariance) / size).max() < 0.05
    assert np.allclose(verified.reference_point, found.reference_point, atol=1e-3)
    assert verified.overlap == pytest.approx(found.overlap)
    assert verified.overlap_target == pytest.approx(found.overlap_target)
    assert verified.alternatives == ()


def test_the_pose_stays_as_it_is(clouds, pair, rng):
    """A right one is not made better, a wrong one not righted; only its rotation is cleaned of rounding."""
    for T in (pair.T_target_source, pushed(pair.T_target_source, pair.target, rng, 1, 0.02), np.eye(4)):
        before = T.copy()
        assert np.abs(fa.verify(*clouds, T, search=False).T_target_source - T).max() < 1e-14
        assert np.array_equal(T, before)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("search", [True, False])
def test_a_pose_pushed_far_is_refused(clouds, pair, seed, search):
    wrong = pushed(pair.T_target_source, pair.target, np.random.default_rng(seed), 30, 0.3)
    result = fa.verify(*clouds, wrong, search=search)
    assert not result.accepted
    assert result.evidence.margin < 1  # others agree better
    assert result.evidence.strength < 1
    assert np.abs(result.T_target_source - wrong).max() < 1e-14


def test_the_last_step_says_how_far_the_pose_is_off(clouds, found):
    """Of a pose near the truth, in voxels: twice as far is twice as much."""
    off = [fa.verify(*clouds, translation([0, 0, away]) @ found.T_target_source, search=False).evidence.off
           for away in (0.005, 0.01)]
    assert off[1] == pytest.approx(2 * off[0], rel=0.3)
    assert off[0] > 0.01


def test_without_a_search_the_reason_says_so(clouds, found, verified):
    near = fa.verify(*clouds, found.T_target_source, search=False)
    assert near.reason is fa.Reason.ACCEPTED_NEAR_INIT
    assert near.accepted
    assert not near.evidence.searched
    assert verified.evidence.searched
    assert near.evidence.margin >= verified.evidence.margin
    assert np.array_equal(near.information, verified.information)


@pytest.mark.parametrize("search", [True, False])
def test_other_rooms_laid_on_each_other_are_refused(clouds, search):
    other = fa.prepare(simulate_pair(7, 20_000).source)
    for pair in ((other, clouds[1]), (clouds[0], other)):
        assert not fa.verify(*pair, np.eye(4), search=search).accepted


def test_the_inverse_pose_between_swapped_clouds_is_as_good(clouds, found, verified):
    back = fa.verify(clouds[1], clouds[0], inverse(found.T_target_source))
    assert back.reason is verified.reason
    assert back.evidence.met == pytest.approx(verified.evidence.met, rel=0.05)
    assert back.evidence.agreeing == pytest.approx(verified.evidence.agreeing, rel=0.05)
    assert back.overlap == pytest.approx(verified.overlap_target, abs=0.02)


def test_what_slides_is_told(rng):
    sheets = [np.c_[rng.uniform(0, 3, (5000, 2)), np.zeros(5000)] for _ in range(2)]
    result = fa.verify(*sheets, np.eye(4))
    assert result.reason is fa.Reason.DEGENERATE
    assert sorted(freedom.kind for freedom in result.freedoms) == ["slide", "slide", "turn"]
    assert result.verdict.startswith(str(fa.Reason.DEGENERATE))
    assert result.verdict.count("slide along (") == 2
    assert result.verdict.count("turn about (") == 1
    assert str(result.evidence) in result.verdict
    plain = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert plain["message"] == result.verdict
    assert [freedom["kind"] for freedom in plain["freedoms"]] == [freedom.kind for freedom in result.freedoms]
    assert np.allclose(plain["freedoms"][0]["axis"], result.freedoms[0].axis)


@pytest.mark.parametrize("search", [True, False])
def test_a_cloud_laid_on_itself_is_accepted(clouds, search):
    """Where most residuals are zero to the last bit."""
    result = fa.verify(clouds[1], clouds[1], np.eye(4), search=search)
    assert result.accepted
    assert np.isfinite(result.history[-1].increment).all()


def test_tiny_clouds_are_judged(rng):
    """Too few for a surface: refused, with finite numbers."""
    for n in (3, 10, 50):
        few = rng.random((n, 3))
        result = fa.verify(few, few, np.eye(4))
        assert not result.accepted
        json.dumps(result.to_dict(), allow_nan=False)


# ------------------------------------------------------------------------------------------------------ a guess alone


@pytest.mark.parametrize("seed", range(8))
def test_a_guess_pushed_far_is_accepted_only_where_it_came_back(clouds, pair, seed):
    rng = np.random.default_rng(seed)
    init = pushed(pair.T_target_source, pair.target, rng, [5, 30, 60, 90, 120, 150, 170, 180][seed], 0.5)
    result = fa.register(*clouds, init=init)
    came_back = rotation_error(result.T_target_source, pair.T_target_source) < 0.1 and (
        translation_error(result.T_target_source, pair.T_target_source) < 0.01)
    assert result.accepted is came_back
    assert result.reason is fa.Reason.ACCEPTED_NEAR_INIT or not came_back
    assert came_back or seed > 0  # the nearest does


# ---------------------------------------------------------------------------------------------------- what goes in


def test_the_seed_and_nothing_else_decides(pair, found):
    first = fa.verify(pair.source, pair.target, found.T_target_source, seed=1, threads=1)
    for threads in (2, 5, None):
        again = fa.verify(pair.source, pair.target, found.T_target_source, seed=1, threads=threads)
        assert again.evidence == first.evidence
        assert again.information.tobytes() == first.information.tobytes()
        assert again.covariance.tobytes() == first.covariance.tobytes()
    assert fa.verify(pair.source, pair.target, found.T_target_source, seed=2).evidence.margin != first.evidence.margin


def test_files_arrays_and_prepared_clouds_are_clouds(clouds, pair, verified, tmp_path):
    np.save(tmp_path / "source.npy", pair.source.points)
    fa.write_cloud(tmp_path / "target.ply", pair.target.points)
    expected = fa.verify(pair.source.points, pair.target.points, verified.T_target_source)
    for source, target in ((tmp_path / "source.npy", str(tmp_path / "target.ply")), (clouds[0], pair.target.points)):
        result = fa.verify(source, target, verified.T_target_source.tolist())
        assert result.accepted
        assert result.evidence.margin == pytest.approx(expected.evidence.margin, rel=1e-6)
    without = fa.verify(tmp_path / "source.npy", pair.target.points, np.eye(4), search=False)
    assert without.evidence.seen_through is None


def test_missing_returns_are_counted(pair, found):
    gaps = np.vstack([pair.source.points, np.full((5, 3), np.nan)])
    assert fa.verify(gaps, pair.target, found.T_target_source, search=False).dropped == (5, 0)
    with pytest.raises(ArgumentError, match=r"^source must be finite, but 5 rows"):
        fa.verify(gaps, pair.target, found.T_target_source, drop_nonfinite=False)


@pytest.mark.parametrize("pose", [np.eye(3), 2 * np.eye(4), np.diag([1, 1, -1, 1]), np.full((4, 4), np.nan), "pose"])
def test_what_is_no_motion_is_refused(clouds, pose):
    with pytest.raises(ArgumentError, match=r"^T_target_source must"):
        fa.verify(*clouds, pose)


@pytest.mark.parametrize(
    ("keyword", "value", "word"),
    [("search", "no", "search must be True or False, but is 'no'"), ("search", None, "search must be"),
     ("search", 2, "search must be"), ("seed", -1, "seed must be"), ("seed", True, "seed must be"),
     ("threads", 0, "threads must be"), ("threads", 1.5, "threads must be")],
)
def test_a_keyword_that_cannot_be_is_refused(clouds, keyword, value, word):
    with pytest.raises(ArgumentError, match=f"^{word}"):
        fa.verify(*clouds, np.eye(4), **{keyword: value})


@pytest.mark.parametrize("name", ["source", "target"])
@pytest.mark.parametrize(("points", "word"), [(np.zeros((5, 2)), "shape"), (np.zeros((0, 3)), "distinct")])
def test_a_cloud_that_cannot_be_is_named(clouds, name, points, word):
    named = dict(zip(("source", "target"), clouds, strict=True)) | {name: points}
    with pytest.raises(ArgumentError, match=f"^{name} must.*{word}"):
        fa.verify(**named, T_target_source=np.eye(4))


def test_a_missing_file_is_one_error(clouds, tmp_path):
    with pytest.raises(CloudFileError, match=r"nothing\.ply does not exist"):
        fa.verify(tmp_path / "nothing.ply", clouds[1], np.eye(4))


def test_keywords_are_keywords(clouds):
    with pytest.raises(TypeError):
        fa.verify(*clouds, np.eye(4), False)
