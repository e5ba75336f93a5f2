"""KISS-ICP, point-to-point odometry, by the objects of its Python pipeline and with its own settings.

Its one length is the sensor's range: a voxel of the map is a hundredth of it, as its command line has it.
"""

from __future__ import annotations

import numpy as np
from kiss_icp.config import KISSConfig
from kiss_icp.kiss_icp import KissICP


class Odometry:
    """Steps like fieldalign's; its poses are for the end of each sweep."""

    def __init__(self, deskew: bool, reach: float, threads: int) -> None:
        """reach: of the sensor, metres."""
        config = KISSConfig()
        config.data.deskew, config.data.max_range, config.registration.max_num_threads = deskew, reach, threads
        config.mapping.voxel_size = reach / 100
        self._pipeline = KissICP(config)

    def step(self, points: np.ndarray, times: np.ndarray | None) -> np.ndarray:
        """The pose (4, 4) of the sensor; points (N, 3), float64."""
        self._pipeline.register_frame(points, np.empty(0) if times is None else times)
        return self._pipeline.last_pose.copy()
