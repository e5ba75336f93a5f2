"""Clouds in the plane: scans of a laser that turns, from any pose in SE(2)."""

import time
from functools import lru_cache, partial

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.errors import ArgumentError
from fieldalign.flat import FlatCloud, is_flat, upright

NOISE = 0.01
UTM = np.array([5e6, 4e5])


# -------------------------------------------------------------------------------------------------------------- a world


def se2(x, y, turn):
    """The motion (3, 3) in the plane."""
    c, s = np.cos(turn), np.sin(turn)
    return np.array([[c, -s, x], [s, c, y], [0, 0, 1]])


def moved(T, points):
    return points @ T[:2, :2].T + T[:2, 2]


def outline(corners):
    """The segments (n, 4) of a polygon."""
    corners = np.asarray(corners)
    return np.c_[corners, np.roll(corners, -1, axis=0)]


@lru_cache
def room(seed, boxes=9):
    """Segments (n, 4) of an L-shaped room with boxes in it, and two places (2, 2) that are clear of them."""
    rng = np.random.default_rng(seed)
    w, h = rng.uniform(7, 10), rng.uniform(5, 7)
    a, b = 0.6 * w, 0.65 * h
    segments = [outline([(0, 0), (w, 0), (w, b), (a, b), (a, h), (0, h)])]
    places = np.array([[0.3 * w, 0.4 * h], [0.3 * w, 0.4 * h] + rng.uniform(-0.8, 0.8, 2)])
    while len(segments) <= boxes:
        middle, half = rng.uniform([0.4, 0.4], [w - 0.4, b - 0.4]), rng.uniform(0.1, 0.45, 2)
        if np.linalg.norm(places - middle, axis=1).min() > 1:
            turned = se2(*middle, rng.uniform(0, np.pi))
            segments.append(outline(moved(turned, half * [(-1, -1), (1, -1), (1, 1), (-1, 1)])))
    return np.vstack(segments), places


def scan(segments, place, turn, rng, beams=1080, noise=NOISE):
    """Points (n, 2) in the laser's frame: along each beam the nearest segment."""
    angles = np.linspace(-np.pi, np.pi, beams, endpoint=False)
    d = np.c_[np.cos(angles + turn), np.sin(angles + turn)]
    start, along = segments[:, :2] - place, segments[:, 2:] - segments[:, :2]
    facing = d[:, :1] * along[:, 1] - d[:, 1:] * along[:, 0]
    far = (start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0]) / facing
    share = (start[:, 0] * d[:, 1:] - start[:, 1] * d[:, :1]) / facing
    ranges = np.where((far > 0) & (share >= 0) & (share <= 1), far, np.inf).min(axis=1)
    return (ranges + noise * rng.normal(size=beams))[:, None] * np.c_[np.cos(angles), np.sin(angles)]


@lru_cache
def scans(seed, noise_seed=0, noise=NOISE):
    """Two scans of a room, and T_target_source."""
    segments, places = room(seed)
    rng = np.random.default_rng((seed, noise_seed))
    turns = np.random.default_rng(seed).uniform(-np.pi, np.pi, 2)
    source, target = (scan(segments, p, turn, rng, noise=noise) for p, turn in zip(places, turns, strict=True))
    world = [se2(*p, turn) for p, turn in zip(places, turns, strict=True)]
    return source, target, np.linalg.inv(world[1]) @ world[0]


def dense_map(seed, count=200_000):
    """Points (count, 2) all over the lines of a room."""
    segments, places = room(seed)
    rng = np.random.default_rng(seed)
    lengths = np.linalg.norm(segments[:, 2:] - segments[:, :2], axis=1)
    chosen = segments[rng.choice(len(segments), count, p=lengths / lengths.sum())]
    on = chosen[:, :2] + rng.random((count, 1)) * (chosen[:, 2:] - chosen[:, :2])
    return on + NOISE * rng.normal(size=(count, 2)), places


def error(result, T):
    """Turn (degrees), and shift at the reference point."""
    D, at = T @ np.linalg.inv(result.T_target_source), result.reference_point
    return np.degrees(abs(np.arctan2(D[1, 0], D[0, 0]))), np.linalg.norm(moved(D, at) - at)


def is_right(result, T, degrees=0.3, metres=0.01):
    turned, shifted = error(result, T)
    return result.accepted and turned < degrees and shifted < metres


def squared_error(result, T):
    """In units of the stated covariance: chi^2 with three degrees of freedom where that is right."""
    D, at = T @ np.linalg.inv(result.T_target_source), result.reference_point
    x = np.r_[np.arctan2(D[1, 0], D[0, 0]), moved(D, at) - at]
    return float(x @ result.information @ x)


def bits(result):
    arrays = result.T_target_source, result.information, result.covariance, result.reference_point
    return [a.tobytes() for a in arrays] + [repr(result.evidence)]


# -------------------------------------------------------------------------------------------------------- from any pose


@pytest.mark.parametrize("seed", [0, 1, 2, 3, 5, 6, 7])
def test_the_motion_is_found_from_any_pose(seed, rng):
    source, target, T = scans(seed)
    W = se2(*rng.uniform(-20, 20, 2), rng.uniform(-np.pi, np.pi))
    assert is_right(fa.register(source, target), T)
    assert is_right(fa.register(source, moved(W, target)), W @ T)


def test_the_answer_is_one_in_the_plane():
    source, target, _ = scans(0)
    result = fa.register(source, target)
    shapes = {"T_target_source": (3, 3), "information": (3, 3), "covariance": (3, 3), "unobservable": (3, 0),
              "reference_point": (2,)}
    for name, shape in shapes.items():
        assert getattr(result, name).shape == shape
    R = result.T_target_source[:2, :2]
    assert np.abs(R @ R.T - np.eye(2)).max() < 1e-14
    assert np.linalg.det(R) == pytest.approx(1)
    assert np.array_equal(result.T_target_source[2], [0, 0, 1])
    assert np.allclose(result.covariance @ result.information, np.eye(3), atol=1e-6)
    assert np.linalg.eigvalsh(result.covariance).min() > 0
    assert result.freedoms == ()
    assert result.dropped == (0, 0)
    assert np.array_equal(result.to_dict()["T_target_source"], result.T_target_source)
    assert "accepted=True" in repr(result)


def test_the_reference_point_lies_in_the_overlap():
    source, target, _ = scans(0)
    at = fa.register(source, target).reference_point
    assert (target.min(axis=0) < at).all()
    assert (at < target.max(axis=0)).all()


@pytest.mark.slow
def test_errors_are_as_large_as_the_covariance_says():
    """16 rooms: the mean of so many chi^2 with three freedoms is 3, give or take 0.6."""
    errors = [squared_error(fa.register(*scans(seed)[:2], init=scans(seed)[2]), scans(seed)[2]) for seed in range(16)]
    assert 1 < np.mean(errors) < 8
    assert 0.7 < np.median(errors) < 5
    assert max(errors) < 40


@pytest.mark.slow
def test_the_same_room_again_and_again_scatters_as_the_covariance_says():
    found = [scans(1, noise_seed=k) for k in range(12)]
    errors = [squared_error(fa.register(source, target, init=T), T) for source, target, T in found]
    assert 1 < np.mean(errors) < 8


def test_more_noise_is_less_information():
    spread = []
    for noise in (0.005, 0.02):
        source, target, T = scans(2, noise=noise)
        spread.append(np.diag(fa.register(source, target, init=T).covariance))
    ratio = np.sqrt(spread[1] / spread[0])
    assert (ratio > 1.5).all()
    assert (ratio < 10).all()


# --------------------------------------------------------------------------------------------------------------- copies


@pytest.mark.parametrize("far", [0.0, 1000.0])
@pytest.mark.parametrize("permuted", [False, True])
def test_copies_meet_to_the_last_digits(far, permuted, rng):
    source, *_ = scans(0)
    T = se2(far, -0.5 * far + 1, 2.5)
    target = moved(T, source)
    result = fa.register(source, rng.permutation(target) if permuted else target)
    turned, shifted = error(result, T)
    assert result.accepted
    assert turned < 1e-6
    assert shifted < 1e-9 * (1 + far)


def test_a_cloud_lies_on_itself():
    source, *_ = scans(0)
    result = fa.register(source, source)
    assert result.accepted
    assert np.abs(result.T_target_source - np.eye(3)).max() < 1e-12


# ------------------------------------------------------------------------------------------------------------- freedoms


@pytest.mark.parametrize("dof", ["yaw", "x y", "x", "rz y", "planar"])
def test_less_can_be_free(dof, rng):
    source, target, truth = scans(0)
    mask = fa.Dof(dof).mask[[2, 3, 4]]
    T = se2(*(rng.uniform(-5, 5, 2) * mask[1:]), 2.0 * mask[0])
    for init in (None, se2(1, 2, -2.5)):
        wanted = T if init is None else T @ init
        result = fa.register(moved(np.linalg.inv(wanted) @ truth, source), target, dof=dof, init=init, search=True)
        assert is_right(result, wanted)
        D = result.T_target_source @ (np.eye(3) if init is None else np.linalg.inv(init))
        parts = np.r_[np.arctan2(D[1, 0], D[0, 0]), D[:2, 2]]
        assert np.abs(parts[mask == 0]).max(initial=0) < 1e-12
        assert np.linalg.matrix_rank(result.covariance, tol=1e-6 * np.abs(result.covariance).max()) == mask.sum()


def test_a_turn_about_a_centre():
    source, target, truth = scans(0)
    to = se2(2, -1, 0)
    T = to @ se2(0, 0, 2.2) @ np.linalg.inv(to)
    result = fa.register(moved(np.linalg.inv(T) @ truth, source), target, dof=fa.Dof("yaw", centre=[2, -1, 0]))
    assert is_right(result, T)
    assert np.abs(moved(result.T_target_source, np.array([[2.0, -1]])) - [2, -1]).max() < 1e-13


def test_all_of_the_plane_is_as_none():
    source, target, _ = scans(0)
    one = bits(fa.register(source, target))
    for dof in ("planar", "rz x y", "rx ry rz x y z"):
        assert bits(fa.register(source, target, dof=dof)) == one


def test_a_circle_turns_about_itself(rng):
    circles = (np.exp(1j * rng.uniform(0, 2 * np.pi, 800)) for _ in range(2))
    source, target = (np.c_[c.real, c.imag] + [3, 4] + 0.0005 * rng.normal(size=(800, 2)) for c in circles)
    result = fa.register(source, target)
    assert result.reason is fa.Reason.DEGENERATE
    assert result.unobservable.shape == (3, 1)
    (freedom,) = result.freedoms
    assert freedom.kind == "turn"
    assert np.abs(freedom.point[:2] - [3, 4]).max() < 0.03
    assert freedom.point[2] == 0


def two_walls(rng):
    walls = np.c_[rng.uniform(-5, 5, 1500), rng.choice([-1.0, 1], 1500)]
    return walls + 0.003 * rng.normal(size=walls.shape)


def test_a_corridor_slides_along_itself(rng):
    result = fa.register(two_walls(rng), two_walls(rng))
    assert result.reason is fa.Reason.DEGENERATE
    (freedom,) = result.freedoms
    assert freedom.kind == "slide"
    assert result.unobservable.shape == (3, 1)
    angle = np.arctan2(*result.T_target_source[1::-1, 0])
    assert abs(np.sin(angle)) < 0.01
    assert abs(freedom.axis[0]) == pytest.approx(1, abs=1e-3)


@pytest.mark.parametrize(
    "noise",
    [0.001, 0.003, pytest.param(0.01, marks=pytest.mark.xfail(strict=True, reason="a known weakness: docs/fields.md"))],
)
def test_a_laser_in_an_endless_corridor_is_not_sure_where_it_is(noise):
    """It sees ten metres of bare walls, as two scans that are a metre apart do: from a guess 0.3 m off along it."""
    segments, T = np.array([[-40, -1, 40, -1.0], [-40, 1, 40, 1.0]]), se2(1, 0.1, 0.2)
    for seed in range(4):
        rng = np.random.default_rng(seed)
        source, target = (scan(segments, p[:2], p[2], rng, noise=noise) for p in ([0, 0, 0.1], [1, 0.1, 0.2]))
        source, target = (points[np.linalg.norm(points, axis=1) < 10] for points in (source, target))
        result = fa.register(source, target, init=np.linalg.inv(T) @ se2(0.3, 0, 0.1))
        assert not result.accepted


def test_a_slide_stays_as_in_the_guess(rng):
    T = se2(0.02, 0.05, 0.01)
    init = se2(0.5, 0, 0)
    result = fa.register(moved(np.linalg.inv(T), two_walls(rng)), two_walls(rng), init=init)
    assert result.reason is fa.Reason.DEGENERATE
    assert result.T_target_source[0, 2] == pytest.approx(0.5, abs=0.01)
    assert result.T_target_source[1, 2] == pytest.approx(0.05, abs=0.005)


# -------------------------------------------------------------------------------------------------------------- a guess


def test_near_a_guess_nothing_is_searched():
    source, target, T = scans(0)
    result = fa.register(source, target, init=T @ se2(0.1, -0.1, 0.1))
    assert is_right(result, T)
    assert result.reason is fa.Reason.ACCEPTED_NEAR_INIT


def test_around_a_guess_is_searched():
    source, target, T = scans(0)
    result = fa.register(source, target, init=T @ se2(0.5, -0.5, 0.6), search_radius=2.0, search_angle=60.0)
    assert is_right(result, T)


def test_a_guess_may_be_a_list_or_have_few_digits():
    source, target, T = scans(0)
    for init in (T.tolist(), np.round(T, 4)):
        assert is_right(fa.register(source, target, init=init), T)


def test_a_motion_in_the_plane_stands_up():
    T = se2(1, 2, 0.3)
    lifted = upright(T, "init")
    assert np.array_equal(lifted[np.ix_([0, 1, 3], [0, 1, 3])], T)
    assert np.allclose(lifted[2], [0, 0, 1, 0], rtol=0, atol=1e-15)
    scaled = upright(T @ np.diag([3, 3, 1]), "init")
    assert np.linalg.det(scaled[:3, :3]) == pytest.approx(27)


@pytest.mark.parametrize(
    ("init", "word"),
    [
        (np.eye(4), r"\(3, 3\) matrix for clouds in the plane, but has shape \(4, 4\)"),
        (np.eye(2), r"\(3, 3\) matrix"),
        (np.diag([1, -1, 1]), "rigid"),
        (np.diag([2, 2, 1]), "rigid"),
        (np.diag([1, 1, 2]), "row"),
        (np.full((3, 3), np.nan), "finite"),
        ("pose", "numbers"),
        ([[1, 2], [3]], "numbers"),
    ],
    ids=str,
)
def test_a_guess_that_is_no_motion_in_the_plane_is_refused(init, word):
    with pytest.raises(ArgumentError, match=f"^init must.*{word}"):
        fa.register(*scans(0)[:2], init=init)


# ---------------------------------------------------------------------------------------------------------- the verdict


def test_a_true_pose_is_verified_and_a_wrong_one_is_not():
    source, target, T = scans(0)
    right = fa.verify(source, target, T)
    assert right.accepted
    assert np.allclose(right.T_target_source, T, rtol=0, atol=1e-15)
    assert right.covariance.shape == right.information.shape == (3, 3)
    assert squared_error(right, T) < 1e-15
    assert not fa.verify(source, target, T @ se2(0.5, 0.2, 0.2)).accepted
    assert fa.verify(source, target, T, search=False).reason is fa.Reason.ACCEPTED_NEAR_INIT


def test_a_pose_to_verify_is_one_in_the_plane():
    with pytest.raises(ArgumentError, match=r"^T_target_source must be a \(3, 3\) matrix for clouds in the plane"):
        fa.verify(*scans(0)[:2], np.eye(4))
    with pytest.raises(ArgumentError, match=r"^T_target_source must be rigid"):
        fa.verify(*scans(0)[:2], np.diag([2, 2, 1]))


@pytest.mark.parametrize("seed", range(6))
def test_two_rooms_are_not_one(seed):
    assert not fa.register(scans(seed)[0], scans(seed + 1)[1]).accepted


def test_a_square_fits_onto_itself_in_four_ways(rng):
    side = rng.uniform(-1, 1, (4, 300))
    corners = np.r_[np.c_[side[0], 0 * side[0] + 1], np.c_[side[1], 0 * side[1] - 1], np.c_[0 * side[2] + 1, side[2]],
                    np.c_[0 * side[3] - 1, side[3]]]
    result = fa.register(corners[::2], corners[1::2])
    assert result.reason is fa.Reason.AMBIGUOUS
    assert all(other.T_target_source.shape == (3, 3) for other in result.alternatives)
    assert all(other.covariance.shape == (3, 3) for other in result.alternatives)
    assert len(result.alternatives) == 3


# -------------------------------------------------------------------------------------------------- clouds of all sorts


@pytest.mark.parametrize(
    "options", [{}, {"init": scans(0)[2]}, {"dof": "x y", "init": scans(0)[2]}, {"method": "paper"}],
    ids=["searched", "from a guess", "dof", "paper"],
)
def test_the_seed_and_nothing_else_decides(options):
    source, target, _ = scans(0)
    one = bits(fa.register(source, target, threads=1, **options))
    for threads in (1, 2, 3, 8, None):
        assert bits(fa.register(source, target, threads=threads, **options)) == one


def test_prepared_clouds_are_clouds():
    source, target, _ = scans(0)
    one, ready = bits(fa.register(source, target)), fa.prepare(target)
    assert isinstance(ready, FlatCloud)
    assert fa.prepare(ready) is ready
    assert np.array_equal(ready.points, target)
    for _ in range(2):
        assert bits(fa.register(source, ready)) == bits(fa.register(fa.prepare(source), ready)) == one


def test_what_a_cloud_was_used_for_before_leaves_no_trace():
    source, target, _ = scans(0)
    ready = fa.prepare(target)
    for partner in (0.2 * source, 5 * source, source[::10]):
        fa.register(partner, ready)
    assert bits(fa.register(source, ready)) == bits(fa.register(source, target))


def test_missing_returns_are_dropped_and_counted():
    source, target, _ = scans(0)
    gaps = np.array([[np.nan, 0], [1, np.nan], [np.nan, np.nan]])
    result = fa.register(np.r_[gaps, source], np.r_[target, gaps[:1]])
    assert result.dropped == (3, 1)
    assert np.array_equal(result.T_target_source, fa.register(source, target).T_target_source)
    with pytest.raises(ArgumentError, match=r"^source must be finite, but 3 rows"):
        fa.register(np.r_[gaps, source], target, drop_nonfinite=False)


def test_lists_and_other_layouts_are_clouds():
    source, target, _ = scans(0)
    one = bits(fa.register(source, target))
    assert bits(fa.register(source.tolist(), np.asfortranarray(target))) == one
    for cloud in (source, target):
        cloud.flags.writeable = False
    assert bits(fa.register(source, target)) == one


@pytest.mark.parametrize("cloud", [np.zeros((5, 2)), [[1, 2], [3, 4]], np.zeros((0, 2))])
def test_two_columns_are_a_cloud_in_the_plane(cloud):
    assert is_flat(cloud)


@pytest.mark.parametrize(
    "cloud", [np.zeros((5, 3)), np.zeros(2), [[1, 2], [3]], None, "scan.ply", fa.PointCloud(np.eye(3))], ids=str
)
def test_nothing_else_is(cloud):
    assert not is_flat(cloud)


@pytest.mark.parametrize("factor", [1000.0, 1e-3, 0.3048])
def test_the_unit_does_not_matter(factor):
    source, target, _ = scans(0)
    here, there = fa.register(source, target), fa.register(factor * source, factor * target)
    assert there.reason is here.reason
    assert np.abs(there.T_target_source[:2, :2] - here.T_target_source[:2, :2]).max() < 1e-6
    assert np.abs(there.T_target_source[:2, 2] / factor - here.T_target_source[:2, 2]).max() < 1e-5
    lever = np.array([1, factor, factor])
    assert np.allclose(there.information * np.outer(lever, lever), here.information, rtol=0.02,
                       atol=0.01 * np.abs(here.information).max())


@pytest.mark.parametrize("far", [100.0, 1e4])
def test_the_worlds_place_does_not_matter(far):
    source, target, _ = scans(0)
    F = se2(far, -far, 0)
    found = fa.register(moved(F, source), moved(F, target))
    here = np.linalg.inv(F) @ found.T_target_source @ F
    assert found.accepted
    assert np.abs(here - fa.register(source, target).T_target_source).max() < 1e-5


def test_far_from_the_origin_as_much_is_known():
    source, target, _ = scans(0)
    here, there = fa.register(source, target), fa.register(source + UTM / 50, target + UTM / 50)
    assert np.allclose(there.covariance, here.covariance, rtol=0.01, atol=0.01 * here.covariance.max())


@pytest.mark.parametrize("guessed", [False, True])
def test_coordinates_of_utm_size(guessed):
    source, target, T = scans(0)
    F = se2(*UTM, 0)
    init = F @ T @ se2(0.05, 0.05, 0.05) @ np.linalg.inv(F) if guessed else None
    result = fa.register(source + UTM, target + UTM, init=init)
    here = np.linalg.inv(F) @ result.T_target_source @ F
    assert result.accepted
    assert np.abs(here - T).max() < 0.01


def test_swapped_clouds_give_the_inverse():
    source, target, _ = scans(0)
    there, back = fa.register(source, target), fa.register(target, source)
    D = np.linalg.inv(back.T_target_source) @ np.linalg.inv(there.T_target_source)
    at = there.reference_point
    x = np.r_[np.arctan2(D[1, 0], D[0, 0]), moved(D, at) - at]
    assert x @ np.linalg.inv(2 * there.covariance) @ x < 14.2  # 0.9973 quantile of chi^2 with three freedoms


def test_permuted_points_change_little(rng):
    source, target, _ = scans(0)
    one, other = fa.register(source, target), fa.register(rng.permutation(source), rng.permutation(target))
    assert squared_error(one, other.T_target_source) < 2 * 14.2


@pytest.mark.parametrize("count", [3, 4, 10, 30])
def test_few_points_are_an_answer_and_never_accepted(count, rng):
    source, target = rng.random((2, count, 2))
    result = fa.register(source, target)
    assert result.T_target_source.shape == (3, 3)
    assert not result.accepted


@pytest.mark.slow
def test_a_dense_map_takes_no_long_time():
    """200,000 points, and a scan in it; and half of the map on the other half."""
    seed = 3
    points, places = dense_map(seed)
    T = se2(*places[0], 0.7)
    source = scan(room(seed)[0], places[0], 0.7, np.random.default_rng(1))
    start = time.perf_counter()
    result = fa.register(source, points)
    halves = fa.register(points[::2], moved(se2(1, 2, 2.0), points[1::2]))
    assert time.perf_counter() - start < 4
    assert is_right(result, T)
    assert is_right(halves, se2(1, 2, 2.0))


# --------------------------------------------------------------------------------------------------- the paper's method


def test_the_papers_method_works_in_the_plane_too():
    source, target, T = scans(0)
    result = fa.register(source, target, method="paper", init=T @ se2(0.1, -0.1, 0.2))
    turned, shifted = error(result, T)
    assert result.accepted
    assert turned < 0.5
    assert shifted < 0.02
    assert result.T_target_source.shape == result.covariance.shape == (3, 3)
    assert fa.register(source, target, method="paper", init=T, dof="x y").accepted


# ------------------------------------------------------------------------------------------------------------ the scale


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 2])
def test_the_scale_is_right_where_it_is_accepted(seed):
    source, target, T = scans(seed)
    result = fa.register(0.4 * source, target, scale=True)
    assert result.T_target_source.shape == (3, 3)
    assert result.information.shape == result.covariance.shape == (4, 4)
    assert result.unobservable.shape[0] == 4
    D = T @ np.diag([2.5, 2.5, 1]) @ np.linalg.inv(result.T_target_source)
    at = result.reference_point
    is_right = abs(np.sqrt(np.linalg.det(D[:2, :2])) - 1) < 0.005 and np.linalg.norm(moved(D, at) - at) < 0.02
    assert is_right or not result.accepted


def test_the_scale_from_a_guess():
    source, target, T = scans(0)
    S = T @ np.diag([2.5, 2.5, 1])
    result = fa.register(0.4 * source, target, scale=True, init=S @ np.diag([1.03, 1.03, 1]))
    assert result.accepted
    assert np.sqrt(np.linalg.det(result.T_target_source[:2, :2])) == pytest.approx(2.5, rel=0.005)
    assert np.abs(result.T_target_source - S).max() < 0.03


# --------------------------------------------------------------------------------------------------------------- errors


def test_one_in_the_plane_and_one_in_space_are_refused(corner):
    source, *_ = scans(0)
    with pytest.raises(ArgumentError, match=r"^target must have shape \(N, 3\), as source is no cloud in the plane"):
        fa.register(corner, source)
    for flat in (source, fa.prepare(source)):
        for solid in (corner, fa.prepare(corner), fa.PointCloud(corner)):
            with pytest.raises(ArgumentError, match=r"^source must have shape \(N, 3\)"):
                fa.register(flat, solid)
            with pytest.raises(ArgumentError, match=r"^target must have shape \(N, 3\)"):
                fa.verify(solid, flat, np.eye(3))


@pytest.mark.parametrize("dof", ["levelled", "z", "rx", fa.Dof("yaw", axis=[0, 0, 1])], ids=str)
def test_what_the_plane_does_not_have_is_not_free(dof):
    with pytest.raises(ArgumentError, match=r"^dof of clouds in the plane must be among rz, x, y"):
        fa.register(*scans(0)[:2], dof=dof)


@pytest.mark.parametrize(
    ("points", "word"),
    [
        (np.zeros((0, 2)), "distinct"),
        (np.ones((9, 2)), "distinct"),
        (np.full((9, 2), np.nan), "distinct"),
        (np.array([[0, 0], [1, 0], [np.inf, 1]]), "finite"),
        (1e300 * np.eye(3)[:, :2], "below"),
        (np.eye(3)[:, :2] + 1j, "real"),
        (np.full((5, 2), "a"), "numbers"),
    ],
    ids=["empty", "one point", "NaN", "inf", "huge", "complex", "words"],
)
@pytest.mark.parametrize("name", ["source", "target"])
def test_an_error_names_the_cloud(name, points, word):
    flat = scans(0)[0]
    for register in (fa.register, partial(fa.register, method="paper")):
        with pytest.raises(ArgumentError, match=f"^{name} must.*{word}"):
            register(**{"source": flat, "target": flat, name: points})


def test_a_line_is_degenerate_and_no_error(rng):
    line = np.c_[rng.uniform(0, 5, 500), np.zeros(500)]
    result = fa.register(line, line[::2])
    assert result.reason is fa.Reason.DEGENERATE
