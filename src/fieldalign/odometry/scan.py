"""One scan, made ready: few points of it for the map, fewer pseudo points to be aligned."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from ..arguments import as_numbers, is_number
from ..clouds.cloud import PointCloud, as_points
from ..errors import ArgumentError
from ..fields.protocol import Floats
from .measure import THINNING, Measure
from .spin import Spin

Rows = NDArray[np.float32]  # (., 4): a place in the sensor's frame, and seconds from the middle of the sweep

_FEWEST = 50  # pseudo points: with fewer, a scan counts as empty
_NEAR = 0.5   # voxels: what is nearer is the sensor itself, or a missing return written as zero


@dataclass(frozen=True, eq=False)
class Sweep:
    """Points (N, 3) of a scan as they came, and when they were seen.

    times: (N,), seconds, or None. middle: of the sweep, on the times' clock; without them the stamp, or None.
    span: from its first to its last point. stamp: the moment that the pose is wanted for, or None.
    """

    points: NDArray[Any]
    times: Floats | None
    middle: float | None
    span: float
    stamp: float | None
    is_missing: bool = False


@dataclass(frozen=True, eq=False)
class Scan:
    """points: (M, 4) for the fine map. sparse: (K, 4) of them, for the coarse one. pseudo: (L, 4) of these, on the
    scan's surface: their own distance is zero by construction. is_spun: its times are but those of a sensor that spins
    steadily."""

    points: Rows
    sparse: Rows
    pseudo: Rows
    is_timed: bool
    is_spun: bool = False

    @property
    def is_empty(self) -> bool:
        """Whether there is too little to be aligned."""
        return len(self.pseudo) < _FEWEST

    def all_at_once(self) -> Scan:
        """The same as if the times were not known."""
        return replace(self, is_timed=False)

    def seen_by(self, spin: Spin, seconds: float) -> Scan:
        """The same, its points seen one after the other by a sensor that spins once in so many seconds."""
        points, sparse, pseudo = (_timed(rows, spin, seconds) for rows in (self.points, self.sparse, self.pseudo))
        return Scan(points, sparse, pseudo, is_timed=True, is_spun=True)

    def at_once(self, velocity: Floats) -> tuple[Rows, Rows]:
        """The points for the fine and the coarse map as seen in the middle of the sweep, the sensor moving at a twist
        (6,) a second."""
        if not self.is_timed:
            return self.points, self.sparse
        return _core.deskew(self.points, velocity), _core.deskew(self.sparse, velocity)


def _timed(rows: Rows, spin: Spin, seconds: float) -> Rows:
    timed = rows.copy()
    timed[:, 3] = seconds * (spin.share(rows) - 0.5)
    return timed


def sweep_of(
    cloud: PointCloud | ArrayLike | None, times: ArrayLike | None, stamp: float | None, ahead: float = 0.0
) -> Sweep:
    """The scan with its times, counted from the stamp where they are not near it. Raises ArgumentError.

    cloud: None is a scan that is missing. ahead: seconds from the stamp to the middle, where there are no times.
    """
    if stamp is not None and not (is_number(stamp) and np.isfinite(stamp)):
        raise ArgumentError(f"stamp must be a finite number of seconds, but is {stamp!r}")
    if cloud is None:
        return replace(_timeless(np.zeros((0, 3), np.float32), stamp, ahead), is_missing=True)
    points = cloud.points if isinstance(cloud, PointCloud) else as_points(cloud, "cloud")
    if times is None and isinstance(cloud, PointCloud):
        times = cloud.times
    if times is None or not len(points):
        return _timeless(points, stamp, ahead)
    seconds = as_numbers(times, "times")
    if seconds.shape != (len(points),):
        raise ArgumentError(f"times must have shape ({len(points)},), one for each point, but has {seconds.shape}")
    first, last = float(seconds.min()), float(seconds.max())
    if not np.isfinite(first + last):
        raise ArgumentError("times must be finite, but hold NaN or infinity")
    span = last - first
    if stamp is not None and not first - span <= stamp <= last + span:
        seconds, first, last = seconds + stamp, first + stamp, last + stamp
    return Sweep(points, seconds, (first + last) / 2, span, stamp)


def _timeless(points: NDArray[Any], stamp: float | None, ahead: float) -> Sweep:
    return Sweep(points, None, None if stamp is None else stamp + ahead, 0.0, stamp)


def thin_scan(sweep: Sweep, measure: Measure, points: int, pseudo_points: int, deskew: bool) -> Scan:
    """Of about so many points those for the map, one in 0.4 voxels, and of these so many pseudo points."""
    # An odd stride meets every beam, where points come one beam after the other.
    stride = len(sweep.points) // points | 1
    kept = _core.thin_scan(
        sweep.points, sweep.times if deskew else None, sweep.middle or 0.0, stride, THINNING * measure.voxel,
        _NEAR * measure.voxel, measure.range,
    )
    sparse, pseudo = _core.thin_twice(kept, measure.voxel, pseudo_points)
    return Scan(kept, sparse, pseudo, deskew and sweep.times is not None)
