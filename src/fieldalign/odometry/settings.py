"""What may be chosen of odometry; nothing has to be."""

from __future__ import annotations

from dataclasses import dataclass

from ..arguments import MAX_PLACES, as_count, check_positive


@dataclass(frozen=True)
class OdometrySettings:
    """Choices of odometry. No length is asked for: all of them are read from the first scan.

    voxel: edge of the map's voxels (the scans' unit); None: read from the first scan, for a rotating sensor in a street
        about a hundredth of its range.
    pseudo_points: how many of a scan are to be aligned on planes of the map.
    points: of so many, evenly taken from a scan, the map is made.

    Raises ArgumentError for a value out of its range.
    """

    voxel: float | None = None
    pseudo_points: int = 1000
    points: int = 25_000

    def __post_init__(self) -> None:
        if self.voxel is not None:
            check_positive("voxel", self.voxel)
        as_count(self.pseudo_points, "pseudo_points", 100, MAX_PLACES)
        as_count(self.points, "points", 1000, MAX_PLACES)
