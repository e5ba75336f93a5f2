"""Times of points from their azimuth, for a sensor that spins about its z axis and writes none.

The sweep begins and ends behind the sensor, at -x, and the stamp is that of its middle, when the sensor looks ahead: so
it is of KITTI's Velodyne, which turns clockwise as seen from above and lets the cameras see when it looks ahead.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import chain, islice

import numpy as np

from ...arguments import check_one_of
from ...clouds.cloud import Array, PointCloud
from ...motions import Matrix
from ..spin import Spin
from .sequence import Frame

_SPINS = {"clockwise": Spin(-1, np.pi), "counterclockwise": Spin(1, np.pi)}
SWEEPS = tuple(_SPINS)


def check_sweep(sweep: str) -> None:
    """Raises ArgumentError where it is no direction that a sensor turns in."""
    check_one_of("sweep", sweep, SWEEPS)


def with_times(frames: Callable[[], Iterator[Frame]], sweep: str) -> Iterator[Frame]:
    """The frames, their points with times; those that have some keep them.

    A sweep takes as long as the shortest time between two stamps so far; 1, where there are no stamps.
    """
    coming = frames()
    head = list(islice(coming, 2))
    last, period = None, np.inf
    for stamp in (frame.stamp for frame in head):
        period, last = _shorter(period, last, stamp), stamp
    for frame in chain(head, coming):
        period, last = _shorter(period, last, frame.stamp), frame.stamp
        yield frame if frame.cloud is None else replace(frame, cloud=_timed(frame.cloud, frame.stamp, sweep, period))


def _shorter(period: float, last: float | None, stamp: float | None) -> float:
    return period if last is None or stamp is None or stamp <= last else min(period, stamp - last)


def _timed(cloud: PointCloud, stamp: float | None, sweep: str, period: float) -> PointCloud:
    if cloud.times is not None:
        return cloud
    length = period if np.isfinite(period) else 1.0
    return replace(cloud, times=(stamp or 0.0) + (share_of_sweep(cloud.points, sweep) - 0.5) * length)


def share_of_sweep(points: Array, sweep: str) -> Matrix:
    """How much of the sweep was over when each point (N, 3) was seen, 0 to 1."""
    return np.asarray(np.nan_to_num(_SPINS[sweep].share(np.asarray(points, float)), nan=0.5))
