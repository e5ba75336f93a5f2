"""The scale, too: the source is tried at several sizes, and goes on at the one at which it agrees best."""

from __future__ import annotations

import numpy as np

from ..alignment.robust import anneal
from ..clock import Clock
from ..motions import size_of
from ..prepared import PreparedCloud
from ..result import RegistrationResult
from ..scale import common_voxel
from ..scaled import ScaledCloud
from .pair import Pair
from .robust import Start, register_robust, starting_poses

_STEPS = 12           # of sizes, to twice the size
_OCTAVES = 1          # the size is sought from half to twice what the surfaces suggest
_ROUNDS = 3           # of draws, for each size
_CANDIDATES = 12      # poses that go on from there
_FINALISTS = 4        # sizes that are searched as long as need be
_CLEARLY_OTHER = 2.5  # steps: a clearly different size


def register_similar(
    source: PreparedCloud, target: PreparedCloud, start: Start, seed: int, threads: int, clock: Clock
) -> RegistrationResult:
    """From any pose and any size within a factor of two of what the surfaces suggest, or from a guess, to a result."""
    if start.init is not None and not start.searches:
        return register_robust(ScaledCloud(source, size_of(start.init)), target, start, seed, threads, clock)
    middle = _ratio(source, target) if start.init is None else size_of(start.init)
    steps = np.arange(-_OCTAVES * _STEPS, _OCTAVES * _STEPS + 1)
    sizes = middle * 2 ** (steps / _STEPS)
    voxel = common_voxel(source.scale.scaled(middle), target.scale)

    def score(size: float, **effort: int) -> float:
        pair = Pair(ScaledCloud(source, size), target, voxel, start.dof, start.init, grows=True)
        poses = starting_poses(pair, start, seed, threads, **effort)[:_CANDIDATES]
        return float(anneal(*pair.surfaces(), poses, seed, threads, pair.allowed)[1][0])

    scores = np.array([score(size, rounds=_ROUNDS) for size in sizes])
    for k in np.argsort(-scores, kind="stable")[:_FINALISTS]:
        scores[k] = score(sizes[k])
    best = int(np.argmax(scores))
    other = scores[np.abs(steps - steps[best]) > _CLEARLY_OTHER].max(initial=0.0)
    clock.lap("sizes")
    return register_robust(ScaledCloud(source, sizes[best]), target, start, seed, threads, clock, float(other))


def _ratio(source: PreparedCloud, target: PreparedCloud) -> float:
    """How much larger the target's surface is than the source's."""
    sizes = [cloud.surface(cloud.scale.voxel).size for cloud in (source, target)]
    return sizes[1] / sizes[0] if min(sizes) > 0 else target.extent / source.extent
