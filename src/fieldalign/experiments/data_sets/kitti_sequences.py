"""KITTI's odometry sequences (Geiger et al., CVPR 2012): scans and poses.

Layout: `sequences/08/velodyne/*.bin`, `sequences/08/calib.txt`, and `poses/08.txt` or `sequences/08/poses.txt`, in the
folder or in its `dataset`. The poses are of GPS and inertial sensors, and of the left camera; here they are turned into
the LiDAR's frame. They are smooth over a drive, but off by some centimetres from one scan to the next.

This project's part stands in where no sequence is asked for by its number: kitti00 (16 scans of sequence 00, poses of
SemanticKITTI), kittiraw_22f and kittiraw_154f (poses of KISS-ICP; a chain of GICP agrees to 1.5 cm: no truth to the
centimetre). `truth` says of each whose poses they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...errors import DataSetError
from ...motions import Matrix, as_rigid, inverse
from ...odometry.sequences.folders import cloud_files
from ...odometry.sequences.kitti import read_calibration
from ...odometry.trajectory_files import read_trajectory
from .files import PathLike, arrays_in, as_folder, first_of, inside, nothing_of, points_of

TEST = ("08", "09", "10")
"""The sequences that the paper, and DeepCLR before it, test on."""

LAYOUTS = (
    "sequences/08/velodyne/*.bin with calib.txt, and poses/08.txt or sequences/08/poses.txt (also in dataset)",
    "kitti00, kittiraw_22f, kittiraw_154f, kitti_10m_pairs or kitti07_submaps",
)
PARTS = {
    "kitti00": ("poses.npz", "world_from_lidar_semantickitti", "SemanticKITTI"),
    "kittiraw_22f": ("reference_poses.npz", "world_from_lidar_kissicp", "KISS-ICP"),
    "kittiraw_154f": ("reference_poses.npz", "world_from_lidar_kissicp", "KISS-ICP"),
}
"""Folder, the file of its poses, their name in it, and whose they are."""

_OFFICIAL = "KITTI's GPS and inertial sensors"


@dataclass(frozen=True, eq=False)
class ScanPair:
    """Two scans of a sequence and the motion between them, in metres, in the LiDAR's frame.

    i, j: the numbers of the target and of the source, which comes later. name: unlike any other's. source, target:
    their files. T_target_source: (4, 4). truth: whose poses these are.
    """

    sequence: str
    i: int
    j: int
    source: str
    target: str
    T_target_source: Matrix
    truth: str

    @property
    def name(self) -> str:
        """SEQUENCE/i_j."""
        return f"{self.sequence}/{self.i}_{self.j}"

    @property
    def group(self) -> str:
        """What its results are summed up with: the sequence."""
        return self.sequence

    def clouds(self) -> tuple[Matrix, Matrix]:
        """The points of source and target, (N, 3) and (M, 3) float64; raises CloudFileError where a file has none."""
        return points_of(self.source), points_of(self.target)


@dataclass(frozen=True, eq=False)
class KittiSequence:
    """The scans of a sequence and their poses.

    name: "00" or a folder of the part. folder: as `fa.read_sequence` takes it. frames: (n,), the scans' numbers. files:
    (n,).
    world_from_lidar: (n, 4, 4), the world is the first scan's frame. positions: (n, 3), of the sensor that the poses
    are given for, by which pairs are chosen: KITTI's left camera, else the LiDAR. truth: whose poses they are.
    """

    name: str
    folder: Path
    frames: tuple[int, ...]
    files: tuple[str, ...]
    world_from_lidar: Matrix
    positions: Matrix
    truth: str

    def __len__(self) -> int:
        return len(self.files)

    def points(self, row: int) -> Matrix:
        """The points (N, 3) of a scan, float64, in the LiDAR's frame."""
        return points_of(self.files[row])

    def pair(self, row: int, later: int) -> ScanPair:
        """The pair of two scans, by their rows."""
        T = inverse(self.world_from_lidar[row]) @ self.world_from_lidar[later]
        i, j = self.frames[row], self.frames[later]
        return ScanPair(self.name, i, j, self.files[later], self.files[row], T, self.truth)


def sequence(folder: PathLike, name: str) -> KittiSequence:
    """A sequence by its number ("00"), or one of the part by its folder; of "00", the part's 16 scans stand in.

    Raises DataSetError where the folder holds none of that name, or its poses do not fit its scans.
    """
    place = as_folder(folder)
    found = first_of(_published, inside(place, "dataset"), name) or _parts(place, "kitti00" if name == "00" else name)
    if not found:
        raise nothing_of(f"KITTI's sequence {name!r}", place, LAYOUTS)
    return found[0]


def sequences_in(folder: PathLike, names: Sequence[str] | None) -> list[KittiSequence]:
    """The sequences of these names; of None, those of TEST that are there, or where none is, those of the part.

    Raises DataSetError where one that is asked for, or all, are missing.
    """
    place = as_folder(folder)
    if names is not None:
        return [sequence(place, name) for name in names]
    found = published_in(place, TEST) or [drive for name in PARTS for drive in _parts(place, name)]
    if not found:
        raise nothing_of("KITTI's odometry sequences", place, LAYOUTS)
    return found


def published_in(place: Path, names: Sequence[str]) -> list[KittiSequence]:
    """Those of the sequences that are there in KITTI's own layout."""
    return [drive for name in names for drive in first_of(_published, inside(place, "dataset"), name)]


def _published(place: Path, name: str) -> list[KittiSequence]:
    folder = place / "sequences" / name
    if not (folder / "velodyne").is_dir():
        return []
    poses = next((file for file in (place / "poses" / f"{name}.txt", folder / "poses.txt") if file.is_file()), None)
    if poses is None:
        raise DataSetError(f"{folder} has scans, but no poses: looked for {place / 'poses' / name}.txt and poses.txt")
    numbered = {int(file.stem): str(file) for file in cloud_files(folder / "velodyne") if file.stem.isdigit()}
    frames = sorted(numbered)
    world_from_camera = read_trajectory(poses, "kitti").poses
    if not frames or frames[-1] >= len(world_from_camera):
        last = f"the last scan is number {frames[-1]}" if frames else "there are no scans whose names are numbers"
        raise DataSetError(f"{poses} holds {len(world_from_camera)} poses, but in {folder} {last}")
    T_camera_lidar = read_calibration(folder / "calib.txt")
    world_from_lidar = inverse(T_camera_lidar) @ world_from_camera[frames] @ T_camera_lidar
    return [_drive(name, folder, frames, numbered, world_from_lidar, world_from_camera[frames, :3, 3], _OFFICIAL)]


def _parts(place: Path, name: str) -> list[KittiSequence]:
    folder = place / name
    if name not in PARTS or not folder.is_dir():
        return []
    file, array, truth = PARTS[name]
    frames, poses = arrays_in(folder / file, "frames", array)
    numbered = {int(frame): f"{folder / f'{frame:06d}.npz'}#xyz" for frame in frames}
    poses = np.array([as_rigid(pose, f"{array} of {folder / file}") for pose in poses])
    return [_drive(name, folder, list(map(int, frames)), numbered, poses, poses[:, :3, 3], truth)]


def _drive(
    name: str, folder: Path, frames: list[int], files: dict[int, str], poses: Matrix, positions: Matrix, truth: str
) -> KittiSequence:
    return KittiSequence(
        name, folder, tuple(frames), tuple(files[frame] for frame in frames), inverse(poses[0]) @ poses, positions,
        truth,
    )
