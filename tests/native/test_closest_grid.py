"""The grid of closest surfels, against SciPy's tree: what it holds at a place, how far it reaches, what it costs."""

import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fieldalign import _core
from fieldalign.motions import apply, rotate

CELL, MARGIN = 0.25, 1.0
DIAGONAL = np.sqrt(3) * CELL


def looked_up(means, queries, cell=CELL, margin=MARGIN):
    """For each query (L, 3), its offset (L, 3) from the surfel that the grid holds there; NaN where it holds none.

    A grid tells no surfels, but sums: with one pseudo point, all normals along an axis and no weighing, g is the
    residual, which is the offset along that axis.
    """
    poses = np.tile(np.eye(4), (len(queries), 1, 1))
    poses[:, :3, 3] = queries
    offsets = np.full((len(queries), 3), np.nan)
    for axis, up in enumerate(np.eye(3)):
        normals = np.tile(up, (len(means), 1))
        grid = _core.ClosestGrid(np.ascontiguousarray(means), normals, cell, margin)
        _, g, totals = grid.robust_sums(np.zeros((1, 3)), up[None], np.zeros(1), poses, 1e9, 0.5, 1e9, False, 1)
        offsets[:, axis] = np.where(totals[:, 3] == 1, g[:, 3 + axis], np.nan)
    return offsets


def surfaces():
    rng = np.random.default_rng(4)
    ball = rng.normal(size=(2000, 3))
    return {
        "sphere": 3 * ball / np.linalg.norm(ball, axis=1)[:, None],
        "sheet": np.c_[rng.uniform(-3, 3, (2000, 2)), np.zeros(2000)],
        "scattered": rng.uniform(-4, 4, (300, 3)),
        "line": np.c_[np.zeros((300, 2)), rng.uniform(-4, 4, 300)],
        "one": np.array([[1.0, 2, 3]]),
        "equal": np.full((50, 3), 0.3),
        "two far apart": np.array([[0.0, 0, 0], [90, 0, 0]]),
    }


@pytest.mark.parametrize("name", surfaces())
def test_within_the_margin_it_holds_one_of_the_nearest(rng, name):
    """The nearest to the cell's middle, which is half a diagonal off at most: so a diagonal from the best at most."""
    means = surfaces()[name]
    near = means[rng.integers(0, len(means), 3000)] + rng.normal(0, 0.5, (3000, 3))
    best, _ = cKDTree(means).query(near)
    near, best = near[best < MARGIN - DIAGONAL / 2], best[best < MARGIN - DIAGONAL / 2]
    found = np.linalg.norm(looked_up(means, near), axis=1)
    assert not np.isnan(found).any()
    assert (found >= best - 1e-5).all()
    assert (found <= best + DIAGONAL + 1e-5).all()


@pytest.mark.parametrize("name", surfaces())
def test_beyond_the_margin_it_holds_nothing(rng, name):
    means = surfaces()[name]
    size = np.ptp(means, axis=0).max() + 4
    anywhere = means.mean(axis=0) + size * rng.uniform(-1, 1, (5000, 3))
    best, _ = cKDTree(means).query(anywhere)
    far = anywhere[best > MARGIN + DIAGONAL]  # the middle of a place's cell may lie half a diagonal nearer
    assert len(far) > 300
    assert np.isnan(looked_up(means, far)).all()


def test_what_it_holds_is_a_surfel_and_about_the_one_nearest_to_the_cells_middle(rng):
    """Handed on from cell to cell, the nearest surfel may be missed, but by little."""
    means = surfaces()["sphere"].astype(np.float32).astype(float)
    queries = means[rng.integers(0, 2000, 4000)] + rng.normal(0, 0.3, (4000, 3))
    offsets = looked_up(means, queries)
    known = ~np.isnan(offsets[:, 0])
    held = queries[known] - offsets[known]
    assert cKDTree(means).query(held)[0].max() < 1e-5
    low = means.min(axis=0) - MARGIN - CELL
    middles = low + (np.floor((queries[known] - low) / CELL) + 0.5) * CELL
    excess = np.linalg.norm(held - middles, axis=1) - cKDTree(means).query(middles)[0]
    assert excess.min() > -1e-5
    assert (excess > 0.2 * CELL).mean() < 0.1
    assert excess.max() < CELL


@pytest.mark.parametrize("value", [1e3, 1e6, 1e15, -1e15])
def test_places_far_away_are_nowhere(value):
    means = surfaces()["sheet"]
    queries = np.vstack([value * np.eye(3), value * np.ones((1, 3))])
    assert np.isnan(looked_up(means, queries)).all()


STREET = """
import resource, sys
import numpy as np
from fieldalign import _core
rng = np.random.default_rng(0)
u, across = rng.uniform(0, 200, 300_000), rng.uniform(-10, 10, 300_000)
flat = np.stack([u, np.clip(across, -5, 5), np.maximum(np.abs(across) - 5, 0)], axis=1)
street = flat @ (np.array([[1, 1, 1.], [1, -1, 0], [1, 1, -2]]) / np.sqrt([[3.], [2.], [6.]]))
up = np.tile([0, 0, 1.], (300_000, 1))
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
grid = _core.ClosestGrid(street, up, 0.1, 0.3)
used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
print(used / 1024 / (1 if sys.platform == "linux" else 1024))
"""


@pytest.mark.slow
def test_only_blocks_near_the_surface_are_kept():
    """A street of 200 m and its house fronts, across its box, in cells of 0.1 m: a dense grid of the box, 115 m wide
    each way, would take 6 GB."""
    pytest.importorskip("resource")
    ran = subprocess.run([sys.executable, "-c", STREET], capture_output=True, text=True, check=True)
    assert float(ran.stdout) < 250  # MiB


def test_a_box_of_too_many_cells_is_refused_before_it_is_made():
    means = np.array([[0.0, 0, 0], [1e6, 1e6, 1e6]])
    with pytest.raises(ValueError, match="too many cells"):
        _core.ClosestGrid(means, means * 0 + [1, 0, 0], 0.1, 0.3)


@pytest.mark.parametrize(("cell", "margin"), [(0, 1), (-1, 1), (1, 0), (np.nan, 1), (1, np.nan)])
def test_lengths_are_positive(cell, margin):
    with pytest.raises(ValueError, match="positive"):
        _core.ClosestGrid(np.eye(3), np.eye(3), cell, margin)


def test_a_grid_of_nothing_and_arrays_of_other_lengths_are_refused():
    with pytest.raises(ValueError, match="at least one"):
        _core.ClosestGrid(np.zeros((0, 3)), np.zeros((0, 3)), 1, 1)
    with pytest.raises(ValueError, match="length"):
        _core.ClosestGrid(np.eye(3), np.eye(3)[:2], 1, 1)
    grid = _core.ClosestGrid(np.eye(3), np.eye(3), 1, 1)
    for normals, offsets in ((2, 3), (3, 2)):
        with pytest.raises(ValueError, match="length"):
            grid.robust_sums(np.eye(3), np.eye(3)[:normals], np.zeros(offsets), np.eye(4)[None], 1, 0, 1, False, 1)
    with pytest.raises(ValueError, match="length"):
        grid.agreement(np.eye(3), np.eye(3)[:2], np.ones(3), np.eye(4)[None], 1, 0, 1, False, 1)
    with pytest.raises(ValueError, match="length"):
        grid.agreement(np.eye(3), np.eye(3), np.ones(2), np.eye(4)[None], 1, 0, 1, False, 1)


# --------------------------------------------------------------------------------------------------------------- sums


@pytest.fixture
def scene(rng):
    """Surfels of a rough sphere, pseudo points near it, and poses that move them a little."""
    means = surfaces()["sphere"]
    normals = means / 3 + 0.1 * rng.normal(size=(2000, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    rows = rng.integers(0, 2000, 500)
    offsets = rng.normal(0, 0.1, 500)
    poses = np.stack([np.eye(4)] * 5)
    poses[:, :3, 3] = rng.normal(0, 0.1, (5, 3))
    return _core.ClosestGrid(means, normals, CELL, MARGIN), means, normals, rows, offsets, poses


def test_each_pose_is_summed_alone_and_by_any_number_of_threads(scene):
    grid, means, normals, rows, offsets, poses = scene
    pseudo = means[rows] + offsets[:, None] * normals[rows], normals[rows], offsets
    together = [grid.robust_sums(*pseudo, poses, 0.1, 0.8, 0.5, False, threads) for threads in (1, 2, 8)]
    alone = [grid.robust_sums(*pseudo, poses[k : k + 1], 0.1, 0.8, 0.5, False, 1) for k in range(5)]
    for part in range(3):
        assert all(np.array_equal(other[part], together[0][part]) for other in together)
        assert np.array_equal(np.concatenate([one[part] for one in alone]), together[0][part])


def test_a_normals_sign_means_nothing(scene, rng):
    """Nor that of a pseudo point's own surface: its offset is along it, and turns with it."""
    grid, means, normals, rows, offsets, poses = scene
    signs = rng.choice([-1.0, 1.0], 500)
    places = means[rows] + offsets[:, None] * normals[rows]
    plain = grid.robust_sums(places, normals[rows], offsets, poses, 0.1, 0.8, 0.5, False, 1)
    turned = grid.robust_sums(places, signs[:, None] * normals[rows], signs * offsets, poses, 0.1, 0.8, 0.5, False, 1)
    flipped = _core.ClosestGrid(means, rng.choice([-1.0, 1.0], (2000, 1)) * normals, CELL, MARGIN)
    other = flipped.robust_sums(places, normals[rows], offsets, poses, 0.1, 0.8, 0.5, False, 1)
    for part in range(3):
        size = np.abs(plain[part]).max()
        assert np.allclose(plain[part], turned[part], rtol=0, atol=1e-12 * size)
        assert np.allclose(plain[part], other[part], rtol=0, atol=1e-12 * size)


def test_the_sums_over_known_planes_are_those_of_the_grid(scene):
    """One formula: without offsets, and at the scale of the residuals' own median."""
    grid, means, normals, rows, _, poses = scene
    x = apply(poses[0], means[rows])
    offsets = looked_up(means, x)
    known = ~np.isnan(offsets[:, 0])
    partners = cKDTree(means).query(x[known] - offsets[known])[1]
    narrow = [np.ascontiguousarray(a[partners].astype(np.float32).astype(float)) for a in (means, normals)]
    own = rotate(poses[0][:3, :3], normals[rows])
    (H, g, totals), *_ = _core.robust_sums(x[known], own[known], *narrow, np.ones(known.sum()), 0.8, 0.5, 3.0, 0.0)
    assert totals[0, 3] > 300
    between = own[known] + narrow[1] * np.sign((own[known] * narrow[1]).sum(axis=1))[:, None]
    between /= np.linalg.norm(between, axis=1)[:, None]
    r = (between * (x[known] - narrow[0])).sum(axis=1)
    taken = (np.abs((own[known] * narrow[1]).sum(axis=1)) >= 0.8) & (
        np.linalg.norm(x[known] - narrow[0], axis=1) <= 0.5
    )
    scale = 3 * 1.4826 * np.sort(np.abs(r[taken]))[taken.sum() // 2]
    expected = grid.robust_sums(means[rows], normals[rows], np.zeros(500), poses[:1], scale, 0.8, 0.5, False, 1)
    H, g = H[:, :6, :6], g[:, :6]  # the grid knows no growth
    for got, wanted in zip((H, g, totals), expected, strict=True):
        assert np.allclose(got, wanted, rtol=0, atol=1e-6 * np.abs(wanted).max())


def test_residuals_that_spread_more_count_less(scene):
    """A spread of 2 is a residual of half the size, seen in units of 2."""
    _, means, normals, rows, offsets, _ = scene
    x = means[rows] + 0.02 * offsets[:, None]
    planes = means[rows], normals[rows]
    how = 0.8, 0.5, 3.0, 0.0
    (H, g, totals), hold, scatter, _ = _core.robust_sums(x, normals[rows], *planes, np.ones(500), *how)
    wide, wide_hold, wide_scatter, _ = _core.robust_sums(x, normals[rows], *planes, np.full(500, 2.0), *how)
    assert np.allclose(wide[0], H / 4)
    assert np.allclose(wide[1], g / 4)
    assert np.allclose(wide[2], totals / [4, 4, 4, 1])
    assert np.allclose(wide_hold, hold / 4)
    assert np.allclose(wide_scatter, scatter / 16)


def test_nothing_near_is_nothing_summed(scene):
    grid, means, normals, rows, offsets, poses = scene
    away = poses.copy()
    away[:, 0, 3] = 1e4
    for sums in grid.robust_sums(means[rows], normals[rows], offsets, away, 0.1, 0.8, 0.5, False, 1):
        assert not sums.any()
    assert not grid.agreement(means[rows], normals[rows], np.ones(500), away, 0.1, 0.8, 0.5, False, 1).any()
    sums, hold, scatter, _ = _core.robust_sums(means + 9, normals, means, normals, np.ones(2000), 0.8, 0.5, 3.0, 0.0)
    for matrix in (*sums, hold, scatter):
        assert not matrix.any()


# -------------------------------------------------------------------------------------------------------------- steps


def test_a_step_is_least_squares_and_no_longer_than_allowed(rng):
    J = rng.normal(size=(4, 50, 6))
    H, g = np.einsum("bni,bnj->bij", J, J), np.einsum("bni,bn->bi", J, 0.05 * rng.normal(size=(4, 50)))
    g[3] *= 1e4
    poses = np.tile(np.eye(4), (4, 1, 1))
    twists, moved = _core.take_steps(poses, H, g, np.array([1.0, 1.5, 1.0, 1.0]), 0.3)
    full = -np.linalg.solve(H, g[..., None])[..., 0] * [[1.0], [1.5], [1.0], [1.0]]
    assert np.allclose(twists[:3], full[:3])
    assert np.linalg.norm(twists[3, :3]) == pytest.approx(0.3)
    assert np.allclose(twists[3] / 0.3, full[3] / np.linalg.norm(full[3, :3]))
    again = _core.take_steps(moved, H, g * 0, np.ones(4), 0.3)[1]
    assert np.array_equal(again, moved)
    for pose, twist in zip(moved, twists, strict=True):
        assert np.allclose(pose, _core.exp_twist(twist), atol=1e-15)


def test_no_step_along_what_nothing_holds():
    H = np.zeros((1, 6, 6))
    H[0, 5, 5] = 4.0
    twists, _ = _core.take_steps(np.eye(4)[None], H, np.full((1, 6), 2.0), np.ones(1), 0.3)
    assert np.allclose(twists, [[0, 0, 0, 0, 0, -0.5]])
