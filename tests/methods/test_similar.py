"""The scale as a seventh freedom: a similarity from any pose and size, how well it is known, and when it is not."""

from functools import lru_cache

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

import fieldalign as fa
from fieldalign.clouds.simulated import simulate_pair
from fieldalign.errors import ArgumentError
from fieldalign.evaluation import rotation_error
from fieldalign.fields import MeshField
from fieldalign.motions import exp_twist, growth, size_of, translation

FACTORS = pytest.mark.parametrize("factor", [1000.0, 0.37])


@lru_cache
def scans(seed=3, points=8000):
    pair = simulate_pair(seed, points)
    return pair.source.points, pair.target.points, pair.T_target_source


def posed(S, seed=3):
    """The pair, its source moved and scaled so that the true similarity is S."""
    source, target, truth = scans(seed)
    return apply_similar(np.linalg.inv(S) @ truth, source), target


def apply_similar(S, points):
    return points @ S[:3, :3].T + S[:3, 3]


def any_similarity(rng, size, turn=2.5):
    w = rng.normal(size=3)
    return exp_twist(np.r_[turn * w / np.linalg.norm(w), 3 * rng.normal(size=3)]) @ growth(size)


def is_right(result, S, degrees=0.1, metres=0.01, share=0.001):
    found, at = result.T_target_source, result.reference_point[None]
    before = apply_similar(np.linalg.inv(S), at)
    turned = rotation_error(found @ growth(1 / size_of(found)), S @ growth(1 / size_of(S)))
    away = np.linalg.norm(apply_similar(found, before) - at)
    return result.accepted and turned < degrees and away < metres and abs(size_of(found) / size_of(S) - 1) < share


# ------------------------------------------------------------------------------------------------------- from any pose


@FACTORS
@pytest.mark.slow
def test_two_scans_in_other_units_find_each_other(factor, rng):
    S = any_similarity(rng, 1 / factor)
    result = fa.register(*posed(S), scale=True)
    assert is_right(result, S)
    assert result.reason is fa.Reason.ACCEPTED
    assert "sizes" in result.seconds


@pytest.mark.slow
def test_the_size_is_sought_around_that_of_the_guess(rng):
    """As far off as by a half: the guess's own size is no good start."""
    S = any_similarity(rng, 1.0)
    init = exp_twist(np.array([0.1, 0, 0.1, 0.2, 0, 0])) @ S @ growth(1.5)
    assert is_right(fa.register(*posed(S), scale=True, init=init, search=True), S)


@FACTORS
def test_near_a_guess_no_size_is_sought(factor, rng):
    S = any_similarity(rng, 1 / factor)
    init = S @ exp_twist(np.r_[0.03, 0.02, -0.05, 0, 0, 0]) @ growth(1.04)
    result = fa.register(*posed(S), scale=True, init=init)
    assert is_right(result, S)
    assert result.reason is fa.Reason.ACCEPTED_NEAR_INIT
    assert "sizes" not in result.seconds


def test_where_nothing_has_grown_the_scale_is_one(rng):
    T = any_similarity(rng, 1.0)
    source, target = posed(T)
    rigid, similar = fa.register(source, target, init=T), fa.register(source, target, init=T, scale=True)
    assert size_of(similar.T_target_source) == pytest.approx(1, abs=0.001)
    assert np.abs(similar.T_target_source - rigid.T_target_source).max() < 0.01


def test_the_unit_of_either_cloud_does_not_matter(rng):
    """Each by a power of two, so that all digits stay."""
    S = any_similarity(rng, 1.0)
    source, target = posed(S)
    one = fa.register(source, target, scale=True, init=S)
    other = fa.register(1024 * source, target / 64, scale=True, init=growth(1 / 64) @ S @ growth(1 / 1024))
    there = growth(64) @ other.T_target_source @ growth(1024)
    assert np.abs(there - one.T_target_source).max() < 1e-9
    assert other.reason is one.reason
    assert other.covariance[6, 6] == pytest.approx(one.covariance[6, 6], rel=1e-6)


def test_a_quarter_of_the_source_grows_too(rng):
    """Then the source is the one that moves."""
    S = any_similarity(rng, 0.37)
    source, target = posed(S)
    near = np.linalg.norm(source - np.median(source, axis=0), axis=1)
    result = fa.register(source[near < np.quantile(near, 0.4)], target, scale=True, init=S @ growth(1.02))
    assert size_of(result.T_target_source) == pytest.approx(0.37, rel=0.02)


# -------------------------------------------------------------------------------------------------- without any noise


def lopsided(fineness=3):
    """A lump that no turn brings onto itself: vertices and faces."""
    sphere = trimesh.creation.icosphere(fineness)
    d = np.asarray(sphere.vertices)
    bump = np.exp(-8 * ((d - [0, 0.6, 0.8]) ** 2).sum(axis=1))
    waves = 0.25 * np.sin(3 * d[:, 1] + d[:, 0]) + 0.2 * np.cos(4 * d[:, 2] * d[:, 0])
    return d * (1 + 0.3 * d[:, 0] + waves + 0.35 * bump)[:, None] * [1.3, 1, 0.8], np.asarray(sphere.faces)


@pytest.fixture(scope="module")
def mesh():
    pytest.importorskip("igl")
    return MeshField(*lopsided())


def assert_exact(result, S, points, extent):
    found = result.T_target_source
    assert result.accepted
    assert size_of(found) == pytest.approx(size_of(S), rel=1e-9)
    assert np.linalg.norm(apply_similar(found, points) - apply_similar(S, points), axis=1).max() < 1e-9 * extent


@FACTORS
@pytest.mark.slow
def test_points_find_their_place_and_size_on_a_mesh_to_the_last_digits(mesh, factor, rng):
    S = any_similarity(rng, 1 / factor)
    source = apply_similar(np.linalg.inv(S), mesh.spread(3000))
    assert_exact(fa.register(source, mesh, scale=True), S, source, 4)


@FACTORS
@pytest.mark.parametrize("order", ["points, mesh", "mesh, points", "mesh, mesh"])
def test_from_a_guess_to_the_last_digits(mesh, factor, order, rng):
    S = any_similarity(rng, 1 / factor)
    points = mesh.spread(3000)
    clouds = {
        "points, mesh": (apply_similar(np.linalg.inv(S), points), mesh),
        "mesh, points": (mesh, apply_similar(S, points)),
        "mesh, mesh": (MeshField(apply_similar(np.linalg.inv(S), mesh.vertices), mesh.faces), mesh),
    }[order]
    known = points if order == "mesh, points" else apply_similar(np.linalg.inv(S), points)
    result = fa.register(*clouds, scale=True, init=S @ growth(1.05))
    assert_exact(result, S, known, 4 / (factor if order == "mesh, points" else 1))


# -------------------------------------------------------------------------------------------------------------- a dof


@FACTORS
def test_levelled_clouds_stay_levelled(factor):
    S = exp_twist(np.array([0, 0, 2.0, 3, 4, 1])) @ growth(1 / factor)
    init = S @ exp_twist(np.array([0, 0, 0.05, 0, 0, 0])) @ growth(0.97)
    result = fa.register(*posed(S), scale=True, dof="levelled", init=init)
    assert is_right(result, S)
    R = result.T_target_source[:3, :3] / size_of(result.T_target_source)
    assert np.abs(R[2] - [0, 0, 1]).max() < 1e-12
    assert np.abs(R @ R.T - np.eye(3)).max() < 1e-12
    assert_seven(result, 5)


@pytest.mark.slow
def test_levelled_clouds_are_searched_for_at_all_sizes():
    S = exp_twist(np.array([0, 0, 2.0, 3, 4, 1])) @ growth(2.7)
    result = fa.register(*posed(S), scale=True, dof="levelled")
    assert is_right(result, S)
    assert np.abs(result.T_target_source[2, :2]).max() < 1e-12 * 2.7


@FACTORS
def test_a_centre_stays_where_it_is_while_all_grows_about_it(factor):
    centre = np.array([1.0, 2, 0.5])
    about, back = translation(centre), translation(-centre)
    R = np.eye(4)
    R[:3, :3] = Rotation.random(random_state=3).as_matrix()
    S, init = (about @ R @ exp_twist(e * np.array([1, 2, -1, 0, 0, 0])) @ growth((1 + e) / factor) @ back
               for e in (0.0, 0.03))
    result = fa.register(*posed(S), scale=True, dof=fa.Dof("rotation", centre=centre), init=init)
    assert is_right(result, S)
    at = apply_similar(np.linalg.inv(init), centre[None])
    assert np.abs(apply_similar(result.T_target_source, at) - centre).max() < 1e-9
    assert_seven(result, 4)


def assert_seven(result, free):
    """Information and covariance (7, 7), of the rank of what is free."""
    for matrix in (result.information, result.covariance):
        assert matrix.shape == (7, 7)
        assert np.array_equal(matrix, matrix.T) or np.allclose(matrix, matrix.T, rtol=1e-9)
        lever = np.sqrt(np.diag(matrix))
        lever = 1 / np.where(lever > 1e-9 * lever.max(), lever, np.inf)  # so that no unit decides
        assert np.linalg.matrix_rank(matrix * np.outer(lever, lever), tol=1e-7) == free
    assert result.unobservable.shape == (7, 0)
    assert result.covariance[6, 6] > 0


# ------------------------------------------------------------------------------------------------- how well it is known


def test_the_answer_is_a_similarity_and_has_a_seventh_row(rng):
    S = any_similarity(rng, 2.5)
    result = fa.register(*posed(S), scale=True, init=S)
    sR = result.T_target_source[:3, :3]
    assert np.allclose(sR @ sR.T, size_of(result.T_target_source) ** 2 * np.eye(3), rtol=0, atol=1e-12)
    assert np.linalg.det(sR) > 0
    assert np.array_equal(result.T_target_source[3], [0, 0, 0, 1])
    assert_seven(result, 7)
    assert np.allclose(result.information @ result.covariance, np.eye(7), atol=1e-5)
    assert all(step.increment.shape == (7,) for step in result.history)
    plain = result.to_dict()
    assert np.array_equal(plain["T_target_source"], result.T_target_source)
    assert np.shape(plain["covariance"]) == (7, 7)


@pytest.mark.slow
def test_the_scale_is_as_uncertain_as_is_said():
    """Over 14 rooms the mean square of the error of log(scale), in standard deviations, is 1, give or take 0.4."""
    z = []
    for seed in range(200, 214):
        source, target, T = scans(seed, 4000)
        result = fa.register(10 * source, target, scale=True, init=T @ growth(0.1))
        z.append(np.log(10 * size_of(result.T_target_source)) / np.sqrt(result.covariance[6, 6]))
    assert 0.2 < np.mean(np.square(z)) < 4
    assert np.abs(z).max() < 5


def test_in_another_unit_as_much_is_known_of_it(rng):
    S = any_similarity(rng, 1.0)
    source, target = posed(S)
    here = fa.register(source, target, scale=True, init=S)
    there = fa.register(source / 1000, target, scale=True, init=S @ growth(1000))
    assert np.allclose(there.covariance, here.covariance, rtol=1e-3, atol=1e-3 * np.abs(here.covariance).max())


# --------------------------------------------------------------------------------------------------- what is not known


def flat_square(rng):
    return rng.uniform(-1, 1, (3000, 3)) * [2, 1, 0] + [0, 0, 1] * rng.normal(0, 0.003, (3000, 1))


def test_a_plane_may_be_of_any_size(rng):
    result = fa.register(flat_square(rng), 3 * flat_square(rng), scale=True)
    assert result.reason is fa.Reason.DEGENERATE
    assert sorted(freedom.kind for freedom in result.freedoms) == ["grow", "slide", "slide", "turn"]
    assert result.unobservable.shape == (7, 4)
    assert "grow about" in result.verdict


def test_three_planes_grow_about_their_corner(rng):
    """All about the corner is as it was, however large."""
    a, b = rng.uniform(0, 1, (2, 6000))
    side = np.arange(6000) % 3
    corner = np.zeros((6000, 3))
    corner[np.arange(6000), (side + 1) % 3], corner[np.arange(6000), (side + 2) % 3] = a, b
    corner += [5, 6, 7]
    init = translation([5, 6, 7]) @ growth(1.01) @ translation([-5, -6, -7])
    result = fa.register(corner[::2], corner[1::2] + rng.normal(0, 1e-3, (3000, 3)), scale=True, init=init)
    assert result.reason is fa.Reason.DEGENERATE
    (freedom,) = result.freedoms
    assert freedom.kind == "grow"
    assert np.abs(freedom.point - [5, 6, 7]).max() < 0.02


@pytest.mark.slow
def test_two_rooms_are_not_one_at_another_size():
    assert not fa.register(0.2 * scans(6)[0][::2], scans(3)[1][::2], scale=True).accepted


def test_a_lump_and_another_lump_are_not_one_at_another_size(mesh, rng):
    d = np.asarray(trimesh.creation.icosphere(3).vertices)
    other = d * (1 + 0.4 * np.sin(5 * d[:, 0]) * np.cos(3 * d[:, 1] + 2 * d[:, 2]))[:, None]
    assert not fa.register(5 * other, mesh, scale=True, init=growth(0.2)).accepted


def test_few_points_are_an_answer_and_never_accepted(rng):
    assert not fa.register(rng.random((3, 3)), rng.random((5, 3)), scale=True).accepted


def test_ten_points_are_an_answer_and_never_accepted(rng):
    assert not fa.register(rng.random((10, 3)), rng.random((12, 3)), scale=True).accepted


# -------------------------------------------------------------------------------------------------------------- errors


@pytest.mark.parametrize(
    ("init", "word"),
    [
        (np.diag([2, 2, 2.2, 1]), "rigid"),
        (np.diag([2, 2, -2, 1]), "rigid"),
        (np.diag([0, 0, 0, 1]), "rigid"),
        (np.diag([2, 2, 2, 2]), "row"),
        (np.full((4, 4), np.nan), "finite"),
        (np.eye(3), "shape"),
        ("pose", "numbers"),
    ],
    ids=str,
)
def test_a_guess_that_is_no_similarity_is_refused(corner, init, word):
    with pytest.raises(ArgumentError, match=f"^init must.*{word}"):
        fa.register(corner, corner, init=init, scale=True)


def test_a_guess_that_is_larger_is_a_motion_only_with_scale(corner):
    with pytest.raises(ArgumentError, match=r"^init must be rigid"):
        fa.register(corner, corner, init=growth(2))


def test_the_papers_method_knows_no_scale(corner):
    with pytest.raises(ArgumentError, match=r"^method 'paper' never searches: leave .* and scale out"):
        fa.register(corner, corner, method="paper", scale=True)
