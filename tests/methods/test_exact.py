"""Registration against surfaces that are known exactly: to the last digits without noise, and as far off as is said."""

import numpy as np
import pytest
import trimesh

import fieldalign as fa
from fieldalign.fields import MeshField
from fieldalign.motions import apply, inverse, log_motion, translation

pytest.importorskip("igl")

SEEDS = [0, 1]
NOISE = 0.01


def lopsided(fineness=3):
    """A lump that no turn brings onto itself: vertices and faces."""
    sphere = trimesh.creation.icosphere(fineness)
    d = np.asarray(sphere.vertices)
    bump = np.exp(-8 * ((d - [0, 0.6, 0.8]) ** 2).sum(axis=1))
    waves = 0.25 * np.sin(3 * d[:, 1] + d[:, 0]) + 0.2 * np.cos(4 * d[:, 2] * d[:, 0])
    return d * (1 + 0.3 * d[:, 0] + waves + 0.35 * bump)[:, None] * [1.3, 1, 0.8], np.asarray(sphere.faces)


@pytest.fixture(scope="module")
def mesh():
    return MeshField(*lopsided())


@pytest.fixture(scope="module")
def patch(mesh):
    """Points on a half of the surface."""
    points = mesh.spread(16_000)[np.random.default_rng(5).permutation(16_000)]
    return points[points @ [0.3, 0.5, -0.8] > -0.1]


def off(T, truth, points, extent):
    """By how much points are misplaced at most, of the extent."""
    return np.linalg.norm(apply(T, points) - apply(truth, points), axis=1).max() / extent


def extent_of(field):
    return float(np.linalg.norm(np.ptp(field.bounds, axis=0)))


def error_in_sigmas(result, truth):
    """The error (6,) in units of its stated standard deviations, along its own axes."""
    to_reference = translation(-result.reference_point)
    twist = log_motion(to_reference @ result.T_target_source @ inverse(truth) @ inverse(to_reference))
    return np.linalg.cholesky(result.information).T @ twist


# -------------------------------------------------------------------------------------------------------- without noise


@pytest.mark.parametrize("seed", SEEDS)
def test_points_find_their_place_on_a_mesh_to_the_last_digits(mesh, patch, any_motion, seed):
    T = any_motion(np.random.default_rng(seed), 3.0)
    result = fa.register(apply(inverse(T), patch), mesh, seed=seed)
    assert result.accepted
    assert off(result.T_target_source, T, apply(inverse(T), patch), extent_of(mesh)) < 1e-6
    assert result.overlap > 0.95
    assert 0.3 < result.overlap_target < 0.8


@pytest.mark.parametrize("seed", SEEDS)
def test_a_mesh_finds_its_place_on_points(mesh, patch, any_motion, seed):
    T = any_motion(np.random.default_rng(seed), 3.0)
    result = fa.register(mesh, apply(T, patch), seed=seed)
    assert result.accepted
    assert off(result.T_target_source, T, patch, extent_of(mesh)) < 1e-6
    assert result.overlap_target > 0.95


def test_the_other_order_gives_the_inverse(mesh, patch, any_motion):
    source = apply(any_motion(np.random.default_rng(7), 3.0), patch)
    there, back = fa.register(source, mesh), fa.register(mesh, source)
    assert off(inverse(back.T_target_source), there.T_target_source, source, extent_of(mesh)) < 1e-9


@pytest.mark.parametrize("seed", SEEDS)
def test_a_mesh_finds_its_place_on_a_mesh(mesh, any_motion, seed):
    T = any_motion(np.random.default_rng(seed), 3.0)
    moved = MeshField(apply(inverse(T), mesh.vertices), mesh.faces)
    result = fa.register(moved, mesh, seed=seed)
    assert result.accepted
    assert off(result.T_target_source, T, moved.vertices, extent_of(mesh)) < 1e-6
    assert min(result.overlap, result.overlap_target) > 0.95


def test_meshes_of_other_triangles_agree(any_motion, rng):
    """The same lump by four times as many triangles, which lie up to a hundredth beside the others."""
    T, (vertices, faces) = any_motion(rng, 3.0), lopsided(4)
    result = fa.register(MeshField(apply(inverse(T), vertices), faces), MeshField(*lopsided()))
    assert result.accepted
    assert off(result.T_target_source, T, apply(inverse(T), vertices), 4.5) < 2e-3


@pytest.mark.parametrize(("factor", "shift"), [(1000.0, 0.0), (1.0, 5e6)], ids=["millimetres", "utm"])
def test_the_unit_and_the_offset_do_not_matter(mesh, patch, any_motion, rng, factor, shift):
    far, T = np.array([shift, 0.1 * shift, 0]), any_motion(rng, 3.0 * factor)
    field = MeshField(factor * mesh.vertices + far, mesh.faces)
    source = apply(T, factor * patch)
    result = fa.register(source, field)
    assert result.accepted
    assert np.abs(apply(result.T_target_source, source) - far - factor * patch).max() < 1e-6 * factor


def test_an_open_mesh_has_no_side_but_a_place(mesh, patch, any_motion, rng):
    """Its lower half is missing, and with it some of what the points lie on."""
    kept = mesh.vertices[mesh.faces].mean(axis=1) @ [0.3, 0.5, -0.8] > -0.4
    half, T = MeshField(mesh.vertices, mesh.faces[kept]), any_motion(rng, 3.0)
    assert not half.signed
    result = fa.register(apply(inverse(T), patch), half)
    assert result.accepted
    assert off(result.T_target_source, T, apply(inverse(T), patch), extent_of(mesh)) < 1e-6


def test_another_lump_is_not_accepted(patch, any_motion, rng):
    sphere = trimesh.creation.icosphere(3)
    d = np.asarray(sphere.vertices)
    other = d * (1 + 0.4 * np.sin(5 * d[:, 0]) * np.cos(3 * d[:, 1] + 2 * d[:, 2]))[:, None]
    assert not fa.register(apply(any_motion(rng, 3.0), patch), MeshField(other, sphere.faces)).accepted


def test_a_true_pose_is_verified_and_a_wrong_one_is_not(mesh, patch, motion, rng):
    T = motion(rng, 50, 2.0)
    source = apply(inverse(T), patch)
    assert fa.verify(source, mesh, T).accepted
    assert not fa.verify(source, mesh, motion(rng, 10, 0.2) @ T).accepted


# ----------------------------------------------------------------------------------------------------------- with noise


@pytest.fixture(scope="module")
def noisy(mesh, patch, any_motion):
    """Results for points with noise from any pose, in either order, and the true motions."""
    found = []
    for seed in range(4):
        rng = np.random.default_rng(100 + seed)
        T = any_motion(rng, 3.0)
        source = apply(inverse(T), patch + NOISE * rng.normal(size=patch.shape))
        result = fa.register(*((source, mesh) if seed % 2 else (mesh, source)), seed=seed)
        found.append((result, T if seed % 2 else inverse(T)))
    return found


def test_noise_moves_the_pose_by_no_more_than_is_said(noisy):
    for result, T in noisy:
        assert result.accepted
        assert np.abs(error_in_sigmas(result, T)).max() < 4


def test_and_by_no_less(noisy):
    """The squares of all 24 errors in sigmas have the mean 1."""
    squares = np.concatenate([error_in_sigmas(result, T) ** 2 for result, T in noisy])
    assert 0.4 < squares.mean() < 2


def test_many_points_with_noise_are_placed_better_than_one(noisy, patch, mesh):
    for k, (result, T) in enumerate(noisy):
        source = apply(inverse(T), patch) if k % 2 else patch
        assert off(result.T_target_source, T, source, 1.0) < NOISE / 5


def test_scattered_points_off_the_surface_do_not_pull(mesh, patch, any_motion, rng):
    T = any_motion(rng, 3.0)
    strays = rng.uniform(*mesh.bounds, (len(patch) // 10, 3))
    result = fa.register(apply(inverse(T), np.r_[patch, strays]), mesh)
    assert result.accepted
    assert off(result.T_target_source, T, apply(inverse(T), patch), extent_of(mesh)) < 1e-4
