"""A glance at two scans: a quarter of a registration tells which pairs are worth one."""

from __future__ import annotations

import numpy as np

from ..alignment.agreement import both_ways, mutual_score
from ..alignment.robust import anneal
from ..dof import Dof, allowed_poses
from ..scale import common_voxel
from ..search import search
from .scan import ThinScan

_MOST_UNLIKE = 4.0  # in voxels of their own: scans of places of so different a size are not looked at
_POSES = 6          # of one round of the search, that go on
_FINER = 4.0        # a right pose agrees better at a finer scale, one that looks alike does not


def glance(scan: ThinScan, other: ThinScan, seed: int, dof: Dof | None) -> float:
    """How well two scans agree, at a scale finer than the search's, in the best pose that one round of it finds."""
    one, two = scan.cloud, other.cloud
    ratio = one.scale.voxel / two.scale.voxel
    if not 1 / _MOST_UNLIKE < ratio < _MOST_UNLIKE:
        return 0.0
    voxel = common_voxel(one.scale, two.scale)
    held, moving = one.surface(voxel), two.surface(voxel)
    allowed = None if dof is None else allowed_poses(dof, None, held.origin, moving.origin, target_is_held=True)
    poses, _, _ = search(held, moving, seed, 1, allowed=allowed, rounds=1)
    if not len(poses):
        return 0.0
    poses, _ = anneal(held, moving, poses[:_POSES], seed, 1, allowed)
    finer = one.surface(voxel / _FINER), two.surface(voxel / _FINER)
    return float(mutual_score(*both_ways(*finer, np.ascontiguousarray(poses[:1]), 1))[0])
