"""The front door: it finds motions of the paper's range, says the truth about them, and refuses what it cannot do."""

import json
import subprocess
import sys
from dataclasses import fields, replace

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

import fieldalign as fa
from fieldalign.errors import ArgumentError, CloudFileError
from fieldalign.evaluation import rotation_error, translation_error
from fieldalign.motions import apply, inverse, translation

FEW_DEGREES = fa.Settings(max_iterations=2)  # where only the way in and out is looked at


@pytest.fixture
def pair(corner, motion, rng):
    """Two copies of the corner, 30 degrees and half a metre apart, and the motion between them."""
    T = motion(rng, 30, 0.5)
    return corner, apply(T, corner), T


@pytest.fixture(scope="session")
def found(corner):
    """A result as any other."""
    T = translation([0.2, -0.1, 0.3])
    return fa.register(corner[:4000], apply(T, corner[2000:]))


# ------------------------------------------------------------------------------------------- motions that are known


@pytest.mark.parametrize("degrees", [1e-5, 5, 20, 30, 40])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_copies_are_brought_onto_each_other(corner, motion, degrees, seed):
    T = motion(np.random.default_rng(seed), degrees, 0.8)
    result = fa.register(corner, apply(T, corner))
    assert rotation_error(result.T_target_source, T) < 1e-6
    assert translation_error(result.T_target_source, T) < 1e-8
    assert result.accepted
    assert result.reason is fa.Reason.ACCEPTED
    assert (result.overlap, result.overlap_target) == (1, 1)
    assert result.rmse < 1e-8


@pytest.mark.parametrize("degrees", [20, 30, 40])
def test_different_points_of_one_surface(corner, motion, rng, degrees):
    """No point has a partner; the points are 4 to 5 cm apart."""
    T = motion(rng, degrees, 0.8)
    result = fa.register(corner[::2], apply(T, corner[1::2]))
    assert result.accepted
    assert rotation_error(result.T_target_source, T) < 0.15
    assert translation_error(result.T_target_source, T) < 0.008
    assert 0.004 < result.rmse < 0.04


def test_parts_that_overlap_by_two_thirds(corner, motion, rng):
    source, target = corner[corner[:, 0] < 2.4], corner[corner[:, 0] > 0.4]
    T = motion(rng, 10, 0.1)
    result = fa.register(source, apply(T, target), init=T @ motion(rng, 8, 0.15))
    assert result.accepted
    assert rotation_error(result.T_target_source, T) < 0.1
    assert translation_error(result.T_target_source, T) < 0.005
    in_target = (source[:, 0] > 0.4).mean()
    assert result.overlap == pytest.approx(in_target, abs=0.1)


def test_identical_clouds_stay_where_they_are(corner):
    result = fa.register(corner, corner)
    assert np.abs(result.T_target_source - np.eye(4)).max() < 1e-9
    assert result.accepted
    assert result.iterations == 1


def test_the_mean_of_five_neighbours_stands_noise(corner, motion):
    """The paper's table: with noise, the mean feature is the better one (Sec. V-G.2)."""
    errors = {1: [], 5: []}
    for seed in range(4):
        rng = np.random.default_rng(seed)
        T = motion(rng, 20, 0.3)
        clouds = [corner[seed % 2 :: 2], apply(T, corner[1 - seed % 2 :: 2])]
        source, target = (cloud + rng.normal(0, 0.02, cloud.shape) for cloud in clouds)
        for k, kept in errors.items():
            result = fa.register(source, target, settings=fa.Settings(neighbours=k))
            kept.append(rotation_error(result.T_target_source, T))
            assert result.accepted
    assert max(errors[5]) < 0.5
    assert np.mean(errors[5]) < np.mean(errors[1])


@pytest.mark.parametrize("name", fa.PRESETS)
def test_every_preset_runs_and_finds_a_small_motion(corner, motion, rng, name):
    T = motion(rng, 15, 0.2)
    result = fa.register(corner, apply(T, corner), settings=name)
    assert result.accepted
    assert rotation_error(result.T_target_source, T) < 1e-5
    assert result.iterations <= fa.PRESETS[name].max_iterations
    assert result.T_target_source.tobytes() == fa.register(
        corner, apply(T, corner), settings=fa.PRESETS[name]
    ).T_target_source.tobytes()


@pytest.mark.parametrize(
    "options",
    [
        {"irls": False},
        {"irls_steps": 1},
        {"irls_distance": 1e-3},
        {"irls_tolerance": 1e-8},
        {"direction": "normals"},
        {"direction": "none"},
        {"direction": "none", "share_limit": None},
        {"share_limit": 1},
        {"min_cosine": 0.5},
        {"min_kept": 100},
        {"pseudo_set": "uniform"},
        {"pseudo_set": "keypoints", "sigma": 0.1},
        {"pseudo_count": 300},
        {"half_width": 1.0},
        {"sigma": 0.2},
        {"neighbours": 8},
        {"normal_neighbours": 25},
        {"max_iterations": 100},
        {"tolerance": 1e-10},
        {"unit": 10.0},
    ],
    ids=str,
)
def test_every_option_runs_and_finds_a_small_motion(corner, motion, rng, options):
    T = motion(rng, 15, 0.2)
    result = fa.register(corner, apply(T, corner), settings=fa.Settings(**options))
    assert result.accepted
    assert rotation_error(result.T_target_source, T) < 1e-4


def test_handed_in_pseudo_points_lead_there_too(corner, pair, rng):
    source, target, T = pair
    near = target[:800] + rng.normal(0, 0.3, (800, 3))
    result = fa.register(source, target, settings=fa.Settings(pseudo_points=near))
    assert result.accepted
    assert rotation_error(result.T_target_source, T) < 1e-6


# ----------------------------------------------------------------------------------------------------- the first guess


def test_without_a_guess_the_centroids_are_laid_on_each_other(corner):
    far = translation([5e3, -2e3, 8e3])
    result = fa.register(corner, apply(far, corner))
    assert np.abs(result.T_target_source - far).max() < 1e-8
    assert result.iterations == 1  # it was there from the start


def test_an_exact_guess_is_there_at_once(corner, motion, rng):
    """170 degrees and far off: no other way leads there, and the guess is one of the frames as they are given."""
    T = translation([100, 200, 300]) @ motion(rng, 170, 3.0)
    target = apply(T, corner)
    result = fa.register(corner, target, init=T)
    assert result.iterations == 1
    assert np.abs(result.T_target_source - T).max() < 1e-9
    assert result.accepted
    assert rotation_error(fa.register(corner, target).T_target_source, T) > 5


def test_a_guess_nearby_is_enough(corner, motion, rng):
    T = translation([100, 200, 300]) @ motion(rng, 170, 3.0)
    turned_in_place = translation(corner.mean(axis=0)) @ motion(rng, 30, 0.3) @ translation(-corner.mean(axis=0))
    result = fa.register(corner, apply(T, corner), init=T @ turned_in_place)
    assert result.accepted
    assert rotation_error(result.T_target_source, T) < 1e-6
    assert translation_error(result.T_target_source, T) < 1e-8


def test_a_guess_may_be_a_list_or_have_few_digits(corner, pair):
    source, target, T = pair
    for init in (T.tolist(), np.round(T, 4)):
        result = fa.register(source, target, init=init)
        assert rotation_error(result.T_target_source, T) < 1e-6


@pytest.mark.parametrize("init", [np.eye(3), 2 * np.eye(4), np.diag([1, 1, -1, 1]), np.full((4, 4), np.nan), "pose"])
def test_a_guess_that_is_no_motion_is_refused(corner, init):
    with pytest.raises(ArgumentError, match=r"^init must"):
        fa.register(corner, corner, init=init)


def test_the_guess_is_left_as_it_was(corner):
    init = np.round(translation([0.1, 0, 0]), 3)
    before = init.copy()
    fa.register(corner, corner, init=init, settings=FEW_DEGREES)
    assert np.array_equal(init, before)


# ---------------------------------------------------------------------------------------------------------- arguments


@pytest.mark.parametrize(
    ("keyword", "value", "word"),
    [
        ("method", "robust", "method must be 'paper'"),
        ("method", None, "method must be 'paper'"),
        ("search", True, "search is not available"),
        ("search_radius", 1.0, "search is not available"),
        ("search_radius", 0, "search is not available"),
        ("search_angle", 30.0, "search is not available"),
        ("dof", 4, "dof and scale are not available"),
        ("scale", True, "dof and scale are not available"),
        ("seed", -1, "seed must be"),
        ("seed", 1.5, "seed must be"),
        ("seed", "1", "seed must be"),
        ("seed", None, "seed must be"),
        ("seed", True, "seed must be"),
        ("threads", 0, "threads must be"),
        ("threads", -1, "threads must be"),
        ("threads", 1.5, "threads must be"),
        ("threads", True, "threads must be"),
        ("settings", "room", "settings must be"),
    ],
)
def test_a_keyword_that_cannot_be_is_refused_with_a_sentence(corner, keyword, value, word):
    with pytest.raises(ArgumentError, match=f"^{word}") as caught:
        fa.register(corner, corner, **{keyword: value})
    assert "\n" not in str(caught.value)


def test_keywords_are_keywords(corner):
    with pytest.raises(TypeError):
        fa.register(corner, corner, np.eye(4))
    with pytest.raises(TypeError):
        fa.register(corner, corner, guess=np.eye(4))


def test_no_search_may_be_said(corner):
    assert fa.register(corner, corner, search=False).accepted


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
def test_an_error_names_the_cloud(corner, name, word):
    clouds = {"source": corner, "target": corner, name: broken(corner)[word]}
    with pytest.raises(ArgumentError, match=f"^{name} must.*{word}"):
        fa.register(**clouds)


@pytest.mark.parametrize("name", ["source", "target"])
@pytest.mark.parametrize(
    ("points", "word"),
    [(np.zeros((0, 3)), "distinct"), (np.ones((9, 3)), "distinct"), (np.full((9, 3), np.nan), "distinct"),
     (1e300 * np.eye(3), "below")],
    ids=["empty", "one point", "NaN", "huge"],
)
def test_an_error_found_later_names_the_cloud_too(corner, name, points, word):
    with pytest.raises(ArgumentError, match=f"^{name} must.*{word}"):
        fa.register(**{"source": corner, "target": corner, name: points})


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.ones((9, 3)), np.eye(3)[:2], np.full((9, 3), np.nan)])
def test_an_empty_cloud_is_an_error_and_never_an_answer(corner, points):
    for pair in ((points, corner), (corner, points), (points, points)):
        with pytest.raises(ArgumentError, match="at least 3 distinct points"):
            fa.register(*pair)


def test_a_missing_file_is_one_error(corner, tmp_path):
    with pytest.raises(CloudFileError, match=r"nothing\.ply does not exist"):
        fa.register(tmp_path / "nothing.ply", corner)


def test_missing_returns_are_counted_and_change_nothing(pair, rng):
    source, target, _ = pair
    gaps = np.full((5, 3), np.nan)
    plain = fa.register(source, target)
    result = fa.register(np.vstack([gaps, source]), fa.PointCloud(np.vstack([target, gaps[:2]])))
    assert result.dropped == (5, 2)
    assert plain.dropped == (0, 0)
    assert np.array_equal(result.T_target_source, plain.T_target_source)
    with pytest.raises(ArgumentError, match=r"^source must be finite, but 5 rows"):
        fa.register(np.vstack([gaps, source]), target, drop_nonfinite=False)


def test_any_array_of_numbers_is_a_cloud(pair):
    source, target, T = pair
    plain = fa.register(source, target)
    for one, other in ((source.tolist(), target.tolist()), (np.asfortranarray(source), np.asfortranarray(target)),
                       (np.repeat(source, 2, axis=0)[::2], fa.PointCloud(target))):
        assert np.array_equal(fa.register(one, other).T_target_source, plain.T_target_source)
    rounded = fa.register(source.astype(np.float32), target.astype(np.float32)).T_target_source
    assert rotation_error(rounded, T) < 1e-4
    millimetres = fa.register(
        *((1000 * cloud).round().astype(np.int32) for cloud in (source, target)),
        settings=fa.PRESETS["indoor"].scaled(1000),
    ).T_target_source
    assert rotation_error(millimetres, T) < 0.01
    assert np.allclose(millimetres[:3, 3] / 1000, T[:3, 3], atol=2e-4)


def test_clouds_are_left_as_they_were(pair):
    source, target, _ = pair
    before = source.copy(), target.copy()
    for cloud in (source, target):
        cloud.flags.writeable = False
    fa.register(source, target)
    assert np.array_equal(source, before[0])
    assert np.array_equal(target, before[1])


def test_files_are_clouds(pair, tmp_path):
    source, target, _ = pair
    np.save(tmp_path / "source.npy", source)
    fa.write_cloud(tmp_path / "target.ply", target)
    result = fa.register(tmp_path / "source.npy", str(tmp_path / "target.ply"))
    assert np.array_equal(result.T_target_source, fa.register(source, target).T_target_source)


def test_the_seed_and_nothing_else_decides(corner, pair):
    source, target, _ = pair
    source = source[::2]  # no copy, so that the seed can be seen
    one = fa.register(source, target, seed=1, threads=1)
    for threads in (1, 2, 5, None):
        again = fa.register(source, target, seed=np.int64(1), threads=threads)
        assert np.array_equal(again.T_target_source, one.T_target_source)
        assert np.array_equal(again.information, one.information)
    other = fa.register(source, target, seed=2, threads=1)
    assert not np.array_equal(other.history[0].increment, one.history[0].increment)


# ---------------------------------------------------------------------------------------------------------- the answer


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
def test_the_pose_is_a_motion(corner, motion, rng, far):
    T = translation([far, 0, -far]) @ motion(rng, 35, 0.5)
    pose = fa.register(corner, apply(T, corner)).T_target_source
    assert np.abs(pose[:3, :3] @ pose[:3, :3].T - np.eye(3)).max() < 1e-12
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1, abs=1e-12)
    assert np.array_equal(pose[3], [0, 0, 0, 1])
    assert np.allclose(RigidTransform.from_matrix(pose).inv().as_matrix(), inverse(pose), atol=1e-11 * (1 + far))


def test_the_stages_are_timed(found):
    assert list(found.seconds) == ["prepare", "pseudo points", "align", "judge"]
    assert all(0 < seconds < 10 for seconds in found.seconds.values())


def test_the_history_is_of_the_iterations(found):
    assert len(found.history) == found.iterations <= fa.PRESETS["indoor"].max_iterations
    assert all(step.increment.shape == (6,) for step in found.history)
    assert all(10 <= step.kept <= 1000 for step in found.history)
    first, last = found.history[0], found.history[-1]
    assert last.cost < 0.3 * first.cost
    assert np.linalg.norm(last.increment) < 0.01 * np.linalg.norm(first.increment)


@pytest.mark.parametrize("unit", [0.3, 1.0, 1000.0])
def test_it_stops_at_the_first_increment_below_the_tolerance(corner, unit):
    """A shift alone: where 1000 is the unit, its first increment is small already."""
    settings = fa.Settings(tolerance=0.01, unit=unit)
    start = translation([0.2, -0.1, 0.15])
    history = fa.register(corner[::2], corner[1::2], init=start, settings=settings).history
    sizes = [np.linalg.norm(step.increment / [1, 1, 1, unit, unit, unit]) for step in history]
    assert sizes[-1] < 0.01
    assert min([np.inf, *sizes[:-1]]) >= 0.01
    assert (len(sizes) == 1) is (unit == 1000)


def test_the_dictionary_holds_the_whole_result(found):
    plain = json.loads(json.dumps(found.to_dict()))
    assert {f.name for f in fields(found)} <= set(plain)
    for name in ("T_target_source", "information", "covariance", "reference_point"):
        assert np.array_equal(plain[name], getattr(found, name))
    assert np.shape(plain["unobservable"])[0] == 6
    for name in ("accepted", "overlap", "overlap_target", "iterations", "rmse", "seconds"):
        assert plain[name] == getattr(found, name)
    assert plain["reason"] == "accepted"
    assert plain["message"] == str(found.reason)
    assert plain["dropped"] == {"source": 0, "target": 0}
    assert [step["kept"] for step in plain["history"]] == [step.kept for step in found.history]
    assert plain["alternatives"] == []


def test_alternatives_are_in_the_dictionary_too(found):
    symmetric = replace(found, alternatives=(found,))
    assert symmetric.to_dict()["alternatives"] == [found.to_dict()]


@pytest.mark.parametrize("reason", fa.Reason)
def test_a_reason_is_a_sentence(reason):
    assert str(reason).endswith(".")
    assert str(reason).startswith("Accepted:" if reason is fa.Reason.ACCEPTED else "Not accepted:")
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


# ------------------------------------------------------------------------------------------------------- not accepted


def line_bundle(rng):
    return np.c_[rng.normal(0, 0.01, (3000, 2)), rng.uniform(0, 30, 3000)]


def shell(rng):
    away = rng.normal(size=(3000, 3))
    return 0.5 * away / np.linalg.norm(away, axis=1)[:, None]


@pytest.mark.parametrize("seed", range(3))
def test_a_line_is_no_shell(seed):
    rng = np.random.default_rng(seed)
    line, ball = line_bundle(rng), shell(rng)
    for result in (fa.register(line, ball, seed=seed), fa.register(ball, line, seed=seed)):
        assert not result.accepted
        assert result.reason is not fa.Reason.ACCEPTED
        assert min(result.overlap, result.overlap_target) < 0.1


@pytest.mark.parametrize("factor", [0.01, 30])
def test_a_cloud_of_quite_another_size_is_not_accepted(corner, factor):
    result = fa.register(corner, factor * corner)
    assert not result.accepted
    assert max(result.overlap, result.overlap_target) < 0.1


def test_a_corner_is_no_line(corner):
    for seed in (30, 42, 50, 73, 76, 95, 99):  # of 150, these and a few more are accepted
        result = fa.register(corner, line_bundle(np.random.default_rng(seed)))
        assert max(result.overlap, result.overlap_target) < 0.2
        assert not result.accepted


def test_a_large_last_step_is_not_accepted(pair):
    source, target, T = pair
    result = fa.register(source, target, settings=fa.Settings(max_iterations=1))
    assert result.iterations == 1
    assert result.reason is fa.Reason.NOT_CONVERGED
    assert not result.accepted
    assert rotation_error(result.T_target_source, T) > 1


def test_too_few_pseudo_points_are_not_accepted(corner, pair):
    source, target, _ = pair
    result = fa.register(source, target, settings=fa.Settings(min_kept=1000))
    assert result.reason is fa.Reason.LOW_OVERLAP
    assert not result.accepted


FEW_POINTS = """
import numpy as np, fieldalign as fa
few = np.random.default_rng(0).random(({n}, 3))
print(len(fa.register(few, few, settings=fa.Settings("uniform", neighbours={k}, direction={rule!r})).T_target_source))
"""


@pytest.mark.parametrize(("n", "k", "rule"), [(9, 1, "normals"), (3, 5, "feet")])
def test_a_cloud_of_few_points_is_answered(n, k, rule):
    """In a process of its own, since it takes the whole process with it."""
    program = FEW_POINTS.format(n=n, k=k, rule=rule)
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert (ran.returncode, ran.stdout) == (0, "4\n")
