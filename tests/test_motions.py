import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from fieldalign.errors import ArgumentError
from fieldalign.motions import (
    adjoint,
    apply,
    as_rigid,
    exp_twist,
    inverse,
    log_motion,
    nearest_rotation,
    rotate,
    translation,
)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-7, 9.9e-5, 1.01e-4, 1e-2, 1.0, 3.1, np.pi, 5.0])
def test_exp_agrees_with_scipy(rng, angle):
    w = rng.normal(size=3)
    twist = np.r_[angle * w / np.linalg.norm(w), rng.normal(size=3)]
    assert np.allclose(exp_twist(twist), RigidTransform.from_exp_coords(twist).as_matrix(), atol=4e-15, rtol=0)


ANGLES = [0.0, 1e-12, 1e-9, 1e-7, 9.9e-5, 1.01e-4, 1e-2, 1.0, 2.6, 2.8, 3.1, np.pi - 1e-6, np.pi - 1e-9]


@pytest.mark.parametrize("angle", ANGLES)
def test_log_agrees_with_scipy_and_undoes_exp(rng, angle):
    for _ in range(10):
        w, v = rng.normal(size=(2, 3))
        T = RigidTransform.from_exp_coords(np.r_[angle * w / np.linalg.norm(w), v])
        found = log_motion(T.as_matrix())
        assert np.allclose(found[:3], T.rotation.as_rotvec(), atol=1e-8 if angle > 3.1 else 1e-13, rtol=0)
        assert np.allclose(found, T.as_exp_coords(), atol=1e-7 if angle > 3.1 else 1e-12, rtol=0)
        assert np.allclose(exp_twist(found), T.as_matrix(), atol=1e-8 if angle > 3.1 else 1e-13, rtol=0)


@pytest.mark.parametrize("axis", [*np.eye(3), [1, 1, 0], [-1, 2, 3], [0, -1, 1], [1, 1, 1]], ids=str)
@pytest.mark.parametrize("past", [0.0, 1e-9, -1e-9])
def test_log_of_half_a_turn_is_half_a_turn(rng, axis, past):
    """About either end of the axis: both are logarithms. Just past half a turn it is the shorter way round."""
    T = exp_twist(np.r_[(np.pi + past) * np.array(axis) / np.linalg.norm(axis), rng.normal(size=3)])
    found = log_motion(T)
    assert np.linalg.norm(found[:3]) == pytest.approx(np.pi, abs=2e-9)
    assert np.linalg.norm(found[:3]) <= np.pi + 1e-15
    assert np.linalg.norm(np.cross(found[:3], axis)) < 1e-7
    assert np.allclose(exp_twist(found), T, atol=1e-8, rtol=0)


def test_log_carries_over_to_other_frames_as_adjoints_say(rng):
    T, x = exp_twist(rng.normal(size=6)), 0.7 * rng.normal(size=6)
    assert np.allclose(log_motion(T @ exp_twist(x) @ inverse(T)), adjoint(T) @ x, atol=1e-12)


def test_inverse_undoes(rng):
    T = exp_twist(rng.normal(size=6))
    assert np.allclose(inverse(T) @ T, np.eye(4), atol=1e-15)


def test_apply_moves_points(rng):
    T, points = exp_twist(rng.normal(size=6)), rng.normal(size=(50, 3))
    assert np.allclose(apply(T, points), points @ T[:3, :3].T + T[:3, 3], atol=1e-15)
    assert np.array_equal(apply(translation([1, 2, 3]), np.zeros((1, 3))), [[1, 2, 3]])


def test_rotate_turns_and_does_not_shift(rng):
    T, vectors = exp_twist(rng.normal(size=6)), rng.normal(size=(50, 3))
    assert np.allclose(rotate(T[:3, :3], vectors), vectors @ T[:3, :3].T, atol=1e-15)


@pytest.mark.parametrize("far", [1.0, 1e3])
@pytest.mark.parametrize("angle", [0.0, 1e-5, 1.0, 3.0])
def test_adjoint_carries_twists_across(rng, angle, far):
    """T Exp(x) T^-1 = Exp(Ad x)."""
    w = rng.normal(size=3)
    T = exp_twist(np.r_[angle * w / np.linalg.norm(w), far * rng.normal(size=3)])
    for x in (*np.eye(6), rng.normal(size=6)):
        assert np.allclose(exp_twist(adjoint(T) @ x), T @ exp_twist(x) @ inverse(T), rtol=0, atol=1e-12 * far)


def test_adjoints_compose_as_motions_do(rng):
    A, B = exp_twist(rng.normal(size=6)), exp_twist(rng.normal(size=6))
    assert np.allclose(adjoint(A @ B), adjoint(A) @ adjoint(B), atol=1e-13)
    assert np.allclose(adjoint(inverse(A)), np.linalg.inv(adjoint(A)), atol=1e-13)


def test_nearest_rotation_cleans_rounding(rng):
    R = exp_twist(rng.normal(size=6))[:3, :3]
    cleaned = nearest_rotation(R + 1e-6 * rng.normal(size=(3, 3)))
    assert np.allclose(cleaned @ cleaned.T, np.eye(3), atol=1e-15)
    assert np.abs(cleaned - R).max() < 1e-5


def test_as_rigid_cleans_a_pose_with_few_digits(rng):
    T = exp_twist(rng.normal(size=6))
    cleaned = as_rigid(np.round(T, 5), "init")
    assert np.allclose(cleaned[:3, :3] @ cleaned[:3, :3].T, np.eye(3), atol=1e-15)


def test_nearest_rotation_is_never_a_reflection(rng):
    """Against SciPy, which solves the same (Kabsch's) problem, for matrices that are far from rotations too."""
    for _ in range(20):
        M = rng.normal(size=(3, 3))
        expected = Rotation.align_vectors(M.T, np.eye(3))[0].as_matrix()
        assert np.allclose(nearest_rotation(M), expected, atol=1e-9)
        assert np.linalg.det(nearest_rotation(M)) == pytest.approx(1)


@pytest.mark.parametrize(
    ("pose", "word"),
    [
        (np.eye(3), "shape"),
        (np.diag([1, 1, -1, 1]), "rotation"),
        (np.diag([2, 2, 2, 1]), "rotation"),
        (np.zeros((4, 4)), "row"),
        (np.full((4, 4), np.nan), "finite"),
        ("pose", "numbers"),
        ([[1, 2], [3]], "numbers"),
    ],
)
def test_as_rigid_refuses_what_is_no_motion(pose, word):
    with pytest.raises(ArgumentError, match=f"init.*{word}"):
        as_rigid(pose, "init")
