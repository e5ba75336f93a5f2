"""What the residuals over known planes tell of certainty, and which surfels lie in one plane; against NumPy."""

import numpy as np
import pytest

from fieldalign import _core
from fieldalign.fields import PointField
from fieldalign.fields.protocol import planes_near

RUN = 16  # pseudo points


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


def rows_of(places, normals):
    """Of a twist, and of a growth about the origin."""
    return np.c_[np.cross(places, normals), normals, (places * normals).sum(axis=1)]


@pytest.fixture
def planes(rng):
    """Pseudo points, their normals, partners and spreads: some are too far off or face elsewhere."""
    means, normals = rng.uniform(-2, 2, (1001, 3)), unit(rng.normal(size=(1001, 3)))
    x = means + rng.normal(0, 0.05, (1001, 3))
    x[::7] += 1.0
    own = unit(normals + 0.3 * rng.normal(size=(1001, 3))) * rng.choice([-1.0, 1.0], (1001, 1))
    return x, own, means, normals, rng.uniform(0.5, 2, 1001)


def kept_of(x, own, means, normals, spreads, min_cosine=0.8, reach=0.5):
    """The kept ones, normals turned to the side of their own, and each one's residual and weight."""
    cosine = (own * normals).sum(axis=1)
    kept = (np.linalg.norm(x - means, axis=1) <= reach) & (np.abs(cosine) >= min_cosine)
    normals = normals * np.sign(cosine)[:, None]
    between = unit(normals + own)
    r = (between * (x - means)).sum(axis=1)
    sizes = np.sort(np.abs(r[kept]) / spreads[kept])
    z = r / (3 * 1.4826 * sizes[len(sizes) // 2] * spreads)
    w = np.abs(cosine) / (1 + z**2) ** 2 / spreads**2
    return [part[kept] for part in (x, own, means, normals, between, r, w)]


def test_the_gradients_scatter_is_summed_over_runs_of_those_that_are_kept(planes):
    *_, scatter, _ = _core.robust_sums(*planes, 0.8, 0.5, 3.0, 0.0)
    x, _, _, _, between, r, w = kept_of(*planes)
    assert len(x) % RUN > 0  # the last run is short
    gradients = (w * r)[:, None] * rows_of(x, between)
    runs = np.add.reduceat(gradients, np.arange(0, len(x), RUN))
    assert np.allclose(scatter, runs.T @ runs, rtol=0, atol=1e-12 * np.abs(scatter).max())


def test_the_hold_is_the_product_of_both_clouds_rows(planes):
    _, hold, *_ = _core.robust_sums(*planes, 0.8, 0.5, 3.0, 0.0)
    x, own, means, normals, _, _, w = kept_of(*planes)
    product = (w[:, None] * rows_of(x, own)).T @ rows_of(means, normals)
    assert np.allclose(hold, (product + product.T) / 2, rtol=0, atol=1e-12 * np.abs(hold).max())


def test_the_sums_for_a_step_are_those_of_the_same_weights(planes):
    (H, g, totals), *_ = _core.robust_sums(*planes, 0.8, 0.5, 3.0, 0.0)
    x, _, _, _, between, r, w = kept_of(*planes)
    J = rows_of(x, between)
    assert np.allclose(H[0], (w[:, None] * J).T @ J, rtol=0, atol=1e-12 * np.abs(H).max())
    assert np.allclose(g[0], J.T @ (w * r), rtol=0, atol=1e-12 * np.abs(g).max())
    assert totals[0, 3] == len(x)


@pytest.mark.parametrize("seed", range(3))
def test_noise_in_the_normals_of_two_samples_of_a_plane_holds_nothing(seed):
    """Noise of 0.3 % of the extent, two samples: their normals' noise is not the same, and cancels."""
    rng = np.random.default_rng(seed)
    extent = np.hypot(3, 3)
    one, other = (PointField(np.c_[rng.uniform(0, 3, (5000, 2)), rng.normal(0, 0.003 * extent, 5000)]) for _ in "ab")
    own = planes_near(one, one.spread(2000), 10)
    partners = planes_near(other, own.mean, 10)
    spreads = np.ones(len(own.mean))
    planes = own.mean, own.normal, partners.mean, partners.normal
    (H, _, _), hold, *_ = _core.robust_sums(*planes, spreads, 0.8, 0.3, 3.0, 0.0)
    slides, up = [3, 4], 5
    assert (np.diag(H[0])[slides] > 5e-3 * H[0, up, up]).all()
    assert (np.abs(np.diag(hold)[slides]) < np.diag(H[0])[slides] / 4).all()
    assert hold[up, up] == pytest.approx(H[0, up, up], rel=0.05)  # what is held is held all the same


def test_where_most_residuals_are_zero_the_sums_are_finite():
    """Then the scale is the smallest number there is, and the others are beyond it by more than numbers can say."""
    x = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 1e-17]])
    up = np.tile([0, 0, 1.0], (4, 1))
    sums, hold, scatter, _ = _core.robust_sums(x, up, x * [1, 1, 0], up, np.ones(4), 0.8, 0.5, 3.0, 0.0)
    assert all(np.isfinite(matrix).all() for matrix in (*sums, hold, scatter))


# ----------------------------------------------------------------------------------------------------------- coplanar


def counted(places, normals, witness_places, witness_normals, distance, min_cosine):
    away = np.abs((normals[:, None] * (witness_places - places[:, None])).sum(axis=2))
    return ((away < distance) & (np.abs(normals @ witness_normals.T) > min_cosine)).sum(axis=1)


def test_witnesses_in_a_plane_are_counted(rng):
    places, witnesses = rng.uniform(-3, 3, (700, 3)), rng.uniform(-3, 3, (256, 3))
    normals, their_normals = unit(rng.normal(size=(700, 3))), unit(rng.normal(size=(256, 3)))
    one = _core.coplanar(places, normals, witnesses, their_normals, 0.5, 0.7, 1)
    assert one.dtype == np.uint32
    # In single precision a witness at the very edge may be in or out.
    low, high = (counted(places, normals, witnesses, their_normals, 0.5 - e, 0.7 + e) for e in (1e-5, -1e-5))
    assert ((low <= one) & (one <= high)).all()
    assert one.max() > 5
    for threads in (2, 8):
        assert np.array_equal(_core.coplanar(places, normals, witnesses, their_normals, 0.5, 0.7, threads), one)
    flipped = _core.coplanar(places, -normals, witnesses, their_normals, 0.5, 0.7, 1)
    assert np.array_equal(flipped, one)


def test_coplanar_refuses_arrays_of_other_lengths_and_counts_none_of_none():
    eye = np.eye(3)
    assert not _core.coplanar(eye, eye, np.zeros((0, 3)), np.zeros((0, 3)), 1, 0, 1).any()
    for normals, witness_normals in ((eye[:2], eye), (eye, eye[:2])):
        with pytest.raises(ValueError, match="length"):
            _core.coplanar(eye, normals, eye, witness_normals, 1, 0, 1)
