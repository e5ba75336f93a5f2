"""The real scans that the assembly benchmark puts together, in random poses and order, and how its answers are judged.

    heap = draw(("bunny", "indoor"), seed=0)
    heap.clouds                       # list of (N, 3) float64, each in a frame of its own
    judged(heap, poses, components)   # what came out right
"""

from __future__ import annotations

import zlib
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from scenes import DATA, apply
from scipy.spatial.transform import Rotation

from fieldalign.evaluation import rotation_error

TOLERANCE = 2.0, 0.02  # degrees, and share of the scan's extent by which its centroid may be off


@dataclass(frozen=True)
class Set:
    """load() gives the clouds and world_from_cloud (n, 4, 4). voxel: what the peers are told, metres."""

    load: Callable[[], tuple[list[np.ndarray], np.ndarray]]
    voxel: float


@dataclass(frozen=True, eq=False)
class Heap:
    """Scans of some sets, moved and shuffled. T: (n, 4, 4), world_from_cloud, each set in its own world."""

    clouds: list[np.ndarray]
    T: np.ndarray
    sets: list[str]

    def places(self) -> tuple[np.ndarray, np.ndarray]:
        """The centroid (n, 3) of each cloud in its own frame, and its extent (n,)."""
        extents = [np.linalg.norm(np.ptp(w[:, :3], axis=0)) for w in self.clouds]
        return np.stack([cloud.mean(axis=0) for cloud in self.clouds]), np.array(extents)


def draw(names: Sequence[str], seed: int) -> Heap:
    """The scans of some sets, each moved by a random motion in SE(3), in random order."""
    clouds, truths, sets = [], [], []
    for name in names:
        for k, (cloud, T) in enumerate(zip(*SETS[name].load(), strict=True)):
            rng = np.random.default_rng([seed, zlib.crc32(name.encode()), k])
            P = np.eye(4)
            P[:3, :3] = Rotation.random(random_state=rng).as_matrix()
            P[:3, 3] = rng.normal(size=3) * np.ptp(cloud, axis=0).max()
            clouds.append(apply(P, cloud))
            truths.append(T @ np.linalg.inv(P))
            sets.append(name)
    order = np.random.default_rng(seed).permutation(len(clouds))
    return Heap([clouds[k] for k in order], np.stack(truths)[order], [sets[k] for k in order])


def judged(heap: Heap, poses: Sequence[np.ndarray | None], components: Sequence[Sequence[int]]) -> dict:
    """Shares of the scans that are placed and that are right, foreign scans, and whether the components are the sets.

    A component belongs to the set that most of its scans are of; the others in it are foreign. It is laid on the truth
    by the motion that suits most of its scans. A scan is right in the largest component of its set alone.
    """
    centres, extents = heap.places()
    errors, foreign, taken = {}, [], set()
    for members in sorted(components, key=len, reverse=True):
        name = Counter(heap.sets[k] for k in members).most_common(1)[0][0]
        foreign += [k for k in members if heap.sets[k] != name]
        own = [k for k in members if heap.sets[k] == name]
        if name not in taken:
            taken.add(name)
            found = off(np.stack([poses[k] for k in own]), heap.T[own], centres[own], extents[own])
            errors |= dict(zip(own, found, strict=True))
    right = [k for k, (deg, share) in errors.items() if deg < TOLERANCE[0] and share < TOLERANCE[1]]
    placed = sorted(errors)
    expected = sorted(sorted(k for k, s in enumerate(heap.sets) if s == name) for name in set(heap.sets))
    return {
        "scans": len(heap.clouds),
        "placed": len(errors),
        "right": len(right),
        "foreign": len(foreign),
        "whole": sorted(sorted(int(k) for k in members) for members in components) == expected,
        "components": len(components),
        "deg": [errors[k][0] for k in placed],
        "share": [errors[k][1] for k in placed],
        "of": [heap.sets[k] for k in placed],
        "missed": [heap.sets[k] for k in range(len(heap.clouds)) if k not in right],
    }


def off(poses: np.ndarray, T: np.ndarray, centres: np.ndarray, extents: np.ndarray) -> list[tuple[float, float]]:
    """Degrees, and share of the extent at the centroid, of each pose (n, 4, 4), laid on the truth.

    Laid by the mean motion of those scans that agree best with the motion of one of them.
    """
    motions = T @ np.linalg.inv(poses)
    tried = [_errors(M @ poses, T, centres, extents) for M in motions]
    best = tried[int(np.argmin([np.median(np.max(errors / TOLERANCE, axis=1)) for errors in tried]))]
    agree = np.max(best / TOLERANCE, axis=1) <= max(1.0, np.median(np.max(best / TOLERANCE, axis=1)))
    M = mean_motion(poses[agree], T[agree], centres[agree])
    return [(float(deg), float(share)) for deg, share in _errors(M @ poses, T, centres, extents)]


def mean_motion(poses: np.ndarray, T: np.ndarray, centres: np.ndarray) -> np.ndarray:
    """The motion (4, 4) that lays poses on the truth: rotations on rotations, then centroids on centroids."""
    M = np.eye(4)
    M[:3, :3] = Rotation.from_matrix((T @ np.linalg.inv(poses))[:, :3, :3]).mean().as_matrix()
    there, here = (np.einsum("kab,kb->ka", P[:, :3, :3], centres) + P[:, :3, 3] for P in (T, poses))
    M[:3, 3] = (there - here @ M[:3, :3].T).mean(axis=0)
    return M


def _errors(poses: np.ndarray, T: np.ndarray, centres: np.ndarray, extents: np.ndarray) -> np.ndarray:
    there, here = (np.einsum("kab,kb->ka", P[:, :3, :3], centres) + P[:, :3, 3] for P in (T, poses))
    turned = [rotation_error(a, b) for a, b in zip(poses, T, strict=True)]
    return np.stack([turned, np.linalg.norm(there - here, axis=1) / extents], axis=1)


# ------------------------------------------------------------------------------------------------ sets


@cache
def _stanford(name: str) -> tuple[list[np.ndarray], np.ndarray]:
    archive = np.load(DATA / "stanford" / f"{name}.npz")
    return [archive[str(scan)].astype(float) for scan in archive["names"]], archive["world_from_scan"]


@cache
def _files(pattern: str, pose: str) -> tuple[list[np.ndarray], np.ndarray]:
    archives = [np.load(file) for file in sorted(DATA.glob(pattern))]
    return [archive["xyz"].astype(float) for archive in archives], np.stack([archive[pose] for archive in archives])


SETS = {
    "bunny": Set(lambda: _stanford("bunny"), 0.002),
    "dragon": Set(lambda: _stanford("dragon_stand"), 0.002),
    "indoor": Set(lambda: _files("indoor_fragments/frag*.npz", "world_from_fragment"), 0.05),
    "kitti07": Set(lambda: _files("kitti07_submaps/*.npz", "world_from_submap"), 0.5),
}
EVERYTHING = tuple(SETS)
