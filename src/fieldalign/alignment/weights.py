"""The linear step: direct (paper eq. 16), or reweighted for the sum of absolute residuals (paper Sec. IV-C)."""

from __future__ import annotations

from .. import _core
from ..fields.protocol import Floats
from ..settings import Settings


def linear_step(J: Floats, r: Floats, weights: Floats, settings: Settings) -> tuple[Floats, Floats]:
    """The twist (6,) that best makes J x + r vanish, and the weights (L,) of the pseudo points that led to it.

    With irls, sum |J x + r| is minimised: each round weighs by |J x + r|^(p - 2), p = 1, but no more than residuals of
    irls_distance^2 do, starting from `weights`. Without it, |J x + r|^2 is, by the pseudo-inverse of eq. (16).
    """
    if not settings.irls:
        return _core.direct(J, r), weights
    floor = settings.irls_distance**2
    return _core.reweighted(J, r, weights, floor, settings.unit, settings.irls_tolerance, settings.irls_steps)
