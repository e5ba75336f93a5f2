"""A scan as the assembly keeps it: thinned while it is read, so that no two whole ones are ever in memory."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..fields import PointField
from ..fields.protocol import Floats
from ..lazy import lazy
from ..prepare import CloudLike, prepare_named
from ..prepared import PreparedCloud
from ..whole_file import replacing

_FAR = 32  # extents from the origin of its frame, a scan is in the coordinates of a map, not of a sensor


@dataclass(frozen=True, eq=False)
class ThinScan:
    """points: (n, 3), at most some fifty thousand, in the scan's own frame, seen from `origin` (3,) there. eye: (3,),
    where the sensor stood, seen from there, or None. voxel, extent: its own, lengths. dropped: missing returns (NaN)
    that were left out."""

    points: Floats
    eye: Floats | None
    voxel: float
    extent: float
    dropped: int
    origin: Floats

    @lazy
    def cloud(self) -> PreparedCloud:
        """Ready for registration; made where it is asked for, and not sent along."""
        return PreparedCloud(PointField(self.points, threads=1), self.dropped, 1, self.eye)

    @property
    def place(self) -> Floats:
        """Where it was taken from (3,), or its middle where that is not known, seen from its origin."""
        return np.median(self.points, axis=0) if self.eye is None else self.eye

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "cloud"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)


def thinned(
    cloud: CloudLike, name: str, threads: int, sensor_at_origin: bool = False, keeps_height: bool = False
) -> ThinScan:
    """A scan of any size, or the surface of a field, as few points as a registration can use.

    sensor_at_origin: where the scan itself does not say where its sensor stood, it was at the origin. keeps_height:
        whether heights of scans are to be compared, so that the origin is at none.

    Raises what prepare() raises, in the name of the scan.
    """
    prepared = prepare_named(cloud, name, threads, drop_nonfinite=True)
    assert isinstance(prepared, PreparedCloud)
    points = np.asarray(prepared.fine.points, float)
    eye = np.zeros(3) if prepared.eye is None and sensor_at_origin else prepared.eye
    origin = _origin(prepared.centre, prepared.extent) * [1, 1, not keeps_height]
    eye = None if eye is None else eye - origin
    return ThinScan(points - origin, eye, prepared.scale.voxel, prepared.extent, prepared.dropped, origin)


def _origin(centre: Floats, extent: float) -> Floats:
    """Where a scan is seen from (3,): its frame's own origin or, where that is as far off as in the coordinates of a
    map, near its middle. Few digits, which add and subtract without rounding."""
    if np.linalg.norm(centre) < _FAR * extent:
        return np.zeros(3)
    step = 2.0 ** np.ceil(np.log2(extent))
    return np.asarray(step * np.round(centre / step))


def write_scan(path: Path, scan: ThinScan) -> None:
    """Keeps a scan in a file (.npz), whole or not at all."""
    eye = np.empty(0) if scan.eye is None else scan.eye
    with replacing(path) as unfinished, unfinished.open("wb") as file:
        np.savez(file, points=scan.points, eye=eye, lengths=[scan.voxel, scan.extent], dropped=scan.dropped,
                 origin=scan.origin)


def read_scan(path: Path) -> ThinScan:
    """The scan that write_scan() kept."""
    with np.load(path, allow_pickle=False) as arrays:
        eye = arrays["eye"] if arrays["eye"].size else None
        voxel, extent = arrays["lengths"].tolist()
        return ThinScan(arrays["points"], eye, voxel, extent, int(arrays["dropped"]), arrays["origin"])
