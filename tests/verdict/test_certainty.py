"""How well a pose is known and what is open, against closed forms."""

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.motions import adjoint, apply, exp_twist, inverse, translation
from fieldalign.verdict import MIN_HOLD, freedoms, split


def random_information(rng):
    """A random symmetric positive matrix (6, 6)."""
    M = rng.normal(size=(6, 9))
    return M @ M.T


def lever_of(length):
    return np.array([1, 1, 1, length, length, length])


# -------------------------------------------------------------------------------------------------------------- split


@pytest.mark.parametrize("length", [0.01, 1.0, 1000.0])
def test_where_all_is_held_the_covariance_is_the_sandwich(rng, length):
    """A^-1 S A^-1 (Huber), in any unit, and the information its inverse."""
    weigh = np.outer(1 / lever_of(length), 1 / lever_of(length))
    A, S, hold = (random_information(rng) * weigh for _ in range(3))
    found = split(A, S, hold, np.arange(3.0), length, 1e-9)
    assert np.allclose(found.covariance * weigh, np.linalg.inv(A / weigh) @ (S / weigh) @ np.linalg.inv(A / weigh))
    assert np.allclose(found.covariance @ found.information, np.eye(6), atol=1e-6)
    assert np.array_equal(found.reference_point, np.arange(3.0))
    assert found.unobservable.shape == (6, 0)
    assert np.allclose(found.hold, np.linalg.eigvalsh(hold / weigh) / np.linalg.eigvalsh(hold / weigh)[-1])


@pytest.fixture(params=[0.01, 1.0, 1000.0])
def half_open(request, rng):
    """A split of which two directions are open, its A and S, the known twists (6, 4) and the open ones (6, 2)."""
    length = request.param
    Q = np.linalg.qr(rng.normal(size=(6, 6)))[0]
    weigh = np.outer(1 / lever_of(length), 1 / lever_of(length))
    A, S = (random_information(rng) * weigh for _ in range(2))
    hold = (Q * [-1e-5, 1e-4, 2e-3, 0.1, 0.7, 1.0]) @ Q.T * weigh
    twists = Q * lever_of(length)[:, None]
    return split(A, S, hold, np.zeros(3), length, 1e-3), A, S, twists[:, 2:], twists[:, :2]


def test_a_direction_that_is_hardly_held_is_open(half_open, same_span):
    found, *_, open_twists = half_open
    assert same_span(found.unobservable / found.lever, open_twists / found.lever)
    assert np.allclose(found.unobservable.T @ found.unobservable, np.eye(2), atol=1e-12)
    assert np.allclose(found.hold, [-1e-5, 1e-4, 2e-3, 0.1, 0.7, 1.0], atol=1e-12)


def test_the_known_part_is_a_sandwich_of_the_known_part(half_open):
    """What is said of the pose with the open twists fixed: the sandwich of A and S as seen by the known ones."""
    found, A, S, known, open_twists = half_open
    undo = np.linalg.inv(known.T @ A @ known)
    weigh = found.lever * found.lever.T
    expected = known @ undo @ (known.T @ S @ known) @ undo @ known.T
    assert np.allclose(found.covariance / weigh, expected / weigh, rtol=1e-7, atol=1e-12)
    assert np.allclose(found.information * weigh, np.linalg.pinv(expected / weigh, rcond=1e-10), rtol=1e-6, atol=1e-9)
    assert np.allclose((found.information * weigh) @ (open_twists / found.lever), 0, atol=1e-9)
    assert np.allclose((found.covariance / weigh) @ (open_twists / found.lever), 0, atol=1e-9)


def test_a_twist_falls_into_a_part_that_is_open_and_one_that_is_not(half_open, same_span, rng):
    found, *_, known, open_twists = half_open
    assert same_span(found.observable / found.lever, known / found.lever)
    a, b = rng.normal(size=2), rng.normal(size=4)
    twist = open_twists @ a + known @ b
    scale = found.lever[:, 0]
    assert np.allclose(found.open_part(twist) / scale, open_twists @ a / scale, atol=1e-9)
    assert np.allclose(found.open_part(found.open_part(twist)) / scale, open_twists @ a / scale, atol=1e-9)


def test_the_least_share_decides(rng):
    Q = np.linalg.qr(rng.normal(size=(6, 6)))[0]
    hold = (Q * [1e-4, 2e-3, 0.1, 0.5, 0.7, 1.0]) @ Q.T
    for least, open_directions in ((1e-5, 0), (1e-3, 1), (0.01, 2), (0.6, 4)):
        assert split(hold, hold, hold, np.zeros(3), 1.0, least).unobservable.shape == (6, open_directions)


@pytest.mark.parametrize("broken", range(3))
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_not_finite_leaves_all_open(broken, value):
    matrices = [np.eye(6) for _ in range(3)]
    matrices[broken][1, 2] = value
    assert_all_open(split(*matrices, np.zeros(3), 1.0, 1e-3))


@pytest.mark.parametrize(("hold", "length"), [(np.zeros((6, 6)), 1.0), (np.eye(6), 0.0)])
def test_without_any_hold_all_is_open(hold, length):
    assert_all_open(split(np.eye(6), np.eye(6), hold, np.zeros(3), length, 1e-3))


def assert_all_open(found):
    assert np.array_equal(found.unobservable, np.eye(6))
    assert not found.information.any()
    assert not found.covariance.any()
    assert not found.hold.any()
    assert found.length == 1  # the unit's own: there is none to compare with
    assert len(freedoms(found)) == 6


# ------------------------------------------------------------------------------------------- where not all is free


@pytest.fixture(params=[0.01, 1.0, 1000.0])
def confined(request, rng):
    """A, S and hold (6, 6), the free twists (6, 3), neither orthogonal nor of one size, a zero column, the length."""
    length = request.param
    weigh = np.outer(1 / lever_of(length), 1 / lever_of(length))
    A, S, hold = (random_information(rng) * weigh for _ in range(3))
    free = rng.normal(size=(6, 3)) * [1.0, 5.0, 0.2] * lever_of(length)[:, None]
    return A, S, hold, np.c_[free, np.zeros(6)], length


def test_the_covariance_is_the_sandwich_of_what_is_free(confined):
    """As if the pose were made of the free twists alone: zero along all that is locked, in both."""
    A, S, hold, free, length = confined
    found = split(A, S, hold, np.zeros(3), length, 1e-9, free)
    weigh, B = found.lever * found.lever.T, free[:, :3]
    undo = np.linalg.inv(B.T @ A @ B)
    expected = B @ undo @ (B.T @ S @ B) @ undo @ B.T
    assert np.allclose(found.covariance / weigh, expected / weigh, rtol=1e-7, atol=1e-12)
    assert np.allclose(found.information * weigh, np.linalg.pinv(expected / weigh, rcond=1e-10), rtol=1e-6, atol=1e-9)
    locked = np.linalg.svd((B / found.lever).T)[2][3:].T  # across all that is free, turns and shifts made comparable
    assert np.allclose((found.covariance / weigh) @ locked, 0, atol=1e-12)
    assert np.allclose((found.information * weigh) @ locked, 0, atol=1e-9)


def test_what_is_locked_is_neither_known_nor_open(confined, same_span):
    A, S, hold, free, length = confined
    found = split(A, S, hold, np.zeros(3), length, 1e-9, free)
    assert found.unobservable.shape == (6, 0)
    assert same_span(found.observable / found.lever, free[:, :3] / found.lever)
    assert len(found.hold) == 3
    assert freedoms(found) == ()


def test_the_twists_that_say_what_is_free_may_be_any_that_span_it(confined, rng):
    A, S, hold, free, length = confined
    mixed = free[:, :3] @ rng.normal(size=(3, 5))
    one, other = (split(A, S, hold, np.zeros(3), length, 1e-9, columns) for columns in (free, mixed))
    weigh = one.lever * one.lever.T
    assert np.allclose(one.covariance / weigh, other.covariance / weigh, rtol=1e-6, atol=1e-10)
    assert np.allclose(one.hold, other.hold)


def test_all_that_is_free_is_as_none_said(rng):
    A, S, hold = (random_information(rng) for _ in range(3))
    one, other = split(A, S, hold, np.zeros(3), 1.0, 1e-9), split(A, S, hold, np.zeros(3), 1.0, 1e-9, np.eye(6))
    assert np.allclose(one.covariance, other.covariance)
    assert np.allclose(one.hold, other.hold)


@pytest.mark.parametrize("names", [("rz",), ("x", "y"), ("rz", "x", "y", "z")], ids=" ".join)
def test_locked_coordinates_have_zeros(names, rng):
    mask = fa.Dof(names).mask
    A, S, hold = (random_information(rng) for _ in range(3))
    found = split(A, S, hold, np.zeros(3), 1.0, 1e-9, np.diag(mask))
    for matrix in (found.covariance, found.information):
        assert np.abs(matrix[mask == 0]).max() < 1e-12
        assert np.abs(matrix[:, mask == 0]).max() < 1e-12
        assert np.linalg.matrix_rank(matrix) == len(names)


def test_the_hold_is_a_share_of_what_holds_the_best_of_all(rng):
    """Also of what is locked: a turn of a pole is not well held because nothing else is free to compare it with."""
    hold = np.diag([1e-5, 1.0, 1.0, 0.1, 0.5, 0.2])
    found = split(hold, hold, hold, np.zeros(3), 1.0, MIN_HOLD, np.diag([1.0, 0, 0, 1, 0, 0]))
    assert np.allclose(found.hold, [1e-5, 0.1])
    assert np.allclose(np.abs(found.unobservable), [[1], [0], [0], [0], [0], [0]])
    assert np.allclose(np.diag(found.covariance), [0, 0, 0, 10, 0, 0])
    (freedom,) = freedoms(found)
    assert freedom.kind == "turn"
    assert np.allclose(np.abs(freedom.axis), [1, 0, 0])


def test_what_is_open_but_locked_is_no_freedom():
    hold = np.diag([1e-5, 1.0, 1.0, 0.1, 0.5, 1e-6])
    found = split(hold, hold, hold, np.zeros(3), 1.0, MIN_HOLD, np.diag([0, 1.0, 0, 1, 0, 0]))
    assert found.unobservable.shape == (6, 0)
    assert freedoms(found) == ()
    only = split(hold, hold, hold, np.zeros(3), 1.0, MIN_HOLD, np.diag([1.0, 0, 0, 0, 0, 0]))
    assert not only.covariance.any()
    assert not only.information.any()
    assert only.observable.shape == (6, 0)
    assert [freedom.kind for freedom in freedoms(only)] == ["turn"]


def test_without_any_hold_what_is_locked_is_still_not_open():
    found = split(np.eye(6), np.eye(6), np.zeros((6, 6)), np.zeros(3), 1.0, 1e-3, np.diag([0, 0, 1.0, 1, 0, 0]))
    assert found.unobservable.shape == (6, 2)
    assert sorted(freedom.kind for freedom in freedoms(found)) == ["slide", "turn"]


# ----------------------------------------------------------------------------------------------------------- freedoms


def plane(rng):
    return rng.uniform(-1, 1, (400, 3)) * [1, 1, 0], np.tile([0, 0, 1.0], (400, 1))


def ball(rng):
    normals = rng.normal(size=(400, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    normals[:, 2] = np.abs(normals[:, 2])  # half of it, so that its centre is not the middle of the points
    return normals, normals


def tube(rng):
    angle = rng.uniform(0, np.pi, 400)  # half of it, as well
    normals = np.c_[np.cos(angle), np.sin(angle), 0 * angle]
    return normals + rng.uniform(-2, 2, (400, 1)) * [0, 0, 1], normals


def corridor(rng):
    walls = np.repeat([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]], 100, axis=0)
    along = np.cross(walls, [0, 0, 1.0])
    return walls + rng.uniform(-1, 1, (400, 1)) * along + rng.uniform(-5, 5, (400, 1)) * [0, 0, 1], walls


def room(rng):
    normals = np.repeat(np.eye(3), 150, axis=0)
    return rng.uniform(0, 2, (450, 3)) * (1 - normals), normals


SHAPES = {plane: ["slide", "slide", "turn"], ball: 3 * ["turn"], tube: ["slide", "turn"], corridor: ["slide"],
          room: []}


@pytest.fixture(params=SHAPES, ids=lambda shape: shape.__name__)
def shape(request):
    return request.param


def known_of(shape, W, rng, unit=1.0):
    """What exact planes of a shape, moved by W, tell of a pose, about their centroid."""
    points, normals = shape(rng)
    points, normals = unit * apply(W, points), normals @ W[:3, :3].T
    reference = points.mean(axis=0)
    J = np.c_[np.cross(points - reference, normals), normals]
    length = np.linalg.norm(np.ptp(points, axis=0)) / 4
    return split(J.T @ J, J.T @ J, J.T @ J, reference, length, MIN_HOLD)


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e4])
def test_the_freedoms_of_shapes(any_motion, rng, shape, unit):
    """Slides along and turns about what the shape says, in the frame that it was moved to."""
    W = any_motion(rng, 5.0)
    found = freedoms(known_of(shape, W, rng, unit))
    assert sorted(freedom.kind for freedom in found) == SHAPES[shape]
    centre, up = unit * W[:3, 3], W[:3, 2]
    for freedom in found:
        assert np.linalg.norm(freedom.axis) == pytest.approx(1)
        aside = np.cross(freedom.axis, freedom.point - centre)  # how far its line passes by the centre
        if shape is plane:
            assert abs(freedom.axis @ up) == pytest.approx(1.0 if freedom.kind == "turn" else 0.0, abs=1e-6)
        elif shape is ball:
            assert np.linalg.norm(aside) < 1e-6 * unit
        else:
            assert abs(freedom.axis @ up) == pytest.approx(1, abs=1e-9)
            assert freedom.kind == "slide" or np.linalg.norm(aside) < 1e-6 * unit
    axes = [freedom.axis for freedom in found if freedom.kind == "slide"] if shape is plane else []
    assert len(axes) < 2 or abs(axes[0] @ axes[1]) < 1e-9


def twist_of(freedom):
    """Of a turn by a radian, or a shift by 1, about the freedom's own point."""
    none = np.zeros(3)
    return np.r_[freedom.axis, none] if freedom.kind == "turn" else np.r_[none, freedom.axis]


def test_a_freedom_moves_the_surface_into_itself(any_motion, rng, shape):
    """Each, turned by half a radian or shifted by half of the size: the points stay on their shape."""
    W = any_motion(rng, 5.0)
    distance = {plane: lambda x: x[:, 2], ball: lambda x: np.linalg.norm(x, axis=1) - 1,
                tube: lambda x: np.linalg.norm(x[:, :2], axis=1) - 1,
                corridor: lambda x: np.abs(x[:, :2]).max(axis=1) - 1, room: lambda x: x.min(axis=1)}[shape]
    points, _ = shape(np.random.default_rng(1))
    for freedom in freedoms(known_of(shape, W, rng)):
        about = translation(freedom.point) @ exp_twist(0.5 * twist_of(freedom)) @ translation(-freedom.point)
        moved = apply(inverse(W) @ about @ W, points)
        assert np.abs(distance(moved)).max() < 1e-6
        assert np.abs(moved - points).max() > 0.1


def test_the_unobservable_directions_are_those_of_the_freedoms(any_motion, rng, shape, same_span):
    """As twists about the reference point, a turn about a line elsewhere is a turn and a shift."""
    known = known_of(shape, any_motion(rng, 5.0), rng)
    twists = [adjoint(translation(freedom.point - known.reference_point)) @ twist_of(freedom)
              for freedom in freedoms(known)]
    assert same_span(known.unobservable, np.reshape(twists, (-1, 6)).T)


def test_a_slide_that_noise_bends_is_a_slide(rng):
    """Of a plane whose points are rough the open twists turn a little."""
    points, normals = plane(rng)
    normals = normals + 0.01 * rng.normal(size=(400, 3))
    J = np.c_[np.cross(points, normals), normals]
    found = freedoms(split(J.T @ J, J.T @ J, J.T @ J, np.zeros(3), 0.7, MIN_HOLD))
    assert sorted(freedom.kind for freedom in found) == SHAPES[plane]


# ------------------------------------------------------------------------------------------------------- a growth


@pytest.mark.parametrize("length", [0.01, 1.0, 1000.0])
def test_seven_freedoms_are_a_sandwich_too(rng, length):
    M = rng.normal(size=(3, 7, 10))
    lever = np.r_[lever_of(length), 1]
    weigh = np.outer(1 / lever, 1 / lever)
    A, S, hold = (m @ m.T * weigh for m in M)
    found = split(A, S, hold, np.zeros(3), length, 1e-9)
    assert np.array_equal(found.lever[:, 0], lever)
    assert np.allclose(found.covariance * weigh, np.linalg.inv(A / weigh) @ (S / weigh) @ np.linalg.inv(A / weigh))
    assert np.allclose(found.covariance @ found.information, np.eye(7), atol=1e-6)
    assert found.unobservable.shape == (7, 0)
    assert len(found.hold) == 7


def grown_of(shape, W, rng, unit=1.0):
    """As known_of, with a growth about the centroid."""
    points, normals = shape(rng)
    points, normals = unit * apply(W, points), normals @ W[:3, :3].T
    reference = points.mean(axis=0)
    away = points - reference
    J = np.c_[np.cross(away, normals), normals, (away * normals).sum(axis=1)]
    length = np.linalg.norm(np.ptp(points, axis=0)) / 4
    return split(J.T @ J, J.T @ J, J.T @ J, reference, length, MIN_HOLD)


def cone(rng):
    turn, height = rng.uniform(0, 2 * np.pi, 400), rng.uniform(0.2, 1, (400, 1))
    out = np.c_[np.cos(turn), np.sin(turn), 0 * turn]
    return height * (out + [0, 0, 1]), (out - [0, 0, 1]) / np.sqrt(2)


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e4])
def test_what_is_of_any_size_grows_about_its_own_place(any_motion, rng, shape, unit):
    """A plane about any place in it, a room's corner about the corner; a ball, a tube and a corridor have one size."""
    W = any_motion(rng, 5.0)
    found = freedoms(grown_of(shape, W, rng, unit))
    grows = shape in (plane, room)
    assert sorted(freedom.kind for freedom in found) == ["grow"] * grows + SHAPES[shape]
    if grows:
        away = inverse(W) @ np.r_[found[0].point / unit, 1]
        assert np.abs(away[:3] * ([0, 0, 1] if shape is plane else 1)).max() < 1e-6
        assert found[0].kind == "grow"


def test_a_cone_grows_about_its_tip_and_turns_about_its_axis(any_motion, rng):
    W = any_motion(rng, 5.0)
    grow, turn = freedoms(grown_of(cone, W, rng))
    assert (grow.kind, turn.kind) == ("grow", "turn")
    assert np.linalg.norm(np.cross(turn.axis, W[:3, 2])) < 1e-6
    assert np.linalg.norm(np.cross(turn.axis, turn.point - W[:3, 3])) < 1e-6
    tip = inverse(W) @ np.r_[grow.point, 1]
    assert np.abs(tip[:3]).max() < 1e-5


def test_seven_without_any_hold_are_all_open():
    found = split(np.eye(7), np.eye(7), np.zeros((7, 7)), np.zeros(3), 1.0, 1e-3)
    assert np.array_equal(found.unobservable, np.eye(7))
    assert sorted(freedom.kind for freedom in freedoms(found)) == ["grow", *3 * ["slide"], *3 * ["turn"]]


def test_a_growth_that_is_not_free_is_no_freedom(rng):
    """Of a plane that may only turn about itself and grow, and one that may only slide."""
    points, normals = plane(rng)
    J = np.c_[np.cross(points, normals), normals, (points * normals).sum(axis=1)]
    for free, kinds in ((np.eye(7)[:, [2, 6]], ["grow", "turn"]), (np.eye(7)[:, [3]], ["slide"])):
        found = freedoms(split(J.T @ J, J.T @ J, J.T @ J, np.zeros(3), 0.7, MIN_HOLD, free))
        assert sorted(freedom.kind for freedom in found) == kinds


def test_a_freedom_is_told_in_words():
    point, axis = np.array([1, 2.5, -3]), np.array([0, 0.6, -0.8])
    assert str(fa.Freedom("slide", axis, point)) == "slide along (0, 0.6, -0.8)"
    assert str(fa.Freedom("turn", axis, point)) == "turn about (0, 0.6, -0.8) through (1, 2.5, -3)"
    assert str(fa.Freedom("grow", 0 * axis, point)) == "grow about (1, 2.5, -3)"
