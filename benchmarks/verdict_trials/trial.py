"""One trial of the verdict, and which half of the scenes it belongs to."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scenes import SETS

import fieldalign as fa

FIT, REPORT = "fit", "report"
REGISTER, VERIFY = "register", "verify"
HIGH, LOW = "> 0.3", "0.1-0.3"
HALVES = {
    FIT: ("kitchen", "kitti00", "raw154", "bunny"),
    REPORT: ("office", "demo", "kitti far", "raw22", "kitti07", "dragon_stand"),
}
RIGHT = ("indoor", "low", "lidar", "objects", "paper", "simulated")
VOXELS = {name: SETS[name].voxel for name in RIGHT} | {"shapes": 0.02}


@dataclass(frozen=True)
class Trial:
    """One question to fieldalign.

    kind: why the answer is known; set, scene, name: where it comes from; half: which half the scene belongs to.
    voxel: what the peers are told. overlap: of right pairs, HIGH or LOW; else empty.
    make: () -> source, target, T_true or None, tolerance (degrees, metres) or None, init or None, REGISTER or VERIFY.
    """

    kind: str
    set: str
    scene: str
    name: str
    voxel: float
    make: Callable[[], tuple]
    overlap: str = ""

    @property
    def half(self) -> str:
        return half_of(self.scene)


def half_of(scene: str) -> str:
    """FIT or REPORT, for good: real scenes by the table, made ones by their name."""
    listed = [half for half, members in HALVES.items() if scene in members]
    return listed[0] if listed else (FIT, REPORT)[zlib.crc32(scene.encode()) % 2]


def evenly(rows: list, count: int) -> list:
    """At most `count` of the rows, but one at least, evenly chosen."""
    places = np.linspace(0, len(rows) - 1, min(max(count, 1), len(rows))).round().astype(int)
    return [rows[place] for place in places]


def points_of(cloud) -> np.ndarray:
    return cloud.points if isinstance(cloud, fa.PointCloud) else cloud
