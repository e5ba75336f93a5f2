"""Any pose: hypotheses from pairs of surfels that look alike, each tested on a few hundred probes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import _core
from .dof import Allowed
from .fields.protocol import Floats
from .surface import Surface

_PROBES = 400
ROUNDS = 16  # at most; fewer where one pose stands out
_SETTINGS = {
    "draws": 750,           # pairs drawn in a round
    "matches": 60,          # poses tried for a drawn pair, at most
    "min_cosine": 0.85,     # between normals that agree
    "penalty": 0.2,         # share of its probes near a surface that a wrong pose has on it by chance
    "doubt": 1.0,           # standard deviations below the shortlist at which a pose is dropped half-way
    "keep": 60,             # candidates
    "apart_cosine": 0.95,   # of the angle between candidates that differ
    "drift_cosine": 0.966,  # of the angle from a pose to the allowed one that it stands for
    "enough_hits": 8,       # of the best pose, to settle on it, where
    "distinct": 0.6,        # of its score is more than the next one's; or
    "alike": 0.85,          # of its score is less than that of all others
}
_APART = 3.0   # voxels between candidates that differ
_DRIFT = 5.0   # voxels from a pose to the allowed one that it stands for


@dataclass(frozen=True, eq=False)
class Confinement:
    """Where to search: near a guess (4, 4), the probes' middle at most `radius` from where the guess puts it,
    turned by at most `angle` (rad)."""

    guess: Floats
    radius: float
    angle: float


def search(
    held: Surface, moving: Surface, seed: int, threads: int, within: Confinement | None = None,
    allowed: Allowed | None = None, rounds: int = ROUNDS,
) -> tuple[Floats, Floats, int]:
    """Candidates for the pose that takes `moving` into `held`, about their origins.

    allowed: the poses that a dof allows; those found nearby stand for these. rounds: of draws, at most.
    Returns poses (c, 4, 4), best first, their scores (c,), and how many were tested. None are found where no pairs are:
    on a plane, a line, or in a cloud of a few points.
    """
    rng = np.random.default_rng(seed)
    drawn = moving.sparse
    probes = rng.choice(drawn, _PROBES)
    voxel = max(held.voxel, moving.voxel)
    settings = _SETTINGS | {
        "seed": int(rng.integers(2**63)), "rounds": rounds, "tolerance": voxel, "apart_distance": _APART * voxel,
        "drift_distance": _DRIFT * voxel, "facing": held.faces(moving),
    }
    near = None
    if within is not None:
        pivot = moving.places[probes].mean(axis=0)
        near = (np.ascontiguousarray(within.guess[None]), pivot, within.radius, float(np.cos(within.angle)))
    return _core.search(
        held.coarse_grid, held.pairs, moving.places[drawn], moving.normals[drawn], moving.places[probes],
        moving.normals[probes], near, None if allowed is None else allowed.packed, settings, threads,
    )
