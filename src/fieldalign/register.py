"""The front door for one pair: clouds in, the motion between them out."""

from __future__ import annotations

from time import perf_counter
from typing import Any

from numpy.typing import ArrayLike

from .alignment import align
from .alignment.residual import residual
from .arguments import as_count
from .errors import ArgumentError
from .fields import sampled
from .motions import apply, as_rigid, inverse, translation
from .prepared import CloudLike, prepare_pair
from .result import Reason, RegistrationResult
from .settings import Settings, as_settings
from .threads import resolve_threads
from .verdict import certainty, judge, overlaps, rmse


def register(
    source: CloudLike,
    target: CloudLike,
    *,
    init: ArrayLike | None = None,
    search: bool | None = None,
    search_radius: float | None = None,
    search_angle: float | None = None,
    method: str = "paper",
    settings: Settings | str | None = None,
    seed: int = 0,
    threads: int | None = None,
    dof: Any = None,
    scale: bool = False,
    drop_nonfinite: bool = True,
) -> RegistrationResult:
    """The rigid motion that brings `source` onto `target`, by the paper's method (Yuan & Nüchter, RA-L 2022).

    source, target: points (N, 3), PointClouds, paths, DistanceFields or prepared clouds (fa.prepare), in one unit.
    init: (4, 4), first guess of T_target_source; None: the clouds' centroids are laid on each other.
    method: "paper". It starts at one guess: motions of up to about 45 degrees from it are found.
    settings: "object", "indoor" (its default), "outdoor", or a Settings object; its lengths are in the clouds' unit,
        in the presets they are metres (`fa.PRESETS["indoor"].scaled(1000)` for millimetres).
    seed: of the pseudo points; the same seed gives the same bits at any number of threads.
    threads: None means all cores.
    drop_nonfinite: NaN rows are missing returns, dropped and counted; infinity always raises.
    search, search_radius, search_angle, dof, scale: not available in this version; anything but the default raises.

    Raises ArgumentError for a cloud of the wrong shape, with fewer than 3 distinct points or with infinity, for an init
    that is not rigid, and for settings out of range; CloudFileError for a file that cannot be read.
    """
    _refuse_what_is_missing(method, search, search_radius, search_angle, dof, scale)
    chosen, seed, threads = as_settings(settings), as_count(seed, "seed", 0), resolve_threads(threads)
    clock = _Clock()
    moving, fixed = prepare_pair(source, target, threads, drop_nonfinite)
    clock.lap("prepare")
    pseudo, target_features = fixed.features(chosen, seed, threads)
    clock.lap("pseudo points")
    T_start = translation(fixed.centre - moving.centre) if init is None else as_rigid(init, "init")
    field = moving.sampled_by(chosen, threads)
    found = align(field, target_features, pseudo, T_start, (moving.centre, fixed.centre), chosen)
    clock.lap("align")
    at_source = sampled(field, apply(inverse(found.T_target_source), pseudo), found.at_source)
    known = certainty(at_source, pseudo, found, residual(at_source, target_features))
    overlap, overlap_target = overlaps(moving, fixed, found.T_target_source)
    reason = judge(found, moving, (overlap, overlap_target))
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
        dropped=(moving.dropped, fixed.dropped),
    )


class _Clock:
    """Seconds by stage."""

    def __init__(self) -> None:
        self.laps: dict[str, float] = {}
        self._last = perf_counter()

    def lap(self, stage: str) -> None:
        now = perf_counter()
        self.laps[stage], self._last = now - self._last, now


def _refuse_what_is_missing(
    method: str, search: bool | None, radius: float | None, angle: float | None, dof: Any, scale: bool
) -> None:
    """The interface is fixed from the start; what this version does not do yet is refused, not ignored."""
    if method != "paper":
        raise ArgumentError(f"method must be 'paper' in this version, but is {method!r}")
    if search or radius is not None or angle is not None:
        raise ArgumentError("search is not available in this version: give a guess with init, or leave it out")
    if dof is not None or scale:
        raise ArgumentError("dof and scale are not available in this version: a rigid motion of six freedoms is found")
