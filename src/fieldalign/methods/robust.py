"""The robust method on a pair: from any pose to the last digit.

    scale     the voxel, from both clouds
    prepare   surfels of both; the grid and the pair table of one, which is held, the probes of the other, which moves
    search    hypotheses of pose (search.py), unless there is a guess to start from
    anneal    all of them at once, from coarse to fine (alignment/robust.py)
    refine    the best, on the exact fields, to convergence (refined.py)
    judge     what speaks for each pose and against it (judged.py, verdict/)
    points    where there are no surfels to speak of, the paper's method from many turns (by_points.py)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..alignment import descend
from ..alignment.agreement import best_distinct
from ..alignment.residual import row_dot
from ..alignment.robust import anneal
from ..clock import Clock
from ..dof import Dof
from ..fields.protocol import Floats
from ..motions import apply, exp_twist, translation
from ..prepared import PreparedCloud
from ..result import RegistrationResult
from ..scale import common_voxel
from ..search import ROUNDS, Confinement, search
from ..surface import main_axes
from ..threads import side_by_side
from .by_points import by_points, is_for_points
from .judged import CLEARLY_OTHER, RIVAL, Contest, judged
from .pair import Pair
from .refined import Refined, at_copies, at_its_size, last_level, left_at, refine

_MOST_RIVALS = 4            # poses that the last level sees
_AROUND, _AROUND_FREE = 8, 24  # poses tried around a guess; where a dof leaves few others
_STRAY = 0.1                # of the extent: how far they are shifted


@dataclass(frozen=True, eq=False)
class Start:
    """init: (4, 4), a guess of T_target_source, or None. searches: whether poses are searched for, within `radius` (the
    clouds' unit) and `angle` (rad) of the guess where there is one. dof: what is free, counted from the guess, or None:
    all. grows: whether the scale is free, too. by_points: whether clouds without surfels are tried by their points."""

    init: Floats | None
    searches: bool
    radius: float = np.inf
    angle: float = np.pi
    dof: Dof | None = None
    grows: bool = False
    by_points: bool = True

    @property
    def searches_everywhere(self) -> bool:
        """Whether no pose is left out."""
        return self.searches and (self.init is None or bool(np.isinf(self.radius) and self.angle == np.pi))


def register_robust(
    source: PreparedCloud, target: PreparedCloud, start: Start, seed: int, threads: int, clock: Clock,
    other_scale: float = 0.0,
) -> RegistrationResult:
    """From any pose, or from a guess, to a result. other_scale: the best score of a clearly different scale."""
    pair = _prepared_pair(source, target, start, threads, clock)
    held, moving = pair.surfaces()
    poses = starting_poses(pair, start, seed, threads)
    clock.lap("search")
    poses, scores = anneal(held, moving, poses, seed, threads, pair.allowed)
    contest = _contest(pair, poses, scores, pair.guessed_pose, start.searches_everywhere, seed, threads)
    if start.searches:  # from a confined search, steps may lead out of where it was confined to
        inside = np.array([pair.is_within(start.angle, pair.motion(G)) for G in poses])
        poses, scores = (poses[inside], scores[inside]) if inside.any() else (poses, scores)
    contest = replace(contest, other_scale=other_scale)
    clock.lap("anneal")
    refined = [at_copies(pair, refine(pair, G)) for G in _rivals(pair, poses, scores)]
    if pair.grows:
        pair, refined = at_its_size(pair, refined)
    elif start.init is not None:
        refined = [left_at(start.init, pair, r) for r in refined]
    clock.lap("refine")
    best, *others = judged(pair, refined, contest, threads)
    clock.lap("judge")
    if start.searches and start.by_points and not refined[0].meets and is_for_points(pair, best.reason):
        by_them = by_points(pair, refined[0], start.angle, seed, threads)
        if by_them is not refined[0]:
            best, *others = judged(pair, [by_them], contest, threads)
        clock.lap("points")
    return replace(best, seconds=clock.laps, alternatives=tuple(others))


def verify_robust(
    source: PreparedCloud, target: PreparedCloud, T: Floats, searches: bool, seed: int, threads: int, clock: Clock,
    dof: Dof | None = None,
) -> RegistrationResult:
    """The verdict on a pose T_target_source (4, 4) as it is; other poses are searched for, or only tried around it."""
    start = Start(None, searches, dof=dof)
    pair = _prepared_pair(source, target, start, threads, clock)
    held, moving = pair.surfaces()
    G = pair.pose(T)
    poses, scores = np.empty((0, 4, 4)), np.empty(0)
    if searches:
        poses, scores = anneal(held, moving, starting_poses(pair, start, seed, threads), seed, threads, pair.allowed)
    clock.lap("search")
    contest = _contest(pair, poses, scores, G, searches, seed, threads)
    clock.lap("anneal")
    _, steps = descend(last := last_level(pair), G[None])
    clock.lap("refine")
    (result,) = judged(pair, [Refined(G, steps, last)], contest, threads)
    clock.lap("judge")
    return replace(result, T_target_source=T, seconds=clock.laps)


def _prepared_pair(
    source: PreparedCloud, target: PreparedCloud, start: Start, threads: int, clock: Clock
) -> Pair:
    """Both clouds at one scale, with all that the search and the alignment look up."""
    scales = side_by_side(threads, lambda: source.scale, lambda: target.scale)
    pair = Pair(source, target, common_voxel(*scales), start.dof, start.init, start.grows)
    clock.lap("scale")
    side_by_side(threads, lambda: source.surface(pair.voxel), lambda: target.surface(pair.voxel))
    clock.lap("surfels")
    held, moving = pair.surfaces()
    side_by_side(
        threads,
        lambda: held.fine_grid,
        lambda: start.searches and held.pairs,
        lambda: (held.coarse_grid, held.weights),
        lambda: (moving.coarse_grid, moving.weights),
    )
    clock.lap("lookups")
    return pair


def starting_poses(pair: Pair, start: Start, seed: int, threads: int, rounds: int = ROUNDS) -> Floats:
    """Poses (B, 4, 4) to anneal: the guess and what the search found; without either, the main axes on each other."""
    held, moving = pair.surfaces()
    guess = pair.guessed_pose
    poses = [] if guess is None else [guess]
    if start.searches:
        within = None if guess is None else Confinement(guess, start.radius, start.angle)
        poses.extend(search(held, moving, seed, threads, within, pair.allowed, rounds)[0])
    return np.stack(poses or main_axes(held, moving))


def _contest(
    pair: Pair, poses: Floats, scores: Floats, guess: Floats | None, searched: bool, seed: int, threads: int
) -> Contest:
    """The poses that a pose is measured by: those found, and where none of these is clearly another, some around the
    guess."""
    found_others = bool(len(poses)) and CLEARLY_OTHER.differ(poses, poses[0], pair.middle, pair.voxel).any()
    centre, count = guess, _AROUND
    if pair.allowed is not None:  # where little is free, the allowed poses are too few to tell what chance brings about
        centre, count, found_others = poses[0] if len(poses) else guess, _AROUND_FREE, False
    if centre is not None and not found_others:
        around = anneal(*pair.surfaces(), _around(centre, pair, count, seed), seed, threads)
        poses, scores = np.concatenate([poses, around[0]]), np.r_[scores, around[1]]
    return Contest(poses, scores, searched)


def _around(guess: Floats, pair: Pair, count: int, seed: int) -> Floats:
    """Poses (B, 4, 4) anywhere around a guess: turned about the middle of what moves, and shifted."""
    rng = np.random.default_rng(seed)
    axes, shifts = rng.normal(size=(2, count, 3))
    axes *= (rng.uniform(0.3, np.pi, count) / np.sqrt(row_dot(axes, axes)))[:, None]
    middle = apply(guess, pair.middle[None])[0]
    shifts *= _STRAY * pair.surfaces()[1].extent
    from_middle = translation(-middle) @ guess
    turns = (exp_twist(np.r_[axis, np.zeros(3)]) @ from_middle for axis in axes)
    return np.stack([translation(middle + shift) @ turned for shift, turned in zip(shifts, turns, strict=True)])


def _rivals(pair: Pair, poses: Floats, scores: Floats) -> list[Floats]:
    """The best pose (4, 4), and those that score almost as well and are clearly others."""
    close = scores >= RIVAL * scores[0]
    rows = best_distinct(poses[close], scores[close], pair.middle, CLEARLY_OTHER, pair.voxel, _MOST_RIVALS)
    return [poses[k] for k in rows]
