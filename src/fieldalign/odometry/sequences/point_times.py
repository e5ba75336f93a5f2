"""When each point was seen: what sensors write, in seconds on the clock of the frame's stamp.

| sensor | field | type | what it is |
| --- | --- | --- | --- |
| Velodyne | time | float32 | seconds from the stamp, of some drivers negative |
| Ouster | t | uint32 | nanoseconds from the stamp |
| Livox | timestamp | float64 | nanoseconds, absolute |
| Livox | offset_time | uint32 | nanoseconds from the stamp |
| Hesai, RoboSense | timestamp | float64 | seconds, absolute |

A sweep takes neither a microsecond nor a quarter of an hour, so numbers that differ by 1000 or more are nanoseconds.
Whole numbers are nanoseconds always.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...clouds.cloud import Array, PointCloud
from ...clouds.formats.columns import TIMES
from ...motions import Matrix

_SECONDS_DIFFER = 1000  # by less
_ANOTHER_CLOCK = 10.0  # seconds that a sweep begins off its stamp, at least


def with_seconds(cloud: PointCloud, stamp: float | None) -> PointCloud:
    """The cloud with its times as seconds on the stamp's clock; none where it has none, or they are all the same.

    stamp: of the frame, seconds; None: on the times' own clock. What a reader left as an attribute for want of a unit
    counts, too.
    """
    attributes = dict(cloud.attributes)
    name = next((name for name in attributes if name.lower() in TIMES and attributes[name].ndim == 1), None)
    values = cloud.times
    if values is None and name is not None:
        values = attributes.pop(name)
    if values is None:
        return cloud
    return replace(cloud, times=seconds_of(values, stamp), attributes=attributes)


def seconds_of(values: Array, stamp: float | None) -> Matrix | None:
    """Times (N,) of points as seconds on the stamp's clock; None where they are all the same, and so say nothing.

    A time that is NaN becomes the first one.
    """
    known = values[np.isfinite(values)]
    if not len(known) or known.min() == known.max():
        return None
    first = known.min()
    after = np.asarray(np.where(np.isfinite(values), values, first) - first, float)  # whole numbers lose nothing
    unit = 1e-9 if values.dtype.kind in "iu" or after.max() >= _SECONDS_DIFFER else 1.0
    begin = float(first) * unit
    return (begin if stamp is None else _on_clock(begin, float(after.max()) * unit, stamp)) + after * unit


def _on_clock(begin: float, span: float, stamp: float) -> float:
    """When a sweep began, on the clock of its stamp, which is of its beginning, its end or between.

    begin: counted from the stamp, or on its clock, whichever of them says so; or on a clock of its own, of which
    nothing is known but the span: then the sweep is taken to begin with the stamp.
    """
    off_stamp, off_zero = (max(value, -span - value, 0.0) for value in (begin - stamp, begin))
    if min(off_stamp, off_zero) > _ANOTHER_CLOCK:
        return stamp
    return begin if off_stamp < off_zero else stamp + begin
