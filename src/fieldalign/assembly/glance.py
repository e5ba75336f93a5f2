"""A glance at two scans: a few thousand poses of the any-pose search, a tenth of a registration, tell which pairs are
worth one."""

from __future__ import annotations

from ..scale import common_voxel
from ..search import search
from .scan import ThinScan

_MOST_UNLIKE = 4.0  # in voxels of their own: scans of places of so different a size are not looked at


def glance(scan: ThinScan, other: ThinScan, seed: int) -> float:
    """The score of the best pose that one round of the search finds: about 0.1 by chance, 0.3 where they overlap."""
    one, two = scan.cloud, other.cloud
    ratio = one.scale.voxel / two.scale.voxel
    if not 1 / _MOST_UNLIKE < ratio < _MOST_UNLIKE:
        return 0.0
    voxel = common_voxel(one.scale, two.scale)
    _, scores, _ = search(one.surface(voxel), two.surface(voxel), seed, 1, rounds=1)
    return float(scores[0]) if len(scores) else 0.0

