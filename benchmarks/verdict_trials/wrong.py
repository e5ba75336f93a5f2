"""Wrong poses: clouds that do not meet, mirror images, poses pushed away from the truth."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import scenes
from scenes import shift
from scipy.spatial.transform import Rotation

from .clouds import Cloud, clouds, direction, nothing_right, rng_of
from .trial import FIT, REPORT, VOXELS, Trial, points_of


def crossed(count: int, seed: int) -> list[Trial]:
    """Clouds of different scenes, of one half; across sets always scaled to one extent, within a set sometimes."""
    rng, found = np.random.default_rng([seed, 1]), []
    while len(found) < count:
        pool = clouds((FIT, REPORT)[len(found) % 2])
        a, b = (pool[k] for k in rng.integers(len(pool), size=2))
        if not _may_meet(a, b):
            name = f"{len(found)} {a.name} x {b.name}"
            make = partial(_crossed_pair, a, b, (seed, name))
            found.append(Trial("crossed", f"{a.set} x {b.set}", b.scene, name, VOXELS[b.set], make))
    return found


def _may_meet(a: Cloud, b: Cloud) -> bool:
    """Whether two clouds may show the same place, or shapes or rooms that are alike."""
    if a.scene == b.scene or (a.set == b.set and a.set in ("shapes", "simulated")):
        return True
    streets = a.set == b.set == "lidar"
    return streets and not (a.scene.startswith("raw") or b.scene.startswith("raw"))


def _crossed_pair(a: Cloud, b: Cloud, key: tuple) -> tuple:
    rng = rng_of("crossed", *key)
    sighted = bool(rng.integers(2))
    source, target = a.load(sighted), b.load(sighted)
    if a.set != b.set or rng.uniform() < 0.3:
        source = source.scaled(target.extent() / source.extent())
    return nothing_right(source, target, rng)


def similar_rooms(count: int, seed: int) -> list[Trial]:
    """Two simulated rooms, alike in layout, one of them a fifth smaller or a quarter larger."""
    rng, found = np.random.default_rng([seed, 2]), []
    for k in range(count):
        rooms = [cloud for cloud in clouds((FIT, REPORT)[k % 2]) if cloud.set == "simulated"]
        a, b = (rooms[place] for place in rng.choice(len(rooms), 2, replace=False))
        make = partial(_similar_pair, a, b, float(rng.choice((0.8, 1.25))), (seed, k))
        name = f"{k} {a.name} x {b.name}"
        found.append(Trial("similar rooms", "simulated", b.scene, name, VOXELS[b.set], make))
    return found


def _similar_pair(a: Cloud, b: Cloud, factor: float, key: tuple) -> tuple:
    rng = rng_of("similar", *key)
    sighted = bool(rng.integers(2))
    return nothing_right(a.load(sighted).scaled(factor), b.load(sighted), rng)


def of_one(kind: str, cut: Callable, count: int, seed: int) -> list[Trial]:
    """Trials of one cloud that is cut in two; shapes, many of them symmetric, are left out."""
    rng, found = np.random.default_rng([seed, zlib.crc32(kind.encode())]), []
    for k in range(count):
        pool = [cloud for cloud in clouds((FIT, REPORT)[k % 2]) if cloud.set != "shapes"]
        cloud = pool[rng.integers(len(pool))]
        make = partial(cut, cloud, (kind, seed, k))
        found.append(Trial(kind, cloud.set, cloud.scene, f"{k} {cloud.name}", VOXELS[cloud.set], make))
    return found


def opposite_ends(cloud: Cloud, key: tuple) -> tuple:
    """What lies below the 45 % and above the 55 % quantile in a direction within the cloud's two longer axes."""
    rng = rng_of(*key)
    whole = cloud.load(bool(rng.integers(2)))
    _, _, axes = np.linalg.svd(whole.points[::10] - whole.points.mean(axis=0), full_matrices=False)
    along = whole.points @ (scenes._unit(rng.normal(size=2)) @ axes[:2])
    low, high = np.quantile(along, (0.45, 0.55))
    return nothing_right(whole.taken(along < low), whole.taken(along > high), rng)


def mirrored(cloud: Cloud, key: tuple) -> tuple:
    """One half of the points, drawn by chance, as a mirror shows them, and the other half."""
    rng = rng_of(*key)
    whole = cloud.load(bool(rng.integers(2)))
    half = rng.uniform(size=len(whole.points)) < 0.5
    return nothing_right(whole.taken(half).reflected(direction(rng)), whole.taken(~half), rng)


def pushed(kind: str, ask: str, right: list[Trial], count: int, seed: int) -> list[Trial]:
    """Right pairs with the truth pushed by 10 to 180 degrees and a shift: as a guess without search, or to verify."""
    rng, base = np.random.default_rng([seed, zlib.crc32(kind.encode())]), [t for t in right if t.set != "low"]
    found = []
    for k in range(count):
        pair = base[rng.integers(len(base))]
        make = partial(_pushed_pair, pair, ask, (kind, seed, k))
        found.append(replace(pair, kind=kind, name=f"{k} {pair.name}", make=make, overlap=""))
    return found


def _pushed_pair(pair: Trial, ask: str, key: tuple) -> tuple:
    source, target, T, tolerance, *_ = pair.make()
    rng, points = rng_of(*key), points_of(target)
    turn, middle = np.eye(4), points.mean(axis=0)
    turn[:3, :3] = Rotation.from_rotvec(np.radians(rng.uniform(10, 180)) * direction(rng)).as_matrix()
    step = direction(rng) * rng.uniform(0, 0.075) * np.linalg.norm(np.ptp(points, axis=0))
    return source, target, T, tolerance, shift(middle + step) @ turn @ shift(-middle) @ T, ask
