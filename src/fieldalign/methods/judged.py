"""From refined poses to results: what is known of each, and whether it may be used."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..alignment.agreement import Agreement, Apart, both_ways, mutual_score
from ..fields.protocol import Floats
from ..motions import reach_of
from ..result import RegistrationResult
from ..verdict import MIN_MARGIN, Evidence, freedoms
from .pair import Pair
from .refined import Refined, certainty, sketch

CLEARLY_OTHER = Apart(0.966, 5.0)  # 15 degrees, or voxels
RIVAL = 0.9               # of the best score: a pose that the data cannot tell from it
_EQUAL = 0.98             # of the best score: a pose that is as good; the one nearest to a guess comes first


_NEARLY_ALL = 0.95
_FINE_RIVALS = 3          # that are compared at the scale of the noise, where surfaces are known exactly


@dataclass(frozen=True, eq=False)
class Contest:
    """The poses (B, 4, 4) that a pose is compared with, and their scores (B,); whether all poses were searched; the
    best score of a clearly different scale."""

    poses: Floats
    scores: Floats
    searched: bool
    other_scale: float = 0.0

    def margin(self, G: Floats, score: float, pair: Pair) -> float:
        """By what factor a score is better than that of the best clearly different pose."""
        others = self.scores[CLEARLY_OTHER.differ(self.poses, G, pair.middle, pair.voxel)]
        return score / max(float(others.max(initial=self.other_scale)), 1e-12)


    def at_the_noise(self, refined: Refined, pair: Pair) -> float:
        """By what factor the squared residuals are smaller, seen at the scale of the noise, than in the best clearly
        different poses, refined. A smooth part agrees coarsely with itself in many poses, but exactly in one."""
        own = refined.last.distances(refined.G)
        near = own[np.isfinite(own)]
        if not len(near):
            return 0.0
        # Three deviations; or what nearly all keep to, where most of a surface is met much better than the rest.
        within = max(refined.last.scale / 2, float(np.quantile(near, _NEARLY_ALL)), 1e-300)

        def misfit(distances: Floats) -> float:
            return float((np.minimum(distances / within, 1.0) ** 2).mean())

        other = 1.0
        is_other = CLEARLY_OTHER.differ(self.poses, refined.G, pair.middle, pair.voxel)
        for G in self.poses[is_other][np.argsort(-self.scores[is_other], kind="stable")][:_FINE_RIVALS]:
            rival = sketch(pair, G)
            if CLEARLY_OTHER.differ(rival.G[None], refined.G, pair.middle, pair.voxel)[0]:
                other = min(other, misfit(rival.last.distances(rival.G)))
        return other / max(misfit(own), 1e-12)


def judged(pair: Pair, refined: list[Refined], contest: Contest, threads: int) -> list[RegistrationResult]:
    """A result for each pose that agrees about as well as the best, best first; of equal ones the one that turns least
    from the guess."""
    held, moving = pair.surfaces()
    if any(r.meets for r in refined):  # to the last digits: what only comes near is no rival
        refined = [r for r in refined if r.meets]
        contest = replace(contest, poses=contest.poses[:0], scores=contest.scores[:0])
    poses = np.stack([r.G for r in refined])
    there, back = both_ways(held, moving, poses, threads)
    scores = mutual_score(there, back)
    all_of_them = replace(
        contest, poses=np.concatenate([poses, contest.poses]), scores=np.r_[scores, contest.scores]
    )
    order = [k for k in np.argsort(-scores, kind="stable") if scores[k] >= RIVAL * scores.max()]
    if pair.guessed_pose is not None:
        unturned = np.einsum("bij,ij->b", poses[:, :3, :3], pair.guessed_pose[:3, :3])
        order.sort(key=lambda k: -unturned[k] if scores[k] >= _EQUAL * scores.max() else np.inf)
    return [_result(pair, refined[k], (there.of(k), back.of(k)), all_of_them) for k in order]


def _result(
    pair: Pair, refined: Refined, ways: tuple[Agreement, Agreement], contest: Contest
) -> RegistrationResult:
    """What is known of one pose; ways: how the moving surface lies on the held one, and the other way."""
    T, last, (there, back) = pair.motion(refined.G), refined.last, ways
    known, _ = certainty(pair, refined)
    margin = contest.margin(refined.G, float(mutual_score(there, back)[0]), pair)
    if margin < MIN_MARGIN and not pair.held.is_points:
        margin = max(margin, contest.at_the_noise(refined, pair))
    evidence = Evidence(
        met=float(max(there.met[0], back.met[0])),
        agreeing=float(np.sqrt(there.purity * back.purity)[0]),
        margin=margin,
        searched=contest.searched,
        seen_through=pair.seen_through(T),
        hold=float(known.hold[0]),
        off=reach_of(refined.steps[-1].increment, last.extent) / pair.voxel,
    )
    reason = evidence.reason
    on_source, on_target = (there, back) if pair.is_swapped else (back, there)
    return RegistrationResult(
        T_target_source=pair.similarity(refined.G, last.growth) if pair.grows else T,
        accepted=reason.accepts,
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
        evidence=evidence,
        freedoms=freedoms(known),
        dropped=(pair.source.dropped, pair.target.dropped),
    )


