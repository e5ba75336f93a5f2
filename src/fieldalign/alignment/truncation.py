"""Truncation (paper Sec. IV-D, V-D): pseudo points that say nothing reliable are left out of an iteration."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..fields.protocol import FieldSample, Floats
from ..motions import rotate
from ..settings import Settings
from .residual import row_dot

Mask = NDArray[np.bool_]


def truncate(at_source: FieldSample, at_target: FieldSample, R: Floats, settings: Settings) -> tuple[Mask, bool]:
    """Which pseudo points to keep (L,), and whether they passed without the rules being relaxed.

    R (3, 3) turns directions of the target's frame into the source's. Too few left: the cosine is lowered by 0.1 at a
    time, below 0.1 the count rule is dropped, and below -1 all are kept; so it ends, which the rules as the program has
    them need not.
    """
    shared = unshared(at_source, at_target, settings)
    cosine = agreement(at_source, at_target, R, settings)
    kept = shared & (cosine > settings.min_cosine)
    strict = int(kept.sum()) >= settings.min_kept
    lowest = settings.min_cosine
    while int(kept.sum()) < settings.min_kept and lowest > -1:
        lowest -= 0.1
        kept = (shared if lowest > 0.1 else True) & (cosine > lowest)
    return (kept if int(kept.sum()) >= settings.min_kept else np.ones_like(kept)), strict


def unshared(at_source: FieldSample, at_target: FieldSample, settings: Settings) -> Mask:
    """Rule 1: no foot serves more than share_limit pseudo points, in either cloud."""
    if settings.share_limit is None:
        return np.ones(len(at_source.value), bool)
    most = np.maximum(at_source.served, at_target.served)
    return np.asarray(most <= settings.share_limit)


def agreement(at_source: FieldSample, at_target: FieldSample, R: Floats, settings: Settings) -> Floats:
    """The cosine that rule 2 tests, (L,)."""
    if settings.direction == "none":
        return np.ones(len(at_source.value))
    if settings.direction == "normals":  # the paper's words: the foot lies along the surface's normal
        return np.minimum(*(np.abs(row_dot(s.gradient, s.normal)) for s in (at_source, at_target)))
    return row_dot(at_source.direction, rotate(R, at_target.direction))
