"""Residual and Jacobian of the pseudo points between two distance fields."""

from __future__ import annotations

import numpy as np

from .. import _core
from ..fields.protocol import FieldSample, Floats


def residual(at_source: FieldSample, at_target: FieldSample) -> Floats:
    """phi(P_S, G^-1 P_a) - phi(P_tau, P_a), (L,): the squared distances' difference (paper eq. 11; 13 negates it)."""
    return at_source.value**2 - at_target.value**2


def jacobian(at_source: FieldSample, x: Floats) -> Floats:
    """J (L, 6) at the pseudo points x (L, 3) in the source's frame, for a twist (w, v) on their left (paper eq. 14).

    A row is the feature's gradient (eq. 15) times the warp Jacobian [-[x]_x, I] of a moved point; J is L x 6
    and never the L x 3 x L of the text, since each feature belongs to one pseudo point.
    """
    return _core.moment_rows(x, feature_gradient(at_source))


def feature_gradient(at_source: FieldSample) -> Floats:
    """Gradient of phi, the squared distance, (L, 3): 2 (x - p) (paper eq. 15)."""
    return np.asarray(2 * at_source.value[:, None] * at_source.gradient)


def row_dot(a: Floats, b: Floats) -> Floats:
    """Row by row dot product of (L, 3) arrays, (L,)."""
    return np.asarray(np.einsum("ij,ij->i", a, b))
