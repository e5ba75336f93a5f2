"""What has no answer: periodic, symmetric and degenerate surfaces."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from scenes import shift
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from fieldalign.clouds.simulated import Scene
from fieldalign.clouds.simulated.furniture import block

from .clouds import Scan, nothing_right, on_triangles, rng_of
from .trial import REGISTER, VERIFY, Trial


def periodic(count: int) -> list[Trial]:
    """Both scans see an interior stretch of a repeated structure: from any pose; and shifted by one period, verified.

    What the data cannot tell apart may not be accepted, not even the pose that happens to be true.
    """
    return [
        Trial(f"period, {ask}", what, f"{what} {k}", f"{what} {k}", 0.05, partial(_periodic_pair, what, k, ask))
        for what in STRUCTURES
        for ask in (REGISTER, VERIFY)
        for k in range(count)
    ]


def _periodic_pair(what: str, number: int, ask: str) -> tuple:
    rng = rng_of(what, number)
    scene, period, eye, pitch = STRUCTURES[what](rng)
    poses = [_looking(eye + along * period, pitch, rng) for along in (0.0, rng.uniform(-0.6, 0.6))]
    source, target = (
        Scan(scene.scan(pose, 30_000, seed=2 * number + k).points, np.zeros(3) if number % 2 else None)
        for k, pose in enumerate(poses)
    )
    if ask == REGISTER:
        return nothing_right(source, target, rng)
    T = np.linalg.inv(poses[1]) @ shift(rng.choice((-1, 1)) * period) @ poses[0]
    return source.given(), target.given(), None, None, T, VERIFY


def _looking(eye: np.ndarray, pitch: float, rng: np.random.Generator) -> np.ndarray:
    """world_from_sensor (4, 4), near the eye, ahead (+y) and down by the pitch, each off by some degrees."""
    yaw, down, roll = np.array([90, pitch, 0]) + rng.uniform(-6, 6, 3)
    pose = shift(eye + rng.uniform(-0.15, 0.15, 3))
    pose[:3, :3] = Rotation.from_euler("ZYX", [yaw, down, roll], degrees=True).as_matrix()
    return pose


def _facade(rng: np.random.Generator) -> tuple:
    """A wall along x behind y = 0 over a pavement, with equal windows; longer and higher than can be seen."""
    step, width, depth = rng.uniform((1.8, 0.8, 0.15), (2.6, 1.3, 0.3))
    bands = [block((-30, 0, z), (30, 1, z + 1.6)) for z in np.arange(0, 18, 3)]
    piers = [block((x, 0, 0), (x + step - width, 1, 18)) for x in step * np.arange(-12, 12)]
    ground, glass = block((-30, -20, -1), (30, 1, 0)), block((-30, depth, 0), (30, 1, 18))
    return Scene((ground, glass, *bands, *piers)), np.array([step, 0, 0]), np.array([0, -5.0, 1.7]), -8.0


def _row(rng: np.random.Generator) -> tuple:
    """Equal boxes in a row along x, on a floor, before a wall."""
    step, width, height = rng.uniform((1.2, 0.4, 0.5), (1.8, 0.8, 1.2))
    boxes = [block((x, 0, 0), (x + width, 0.7, height)) for x in step * np.arange(-25, 25)]
    floor, wall = block((-40, -20, -1), (40, 2, 0)), block((-40, 1.5, 0), (40, 2.5, 20))
    return Scene((floor, wall, *boxes)), np.array([step, 0, 0]), np.array([0, -3.0, 1.6]), 15.0


def _stairs(rng: np.random.Generator) -> tuple:
    """Equal steps that rise along y, between two walls."""
    tread, rise = rng.uniform((0.26, 0.15), (0.34, 0.19))
    steps = [block((-1.2, k * tread, -20), (1.2, (k + 1) * tread, k * rise)) for k in range(-60, 61)]
    walls = [block((x, -40, -40), (x + 1, 40, 40)) for x in (-2.2, 1.2)]
    return Scene((*walls, *steps)), np.array([0, tread, rise]), np.array([0, 0, 1.6]), 35.0


STRUCTURES = {"facade": _facade, "row": _row, "stairs": _stairs}


def symmetric(count: int) -> list[Trial]:
    """Whole objects that turn into themselves; noise of 0 and 0.3 % of the extent in turn."""
    names = ("box", "cube", *(f"prism {n}" for n in (3, 4, 5, 6, 8)))
    return [
        Trial("symmetric", name, f"{name} {k}", f"{name} {k}", 0.03, partial(_symmetric_pair, name, k))
        for name in names
        for k in range(count)
    ]


def _symmetric_pair(name: str, number: int) -> tuple:
    rng = rng_of(name, number)
    sides = int(name.split()[1]) if name.startswith("prism") else 4
    turns = 2 * np.pi * (np.arange(sides) + 0.5) / sides
    size = {"box": np.array([1.4, 1.0, 0.6]), "cube": np.full(3, 1.0)}.get(name, rng.uniform((1, 1, 0.5), (1, 1, 2)))
    ring = np.sqrt(0.5) * np.column_stack([np.cos(turns), np.sin(turns)])
    corners = np.vstack([np.column_stack([ring, np.full(sides, z)]) for z in (-0.5, 0.5)]) * size
    triangles = corners[ConvexHull(corners).simplices]
    return _noisy_pair(lambda: on_triangles(triangles, 20_000, rng), 0.003 * (number % 2), rng)


def _noisy_pair(draw: Callable[[], np.ndarray], noise: float, rng: np.random.Generator) -> tuple:
    """Two samples of one surface, with noise in shares of the extent along each axis."""
    samples = [draw() for _ in range(2)]
    spread = noise * np.linalg.norm(np.ptp(samples[0], axis=0))
    return nothing_right(*(Scan(s + spread * rng.normal(size=s.shape)) for s in samples), rng)


def degenerate(count: int) -> list[Trial]:
    """Surfaces that slide or turn on themselves, by noise and density."""
    return [
        Trial(
            kind="degenerate",
            set=what,
            scene=what,
            name=f"{what} {points} points noise {noise} {k}",
            voxel=0.05,
            make=partial(_degenerate_pair, what, points, noise, k),
        )
        for what in SURFACES
        for points in (5000, 40_000)
        for noise in (0.0, 0.001, 0.003, 0.01)
        for k in range(count)
    ]


def _degenerate_pair(what: str, points: int, noise: float, number: int) -> tuple:
    rng = rng_of(what, points, noise, number)
    return _noisy_pair(lambda: SURFACES[what](rng, *rng.uniform(size=(2, points))), noise, rng)


def _ball(rng, u, v):
    g = rng.normal(size=(len(u), 3))
    return g / np.linalg.norm(g, axis=1, keepdims=True)


def _cap(rng, u, v):
    height = 1 - 0.6 * v  # of a sphere, areas go with heights
    return _around(np.sqrt(1 - height**2), 2 * np.pi * u, height)


def _around(radius, turn, z):
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), z])


def _tunnel(rng, u, v):
    vault = np.column_stack([2 * np.cos(np.pi * u), 20 * v, 2 * np.sin(np.pi * u)])
    return np.where(rng.uniform(size=(len(u), 1)) < 0.4, np.column_stack([4 * u - 2, 20 * v, 0 * u]), vault)


def _corridor(rng, u, v):
    walls = [np.column_stack([np.full(len(u), x), 15 * v, 2.5 * u]) for x in (-1, 1)]
    return np.choose(rng.integers(3, size=(len(u), 1)), [*walls, np.column_stack([2 * u - 1, 15 * v, 0 * u])])


def _two_planes(rng, u, v):
    flat, upright = np.column_stack([3 * u, 4 * v, 0 * u]), np.column_stack([0 * u, 4 * v, 3 * u])
    return np.where(rng.uniform(size=(len(u), 1)) < 0.5, flat, upright)


def _torus(rng, u, v):
    keep = rng.uniform(0, 2.6, len(u)) < 2 + 0.6 * np.cos(2 * np.pi * v)
    u, v = 2 * np.pi * u[keep], 2 * np.pi * v[keep]
    return _around(2 + 0.6 * np.cos(v), u, 0.6 * np.sin(v))


SURFACES = {
    "plane": lambda rng, u, v: np.column_stack([4 * u, 3 * v, 0 * u]),
    "sphere": _ball,
    "cap": _cap,
    "cylinder": lambda rng, u, v: _around(1.0, 2 * np.pi * u, 6 * v),
    "half tunnel": _tunnel,
    "corridor": _corridor,
    "cone": lambda rng, u, v: _around(np.sqrt(v), 2 * np.pi * u, 2 * np.sqrt(v)),
    "two planes": _two_planes,
    "torus": _torus,
}
