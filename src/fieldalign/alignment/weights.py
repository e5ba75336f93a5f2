"""The linear step: direct (paper eq. 16), or reweighted for the sum of absolute residuals (paper Sec. IV-C)."""

from __future__ import annotations

import numpy as np

from .. import _core
from ..fields.protocol import Floats
from ..settings import Settings


def direct(J: Floats, r: Floats) -> Floats:
    """The twist (6,) that minimises |J x + r|^2 (paper eq. 16, J^+ (phi_target - phi_source))."""
    return solve(*_core.normal_equations(J, r, np.ones(len(r))))


def reweighted(J: Floats, r: Floats, weights: Floats, settings: Settings) -> tuple[Floats, Floats]:
    """The twist (6,) that minimises the sum of |J x + r|, and the weights (L,) it ends with.

    Iteratively reweighted least squares with p = 1: weight |J x + r|^(p - 2), bounded near zero.
    """
    floor = settings.irls_distance**2
    unit = np.array([1, 1, 1, settings.unit, settings.unit, settings.unit])
    x = np.zeros(6)
    for _ in range(settings.irls_steps):
        before, x = x, solve(*_core.normal_equations(J, r, weights))
        weights = 1 / np.maximum(floor, np.abs(predicted(J, r, x)))
        if np.abs((x - before) / unit).sum() < settings.irls_tolerance:
            break
    return x, weights


def predicted(J: Floats, r: Floats, x: Floats) -> Floats:
    """J x + r, (L,), summed in one order; a BLAS may choose its own by the number of threads."""
    return np.asarray(np.einsum("ij,j->i", J, x) + r)


def solve(H: Floats, g: Floats) -> Floats:
    """x = -H^+ g: the pseudo-inverse, so that directions without any information get no step.

    Rotations and translations are first brought to one size, so that the unit of length does not decide what counts as
    no information.
    """
    turn, shift = np.trace(H[:3, :3]), np.trace(H[3:, 3:])
    length = np.sqrt(turn / shift) if turn > 0 and shift > 0 else 1.0
    scale = np.array([1, 1, 1, length, length, length])
    values, vectors = np.linalg.eigh(H * scale[:, None] * scale)
    known = values > 1e-13 * max(values[-1], 0.0)
    inverted = np.where(known, 1 / np.where(known, values, 1), 0)
    return np.asarray(-scale * (vectors @ (inverted * (vectors.T @ (scale * g)))))
