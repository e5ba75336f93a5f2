"""The paper's method on a pair: one guess, one set of pseudo points, one loop."""

from __future__ import annotations

from ..alignment import align
from ..alignment.residual import residual
from ..clock import Clock
from ..dof import Dof, allowed_poses
from ..fields import sampled
from ..fields.protocol import Floats
from ..motions import apply, inverse, translation
from ..prepared import PreparedCloud
from ..result import RegistrationResult
from ..settings import Settings
from ..threads import side_by_side
from ..verdict import Reason
from .paper_verdict import certainty, judge, overlaps, rmse


def register_by_paper(
    source: PreparedCloud,
    target: PreparedCloud,
    init: Floats | None,
    settings: Settings,
    seed: int,
    threads: int,
    clock: Clock,
    dof: Dof | None = None,
) -> RegistrationResult:
    """Yuan & Nüchter, RA-L 2022, from init (4, 4), or from the centroids laid on each other."""
    side_by_side(threads, source.build, target.build)
    clock.lap("prepare")
    pseudo, target_features = target.features(settings, seed, threads)
    clock.lap("pseudo points")
    T_start = translation(target.centre - source.centre) if init is None else init
    field = source.sampled_by(settings, threads)
    allowed = None if dof is None else allowed_poses(dof, init, source.centre, target.centre, target_is_held=False)
    found = align(field, target_features, pseudo, T_start, (source.centre, target.centre), settings, allowed)
    clock.lap("align")
    at_source = sampled(field, apply(inverse(found.T_target_source), pseudo), found.at_source)
    known = certainty(at_source, pseudo, found, residual(at_source, target_features), dof, init)
    overlap, overlap_target = overlaps(source, target, found.T_target_source)
    reason = judge(found, source, (overlap, overlap_target))
    clock.lap("judge")
    return RegistrationResult(
        T_target_source=found.T_target_source,
        accepted=reason is Reason.ACCEPTED,
        reason=reason,
        overlap=overlap,
        overlap_target=overlap_target,
        information=known.information,
        covariance=known.covariance,
        unobservable=known.unobservable,
        reference_point=known.reference_point,
        iterations=len(found.steps),
        rmse=rmse(at_source, target_features, found),
        seconds=clock.laps,
        history=found.steps,
        dropped=(source.dropped, target.dropped),
    )
