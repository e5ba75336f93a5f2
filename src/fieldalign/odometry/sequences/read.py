"""The front door for sequences: what a path is, is seen from what lies there."""

from __future__ import annotations

import os
from dataclasses import replace
from functools import partial
from pathlib import Path

from ...errors import ArgumentError, CloudFileError
from . import bags, folders, kitti, sweeps
from .sequence import Sequence


def read_sequence(
    path: str | os.PathLike[str], *, topic: str | None = None, sweep: str | None = None
) -> Sequence:
    """The frames of a drive, read one at a time.

    path: a KITTI odometry sequence (velodyne/*.bin; times.txt) or the folder over sequences/00; a KITTI raw drive
        (velodyne_points/data; timestamps.txt); a folder of files of any format that `fa.read_cloud` knows, in natural
        order (2 before 10), with a times.txt if there is one; a ROS 1 bag, or a folder of its parts; the folder of a
        ROS 2 bag; a single .mcap or .db3.
    topic: of a bag, which; needed where it holds several with PointCloud2.
    sweep: "clockwise" or "counterclockwise" (seen from above): the sensor spins about its z axis, and points without
        times get them from their azimuth; see sweeps.py. KITTI's: clockwise, and only the raw drives, for the odometry
        sequences have been freed of the motion within a sweep already.

    What is broken is one frame without a cloud (`Frame.reason` says why). Raises CloudFileError where there is no
    sequence at all, ArgumentError for a topic that is not there, MissingExtraError for bags without the extra 'bag'.
    """
    place = Path(path)
    if not place.exists():
        raise CloudFileError(f"{place} does not exist")
    found = _found(place, topic)
    if sweep is None:
        return found
    sweeps.check_sweep(sweep)
    return replace(found, frames=partial(sweeps.with_times, found.frames, sweep))


def _found(place: Path, topic: str | None) -> Sequence:
    if bags.is_bag(place):
        return bags.read_bag(place, topic)
    if topic is not None:
        raise ArgumentError(f"topic names a part of a bag, but {place} is none")
    if place.is_file():
        raise CloudFileError(f"{place} is no sequence: it must be a folder of clouds or a bag (.bag, .mcap, .db3)")
    if kitti.is_raw(place):
        return kitti.read_raw(place)
    if kitti.is_odometry(place):
        return kitti.read_odometry(place)
    return folders.read_folder(place)
