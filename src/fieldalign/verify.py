"""The verdict on a pose that any other tool has found."""

from __future__ import annotations

from numpy.typing import ArrayLike

from .arguments import as_count
from .clock import Clock
from .errors import ArgumentError
from .flat import PLANAR, laid_down, upright
from .methods import verify_robust
from .motions import as_rigid
from .prepare import CloudLike, are_flat, prepare_pair
from .result import RegistrationResult
from .threads import resolve_threads


def verify(
    source: CloudLike,
    target: CloudLike,
    T_target_source: ArrayLike,
    *,
    search: bool = True,
    seed: int = 0,
    threads: int | None = None,
    drop_nonfinite: bool = True,
) -> RegistrationResult:
    """Whether a pose may be used, with the same evidence as for one of `fa.register`, its covariance, and why (not).

    source, target: points (N, 3), PointClouds, paths, DistanceFields or prepared clouds (fa.prepare), in one unit.
    T_target_source: (4, 4), or (3, 3) for points (N, 2): the pose to judge. It is not refined: the result holds it, its
        rotation made exact.
    search: whether all other poses are searched for one that agrees as well; False: only some around the given one are
        tried, which takes about half of the time, and the reason says that ambiguity is not known.
    seed: of every random draw; the same seed gives the same bits at any number of threads.
    threads: None means all cores. drop_nonfinite: as in `fa.register`.

    The result's `iterations` and `history` are of the one step that tells how far the pose is from the best nearby.

    Raises ArgumentError for a pose that is not rigid and for what `fa.register` raises it for, and CloudFileError for a
    file that cannot be read.
    """
    if search not in (True, False):
        raise ArgumentError(f"search must be True or False, but is {search!r}")
    flat = are_flat(source, target)
    given = upright(T_target_source, "T_target_source") if flat else T_target_source
    T = as_rigid(given, "T_target_source")
    seed, threads, clock = as_count(seed, "seed", 0), resolve_threads(threads), Clock()
    pair = prepare_pair(source, target, threads, drop_nonfinite)
    result = verify_robust(*pair, T, bool(search), seed, threads, clock, PLANAR if flat else None)
    return laid_down(result) if flat else result
