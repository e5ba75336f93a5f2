"""The robust method on a pair: from any pose to the last digit.

    scale     the voxel, from both clouds
    prepare   surfels of both; the grid and the pair table of one, which is held, the probes of the other, which moves
    search    hypotheses of pose (search.py), unless there is a guess to start from
    anneal    all of them at once, from coarse to fine (alignment/robust.py)
    refine    the best, on the exact fields, to convergence
    judge     overlap, rivals, directions without hold (verdict.py)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..alignment import Step, descend
from ..alignment.copies import meet
from ..alignment.robust import Agreement, FieldStage, agreement, anneal
from ..clock import Clock
from ..fields import PointField
from ..fields.protocol import Floats, planes_near
from ..motions import adjoint, apply, inverse, nearest_rotation, reach_of, translation
from ..prepared import PreparedCloud
from ..result import Reason, RegistrationResult
from ..scale import common_voxel
from ..search import Confinement, search
from ..surface import main_axes
from ..threads import side_by_side
from ..verdict import STILL, Certainty, judge_robust, split
from .pair import Pair

_RIVAL = 0.9                # of the best score: a pose that agrees as well
_MOST_RIVALS = 4            # poses that the last level sees
_APART_COSINE, _APART = 0.966, 5.0   # 15 degrees, or voxels: poses that are clearly others
_NEIGHBOURS = 10, 20        # in a plane of the last level: as many as a voxel holds, within these
_REACH = 0.6                # voxels from a pseudo point to its partner, at the last level
_HALVES = (5, 8, 1.0), (1, 5, 0.5)  # of the last level: of so many pseudo points one; at most so many steps; the end
_MEETING = 5000             # points that must meet their copies
_LEAST_HOLD = 1e-3, 5e-3    # of the best held direction's information: what noise gives, within these, is no hold


@dataclass(frozen=True, eq=False)
class Start:
    """init: (4, 4), a guess of T_target_source, or None. searches: whether poses are searched for, within `radius` (the
    clouds' unit) and `angle` (rad) of the guess where there is one."""

    init: Floats | None
    searches: bool
    radius: float
    angle: float


@dataclass(frozen=True, eq=False)
class Refined:
    """Where the last level ended: the pose between the origins, its steps, and what the last one saw."""

    G: Floats
    steps: tuple[Step, ...]
    last: FieldStage


def register_robust(
    source: PreparedCloud, target: PreparedCloud, start: Start, seed: int, threads: int, clock: Clock
) -> RegistrationResult:
    """From any pose, or from a guess, to a result."""
    scales = side_by_side(threads, lambda: source.scale, lambda: target.scale)
    pair = Pair(source, target, common_voxel(*scales))
    clock.lap("scale")
    side_by_side(threads, lambda: source.surface(pair.voxel), lambda: target.surface(pair.voxel))
    clock.lap("surfels")
    held, moving = pair.surfaces()
    side_by_side(
        threads,
        lambda: held.fine_grid,
        lambda: start.searches and held.pairs,
        lambda: held.coarse_grid,
        lambda: moving.coarse_grid,
    )
    clock.lap("lookups")
    poses = _starting_poses(pair, start, seed, threads)
    clock.lap("search")
    poses, scores = anneal(held, moving, poses, seed, threads)
    clock.lap("anneal")
    refined = [_meet(pair, _refine(pair, G)) for G in _rivals(pair, poses, scores)]
    clock.lap("refine")
    best, *others = _judged(pair, refined, threads)
    clock.lap("judge")
    return replace(best, seconds=clock.laps, alternatives=tuple(others))


def _starting_poses(pair: Pair, start: Start, seed: int, threads: int) -> Floats:
    """Poses (B, 4, 4) to anneal: the guess and what the search found; without either, the main axes on each other."""
    held, moving = pair.surfaces()
    guess = None if start.init is None else pair.pose(start.init)
    poses = [] if guess is None else [guess]
    if start.searches:
        within = None if guess is None else Confinement(guess, start.radius, start.angle)
        poses.extend(search(held, moving, seed, threads, within)[0])
    return np.stack(poses or main_axes(held, moving))


def _rivals(pair: Pair, poses: Floats, scores: Floats) -> list[Floats]:
    """The best pose (4, 4), and those that score almost as well and are clearly others."""
    middle = pair.surfaces()[1].places.mean(axis=0)[None]
    chosen: list[Floats] = []
    for G, score in zip(poses, scores, strict=True):
        if chosen and score < _RIVAL * scores[0]:
            break
        if all(_differ(G, other, middle, _APART * pair.voxel) for other in chosen):
            chosen.append(G)
    return chosen[:_MOST_RIVALS]


def _differ(G: Floats, other: Floats, middle: Floats, distance: float) -> bool:
    """Whether two poses turn by clearly different angles, or move the middle (1, 3) to clearly different places."""
    cosine = (np.sum(G[:3, :3] * other[:3, :3]) - 1) / 2
    return bool(cosine < _APART_COSINE or np.linalg.norm(apply(G, middle) - apply(other, middle)) > distance)


def _refine(pair: Pair, G: Floats) -> Refined:
    """The last level, on the exact fields: the first steps with few pseudo points, the last ones with all."""
    held, moving = pair.surfaces()
    neighbours = int(np.clip(len(pair.moving.fine) / len(moving), *_NEIGHBOURS))
    planes = pair.moving.pseudo_planes(neighbours).about(moving.origin)
    lengths = _REACH * pair.voxel, held.extent
    sketch, full = (
        FieldStage(pair.held.exact, held.origin, planes[::stride], neighbours, *lengths, iterations, patience)
        for stride, iterations, patience in _HALVES
    )
    poses, first = descend(sketch, G[None])
    (G,), last = descend(full, poses)
    G[:3, :3] = nearest_rotation(G[:3, :3])
    return Refined(G, first + last, full)


def _meet(pair: Pair, refined: Refined) -> Refined:
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
    return Refined(G, refined.steps + steps, last)


def _judged(pair: Pair, refined: list[Refined], threads: int) -> list[RegistrationResult]:
    """A result for each pose that agrees about as well as the best, best first."""
    held, moving = pair.surfaces()
    poses = np.stack([r.G for r in refined])
    there = agreement(held, moving, poses, threads)
    back = agreement(moving, held, np.stack([inverse(r.G) for r in refined]), threads)
    order = [k for k in np.argsort(-there.score, kind="stable") if there.score[k] >= _RIVAL * there.score.max()]
    return [_result(pair, refined[k], there.of(k), back.of(k), rivals=len(order) - 1) for k in order]


def _result(pair: Pair, refined: Refined, there: Agreement, back: Agreement, rivals: int) -> RegistrationResult:
    """What is known of one pose; there and back: how the moving surface lies on the held one, and the other way."""
    T = pair.motion(refined.G)
    last = refined.last
    known = _certainty(pair, refined, T)
    moved = reach_of(refined.steps[-1].increment, last.extent)
    reason = judge_robust(there, back, known, rivals, has_converged=moved <= STILL * last.extent)
    on_source, on_target = (there, back) if pair.is_swapped else (back, there)
    return RegistrationResult(
        T_target_source=T,
        accepted=reason is Reason.ACCEPTED,
        reason=reason,
        overlap=float(on_source.on[0]),
        overlap_target=float(on_target.on[0]),
        information=known.information,
        covariance=known.covariance,
        unobservable=known.unobservable,
        reference_point=known.reference_point,
        iterations=len(refined.steps),
        rmse=last.rmse,
        seconds={},
        history=refined.steps,
        dropped=(pair.source.dropped, pair.target.dropped),
    )


def _certainty(pair: Pair, refined: Refined, T: Floats) -> Certainty:
    """The last level's Gauss-Newton matrix over the residuals' variance, seen from the overlap's centroid."""
    last, (held, _) = refined.last, pair.surfaces()
    target_from_held = translation(held.origin) if pair.is_swapped else T @ translation(held.origin)
    reference = apply(target_from_held, last.overlap(refined.G)[None])[0]
    seen_from = adjoint(inverse(target_from_held) @ translation(reference))
    noise = max(last.rmse, 1e-12 * last.extent) or 1.0  # 1: all surfels in one place, which say nothing anyway
    information = seen_from.T @ last.H @ seen_from / noise**2
    least = float(np.clip(last.hold_by_chance, *_LEAST_HOLD))
    return split(information, reference, last.extent / 4, least)
