"""What is kept of a whole drive: at some poses, the part of the map around the sensor that was not kept before."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..clouds.cloud import PointCloud
from ..fields.protocol import Floats
from ..motions import apply, inverse, rotate
from .local_map import LocalMap
from .measure import FEWEST
from .scan import Rows

_SPACING = 0.1  # of the range, from one keyframe to the next
_RADIUS = 0.5   # of the range, around a keyframe: what lies farther is seen better from another one
_BITS = 21      # of a voxel's number along an axis


@dataclass(frozen=True, eq=False)
class Keyframe:
    """A step's number, its pose (4, 4), how far the sensor had gone (a length), and the surface that was first kept
    there, in the sensor's frame: means (n, 3) float32, normals (n, 3) float32, counts (n,) of the voxels' points.

    scan: (m, 4) of that step, at once, thinned. voxel: their edge. radius: how far the surface reaches.
    """

    number: int
    pose: Floats
    gone: float
    means: NDArray[np.float32]
    normals: NDArray[np.float32]
    counts: NDArray[np.float32]
    scan: Rows
    voxel: float
    radius: float


@dataclass(eq=False)
class Keyframes:
    """The keyframes of a drive. They hold each voxel once for each time that it came into the range, so memory grows
    with the way, not with the time."""

    kept: list[Keyframe] = field(default_factory=list)
    _gone: float = 0.0
    _latest: tuple[int, Floats, Rows] | None = None
    _map: LocalMap | None = None
    _known: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))

    def follow(self, number: int, pose: Floats, scan: Rows, local: LocalMap) -> None:
        """The pose (4, 4) of a step and its scan (m, 4), after which the map around the sensor is `local`."""
        if self._latest is not None:
            self._gone += float(np.linalg.norm(pose[:3, 3] - self._latest[1][:3, 3]))
        self._latest = number, pose, scan
        if self._map is local and self._gone < self.kept[-1].gone + _SPACING * local.reach:
            return
        if len(self.kept) == 1 and self._map is not local:
            self.kept.clear()  # the first scan's, from before it was deskewed
        keyframe, keys = self._seen(number, pose, scan, local)
        self.kept.append(keyframe)
        self._map, self._known = local, keys

    def with_last(self) -> list[Keyframe]:
        """The keyframes, and one more at the latest step, for what was seen since."""
        if self._latest is None or self._map is None or self.kept[-1].number == self._latest[0]:
            return list(self.kept)
        return [*self.kept, self._seen(*self._latest, self._map)[0]]

    def _seen(
        self, number: int, pose: Floats, scan: Rows, local: LocalMap
    ) -> tuple[Keyframe, NDArray[np.int64]]:
        """What is new around a pose, and the keys of all that is known of this map."""
        means, normals, counts, _ = local.fine.planes(FEWEST)
        keys = _keys(means, local.voxel)
        is_known = np.isin(keys, self._known) if self._map is local else np.zeros(len(keys), bool)
        is_near = ((means - pose[:3, 3]) ** 2).sum(axis=1) < (_RADIUS * local.reach) ** 2
        new, back = is_near & ~is_known, inverse(pose)
        keyframe = Keyframe(
            number, pose.copy(), self._gone, apply(back, means[new]).astype(np.float32),
            rotate(back[:3, :3], normals[new]).astype(np.float32), counts[new].astype(np.float32), scan, local.voxel,
            _RADIUS * local.reach,
        )
        return keyframe, keys[is_near | is_known]


def _keys(means: Floats, voxel: float) -> NDArray[np.int64]:
    """A number (n,) for each voxel that a mean lies in; those far apart may share one."""
    cells = np.floor(means / voxel).astype(np.int64) & (2**_BITS - 1)
    return np.asarray((cells[:, 0] << 2 * _BITS) | (cells[:, 1] << _BITS) | cells[:, 2])


def fused(keyframes: Sequence[Keyframe], poses: Floats | None = None) -> PointCloud:
    """The surface of all keyframes as one cloud with normals: one point for each voxel, of those in it the one with the
    most points behind it. poses: (n, 4, 4), of the keyframes, None: their own."""
    if not keyframes:
        return PointCloud(np.zeros((0, 3)))
    poses = np.stack([k.pose for k in keyframes]) if poses is None else poses
    means, normals, counts = surface_of(keyframes, poses)
    keys = _keys(means, min(k.voxel for k in keyframes))
    order = np.lexsort((np.arange(len(keys)), -counts, keys))
    chosen = np.sort(order[np.diff(keys[order], prepend=keys[order[:1]] - 1) != 0])
    return PointCloud(means[chosen], normals=normals[chosen], attributes={"count": counts[chosen]})


def surface_of(keyframes: Sequence[Keyframe], poses: Floats) -> tuple[Floats, Floats, Floats]:
    """Means (n, 3), normals (n, 3) and counts (n,) of keyframes at some poses (k, 4, 4), all of them."""
    pairs = list(zip(keyframes, poses, strict=True))
    means = np.concatenate([apply(T, k.means.astype(float)) for k, T in pairs])
    normals = np.concatenate([rotate(T[:3, :3], k.normals.astype(float)) for k, T in pairs])
    return means, normals, np.concatenate([k.counts for k, _ in pairs]).astype(float)
