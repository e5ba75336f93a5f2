"""KITTI's velodyne .bin: float32 rows of x, y, z, intensity and nothing else."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...errors import CloudFileError
from ..cloud import PointCloud
from . import write_rows
from .columns import parts_beyond

FARTHEST = 1e9  # A format without a header is told from foreign bytes by values that no scanner measures.


def read(path: Path) -> PointCloud:
    """Points and intensity, both float32."""
    size = path.stat().st_size
    if size % 16:
        raise CloudFileError(
            f"has {size} bytes, but KITTI .bin files hold 16 bytes (float32 x, y, z, intensity) per point"
        )
    rows = np.fromfile(path, "<f4").reshape(-1, 4).astype(np.float32, copy=False)
    if (np.abs(rows) > FARTHEST).any() or np.isnan(rows).all():
        raise CloudFileError("holds absurd values, so it is no KITTI .bin file (float32 x, y, z, intensity)")
    return PointCloud(rows[:, :3], intensity=rows[:, 3].copy())


def write(path: Path, cloud: PointCloud) -> list[str]:
    """As float32; an intensity that is not there is written as 0."""
    rows = np.zeros((len(cloud), 4), "<f4")
    rows[:, :3] = cloud.points
    if cloud.intensity is not None:
        rows[:, 3] = cloud.intensity
    with path.open("wb") as file:
        write_rows(file, rows)
    exact = np.array_equal(rows[:, :3], cloud.points, equal_nan=True)
    return [
        *([] if exact else ["the digits of the points beyond float32"]),
        *parts_beyond(cloud, "intensity"),
    ]
