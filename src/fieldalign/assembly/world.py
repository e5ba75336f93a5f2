"""The frame of a component: that of its first scan, or the world of poses that are known beforehand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..dof import Dof, allowed_poses
from ..fields.protocol import Floats
from ..motions import best_motion, inverse, translation
from .pose_graph import Anchors

_ROUGH_TURN = 0.5  # rad: of poses that are known no better, only the places are


@dataclass(frozen=True, eq=False)
class Given:
    """Poses (4, 4) that are known beforehand, world_from_cloud, or None; sigma: (rad, length), how well, or None: they
    are a guess; fixed: indices of those that do not change."""

    poses: list[Floats | None]
    sigma: tuple[float, float] | None
    fixed: tuple[int, ...]
    is_rough: bool = True  # so that other poses nearby are searched, too

    @property
    def is_useful(self) -> bool:
        """Whether they tell which scans are near each other."""
        return sum(pose is not None for pose in self.poses) > len(self.poses) / 2

    def seen_from(self, origins: Floats) -> Given:
        """The same of scans that are seen from origins (n, 3) in their own frames."""
        poses = [None if T is None else T @ translation(o) for T, o in zip(self.poses, origins, strict=True)]
        return replace(self, poses=poses)

    def between(self, i: int, j: int) -> Floats | None:
        """A guess (4, 4) of the pose of scan j in the frame of scan i, if both are known well enough."""
        one, other = self.poses[i], self.poses[j]
        if one is None or other is None or (self.sigma is not None and self.sigma[0] > _ROUGH_TURN):
            return None
        return inverse(one) @ other


def anchored(poses: Floats, members: Sequence[int], given: Given, dof: Dof | None) -> tuple[Floats, Floats, Anchors]:
    """What takes the frame of a component's poses (n, 4, 4) into its world (4, 4), the poses in that frame, and what
    holds them there. So a turn that all scans share is no matter of the dof."""
    row_of = {k: row for row, k in enumerate(members) if given.poses[k] is not None}
    fixed = [row_of[k] for k in given.fixed if k in row_of]
    priors = {}
    if given.sigma is not None:
        turn, shift = given.sigma
        information = np.diag([turn**-2.0] * 3 + [shift**-2.0] * 3)
        priors = {row: (np.asarray(given.poses[k]), information) for k, row in row_of.items() if row not in fixed}
    allowed = None if dof is None else allowed_poses(dof, None, np.zeros(3), np.zeros(3), target_is_held=True)
    world = _world(poses, members, given, row_of, fixed)
    if allowed is not None and allowed.turns.any() and not fixed:
        world[:3, :3] = allowed.nearest(world[None])[0, :3, :3]  # upright, as the scans are
    priors = {row: (inverse(world) @ pose, information) for row, (pose, information) in priors.items()}
    if not fixed and not priors:
        fixed = [next(iter(row_of.values()), 0)]
    poses = poses.copy()
    for row in set(fixed) & set(row_of.values()):
        poses[row] = inverse(world) @ np.asarray(given.poses[members[row]])
    return world, poses, Anchors(fixed, priors, allowed)


def _world(
    poses: Floats, members: Sequence[int], given: Given, row_of: dict[int, int], fixed: Sequence[int]
) -> Floats:
    """What takes the frame of the component's poses into the world (4, 4)."""
    if not row_of:
        return inverse(poses[0])
    rows = list(row_of.values())
    there = np.stack([np.asarray(given.poses[members[row]]) for row in rows])
    if not fixed and given.sigma is not None and given.sigma[0] > _ROUGH_TURN and len(rows) > 2:
        return best_motion(poses[rows, :3, 3], there[:, :3, 3])
    first = fixed[0] if fixed else rows[0]
    return np.asarray(given.poses[members[first]]) @ inverse(poses[first])
