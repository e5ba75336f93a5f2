"""The front door for many scans: in any order and pose, they become one model, or as many as they are of."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .arguments import as_count, check_positive
from .assembly.assembly import Assembly
from .assembly.build import build
from .assembly.executor import AnyExecutor, as_executor
from .assembly.pairs import told
from .assembly.workshop import Progress, Workshop
from .assembly.world import Given
from .dof import as_dof
from .errors import ArgumentError
from .motions import as_rigid
from .prepare import CloudLike
from .threads import resolve_threads

_GROUPS = {("rz", "x", "y", "z"), ("rz", "x", "y"), ("x", "y", "z")}


def assemble(
    clouds: Sequence[CloudLike],
    *,
    poses: Sequence[ArrayLike | None] | None = None,
    pose_sigma: tuple[float, float] | None = None,
    fixed: Sequence[int] = (),
    ordered: bool = False,
    sensor_at_origin: bool = False,
    dof: Any = None,
    executor: AnyExecutor = None,
    run_folder: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    seed: int = 0,
    threads: int | None = None,
) -> Assembly:
    """Poses for scans of one place or of several, in any order and pose, without a guess; see docs/assemble.md.

    clouds: as `fa.register` takes them, in one unit. Files are read one at a time and thinned while they are.
    poses: world_from_cloud (4, 4) of some scans, None for the others: from a plan, a GPS, a robot. They say which scans
        may overlap, and where to begin. pose_sigma: (degrees, length), how well they are known, as standard deviations;
        they then also pull at the result, whose world is theirs.
    fixed: indices of scans whose given pose is not to change.
    ordered: successive scans are neighbours.
    sensor_at_origin: each scan is in the frame of its own sensor, unless it has a viewpoint that says otherwise. Where
        a sensor looked through what another scan shows, the two do not lie like that: so rooms that look alike are told
        apart.
    dof: "levelled" (all scans know which way is up), "planar" or "translation": what their poses may differ by.
    executor, run_folder, threads: as in `fa.register_many`. The run folder also keeps the thinned scans.
    progress: called as progress(stage, finished, of).
    seed: of every random draw; the same bits on any executor.

    Pairs are chosen by a glance at each (a few thousand poses, some milliseconds), registered from any pose, and used
    where the verdict accepts them and the others do not contradict them around a cycle. Then all poses are refined at
    once against all fields.

    A scan that cannot be read, or that no other one is found to overlap, is left out, with the reason; it stops
    nothing.

    Raises ArgumentError for fewer than two clouds and for arguments out of range or that do not go together, and
    RunError as `fa.register_many` does.
    """
    clouds = list(clouds)
    if len(clouds) < 2:
        raise ArgumentError(f"clouds must be at least two, but are {len(clouds)}")
    freedoms = as_dof(dof)
    if freedoms is not None and (tuple(freedoms.free) not in _GROUPS or freedoms.axis is not None):
        raise ArgumentError(f"dof of an assembly must be levelled, planar or translation, but is {dof!r}")
    given = _given(poses, pose_sigma, fixed, len(clouds))
    chosen, seed = as_executor(executor), as_count(seed, "seed", 0)
    used = chosen.threads if threads is None else resolve_threads(threads)
    settings = told({"seed": seed, "dof": freedoms, "poses": [None if T is None else T.tolist() for T in given.poses],
                     "sigma": given.sigma, "fixed": given.fixed, "ordered": bool(ordered),
                     "sensor_at_origin": bool(sensor_at_origin)})
    with Workshop(clouds, chosen, run_folder, settings, progress, used, bool(sensor_at_origin),
                  keeps_height=freedoms is not None and "z" not in freedoms.free) as shop:
        return build(shop, given, bool(ordered), freedoms, seed)


def _given(
    poses: Sequence[ArrayLike | None] | None, sigma: tuple[float, float] | None, fixed: Sequence[int], count: int
) -> Given:
    """What is known of the poses beforehand, checked."""
    known = [None] * count if poses is None else list(poses)
    if len(known) != count:
        raise ArgumentError(f"poses must be one for each of the {count} clouds, None where it is not known, but are "
                            f"{len(known)}")
    if sigma is not None:
        if poses is None:
            raise ArgumentError("pose_sigma says how well poses are known, but there are none")
        sigma = _sigma(sigma)
    rigid = [None if T is None else as_rigid(T, f"poses[{k}]") for k, T in enumerate(known)]
    return Given(rigid, sigma, _fixed(fixed, known))


def _sigma(sigma: Any) -> tuple[float, float]:
    """In radians and a length."""
    try:
        turn, shift = sigma
    except (TypeError, ValueError):
        raise ArgumentError(f"pose_sigma must be (degrees, length), but is {sigma!r}") from None
    for value in (turn, shift):
        check_positive("pose_sigma", value)
    return float(np.radians(turn)), float(shift)


def _fixed(fixed: Any, known: Sequence[Any]) -> tuple[int, ...]:
    may = {k for k, pose in enumerate(known) if pose is not None}
    wrong = [k for k in fixed if k not in may] if isinstance(fixed, Iterable) else [fixed]
    if wrong:
        raise ArgumentError(f"fixed must be indices of clouds whose pose is given, but holds {wrong[0]!r}")
    return tuple(int(k) for k in fixed)
