"""All that the package computes about a few small scans, as digests; other processes import this."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

import fieldalign as fa
from fieldalign.clouds.simulated import simulate_room
from fieldalign.motions import exp_twist

WIDE = 200, 110  # degrees
STEPS = 6
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
CORNERS = np.array([[0, 0, 0], [2, 0.3, 0], [0.4, 1.5, 0.1], [0.2, 0.3, 1.1]])


@cache
def scans() -> list[np.ndarray]:
    """A sensor that comes through a room: points (n, 3) in its own frame."""
    room, made = simulate_room(0), []
    for k in range(STEPS):
        pose = exp_twist(np.array([0, 0, 0.08 * k, 0, 0, 0]))
        pose[:3, 3] = room.size[0] / 2 + 0.15 * k - 0.4, room.size[1] / 2, 1.5
        made.append(room.scan(pose, 4000, 0.004, WIDE, seed=k).points)
    return made


def solid(threads: int | None) -> Any:
    """A tetrahedron, and points (n, 3) on it, moved."""
    rng = np.random.default_rng(1)
    places = rng.dirichlet(np.ones(3), 3000)
    points = np.stack([(share[:, None] * CORNERS[TRIANGLES[k % 4]]).sum(axis=0) for k, share in enumerate(places)])
    return points + [0.1, -0.05, 0.02], fa.fields.MeshField(CORNERS, TRIANGLES)


def pair(**options: Any) -> Callable[[int | None], Any]:
    return lambda threads: fa.register(scans()[2], scans()[0], threads=threads, **options)


def on_a_mesh(threads: int | None) -> Any:
    return fa.register(*solid(threads), threads=threads)


def in_the_plane(threads: int | None) -> Any:
    walls = [scan[np.abs(scan[:, 2]) < 0.3][:, :2] for scan in scans()[:2]]
    return fa.register(*walls, threads=threads)


def verified(threads: int | None) -> Any:
    return fa.verify(scans()[1], scans()[0], exp_twist(np.array([0, 0, 0.08, 0.15, 0, 0])), threads=threads)


def prepared(threads: int | None) -> Any:
    cloud = fa.prepare(scans()[0], threads=threads)
    assert isinstance(cloud, fa.PreparedCloud)
    surface = cloud.surface(cloud.scale.voxel)
    return surface.places, surface.normals, cloud.scale.voxel, *cloud.fine.surfels(cloud.fine.points[:100], 10)


def thinned(threads: int | None) -> Any:
    return fa.thin(scans()[0], 0.1, threads=threads).points


def deviations(threads: int | None) -> Any:
    return fa.deviation(*solid(threads)).values, fa.deviation(scans()[1], scans()[0]).values


def assembled(threads: int | None) -> Any:
    found = fa.assemble(scans()[:3], threads=threads)
    return found, *(model.points for model in found.models)


def driven(threads: int | None) -> Any:
    odometry = fa.Odometry(whole=True)
    for k, scan in enumerate(scans()):
        odometry.step(scan, stamp=0.1 * k)
    closed = fa.close_loops(odometry, threads=threads)
    way = odometry.trajectory
    return way.poses, way.covariances, odometry.map.points, closed.trajectory.poses, closed.map.points


EVERYTHING: dict[str, Callable[[int | None], Any]] = {
    "robust": pair(), "paper": pair(method="paper"), "from a guess": pair(init=np.eye(4)),
    "scale": pair(init=np.eye(4), scale=True), "levelled": pair(dof="levelled"), "mesh": on_a_mesh,
    "plane": in_the_plane, "verify": verified, "prepare": prepared, "thin": thinned, "deviation": deviations,
    "assemble": assembled, "odometry": driven,
}


def digests(threads: int | None = None) -> dict[str, str]:
    """A digest of each, of all bits but the seconds that it took."""
    return {name: digest(work(threads)) for name, work in EVERYTHING.items()}


def task(threads: int | None, load: Any) -> dict[str, str]:
    """As a task for an executor."""
    return digests(threads)


def digest(value: Any) -> str:
    content = hashlib.blake2b(digest_size=8)
    for part in value if isinstance(value, tuple) else (value,):
        if hasattr(part, "to_dict"):
            content.update(json.dumps(without_seconds(part.to_dict())).encode())
        else:
            content.update(np.ascontiguousarray(part).tobytes())
    return content.hexdigest()


def without_seconds(plain: Any) -> Any:
    if isinstance(plain, dict):
        return {key: without_seconds(value) for key, value in plain.items() if key != "seconds"}
    return [without_seconds(value) for value in plain] if isinstance(plain, list) else plain
