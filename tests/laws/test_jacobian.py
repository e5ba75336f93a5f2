"""For every field: the analytic Jacobian is the derivative, also for small rotations with large translations."""

import numpy as np
import pytest

from fieldalign.alignment.residual import jacobian
from fieldalign.fields import PointField, sampled
from fieldalign.motions import apply, exp_twist, translation

FIELDS = {
    "points": lambda points: PointField(points),
    "mean of 5 points": lambda points: PointField(points, neighbours=5),
}


@pytest.mark.parametrize("name", FIELDS)
@pytest.mark.parametrize("shift", [0.0, 1.0, 50.0])
def test_jacobian_at_a_pose(corner, rng, name, shift):
    field = FIELDS[name](corner)
    G_inv = translation([shift, -shift, 0.5 * shift]) @ exp_twist(np.r_[1e-3 * rng.normal(size=3), 0, 0, 0])
    x = apply(G_inv, rng.uniform(0, 3, (300, 3)))
    h = 1e-6 / (1 + shift)
    phi = [[sampled(field, apply(exp_twist(s * h * e), x)).value ** 2 for s in (1, -1)] for e in np.eye(6)]
    numeric = np.stack([(after - before) / (2 * h) for after, before in phi], axis=1)
    J = jacobian(sampled(field, x), x)
    off = np.abs(numeric - J).max(axis=1) / np.abs(J).max(axis=1).clip(1e-3)
    assert np.quantile(off, 0.98) < 1e-4  # the rest: places whose nearest point changes within h
