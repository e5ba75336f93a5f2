"""The front door for one pair: clouds in, the motion between them out."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .arguments import as_count, check_one_of, check_positive
from .clock import Clock
from .dof import as_dof
from .errors import ArgumentError
from .flat import laid_down, planar, upright
from .methods import Start, register_by_paper, register_robust, register_similar
from .motions import as_rigid, as_similar
from .prepare import CloudLike, are_flat, prepare_pair
from .result import RegistrationResult
from .settings import Settings, as_settings
from .threads import resolve_threads


def register(
    source: CloudLike,
    target: CloudLike,
    *,
    init: ArrayLike | None = None,
    search: bool | None = None,
    search_radius: float | None = None,
    search_angle: float | None = None,
    method: str = "robust",
    settings: Settings | str | None = None,
    seed: int = 0,
    threads: int | None = None,
    dof: Any = None,
    scale: bool = False,
    drop_nonfinite: bool = True,
) -> RegistrationResult:
    """The rigid motion that brings `source` onto `target`: from any pose, without a guess or a length.

    source, target: points (N, 3), PointClouds, paths, DistanceFields or prepared clouds (fa.prepare), in one unit. A
        file of triangles is a mesh, to which distances are exact. Where a cloud knows its viewpoint, a pose that its
        sensor looked through is refused. Or both points (N, 2): the motion is then in the plane, (3, 3).
    init: (4, 4), a guess of T_target_source. The search is then skipped, or confined by the two arguments below. What
        nothing holds (a slide along a wall, a turn about a pole) stays at the guess; without one it is arbitrary.
    search: True: search, though there is an init; False: never; None: where there is no init, or where it is confined.
    search_radius, search_angle: confine the search to so far from init: the shift of the overlap's middle (the clouds'
        unit), and the turn (degrees, up to 180); None: as far as need be.
    method: "robust": any-pose search, then the pseudo points aligned from coarse to fine (docs/method.md); "paper": the
        method of Yuan & Nüchter (RA-L 2022) as published, from one guess (init, or the centroids laid on each other):
        motions of up to about 45 degrees from it are found; it never searches.
    settings: of "paper": "object", "indoor" (its default), "outdoor", or a Settings object; lengths in the clouds'
        unit, in the presets metres (`fa.PRESETS["indoor"].scaled(1000)` for millimetres). "robust" takes none.
    seed: of every random draw; the same seed gives the same bits at any number of threads.
    threads: None means all cores.
    drop_nonfinite: NaN rows are missing returns, dropped and counted; infinity always raises.
    dof: what is free, where not all six are: "levelled" (a turn about z, and shifts), "planar", "yaw", any of
        "rx ry rz x y z", or an fa.Dof with its own axis and centre. It is counted from init, or from the identity.
        The rest stays exactly as it is, and has no variance.
    scale: whether the scale is free, too: the source's unit is then not the target's. T_target_source is a similarity,
        its covariance (7, 7), the seventh of the scale's logarithm. It is sought from half to twice what the sizes of
        the surfaces suggest, or the scale of init, which is all that is tried where init alone is given.

    The result says whether it may be used and why: docs/verdict.md.

    Raises ArgumentError for a cloud of the wrong shape, with fewer than 3 distinct points or with infinity, for an init
    that is not rigid, and for arguments out of range or that do not go together; CloudFileError for a file that cannot
    be read, FieldError for a field in which something is wrong.
    """
    check_one_of("method", method, ("robust", "paper"))
    seed, threads, clock = as_count(seed, "seed", 0), resolve_threads(threads), Clock()
    flat, freedoms = are_flat(source, target), as_dof(dof)
    if flat:
        freedoms, init = planar(freedoms), None if init is None else upright(init, "init")
    start = _start(method, init, search, search_radius, search_angle, bool(scale))
    start = replace(start, dof=freedoms, grows=bool(scale))
    if method == "robust" and settings is not None:
        raise ArgumentError(f"settings belong to method 'paper'; method 'robust' takes none, but got {settings!r}")
    if method == "paper" and (search or scale or search_radius is not None or search_angle is not None):
        raise ArgumentError("method 'paper' never searches: leave search, search_radius, search_angle and scale out")
    chosen = as_settings(settings) if method == "paper" else None
    pair = prepare_pair(source, target, threads, drop_nonfinite, bool(scale))
    if chosen is not None:
        result = register_by_paper(*pair, start.init, chosen, seed, threads, clock, freedoms)
    else:
        result = (register_similar if scale else register_robust)(*pair, start, seed, threads, clock)
    return laid_down(result) if flat else result


def _start(
    method: str, init: ArrayLike | None, search: bool | None, radius: float | None, angle: float | None, scale: bool
) -> Start:
    """Where to begin and whether to search, from arguments that are checked here."""
    if search not in (None, True, False):
        raise ArgumentError(f"search must be True, False or None, but is {search!r}")
    guess = None if init is None else (as_similar if scale else as_rigid)(init, "init")
    is_confined = radius is not None or angle is not None
    if is_confined and guess is None:
        raise ArgumentError("search_radius and search_angle confine the search around init, but there is no init")
    if is_confined and search is False:
        raise ArgumentError("search_radius and search_angle confine a search, but search is False")
    if guess is None and search is False and method == "robust":
        raise ArgumentError("search=False needs a guess to start from, but there is no init")
    if radius is not None:
        check_positive("search_radius", radius)
    if angle is not None:
        check_positive("search_angle", angle)
        if angle > 180:
            raise ArgumentError(f"search_angle must be at most 180 degrees, but is {angle!r}")
    return Start(
        guess,
        searches=guess is None or is_confined or bool(search),
        radius=np.inf if radius is None else float(radius),
        angle=np.pi if angle is None else float(np.radians(angle)),
    )
