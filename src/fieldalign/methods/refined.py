"""The last level of the robust method: one pose on the exact fields, and how well it is known there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..alignment import Step, descend
from ..alignment.copies import meet
from ..alignment.robust import FieldStage
from ..fields import PointField
from ..fields.protocol import Floats, planes_near
from ..motions import adjoint, apply, exp_twist, inverse, log_motion, nearest_rotation, translation
from ..verdict import MIN_HOLD, Certainty, split
from .pair import Pair

_NEIGHBOURS = 10, 20        # in a plane: as many as a voxel holds, within these
_REACH = 0.6                # voxels from a pseudo point to its partner
_HALVES = (5, 8, 1.0), (1, 5, 0.5)  # of so many pseudo points one; at most so many steps; the end
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


def refine(pair: Pair, G: Floats, allowed: Floats | None = None) -> Refined:
    """The last level, on the exact fields: the first steps with few pseudo points, the last ones with all."""
    sketch, full = (last_level(pair, *half, allowed) for half in _HALVES)
    poses, first = descend(sketch, G[None])
    (G,), last = descend(full, poses)
    G[:3, :3] = nearest_rotation(G[:3, :3])
    return Refined(G, first + last, full)


def last_level(
    pair: Pair, stride: int = 1, iterations: int = 1, patience: float = 0.0, allowed: Floats | None = None
) -> FieldStage:
    """Of the pseudo points one in `stride`, for so many steps."""
    held, moving = pair.surfaces()
    neighbours = int(np.clip(len(pair.moving.fine) / len(moving), *_NEIGHBOURS))
    planes = pair.moving.pseudo_planes(neighbours).about(moving.origin)
    lengths = _REACH * pair.voxel, held.extent
    return FieldStage(
        pair.held.exact, held.origin, planes[::stride], neighbours, *lengths, iterations, patience, allowed
    )


def left_at(init: Floats, pair: Pair, refined: Refined) -> Refined:
    """Where nothing holds a part of the motion: that part as in the guess, and the rest refined with that part fixed.

    Solution remapping (Zhang, Kaess & Singh, On Degeneracy of Optimization-based State Estimation, ICRA 2016).
    """
    known, seen_from = certainty(pair, refined)
    open_directions = known.unobservable.shape[1]
    if open_directions in (0, 6):
        return Refined(pair.pose(init), refined.steps, refined.last) if open_directions else refined
    to_reference = translation(-known.reference_point)
    T = pair.motion(refined.G)
    away = log_motion(to_reference @ init @ inverse(T) @ inverse(to_reference))
    remapped = inverse(to_reference) @ exp_twist(known.open_part(away)) @ to_reference @ T
    return refine(pair, pair.pose(remapped), seen_from @ known.observable)


def at_copies(pair: Pair, refined: Refined) -> Refined:
    """Where both clouds are the same points, moved: the pose at which they meet, to the last digits."""
    if not pair.source.is_copy_of(pair.target):
        return refined
    held, moving = pair.surfaces()
    field, own = pair.held.field, pair.moving.field
    assert isinstance(field, PointField)
    assert isinstance(own, PointField)
    to_held, from_moving = translation(held.origin), translation(-moving.origin)
    met = meet(field, own.spread(_MEETING), to_held @ refined.G @ from_moving)
    if met is None:
        return refined
    neighbours = _NEIGHBOURS[0]
    planes = planes_near(own, own.spread(_MEETING), neighbours).about(moving.origin)
    last = FieldStage(field, held.origin, planes, neighbours, _REACH * pair.voxel, held.extent, 1, 0)
    G = inverse(to_held) @ met @ inverse(from_moving)
    _, steps = descend(last, G[None])  # only to see how well they meet
    return Refined(G, refined.steps + steps, last, meets=True)


def certainty(pair: Pair, refined: Refined) -> tuple[Certainty, Floats]:
    """What the last step knows, seen from the overlap's centroid; and what takes twists seen from there to those of the
    poses (6, 6)."""
    last, (held, _) = refined.last, pair.surfaces()
    T = pair.motion(refined.G)
    target_from_held = translation(held.origin) if pair.is_swapped else T @ translation(held.origin)
    reference = apply(target_from_held, last.overlap(refined.G)[None])[0]
    seen_from = adjoint(inverse(target_from_held) @ translation(reference))
    A, S, hold = (seen_from.T @ M @ seen_from for M in (last.curvature, last.gradient_scatter, last.hold))
    hidden = _HIDDEN * (1 + (last.roughness / _ROUGH) ** 2)
    return split(A, hidden * S, hold, reference, last.extent / 4, MIN_HOLD), seen_from
