"""ATE, RPE and association, against evo; KITTI's measure, against its development kit written out."""

from itertools import pairwise

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.evaluation import absolute_errors, associated, evaluate, relative_errors, segment_errors
from fieldalign.evaluation.relative import pairs_apart
from fieldalign.motions import exp_twist, inverse
from fieldalign.odometry.trajectory import Trajectory

TOLERANCE = {"rtol": 1e-9, "atol": 1e-9}


@pytest.fixture(scope="module")
def drive(winding):
    """The poses of a drive of 600 m that stands still for a while, and of an odometry that drifts, in another world."""
    truth = winding(11, 600)
    truth[200:230] = truth[200]
    rng, steps = np.random.default_rng(4), inverse(truth[:-1]) @ truth[1:]
    poses = [exp_twist(np.array([0.4, 0.1, -1.0, 5.0, -3.0, 1.0]))]
    for step in steps:
        poses.append(poses[-1] @ step @ exp_twist(rng.normal(size=6) * [1e-3, 1e-3, 2e-3, 0.03, 0.02, 0.02]))
    return truth, np.stack(poses)


@pytest.fixture
def evo():
    """evo's modules and a maker of its trajectories."""
    pytest.importorskip("evo")
    from evo.core import metrics, sync, trajectory

    class Evo:
        pass

    Evo.metrics, Evo.sync = metrics, sync
    Evo.path = staticmethod(lambda poses: trajectory.PosePath3D(poses_se3=list(poses)))
    Evo.timed = staticmethod(
        lambda t: trajectory.PoseTrajectory3D(poses_se3=list(t.poses), timestamps=np.array(t.times))
    )
    return Evo


def evos_errors(evo, metric, truth, poses, **options):
    """Of translation and of rotation in degrees, and the statistics of both."""
    relations = (evo.metrics.PoseRelation.translation_part, evo.metrics.PoseRelation.rotation_angle_deg)
    measured = [metric(relation, **options) for relation in relations]
    for one in measured:
        one.process_data((truth, poses))
    return [one.error for one in measured], [one.get_all_statistics() for one in measured]


def assert_equal_to(errors, expected):
    (translation, rotation), statistics = expected
    np.testing.assert_allclose(errors.translation, translation, **TOLERANCE)
    np.testing.assert_allclose(errors.rotation, rotation, **TOLERANCE)
    names = {"standard_deviation": "std", "minimum": "min", "maximum": "max"}
    for plain, theirs in zip(errors.to_dict().values(), statistics, strict=True):
        for name, value in plain.items():
            assert value == pytest.approx(theirs[names.get(name, name)], rel=1e-9)


# ------------------------------------------------------------------------------------------------------------------ ATE


@pytest.mark.parametrize("alignment", ["positions", "origin", "none"])
def test_absolute_errors_are_those_of_evo(drive, evo, alignment):
    truth, poses = drive
    reference, estimate = evo.path(truth), evo.path(poses)
    if alignment == "positions":
        estimate.align(reference)
    if alignment == "origin":
        estimate.align_origin(reference)
    errors, T = absolute_errors(truth, poses, alignment)
    assert_equal_to(errors, evos_errors(evo, evo.metrics.APE, reference, estimate))
    np.testing.assert_allclose(T @ poses, estimate.poses_se3, atol=1e-9)


def test_alignment_takes_away_a_motion_of_the_world(drive):
    truth, _ = drive
    T = exp_twist(np.array([1.0, 2.0, -1.0, 30.0, 20.0, 10.0]))
    errors, found = absolute_errors(truth, T @ truth)
    np.testing.assert_allclose(found, inverse(T), atol=1e-12)
    assert errors.translation.max() < 1e-10
    assert absolute_errors(truth, T @ truth, "none")[0].translation.min() > 10


def test_a_mirrored_drive_is_not_laid_on_the_truth(drive):
    truth, _ = drive
    mirrored = truth.copy()
    mirrored[:, 1, 3] *= -1
    T = absolute_errors(truth, mirrored)[1]
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1)


# ------------------------------------------------------------------------------------------------------------------ RPE


@pytest.mark.parametrize("all_pairs", [False, True])
@pytest.mark.parametrize(
    ("delta", "unit"),
    [(1, "frames"), (7, "frames"), (599, "frames"), (2.5, "metres"), (100.0, "metres"), (1e4, "metres")],
)
def test_relative_errors_are_those_of_evo(drive, evo, delta, unit, all_pairs):
    truth, poses = drive
    errors = relative_errors(truth, poses, delta, unit, all_pairs)
    if delta == 1e4:
        assert len(errors.translation) == len(errors.rotation) == 0
        return
    its_unit = evo.metrics.Unit.frames if unit == "frames" else evo.metrics.Unit.meters
    options = {"delta": delta, "delta_unit": its_unit, "all_pairs": all_pairs}
    assert_equal_to(errors, evos_errors(evo, evo.metrics.RPE, evo.path(truth), evo.path(poses), **options))


@pytest.mark.parametrize("all_pairs", [False, True])
@pytest.mark.parametrize("delta", [5.0, 10.5])
def test_pairs_that_are_just_delta_apart_and_equally_near_are_those_of_evo(evo, delta, all_pairs):
    from evo.core.filters import filter_pairs_by_path

    straight = np.tile(np.eye(4), (60, 1, 1))
    straight[:, 0, 3] = np.arange(60)
    expected = filter_pairs_by_path(list(straight), delta, 0.1 * delta, all_pairs)
    assert np.transpose(pairs_apart(straight, delta, "metres", all_pairs)).tolist() == [list(pair) for pair in expected]


def test_relative_errors_know_no_world(drive):
    truth, poses = drive
    T = exp_twist(np.array([1.0, 2.0, -1.0, 30.0, 20.0, 10.0]))
    here, there = relative_errors(truth, poses, 10), relative_errors(T @ truth, poses, 10)
    np.testing.assert_allclose(here.translation, there.translation, atol=1e-11)
    np.testing.assert_allclose(here.rotation, there.rotation, atol=1e-11)


@pytest.mark.parametrize(("delta", "unit", "words"), [(0, "frames", "delta"), (1.5, "frames", "delta"),
                                                      (-1.0, "metres", "delta"), (1, "miles", "unit")])
def test_pairs_that_cannot_be_are_refused(drive, delta, unit, words):
    with pytest.raises(fa.ArgumentError, match=f"{words} must be"):
        relative_errors(*drive, delta, unit)


# ---------------------------------------------------------------------------------------------------------- association


def with_times(times, first=0):
    poses = np.tile(np.eye(4), (len(times), 1, 1))
    poses[:, 0, 3] = np.arange(first, first + len(times))
    return Trajectory(times, poses)


CLOCKS = {
    "the same": (np.arange(30) / 10, np.arange(30) / 10),
    "a shift": (np.arange(30) / 10, np.arange(5, 50) / 10 + 0.004),
    "jitter": (np.arange(300) / 10, np.random.default_rng(0).uniform(0, 30, 900)),
    "sorted jitter": (np.sort(np.random.default_rng(1).uniform(0, 30, 300)), np.arange(900) / 30),
    "halfway": (np.array([1.0, 2.0, 3.0]), np.array([0.995, 1.005, 2.995, 3.005])),
    "twice": (np.array([1.0, 1.0, 2.0, 2.0, 3.0]), np.array([1.0, 2.0, 2.0, 2.5])),
    "a clock that jumped": (np.array([1.0, 2.0, 3.0, 0.5, 1.5]), np.array([0.5, 1.0, 1.5, 2.0, 3.0, 4.0])),
    "one length": (np.array([1.0, 1.006]), np.array([1.001, 1.002])),
    "one": (np.array([5.0]), np.array([1.0, 4.995, 5.004])),
    "one longer": (np.array([1.0, 4.995, 5.004]), np.array([5.0])),
}


@pytest.mark.parametrize("clocks", CLOCKS.values(), ids=CLOCKS)
def test_poses_belong_together_as_for_evo(evo, clocks):
    truth, other = with_times(clocks[0]), with_times(clocks[1], 1000)
    expected = evo.sync.associate_trajectories(evo.timed(truth), evo.timed(other), max_diff=0.01)
    for ours, theirs in zip(associated(truth, other, 0.01), expected, strict=True):
        assert np.array_equal(ours.times, theirs.timestamps)
        assert np.array_equal(ours.positions, theirs.positions_xyz)


def test_times_that_never_meet_are_one_clear_error():
    with pytest.raises(fa.ArgumentError, match=r"within 0\.01 s of .* from 0 to 2, .* from 50\.5 to 52\.5"):
        associated(with_times(np.arange(3) + 50.5), with_times(np.arange(3)))
    with pytest.raises(fa.ArgumentError, match="there are no times"):
        associated(with_times(np.arange(3)), with_times(np.arange(0)))


# ---------------------------------------------------------------------------------------------------------------- KITTI


def development_kit(truth, poses):
    """(first, last, length, t_err, r_err in radians) as KITTI's evaluate_odometry.cpp goes about it."""
    distances = [0.0]
    for a, b in pairwise(truth):
        distances.append(distances[-1] + np.linalg.norm(b[:3, 3] - a[:3, 3]))
    found = []
    for first in range(0, len(truth), 10):
        for length in (100, 200, 300, 400, 500, 600, 700, 800):
            last = next((i for i in range(first, len(truth)) if distances[i] > distances[first] + length), None)
            if last is None:
                continue
            delta_true = np.linalg.inv(truth[first]) @ truth[last]
            delta = np.linalg.inv(poses[first]) @ poses[last]
            error = np.linalg.inv(delta) @ delta_true
            angle = np.arccos(np.clip(0.5 * (np.trace(error[:3, :3]) - 1), -1, 1))
            found.append((first, last, length, np.linalg.norm(error[:3, 3]) / length, angle / length))
    return np.array(found)


def test_segments_are_those_of_the_development_kit(drive):
    first, last, lengths, translation, angle = development_kit(*drive).T
    found = segment_errors(*drive)
    assert len(found) == len(first) > 100
    assert np.array_equal(found.first, first)
    assert np.array_equal(found.last, last)
    assert np.array_equal(found.lengths, lengths)
    np.testing.assert_allclose(found.translation, translation, atol=1e-12)
    np.testing.assert_allclose(found.rotation, np.degrees(angle), atol=1e-8)  # the arccos sees no better
    assert found.translation_percent == pytest.approx(100 * translation.mean(), rel=1e-9)
    assert found.rotation_deg_per_m == pytest.approx(np.degrees(angle.mean()), rel=1e-6)
    assert found.rotation_deg_per_100m == 100 * found.rotation_deg_per_m


def test_a_ruler_that_is_one_percent_short_drifts_by_one_percent():
    truth = np.tile(np.eye(4), (1001, 1, 1))
    truth[:, 0, 3] = np.arange(1001)
    short = truth.copy()
    short[:, 0, 3] *= 0.99
    found = segment_errors(truth, short)
    # A segment is a metre longer than its name, since it ends where the path is longer than that.
    np.testing.assert_allclose(found.translation, 0.01 * (found.lengths + 1) / found.lengths, rtol=1e-9)
    assert found.rotation_deg_per_m == 0
    assert found.of_length(800.0).translation_percent == pytest.approx(1.00125)
    assert len(found.of_length(800.0)) == 20
    assert found.to_dict()["by_length_m"]["800"]["segments"] == 20


def test_a_turn_of_a_tenth_of_a_degree_each_metre_is_named_so():
    truth = np.tile(np.eye(4), (1001, 1, 1))
    truth[:, 0, 3] = np.arange(1001)
    bent = np.tile(np.eye(4), (1001, 1, 1))
    for k in range(1, 1001):
        bent[k] = bent[k - 1] @ exp_twist(np.radians([0, 0, 0.1, 0, 0, 0]))
    bent[:, :3, 3] = truth[:, :3, 3]
    assert segment_errors(truth, bent).of_length(100.0).rotation_deg_per_m == pytest.approx(0.101)


def test_a_short_drive_has_no_segment(winding):
    found = segment_errors(winding(0, 50), winding(1, 50))
    assert len(found) == 0
    assert np.isnan(found.translation_percent)
    assert found.to_dict() == {"segments": 0, "translation_percent": None, "rotation_deg_per_m": None,
                               "rotation_deg_per_100m": None, "by_length_m": {}}


# ------------------------------------------------------------------------------------------------------------- evaluate


def test_all_measures_at_once(drive):
    truth, poses = (Trajectory(np.arange(600) / 10, part) for part in drive)
    found = evaluate(truth=truth, trajectory=poses[50:], delta=10)
    assert len(found.truth) == len(found.trajectory) == 550
    assert found.poses == (550, 600)
    assert found.segments.translation_percent == segment_errors(truth.poses[50:], poses.poses[50:]).translation_percent
    expected = absolute_errors(truth.poses[50:], poses.poses[50:])[0].to_dict()
    plain = found.to_dict()
    assert plain["ate"] == expected
    assert plain["rpe"]["delta"] == 10
    np.testing.assert_allclose(found.trajectory.poses, found.T_truth_trajectory @ poses.poses[50:])
    text = str(found)
    assert "550 poses paired, of 550 and 600 of the truth" in text
    assert f"{found.segments.translation_percent:.4g} %" in text


def test_row_for_row_the_times_say_nothing(drive):
    truth, poses = Trajectory(np.arange(600), drive[0]), Trajectory(np.arange(600) + 1e9, drive[1])
    with pytest.raises(fa.ArgumentError, match="no pose lies within"):
        evaluate(poses, truth)
    found = evaluate(poses, truth, max_difference=None)
    assert found.segments.translation_percent == segment_errors(*drive).translation_percent
    with pytest.raises(fa.ArgumentError, match="as many poses as the truth"):
        evaluate(poses[:-1], truth, max_difference=None)


def test_a_drive_of_one_pose_is_evaluated(winding):
    one = Trajectory([0.0], winding(0, 1))
    found = evaluate(one, one)
    assert found.to_dict()["rpe"]["translation"] is None
    assert "no pair is so far apart" in str(found)
    assert "no segment" in str(found)


def test_an_unknown_alignment_is_refused(drive):
    with pytest.raises(fa.ArgumentError, match="alignment must be one of positions, origin, none"):
        absolute_errors(*drive, "umeyama")
