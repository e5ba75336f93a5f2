"""The front door, the same for both methods: what goes in, what is refused, what the answer holds."""

import json
from dataclasses import fields, replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

import fieldalign as fa
from fieldalign.errors import ArgumentError, CloudFileError
from fieldalign.evaluation import rotation_error
from fieldalign.motions import apply, inverse, translation


@pytest.fixture(scope="session", params=["robust", "paper"])
def found(request, corner):
    """A result as any other, of either method."""
    T = translation([0.2, -0.1, 0.3])
    return fa.register(corner[:4000], apply(T, corner[2000:]), method=request.param)


# ---------------------------------------------------------------------------------------------------- the first guess


def test_a_guess_may_be_a_list_or_have_few_digits(register, pair):
    source, target, T = pair
    for init in (T.tolist(), np.round(T, 4)):
        result = register(source, target, init=init)
        assert rotation_error(result.T_target_source, T) < 1e-6


@pytest.mark.parametrize("init", [np.eye(3), 2 * np.eye(4), np.diag([1, 1, -1, 1]), np.full((4, 4), np.nan), "pose"])
def test_a_guess_that_is_no_motion_is_refused(register, corner, init):
    with pytest.raises(ArgumentError, match=r"^init must"):
        register(corner, corner, init=init)


def test_the_guess_is_left_as_it_was(register, corner):
    init = np.round(translation([0.1, 0, 0]), 3)
    before = init.copy()
    register(corner, corner, init=init)
    assert np.array_equal(init, before)


# ---------------------------------------------------------------------------------------------------------- arguments


@pytest.mark.parametrize(
    ("keyword", "value", "word"),
    [
        ("dof", 4, "dof must be"),
        ("dof", "rx roll", "dof must name freedoms among rx, ry"),
        ("dof", [], "dof must name freedoms"),
        ("seed", -1, "seed must be"),
        ("seed", 1.5, "seed must be"),
        ("seed", "1", "seed must be"),
        ("seed", None, "seed must be"),
        ("seed", True, "seed must be"),
        ("threads", 0, "threads must be"),
        ("threads", -1, "threads must be"),
        ("threads", 1.5, "threads must be"),
        ("threads", True, "threads must be"),
        ("search", "no", "search must be True, False or None, but is 'no'"),
        ("search", 2, "search must be"),
        ("search_radius", 1.0, "search_radius and search_angle confine the search around init, but there is no init"),
        ("search_angle", 30.0, "search_radius and search_angle confine the search around init, but there is no init"),
    ],
)
def test_a_keyword_that_cannot_be_is_refused_with_a_sentence(register, corner, keyword, value, word):
    with pytest.raises(ArgumentError, match=f"^{word}") as caught:
        register(corner, corner, **{keyword: value})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("keyword", ["search_radius", "search_angle"])
@pytest.mark.parametrize("value", [0, -1.0, np.nan, np.inf, "far", True])
def test_how_far_to_search_is_a_positive_number(register, corner, keyword, value):
    with pytest.raises(ArgumentError, match=f"^{keyword} must be a positive number"):
        register(corner, corner, init=np.eye(4), **{keyword: value})


def test_no_turn_is_larger_than_half_of_one(register, corner):
    with pytest.raises(ArgumentError, match=r"^search_angle must be at most 180 degrees, but is 180\.5"):
        register(corner, corner, init=np.eye(4), search_angle=180.5)


def test_a_search_that_is_confined_and_forbidden_is_refused(register, corner):
    with pytest.raises(ArgumentError, match=r"^search_radius and search_angle confine a search, but search is False"):
        register(corner, corner, init=np.eye(4), search=False, search_radius=1.0)


@pytest.mark.parametrize("method", ["icp", "Robust", None, 1])
def test_a_method_is_one_of_two(corner, method):
    with pytest.raises(ArgumentError, match=r"^method must be one of robust, paper, but is"):
        fa.register(corner, corner, method=method)


def test_robust_is_the_method_that_nobody_asked_for(pair):
    source, target, _ = pair
    unsaid, said = fa.register(source, target), fa.register(source, target, method="robust")
    assert unsaid.T_target_source.tobytes() == said.T_target_source.tobytes()


@pytest.mark.parametrize("settings", ["indoor", fa.Settings(), "room"])
def test_settings_belong_to_the_papers_method(corner, settings):
    with pytest.raises(ArgumentError, match=r"^settings belong to method 'paper'"):
        fa.register(corner, corner, settings=settings)


def test_the_papers_settings_are_known_by_name(corner):
    with pytest.raises(ArgumentError, match=r"^settings must be a Settings object or one of object, indoor"):
        fa.register(corner, corner, method="paper", settings="room")


@pytest.mark.parametrize("options", [{"search": True}, {"search_radius": 1.0}, {"search_angle": 30.0}], ids=str)
def test_the_papers_method_never_searches(corner, options):
    with pytest.raises(ArgumentError, match=r"^method 'paper' never searches"):
        fa.register(corner, corner, method="paper", init=np.eye(4), **options)
    assert fa.register(corner, corner, method="paper", search=False).accepted


def test_who_may_not_search_needs_a_guess(corner):
    with pytest.raises(ArgumentError, match=r"^search=False needs a guess to start from, but there is no init"):
        fa.register(corner, corner, search=False)


def test_keywords_are_keywords(corner):
    with pytest.raises(TypeError):
        fa.register(corner, corner, np.eye(4))
    with pytest.raises(TypeError):
        fa.register(corner, corner, guess=np.eye(4))


def broken(corner):
    infinite = corner.copy()
    infinite[3, 1] = np.inf
    return {
        "shape": np.zeros((5, 2)),
        "finite": infinite,
        "numbers": None,
        "rows": [[1, 2, 3], [4]],
        "real": np.eye(3) + 1j,
    }


@pytest.mark.parametrize("name", ["source", "target"])
@pytest.mark.parametrize("word", ["shape", "finite", "numbers", "rows", "real"])
def test_an_error_names_the_cloud(register, corner, name, word):
    clouds = {"source": corner, "target": corner, name: broken(corner)[word]}
    with pytest.raises(ArgumentError, match=f"^{name} must.*{word}"):
        register(**clouds)


@pytest.mark.parametrize("name", ["source", "target"])
@pytest.mark.parametrize(
    ("points", "word"),
    [(np.zeros((0, 3)), "distinct"), (np.ones((9, 3)), "distinct"), (np.full((9, 3), np.nan), "distinct"),
     (1e300 * np.eye(3), "below")],
    ids=["empty", "one point", "NaN", "huge"],
)
def test_an_error_found_later_names_the_cloud_too(register, corner, name, points, word):
    with pytest.raises(ArgumentError, match=f"^{name} must.*{word}"):
        register(**{"source": corner, "target": corner, name: points})


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.ones((9, 3)), np.eye(3)[:2], np.full((9, 3), np.nan)])
def test_an_empty_cloud_is_an_error_and_never_an_answer(register, corner, points):
    for pair in ((points, corner), (corner, points), (points, points)):
        with pytest.raises(ArgumentError, match="at least 3 distinct points"):
            register(*pair)


def test_a_missing_file_is_one_error(register, corner, tmp_path):
    with pytest.raises(CloudFileError, match=r"nothing\.ply does not exist"):
        register(tmp_path / "nothing.ply", corner)


def test_missing_returns_are_counted_and_change_nothing(register, pair, rng):
    source, target, _ = pair
    gaps = np.full((5, 3), np.nan)
    plain = register(source, target)
    result = register(np.vstack([gaps, source]), fa.PointCloud(np.vstack([target, gaps[:2]])))
    assert result.dropped == (5, 2)
    assert plain.dropped == (0, 0)
    assert np.array_equal(result.T_target_source, plain.T_target_source)
    with pytest.raises(ArgumentError, match=r"^source must be finite, but 5 rows"):
        register(np.vstack([gaps, source]), target, drop_nonfinite=False)


def test_any_array_of_numbers_is_a_cloud(register, pair):
    source, target, T = pair
    plain = register(source, target)
    for one, other in ((source.tolist(), target.tolist()), (np.asfortranarray(source), np.asfortranarray(target)),
                       (np.repeat(source, 2, axis=0)[::2], fa.PointCloud(target))):
        assert np.array_equal(register(one, other).T_target_source, plain.T_target_source)
    rounded = register(source.astype(np.float32), target.astype(np.float32)).T_target_source
    assert rotation_error(rounded, T) < 1e-4


@pytest.mark.parametrize(
    "options", [{}, {"method": "paper", "settings": fa.PRESETS["indoor"].scaled(1000)}], ids=["robust", "paper"]
)
def test_whole_millimetres_are_a_cloud(pair, options):
    source, target, T = pair
    whole = ((1000 * cloud).round().astype(np.int32) for cloud in (source, target))
    found = fa.register(*whole, **options).T_target_source
    assert rotation_error(found, T) < 0.01
    assert np.allclose(found[:3, 3] / 1000, T[:3, 3], atol=2e-4)


def test_clouds_are_left_as_they_were(register, pair):
    source, target, _ = pair
    before = source.copy(), target.copy()
    for cloud in (source, target):
        cloud.flags.writeable = False
    register(source, target)
    assert np.array_equal(source, before[0])
    assert np.array_equal(target, before[1])


def test_files_are_clouds(register, pair, tmp_path):
    source, target, _ = pair
    np.save(tmp_path / "source.npy", source)
    fa.write_cloud(tmp_path / "target.ply", target)
    result = register(tmp_path / "source.npy", str(tmp_path / "target.ply"))
    assert np.array_equal(result.T_target_source, register(source, target).T_target_source)


def test_the_seed_and_nothing_else_decides(register, corner, pair):
    source, target, _ = pair
    source = source[::2]  # no copy, so that the seed can be seen
    one = register(source, target, seed=1, threads=1)
    for threads in (1, 2, 5, None):
        again = register(source, target, seed=np.int64(1), threads=threads)
        assert np.array_equal(again.T_target_source, one.T_target_source)
        assert np.array_equal(again.information, one.information)
    other = register(source, target, seed=2, threads=1)
    assert not np.array_equal(other.history[0].increment, one.history[0].increment)


# --------------------------------------------------------------------------------------------------------- the answer

def test_the_result_has_its_shapes(found):
    k = found.unobservable.shape[1]
    shapes = {"T_target_source": (4, 4), "information": (6, 6), "covariance": (6, 6), "unobservable": (6, k),
              "reference_point": (3,)}
    for name, shape in shapes.items():
        assert getattr(found, name).shape == shape
        assert getattr(found, name).dtype == np.float64
    assert type(found.accepted) is bool
    assert type(found.overlap) is type(found.overlap_target) is type(found.rmse) is float
    assert 0 <= found.overlap <= 1
    assert found.alternatives == ()


@pytest.mark.parametrize("far", [0, 1e4])
def test_the_pose_is_a_motion(register, corner, motion, rng, far):
    T = translation([far, 0, -far]) @ motion(rng, 35, 0.5)
    pose = register(corner, apply(T, corner)).T_target_source
    assert np.abs(pose[:3, :3] @ pose[:3, :3].T - np.eye(3)).max() < 1e-12
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1, abs=1e-12)
    assert np.array_equal(pose[3], [0, 0, 0, 1])
    assert np.allclose(RigidTransform.from_matrix(pose).inv().as_matrix(), inverse(pose), atol=1e-11 * (1 + far))


def test_the_stages_are_timed(found):
    assert all(0 < seconds < 10 for seconds in found.seconds.values())


def test_the_history_is_of_the_iterations(found):
    assert len(found.history) == found.iterations > 0
    assert all(step.increment.shape == (6,) for step in found.history)
    assert all(np.isfinite(step.increment).all() for step in found.history)
    assert all(step.kept >= 10 for step in found.history)
    assert np.linalg.norm(found.history[-1].increment) < 0.01 * np.linalg.norm(found.history[0].increment)


def test_the_dictionary_holds_the_whole_result(found):
    plain = json.loads(json.dumps(found.to_dict()))
    assert {f.name for f in fields(found)} <= set(plain)
    for name in ("T_target_source", "information", "covariance", "reference_point"):
        assert np.array_equal(plain[name], getattr(found, name))
    assert np.shape(plain["unobservable"])[0] == 6
    for name in ("accepted", "overlap", "overlap_target", "iterations", "rmse", "seconds"):
        assert plain[name] == getattr(found, name)
    assert plain["reason"] == "accepted"
    assert plain["message"] == found.verdict
    assert plain["evidence"] == (None if found.evidence is None else found.evidence.to_dict())
    assert plain["freedoms"] == []
    assert plain["dropped"] == {"source": 0, "target": 0}
    assert [step["kept"] for step in plain["history"]] == [step.kept for step in found.history]
    assert plain["alternatives"] == []


def test_alternatives_are_in_the_dictionary_too(found):
    symmetric = replace(found, alternatives=(found,))
    assert symmetric.to_dict()["alternatives"] == [found.to_dict()]


@pytest.mark.parametrize("reason", fa.Reason)
def test_a_reason_is_a_sentence(reason):
    assert str(reason).endswith(".")
    begins = {fa.Reason.ACCEPTED: "Accepted:", fa.Reason.ACCEPTED_NEAR_INIT: "Accepted near the guess:"}
    assert str(reason).startswith(begins.get(reason, "Not accepted:"))
    assert reason.accepts is (reason in begins)
    assert len(str(reason).split()) > 5


def test_the_representation_shows_what_matters(found):
    text = repr(found)
    assert "accepted=True" in text
    assert f"overlap={found.overlap:.2f}" in text
    assert f"iterations={found.iterations}" in text
    shown = text.partition("T_target_source=")[2].strip("\n)").replace("[", " ").replace("]", " ").split()
    assert np.allclose(np.reshape([float(number) for number in shown], (4, 4)), found.T_target_source, atol=1e-6)


def test_the_result_is_immutable(found):
    with pytest.raises(AttributeError):
        found.accepted = False


