"""A glance at two scans: a tenth of a registration tells which pairs are worth one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..alignment.agreement import both_ways, mutual_score
from ..alignment.robust import anneal
from ..dof import Dof
from ..fields.protocol import Floats
from ..methods.pair import Pair
from ..scale import common_voxel
from ..search import search
from .scan import ThinScan

_MOST_UNLIKE = 4.0  # in voxels of their own: scans of places of so different a size are not looked at
_POSES = 3          # of one round of the search, that go on
_FINER = 4.0        # a right pose agrees better at a finer scale, one that looks alike does not
_HALF = 0.005       # share of a surface that a sensor looked through, at which a pose counts half


def comparison(scan: ThinScan, other: ThinScan, unit: float, dof: Dof | None = None) -> Pair:
    """The pair of two scans, the other one its source, at a voxel that is a power of two of `unit`, a length: so the
    surfaces of a scan serve all that it is compared with."""
    voxel = unit * 2.0 ** np.round(np.log2(common_voxel(scan.cloud.scale, other.cloud.scale) / unit))
    return Pair(other.cloud, scan.cloud, float(voxel), dof)


def glance(scan: ThinScan, other: ThinScan, unit: float, seed: int, dof: Dof | None) -> float:
    """How well two scans agree, at a scale finer than the search's, in the best pose that one round of it finds; less
    where the one's surface stands where the other's sensor, if it is known, looked through."""
    if not 1 / _MOST_UNLIKE < scan.voxel / other.voxel < _MOST_UNLIKE:
        return 0.0
    pair = comparison(scan, other, unit, dof)
    poses, _, _ = search(*pair.surfaces(), seed, 1, allowed=pair.allowed, rounds=1)
    if not len(poses):
        return 0.0
    poses, _ = anneal(*pair.surfaces(), poses[:_POSES], seed, 1, pair.allowed)
    held, moving = (cloud.surface(pair.voxel / _FINER) for cloud in (pair.held, pair.moving))
    score = float(mutual_score(*both_ways(held, moving, np.ascontiguousarray(poses[:1]), 1))[0])
    through = looked_through(pair, pair.motion(poses[0])) or 0.0
    return score / (1 + (through / _HALF) ** 2)


def looked_through(pair: Pair, T_target_source: Floats) -> float | None:
    """The share of either surface that the other's sensor looked through, None where none is known: at a finer scale
    than the verdict on a lone pair has it, which is to stand furniture that was moved."""
    return replace(pair, voxel=pair.voxel / _FINER).seen_through(T_target_source)
