"""RRE and RTE, against SciPy and closed forms."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from fieldalign.evaluation import rotation_error, translation_error


def turned_apart(rng, degrees):
    """Two motions, the second of which is the first after a turn by so many degrees about a random axis."""
    axis = rng.normal(size=3)
    turn = Rotation.from_rotvec(np.radians(degrees) * axis / np.linalg.norm(axis))
    T = RigidTransform.from_components(rng.normal(size=3), Rotation.random(rng=rng))
    return T.as_matrix(), (T * RigidTransform.from_rotation(turn)).as_matrix()


@pytest.mark.parametrize("degrees", [1e-6, 1e-3, 0.5, 10, 45, 90, 135, 179, 179.99])
def test_rotation_error_is_the_angle(rng, degrees):
    T, T_true = turned_apart(rng, degrees)
    tolerance = 1e-13 / max(np.cos(np.radians(degrees) / 2), 1e-3)  # the chord is flat at 180 degrees
    assert rotation_error(T, T_true) == pytest.approx(degrees, rel=tolerance * 10, abs=1e-13)
    oracle = np.degrees((Rotation.from_matrix(T[:3, :3]).inv() * Rotation.from_matrix(T_true[:3, :3])).magnitude())
    assert rotation_error(T, T_true) == pytest.approx(oracle, rel=1e-9, abs=1e-13)


def test_a_billionth_of_a_degree_is_seen():
    """Where the arccos of the trace sees nothing."""
    angle = np.radians(1e-9)
    T = np.eye(4)
    T[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    assert np.trace(T[:3, :3]) == 3
    assert rotation_error(T, np.eye(4)) == pytest.approx(1e-9, rel=1e-12)


@pytest.mark.parametrize("axis", range(3))
def test_half_a_turn_is_180_degrees(axis):
    T = -np.eye(4)
    T[axis, axis] = T[3, 3] = 1
    assert rotation_error(T, np.eye(4)) == 180
    assert rotation_error(np.eye(4), T) == 180


def test_rounding_beyond_half_a_turn_is_no_nan():
    T = np.diag([1, -1, -1, 1]) * (1 + 1e-15)
    assert rotation_error(T, np.eye(4)) == 180


def test_a_pose_has_no_error_to_itself(rng):
    T, _ = turned_apart(rng, 1)
    assert rotation_error(T, T) == 0
    assert translation_error(T, T) == 0


def test_errors_take_no_side(rng):
    T, T_true = turned_apart(rng, 30)
    assert rotation_error(T, T_true) == rotation_error(T_true, T)
    assert translation_error(T, T_true) == translation_error(T_true, T)


def test_rotation_error_knows_no_translation_nor_the_reverse(rng):
    T, T_true = turned_apart(rng, 30)
    moved = T.copy()
    moved[:3, 3] += 100
    assert rotation_error(moved, T_true) == rotation_error(T, T_true)
    turned = T.copy()
    turned[:3, :3] = np.eye(3)
    assert translation_error(turned, T_true) == translation_error(T, T_true)


def test_translation_error_is_the_distance():
    T, T_true = np.eye(4), np.eye(4)
    T[:3, 3], T_true[:3, 3] = [1, 2, 3], [1, -1, 7]
    assert translation_error(T, T_true) == 5


def test_lists_are_poses_and_the_answer_is_a_float():
    T = np.eye(4).tolist()
    assert type(rotation_error(T, T)) is float
    assert type(translation_error(T, T)) is float
