import numpy as np
import pytest

from fieldalign import _core
from fieldalign.alignment.residual import jacobian, residual, row_dot
from fieldalign.fields import PointField, sampled
from fieldalign.motions import apply, exp_twist


@pytest.mark.parametrize("neighbours", [1, 5])
@pytest.mark.parametrize("far", [0.0, 100.0])
def test_jacobian_is_the_derivative(corner, rng, neighbours, far):
    """Small rotation with large translation too: rows are huge there, and still right."""
    field = PointField(corner + far, neighbours=neighbours)
    x = rng.uniform(-0.5, 3.5, (300, 3)) + far
    J, h = jacobian(sampled(field, x), x), 1e-7
    phi = lambda y: sampled(field, y).value ** 2  # noqa: E731
    moved = [(apply(exp_twist(h * e), x), apply(exp_twist(-h * e), x)) for e in np.eye(6)]
    numeric = np.stack([(phi(after) - phi(before)) / (2 * h) for after, before in moved], axis=1)
    off = np.abs(numeric - J).max(axis=1) / (1 + np.abs(J).max(axis=1))
    assert np.quantile(off, 0.98) < 1e-5  # but where the nearest point changes within h


def test_residual_vanishes_where_both_fields_are_one(corner, rng):
    x = rng.uniform(0, 3, (50, 3))
    sample = sampled(PointField(corner), x)
    assert np.array_equal(residual(sample, sample), np.zeros(50))


def test_row_products(rng):
    a, b = rng.normal(size=(2, 20, 3))
    assert np.allclose(_core.moment_rows(a, b), np.hstack([np.cross(a, b), b]))
    assert np.allclose(row_dot(a, b), (a * b).sum(axis=1))
