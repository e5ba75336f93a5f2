"""Registration recall: each definition against examples worked out by hand."""

import numpy as np
import pytest

from fieldalign.experiments.case import Case
from fieldalign.experiments.data_sets.three_d_match import FragmentPair
from fieldalign.experiments.results import Results
from fieldalign.experiments.scenes import recall
from fieldalign.experiments.scenes.laid import Laid
from fieldalign.motions import apply, exp_twist, inverse, translation

IDENTITY = np.eye(4)


def turn(degrees):
    return exp_twist(np.r_[0, 0, np.radians(degrees), 0, 0, 0])


def information(places):
    """The sum of G^T G over places q, G = [I, -[q]_x]."""
    total = np.zeros((6, 6))
    for x, y, z in places:
        G = np.hstack([np.eye(3), -np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])])
        total += G.T @ G
    return total


def test_a_shift_counts_as_far_as_it_goes():
    info = information([(2, 0, 0), (-2, 0, 0)])
    assert recall.information_error(translation([0.3, 0, 0.4]), IDENTITY, info) == pytest.approx(0.5)


@pytest.mark.parametrize("degrees", [60, -60, 180])
def test_a_turn_counts_by_half_its_sine(degrees):
    """Places 2 m off the axis; the quaternion's vector part is sin(angle / 2) along the axis."""
    info = information([(2, 0, 0), (-2, 0, 0)])
    error = recall.information_error(turn(degrees), IDENTITY, info)
    assert error == pytest.approx(2 * abs(np.sin(np.radians(degrees / 2))))


def test_a_shift_may_undo_a_turn():
    """At one place (1, 0, 0): q = (0, 0, s) moves it by (0, s, 0), which a shift of (0, -s, 0) takes back."""
    info, s = information([(1, 0, 0)]), np.sin(np.radians(10))
    T = turn(20)
    T[1, 3] = -s
    assert recall.information_error(T, IDENTITY, info) == pytest.approx(0, abs=1e-12)
    T[1, 3] = s
    assert recall.information_error(T, IDENTITY, info) == pytest.approx(2 * s)


def test_the_error_is_of_the_motion_between_both_poses(rng, any_motion):
    T_true, off, info = any_motion(rng, 3.0), translation([0, 0.1, 0]) @ turn(4), information(rng.normal(size=(9, 3)))
    assert recall.information_error(T_true @ off, T_true, info) == pytest.approx(
        recall.information_error(off, IDENTITY, info), abs=1e-12)


def test_correspondences_are_measured_one_by_one(rng, any_motion):
    points, T, T_true = rng.normal(size=(50, 3)), any_motion(rng, 1.0), any_motion(rng, 1.0)
    whole = np.insert(points, 3, 1, axis=1)
    apart = apply(T, points) - apply(T_true, points)
    error = recall.correspondence_error(T, T_true, whole.T @ whole / 50)
    assert error == pytest.approx(np.sqrt((apart**2).sum(axis=1).mean()))


def test_without_information_only_what_overlaps_counts(tmp_path, rng):
    """The half of the source that no target's point is near is 100 m away, where a turn would show."""
    target = rng.uniform(0, 1, (200, 3))
    np.savez(tmp_path / "pair.npz", source=np.vstack([target - [5, 0, 0], target + [100, 0, 0]]), target=target)
    file = tmp_path / "pair.npz"
    pair = FragmentPair("a", "a/pair", f"{file}#source", f"{file}#target", translation([5, 0, 0]))
    assert recall.pair_error(pair, translation([5, 0.1, 0])) == pytest.approx(0.1)
    off = turn(1) @ translation([5, 0, 0])
    apart = apply(turn(1), target) - target
    assert recall.pair_error(pair, off) == pytest.approx(np.sqrt((apart**2).sum(axis=1).mean()))


def made_up(found):
    """Results of one method on pairs (scene, i, j) with a shift each, None where it raised. All sources are turned."""
    info, motion = information([(1, 0, 0), (0, 1, 0), (0, 0, 1)]), turn(90)
    cases, rows = [], {}
    for (scene, i, j), shift in found.items():
        pair = FragmentPair(scene, f"{scene}/{i}_{j}", "", "", turn(30), information=info, i=i, j=j)
        laid = Laid(pair, motion)
        case = Case(f"{pair.name}/0", scene, laid, laid.T_target_source)
        T = turn(30) @ translation([0 if shift is None else shift, 0, 0]) @ inverse(motion)
        cases.append(case)
        rows[case.name, "m"] = {"error": "no"} if shift is None else {
            "T": T[:3].ravel().tolist(), "rre_deg": 0.0, "rte": shift, "accepted": None, "seconds": 1, "cpu_seconds": 1,
        }
    return Results(cases, {"m": "method"}, rows, recall.THRESHOLDS, 0, {}, recall.recalls)


def test_the_three_definitions():
    results = made_up({
        ("a", 0, 1): 5.0,   # a neighbour: by thresholds only, and wrong
        ("a", 0, 2): 0.19,  # right by all
        ("a", 0, 3): 0.25,  # by thresholds only
        ("a", 1, 3): None,  # no pose: wrong
        ("b", 4, 7): 0.1,   # right by all
    })
    found = results.summary("m")
    assert found["recall_by_scenes"] == pytest.approx((1 / 3 + 1) / 2)
    assert found["recall_by_pairs"]["share"] == pytest.approx(2 / 4)
    assert found["recall_by_thresholds"]["share"] == pytest.approx(3 / 5)
    assert results.summary("m", "b")["recall_by_scenes"] == 1


def test_a_scene_of_neighbours_has_no_recall():
    found = made_up({("a", 0, 1): 0.0}).summary("m")
    assert found["recall_by_scenes"] is None
    assert found["recall_by_pairs"]["share"] is None
    assert found["recall_by_thresholds"]["share"] == 1
