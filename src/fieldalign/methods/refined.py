"""The last level of the robust method: one pose on the exact fields, and how well it is known there."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..alignment import Step, descend
from ..alignment.copies import meet
from ..alignment.robust import FieldStage, free_twists
from ..dof import Allowed, Remaining
from ..fields import PointField
from ..fields.protocol import Floats, planes_near
from ..motions import apply, exp_twist, inverse, log_motion, orthonormal, seen_from, translation
from ..scaled import ScaledCloud
from ..verdict import MIN_HOLD, Certainty, split
from .pair import Pair

_NEIGHBOURS = 10, 20        # in a plane: as many as a voxel holds, within these
_REACH = 0.6                # voxels from a pseudo point to its partner
_FIRST, _THEN, _EXACT = (1000, 8, 1.0), (5000, 5, 0.5), (np.inf, 5, 0.2)  # pseudo points; steps at most; the end
_DEVIATIONS = 3.0, 6.0      # of a quarter's weight: against points; against exact surfaces, where only noise is left
_MEETING = 5000             # points that must meet their copies
_HIDDEN, _ROUGH = 1.65, 1.1  # of the variance, what no residual shows: a factor, and the roughness that doubles it


@dataclass(frozen=True, eq=False)
class Refined:
    """Where the last level ended: the pose between the origins, its steps and what the last one saw; whether the clouds
    are copies whose points meet there."""

    G: Floats
    steps: tuple[Step, ...]
    last: FieldStage
    meets: bool = False


def refine(pair: Pair, G: Floats, allowed: Allowed | None = None) -> Refined:
    """The last level, on the exact fields: the first steps with few pseudo points, the last ones with all.

    allowed: the poses to stay among; None: those of the pair.
    """
    stage = last_level(pair, allowed)
    steps: tuple[Step, ...] = ()
    poses = orthonormal(G)[None]  # the search finds poses in float32
    for level in (_FIRST, _THEN) if pair.held.is_points else (_FIRST, _THEN, _EXACT):
        poses, taken = descend(stage.take(*level), poses)
        steps += taken
    return Refined(orthonormal(poses[0]), steps, stage)


def sketch(pair: Pair, G: Floats) -> Refined:
    """The first steps of the last level alone: enough to see how well a pose agrees."""
    poses, steps = descend(stage := last_level(pair).take(*_FIRST), orthonormal(G)[None])
    return Refined(orthonormal(poses[0]), steps, stage)


def last_level(pair: Pair, allowed: Allowed | None = None) -> FieldStage:
    """The stage that asks the exact fields."""
    held, moving = pair.surfaces()
    neighbours = int(np.clip(len(pair.moving.fine) / len(moving), *_NEIGHBOURS))
    planes = pair.pseudo_planes(neighbours).about(moving.origin)
    return FieldStage(
        pair.held.exact, held.origin, planes, neighbours, _REACH * pair.voxel, held.extent,
        _DEVIATIONS[0 if pair.held.is_points else 1], allowed or pair.allowed, pair.grows,
    )


def left_at(init: Floats, pair: Pair, refined: Refined) -> Refined:
    """Where nothing holds a part of the motion: that part as in the guess, and the rest refined with that part fixed.

    Solution remapping (Zhang, Kaess & Singh, On Degeneracy of Optimization-based State Estimation, ICRA 2016).
    """
    known, seen = certainty(pair, refined)
    open_directions = known.unobservable.shape[1]
    if not open_directions:
        return refined
    if not known.observable.shape[1]:
        return Refined(pair.pose(init), refined.steps, refined.last)
    to_reference = translation(-known.reference_point)
    T = pair.motion(refined.G)
    away = log_motion(to_reference @ init @ inverse(T) @ inverse(to_reference))
    remapped = inverse(to_reference) @ exp_twist(known.open_part(away)) @ to_reference @ T
    return refine(pair, pair.pose(remapped), Remaining(seen @ known.observable, pair.allowed))


def at_its_size(pair: Pair, refined: list[Refined]) -> tuple[Pair, list[Refined]]:
    """The pair with the source as large as the best pose found it, and the poses refined there."""
    growth = refined[0].last.growth
    poses = [r.G.copy() for r in refined]
    if not pair.is_swapped:  # instead of what moves having grown, the source that is held shrinks
        growth = 1 / growth
        for G in poses:
            G[:3, 3] *= growth
    assert isinstance(pair.source, ScaledCloud)
    pair = replace(pair, source=ScaledCloud(pair.source.original, growth * pair.source.factor))
    return pair, [refine(pair, G) for G in poses]


def at_copies(pair: Pair, refined: Refined) -> Refined:
    """Where both clouds are the same points, moved: the pose at which they meet, to the last digits."""
    if pair.grows or not pair.source.is_copy_of(pair.target):
        return refined
    held, moving = pair.surfaces()
    field, own = pair.held.field, pair.moving.field
    assert isinstance(field, PointField)
    assert isinstance(own, PointField)
    to_held, from_moving = translation(held.origin), translation(-moving.origin)
    met = meet(field, own.spread(_MEETING), to_held @ refined.G @ from_moving)
    if met is None:
        return refined
    G = inverse(to_held) @ met @ inverse(from_moving)
    if pair.allowed is not None and not np.allclose(pair.allowed.nearest(G[None]), G, atol=1e-9 * held.extent):
        return refined
    neighbours = _NEIGHBOURS[0]
    planes = planes_near(own, own.spread(_MEETING), neighbours).about(moving.origin)
    last = FieldStage(
        field, held.origin, planes, neighbours, _REACH * pair.voxel, held.extent, _DEVIATIONS[0], pair.allowed
    )
    _, steps = descend(last, G[None])  # only to see how well they meet
    return Refined(G, refined.steps + steps, last, meets=True)


def certainty(pair: Pair, refined: Refined) -> tuple[Certainty, Floats]:
    """What the last step knows, seen from the overlap's centroid; and what takes twists seen from there to those of the
    poses (n, n)."""
    last, (held, _) = refined.last, pair.surfaces()
    n = 6 + pair.grows
    centre = held.origin + last.overlap(refined.G)
    T = pair.motion(refined.G)
    rigid = np.eye(4) if pair.is_swapped else T
    seen = seen_from(rigid, 1 / last.growth, centre - held.origin)[:n, :n]
    A, S, hold = (seen.T @ M[:n, :n] @ seen for M in (last.curvature, last.gradient_scatter, last.hold))
    hidden = _HIDDEN * (1 + (last.roughness / _ROUGH) ** 2) if pair.held.is_points else 1.0
    free = None
    if pair.allowed is not None:
        free = free_twists(pair.allowed, refined.G[None], last.growth if pair.grows else None)[:n]
        free = np.asarray(np.linalg.solve(seen, free), float)
    known = split(A, hidden * S, hold, apply(rigid, centre[None])[0], last.extent / 4, MIN_HOLD, free)
    return known, seen
