"""The Cramer-Rao bound of a simulated pair: no unbiased method can do better on these scans.

Two scans tell of a pose only where both see the same surface, and the surface itself is unknown. So the surface is cut
into small cells (place and normal direction); in each, either scan measures the cell's offset along its normal, with
the noise of its rays seen along the normal; their difference measures the pose. Angles of rays are exact, ranges have
Gaussian noise, as in fieldalign.clouds.simulated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation
from simulations import Simulation

CELL = 0.1  # metres
STEP = 1e-5  # rad between the rays that a normal is made of
LEAST_COSINE = 0.02  # a ray along the surface would know it exactly


@dataclass(frozen=True, eq=False)
class Bound:
    """The least covariance (6, 6) of a pose, twist (w, v) at `centre` (3,), left perturbation in the target's frame.

    expected: the median rotation (rad) and shift of the centre (m) of errors with just this covariance.
    """

    covariance: np.ndarray
    centre: np.ndarray
    expected: tuple[float, float]

    def error(self, T: np.ndarray, T_true: np.ndarray) -> np.ndarray:
        """The twist (6,) by which T is off, at the centre."""
        D = T @ np.linalg.inv(T_true)
        w = Rotation.from_matrix(D[:3, :3]).as_rotvec()
        return np.r_[w, D[:3, :3] @ self.centre + D[:3, 3] - self.centre]

    @property
    def rms(self) -> tuple[float, float]:
        """Root mean square of rotation (rad) and shift (m)."""
        variances = np.diag(self.covariance)
        return float(np.sqrt(variances[:3].sum())), float(np.sqrt(variances[3:].sum()))


def bound(made: Simulation) -> Bound | None:
    """None where the scans have no noise, or share too little for all six freedoms."""
    if made.noise == 0:
        return None
    target_from_world = np.linalg.inv(made.world_from_target)
    poses = made.world_from_source, made.world_from_target
    seen = [_measured(made, pose, rays, target_from_world) for pose, rays in zip(poses, made.rays, strict=True)]
    places, normals, variances = _shared_cells(*seen)
    if len(places) < 6:
        return None
    centre = places.mean(axis=0)
    J = np.hstack([np.cross(places - centre, normals), normals])
    information = (J.T / variances) @ J
    if np.linalg.cond(information) > 1e12:
        return None
    covariance = np.linalg.inv(information)
    drawn = np.random.default_rng(0).multivariate_normal(np.zeros(6), covariance, 20_000)
    medians = [float(np.median(np.linalg.norm(part, axis=1))) for part in (drawn[:, :3], drawn[:, 3:])]
    return Bound(covariance, centre, (medians[0], medians[1]))


def _measured(made: Simulation, world_from_sensor, rays, target_from_world) -> tuple:
    """Points and normals (N, 3) in the target's frame, without noise, and what each point knows along its normal."""
    origin = world_from_sensor[:3, 3]
    points = made.room.scan(world_from_sensor, rays, noise=0).points @ world_from_sensor[:3, :3].T
    directions = points / np.linalg.norm(points, axis=1, keepdims=True)
    normals = _normals(made.room, origin, directions)
    cosines = np.maximum(np.abs(np.sum(normals * directions, axis=1)), LEAST_COSINE)
    knowledge = (1 - made.outliers) / (made.noise * cosines) ** 2
    R = target_from_world[:3, :3]
    return (points + origin) @ R.T + target_from_world[:3, 3], normals @ R.T, knowledge


def _normals(room, origin, directions) -> np.ndarray:
    """Unit normals (N, 3) towards the sensor, from three rays close together."""
    aside = np.cross(directions, np.eye(3)[np.abs(directions).argmin(axis=1)])
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    up = np.cross(directions, aside)
    hits = []
    for offset in (np.zeros_like(aside), aside, up):
        rays = directions + STEP * offset
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        hits.append(rays * room.ranges(origin, rays)[:, None])
    normals = np.cross(hits[1] - hits[0], hits[2] - hits[0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return normals * -np.sign(np.sum(normals * directions, axis=1, keepdims=True))


def _shared_cells(source: tuple, target: tuple) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places (n, 3), normals (n, 3) and variances (n,) of the offset between the clouds, of cells that hold both."""
    points, normals, knowledge = (np.concatenate(parts) for parts in zip(source, target, strict=True))
    keys = np.hstack([np.floor(points / CELL), np.round(2 * normals)]).astype(np.int64)
    keys -= keys.min(axis=0)
    _, cell = np.unique(np.ravel_multi_index(keys.T, keys.max(axis=0) + 1), return_inverse=True)
    cells = cell.max() + 1
    first = np.arange(len(points)) < len(source[0])
    known = [np.bincount(cell[part], knowledge[part], cells) for part in (first, ~first)]
    both = (known[0] > 0) & (known[1] > 0)
    count = np.bincount(cell, minlength=cells)[both, None]
    mean = [np.stack([np.bincount(cell, c, cells) for c in v.T], axis=1)[both] / count for v in (points, normals)]
    unit = mean[1] / np.linalg.norm(mean[1], axis=1, keepdims=True)
    return mean[0], unit, 1 / known[0][both] + 1 / known[1][both]
