import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from fieldalign.errors import ArgumentError
from fieldalign.motions import (
    adjoint,
    apply,
    as_rigid,
    as_similar,
    best_motion,
    exp_twist,
    growth,
    inverse,
    log_motion,
    nearest_rotation,
    orthonormal,
    quaternions_of,
    rotate,
    rotation_between,
    rotations_of,
    seen_from,
    size_of,
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
    assert np.allclose(cleaned[:3, :3] @ cleaned[:3, :3].T, np.eye(3), atol=1e-14)


def test_best_motion_is_that_of_scipy(rng):
    places, noise = rng.normal(size=(2, 30, 3))
    onto = places @ Rotation.random(rng=rng).as_matrix().T + [1, 2, 3] + 0.3 * noise
    T = best_motion(places, onto)
    expected = Rotation.align_vectors(onto - onto.mean(axis=0), places - places.mean(axis=0))[0]
    np.testing.assert_allclose(T[:3, :3], expected.as_matrix(), atol=1e-12)
    np.testing.assert_allclose(apply(T, places).mean(axis=0), onto.mean(axis=0), atol=1e-12)


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


# ---------------------------------------------------------------------------------------------------------- quaternions


def turns(rng):
    """Rotations (B, 3, 3): any, none, half turns about all sorts of axes, and what is near to these."""
    axes = np.vstack([np.eye(3), -np.eye(3), rng.normal(size=(6, 3))])
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    angles = [0.0, 1e-12, 1e-7, 1.0, 2.0, np.pi - 1e-7, np.pi - 1e-12, np.pi, np.pi + 1e-9, 5.0]
    return Rotation.from_rotvec(np.vstack([angle * axes for angle in angles]))


def test_quaternions_are_scipys_up_to_their_sign(rng):
    rotations = turns(rng)
    expected, found = rotations.as_quat(scalar_first=True), quaternions_of(rotations.as_matrix())
    signs = np.sign((expected * found).sum(axis=1))[:, None]
    assert np.allclose(found, signs * expected, rtol=0, atol=1e-15)
    assert np.allclose(np.linalg.norm(found, axis=1), 1, rtol=0, atol=1e-15)


def test_rotations_of_quaternions_are_scipys(rng):
    rotations = turns(rng)
    q = rotations.as_quat(scalar_first=True)
    for signed in (q, -q):
        assert np.allclose(rotations_of(signed), rotations.as_matrix(), rtol=0, atol=2e-15)


def test_quaternions_and_rotations_undo_each_other(rng):
    R = turns(rng).as_matrix()
    assert np.allclose(rotations_of(quaternions_of(R)), R, rtol=0, atol=3e-15)


def test_no_rotation_has_no_quaternion():
    assert quaternions_of(np.empty((0, 3, 3))).shape == (0, 4)
    assert rotations_of(np.empty((0, 4))).shape == (0, 3, 3)


# --------------------------------------------------------------------------------------------------- between directions


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-6, 1e-3, 1.0, 2.0, 3.0, np.pi])
def test_the_rotation_between_two_directions_is_the_smallest(rng, angle):
    """It turns about what is across both, by the angle between them; their lengths do not matter."""
    for _ in range(5):
        a, other = rng.normal(size=(2, 3))
        across = np.cross(a, other) / np.linalg.norm(np.cross(a, other))
        b = Rotation.from_rotvec(angle * across).apply(a)
        R = rotation_between(3 * a, 0.2 * b)
        assert np.allclose(R @ a, b, rtol=0, atol=1e-10)
        assert np.allclose(R @ R.T, np.eye(3), rtol=0, atol=1e-10)
        assert np.linalg.det(R) == pytest.approx(1)
        turn = Rotation.from_matrix(R).as_rotvec()
        assert np.linalg.norm(turn) == pytest.approx(angle, abs=1e-7)
        assert angle == np.pi or np.allclose(turn, angle * across, rtol=0, atol=1e-7)


@pytest.mark.parametrize("axis", [*np.eye(3), *-np.eye(3)], ids=str)
def test_opposite_axes_are_half_a_turn_apart(axis):
    R = rotation_between(axis, -axis)
    assert np.allclose(R @ axis, -axis, atol=1e-15)
    assert np.allclose(R @ R.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(R) == pytest.approx(1)


@pytest.mark.parametrize("away", [1e-4, 1e-6, 1e-7, 1e-8, 1e-9])
def test_nearly_opposite_directions_too(away):
    a, b = np.array([0.0, 0, 1]), np.array([away, 0, -1.0])
    R = rotation_between(a, b)
    assert np.allclose(R @ a, b / np.linalg.norm(b), rtol=0, atol=1e-9)
    assert np.allclose(R @ R.T, np.eye(3), rtol=0, atol=1e-9)


# --------------------------------------------------------------------------------------------------------- similarities


def similarity(rng, size):
    return exp_twist(np.r_[rng.normal(size=3), 5 * rng.normal(size=3)]) @ growth(size)


@pytest.mark.parametrize("factor", [1e-3, 1.0, 0.37, 1000.0])
def test_a_growth_multiplies_places_and_is_told_again(rng, factor):
    points = rng.normal(size=(20, 3))
    assert np.allclose(apply(growth(factor), points), factor * points, rtol=1e-15)
    assert size_of(similarity(rng, factor)) == pytest.approx(factor, rel=1e-14)
    assert size_of(growth(factor)) == pytest.approx(factor, rel=1e-15)


@pytest.mark.parametrize("size", [1e-6, 0.37, 1.0, 1000.0])
def test_a_similarity_is_taken_as_it_is(rng, size):
    T = similarity(rng, size)
    assert np.allclose(as_similar(T.tolist(), "init"), T, rtol=1e-13, atol=1e-13 * size)


def test_a_similarity_with_few_digits_is_cleaned(rng):
    T = similarity(rng, 2.5)
    cleaned = as_similar(np.round(T, 5), "init")
    R = cleaned[:3, :3] / size_of(cleaned)
    assert np.allclose(R @ R.T, np.eye(3), rtol=0, atol=1e-14)
    assert np.allclose(cleaned, T, rtol=0, atol=2e-5)


@pytest.mark.parametrize(
    ("pose", "word"),
    [
        (np.eye(3), "shape"),
        (np.diag([2, 2, -2, 1]), "rotation"),
        (np.diag([-2, -2, -2, 1]), "rotation"),
        (np.diag([2, 2, 2.1, 1]), "rotation"),
        (np.diag([0, 0, 0, 1]), "rotation"),
        (np.diag([2, 2, 2, 2]), "row"),
        (np.full((4, 4), np.nan), "finite"),
        ("pose", "numbers"),
        ([[1, 2], [3]], "numbers"),
    ],
)
def test_as_similar_refuses_what_is_no_similarity(pose, word):
    with pytest.raises(ArgumentError, match=f"init.*{word}"):
        as_similar(pose, "init")


def test_orthonormal_cleans_the_turn_and_keeps_the_shift(rng):
    T = exp_twist(np.r_[rng.normal(size=3), 5e6 * rng.normal(size=3)])
    rough = T.copy()
    rough[:3, :3] += 1e-6 * rng.normal(size=(3, 3))
    before = rough.copy()
    cleaned = orthonormal(rough)
    assert np.array_equal(rough, before)
    assert np.array_equal(cleaned[:, 3], T[:, 3])
    assert np.allclose(cleaned[:3, :3] @ cleaned[:3, :3].T, np.eye(3), rtol=0, atol=4e-15)
    assert np.allclose(cleaned, T, rtol=0, atol=1e-5)


def grown_about(place, x):
    """The similarity that a twist and a growth (7,) generate about a place."""
    return translation(place) @ growth(np.exp(x[6])) @ exp_twist(x[:6]) @ translation(-place)


@pytest.mark.parametrize("size", [0.2, 1.0, 30.0])
def test_a_small_motion_after_a_similarity_is_another_one_before_it(rng, size):
    """To first order T grown_about(0, seen x) = grown_about(c', x) T, where c' is where T takes the place c."""
    T, place = similarity(rng, size), rng.normal(size=3)
    rigid = T @ growth(1 / size)
    there = apply(T, place[None])[0]
    seen = seen_from(rigid, size, place)
    for x in (*np.eye(7), rng.normal(size=7)):
        errors = [np.abs(T @ grown_about(np.zeros(3), seen @ (e * x)) - grown_about(there, e * x) @ T).max()
                  for e in (1e-3, 1e-5)]
        assert errors[0] < 1e-4 * (1 + size)
        assert errors[1] < 3e-4 * errors[0] + 1e-12 * (1 + size)


def test_seen_from_itself_is_the_adjoint_of_the_place(rng):
    """Without a turn, a scale and a growth a twist about a place is one about the origin."""
    place = rng.normal(size=3)
    assert np.allclose(seen_from(np.eye(4), 1.0, place)[:6, :6], adjoint(translation(place)), atol=1e-15)
    T = exp_twist(rng.normal(size=6))
    about = translation(-apply(T, place[None])[0]) @ T
    assert np.allclose(seen_from(T, 1.0, place)[:6, :6], adjoint(inverse(about)), atol=1e-14)
