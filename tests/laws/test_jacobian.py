"""For every field: the analytic Jacobian is the derivative, also for small rotations with large translations."""

import numpy as np
import pytest

from fieldalign import _core
from fieldalign.alignment.residual import jacobian
from fieldalign.fields import PointField, sampled
from fieldalign.motions import apply, exp_twist, rotate, translation

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


# -------------------------------------------------------------------------------------------------- the robust residual

SCALE, MIN_COSINE, REACH = 0.4, 0.5, 2.0


class Meeting:
    """Pseudo points near planes that stand well apart, so that a small motion changes no partner; a pose between."""

    def __init__(self, rng, off=0.2, tilt=0.3, n=300):
        lattice = np.stack(np.meshgrid(*3 * [np.arange(7.0)]), axis=-1).reshape(-1, 3)[:n]
        # Single precision is what the grid keeps.
        self.means = (8 * lattice + rng.uniform(-1, 1, (n, 3))).astype(np.float32).astype(float)
        self.normals = unit(rng.normal(size=(n, 3))).astype(np.float32).astype(float)
        self.pose = translation([3, -2, 1]) @ exp_twist(np.r_[rng.normal(size=3), 0, 0, 0])
        self.offsets = rng.normal(0, 0.3, n)
        signs = rng.choice([-1.0, 1.0], (n, 1))
        own = signs * unit(self.normals + tilt * rng.normal(size=(n, 3)))
        x = self.means + self.offsets[:, None] * own + off * rng.normal(size=(n, 3))
        self.own_normals = rotate(self.pose[:3, :3].T, own)
        self.places = (x - self.pose[:3, 3]) @ self.pose[:3, :3]

    def sums(self, pose):
        grid = _core.ClosestGrid(self.means, self.normals, 0.5, 3.0)
        H, g, totals = grid.robust_sums(
            self.places, self.own_normals, self.offsets, pose[None], SCALE, MIN_COSINE, REACH, False, 1
        )
        return H[0], g[0], totals[0]

    def between(self, pose):
        """The halved normals at a pose, the cosines, and which pseudo points are kept."""
        x, own = apply(pose, self.places), rotate(pose[:3, :3], self.own_normals)
        cosine = (own * self.normals).sum(axis=1)
        N = unit(self.normals * np.sign(cosine)[:, None] + own)
        kept = (np.abs(cosine) >= MIN_COSINE) & (np.linalg.norm(x - self.means, axis=1) <= REACH)
        return N, np.abs(cosine), kept

    def residuals(self, pose, N=None):
        """N.(x - m) - offset N.n', by NumPy; with the halved normals held where they are given."""
        x, own = apply(pose, self.places), rotate(pose[:3, :3], self.own_normals)
        held = self.between(pose)[0] if N is None else N
        return (held * (x - self.means)).sum(axis=1) - self.offsets * (held * own).sum(axis=1)


def unit(v):
    return v / np.linalg.norm(v, axis=1)[:, None]


def derivative(f, h=1e-6):
    """Of f(pose change) by a twist, (..., 6)."""
    return np.stack([(f(exp_twist(h * e)) - f(exp_twist(-h * e))) / (2 * h) for e in np.eye(6)], axis=-1)


def test_robust_gradient_is_that_of_the_loss(rng):
    """Geman and McClure's: sum of cosine scale^2 / 2 z^2 / (1 + z^2), with the normals between held for the step."""
    meeting = Meeting(rng)
    N, cosine, kept = meeting.between(meeting.pose)
    assert 100 < kept.sum() < 300

    def loss(change):
        # The offsets' own part, -offset N.n', turns with n' as well; the step leaves it where it is.
        r = meeting.residuals(meeting.pose, N) + (N * (apply(change, x) - x)).sum(axis=1)
        z2 = (r / SCALE) ** 2
        return (cosine * SCALE**2 / 2 * z2 / (1 + z2))[kept].sum()

    x = apply(meeting.pose, meeting.places)
    _, g, totals = meeting.sums(meeting.pose)
    assert totals[3] == kept.sum()
    numeric = derivative(loss)
    assert np.allclose(g, numeric, rtol=1e-6, atol=1e-6 * np.abs(numeric).max())


def test_robust_matrix_is_of_the_derivatives_of_the_residuals(rng):
    meeting = Meeting(rng)
    N, cosine, kept = meeting.between(meeting.pose)
    x = apply(meeting.pose, meeting.places)
    J = derivative(lambda change: (N * (apply(change, x) - x)).sum(axis=1))[kept]
    r = meeting.residuals(meeting.pose)[kept]
    w = cosine[kept] / (1 + (r / SCALE) ** 2) ** 2
    H, g, totals = meeting.sums(meeting.pose)
    assert np.allclose(H, (J * w[:, None]).T @ J, rtol=1e-6, atol=1e-6 * np.abs(H).max())
    assert np.allclose(g, J.T @ (w * r), rtol=1e-6, atol=1e-6 * np.abs(g).max())
    assert np.allclose(totals[:2], [w.sum(), (w * r**2).sum()])

    def slope(r):
        return cosine[kept] * r / (1 + (r / SCALE) ** 2) ** 2

    h = 1e-6
    assert totals[2] == pytest.approx(((slope(r + h) - slope(r - h)) / (2 * h)).sum(), rel=1e-6)


def test_robust_residuals_turn_as_their_rows_say_where_the_surfaces_meet(rng):
    """There even the halved normals may turn along: the row is the derivative of all that the residual depends on."""
    meeting = Meeting(rng, off=0.0, tilt=0.0)
    N, _, kept = meeting.between(meeting.pose)
    assert kept.all()
    assert np.abs(meeting.residuals(meeting.pose)).max() < 1e-6
    x = apply(meeting.pose, meeting.places)
    rows = _core.moment_rows(x, N)
    numeric = derivative(lambda change: meeting.residuals(change @ meeting.pose))
    assert np.abs(numeric - rows).max() < 1e-6 * np.abs(rows).max()


def test_a_step_of_the_robust_method_lowers_what_is_left(rng):
    """From a degree and a decimetre off, ten steps lead back, for any pose."""
    meeting = Meeting(rng, off=0.0, tilt=0.1)
    pose = exp_twist(np.r_[0.003 * rng.normal(size=3), 0.05 * rng.normal(size=3)]) @ meeting.pose
    for _ in range(10):
        H, g, _ = meeting.sums(pose)
        pose = exp_twist(-np.linalg.solve(H, g)) @ pose
    assert np.abs(pose - meeting.pose).max() < 1e-6
