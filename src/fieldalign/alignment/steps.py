"""A Gauss-Newton step, made of the motions that are free."""

from __future__ import annotations

import numpy as np

from .. import _core
from ..dof import Allowed
from ..fields.protocol import Floats
from ..motions import exp_twist

LARGEST_TURN = 0.3   # rad, of a step
_NO_INFORMATION = 1e-13  # of the best known direction's


def take_steps(
    poses: Floats, H: Floats, g: Floats, stretch: Floats, allowed: Allowed | None
) -> tuple[Floats, Floats]:
    """Twists -stretch H^+ g (B, 6) among those that are free, and the poses (B, 4, 4) that they lead to."""
    if allowed is None:
        return _core.take_steps(poses, np.ascontiguousarray(H), np.ascontiguousarray(g), stretch, LARGEST_TURN)
    twists = minimisers(H, g, allowed.twists(poses)) * stretch[:, None]
    turns = np.linalg.norm(twists[:, :3], axis=1, keepdims=True)
    twists *= np.minimum(1, LARGEST_TURN / np.maximum(turns, LARGEST_TURN))
    return twists, allowed.nearest(np.stack([exp_twist(x) for x in twists]) @ poses)


def minimisers(H: Floats, g: Floats, basis: Floats) -> Floats:
    """-H^+ g (B, n) for H (B, n, n), g (B, n), within the columns of a basis (B, n, m).

    The columns are brought to one size first, so that no unit decides what counts as no information.
    """
    within = np.swapaxes(basis, -1, -2) @ H @ basis
    size = np.sqrt(np.einsum("bmm->bm", within))
    size = 1 / np.where(size > 0, size, np.inf)
    undo = np.linalg.pinv(size[:, :, None] * within * size[:, None], rcond=_NO_INFORMATION, hermitian=True)
    toward = size * np.einsum("bnm,bn->bm", basis, g)
    return np.asarray(-np.einsum("bnm,bm->bn", basis, size * np.einsum("bmk,bk->bm", undo, toward)))
