"""Triangles that simulated drives see: boxes, posts, walls with windows, cars, trees; heaped up in a Soup.

Every shape is an array of quads (m, 4, 3), corners in order, metres, z up; a Soup makes two triangles of each.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from fieldalign.clouds.simulated import Box, Cylinder, Primitive

CAR = np.array(  # the side of a car, (along, up), from the rear bumper over the roof to the front one
    [(-2.15, 0.25), (-2.2, 0.65), (-2.1, 0.95), (-1.7, 1.0), (-1.25, 1.42), (0.1, 1.46), (0.85, 0.98), (1.9, 0.82),
     (2.2, 0.6), (2.2, 0.25)]
)  # fmt: skip
TRUCK = np.array([(-4.5, 0.5), (-4.5, 3.3), (3.0, 3.3), (3.1, 2.7), (4.4, 2.5), (4.6, 1.2), (4.6, 0.4)])
WHEELS = (-1.35, 1.35)


class Soup:
    """A growing heap of triangles."""

    def __init__(self) -> None:
        self._vertices: list[np.ndarray] = []
        self._faces: list[np.ndarray] = []
        self._count = 0

    def add(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        """vertices: (n, 3); faces: (m, 3), numbers of vertices."""
        self._vertices.append(np.asarray(vertices, np.float32).reshape(-1, 3))
        self._faces.append(np.asarray(faces, np.uint32).reshape(-1, 3) + np.uint32(self._count))
        self._count += len(self._vertices[-1])

    def quads(self, *shapes: np.ndarray) -> None:
        for quads in shapes:
            corners = quads.reshape(-1, 4, 3)
            first = 4 * np.arange(len(corners))[:, None]
            self.add(corners, np.concatenate([first + (0, 1, 2), first + (0, 2, 3)]))

    def arrays(self) -> tuple[np.ndarray, np.ndarray]:
        """vertices (n, 3) float32 and faces (m, 3) uint32."""
        return np.concatenate(self._vertices), np.concatenate(self._faces)


def placed(quads: np.ndarray, x: float, y: float, z: float = 0.0, yaw: float = 0.0) -> np.ndarray:
    """Turned about z, then shifted."""
    c, s = np.cos(yaw), np.sin(yaw)
    return quads @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + (x, y, z)


def box(low: tuple, high: tuple) -> np.ndarray:
    """The six faces between two corners."""
    (a, b, c), (d, e, f) = low, high
    return extruded(np.array([(a, c), (a, f), (d, f), (d, c)]), b, e)


def extruded(outline: np.ndarray, left: float, right: float) -> np.ndarray:
    """A profile (k, 2) in x and z, pulled from y = left to y = right; its ends are closed by fans."""
    following = np.roll(outline, -1, axis=0)
    around = [_raised(p, y) for p, y in ((outline, left), (following, left), (following, right), (outline, right))]
    middle = np.broadcast_to(outline.mean(axis=0), outline.shape)
    ends = [np.stack([_raised(p, y) for p in (outline, following, middle, middle)], 1) for y in (left, right)]
    return np.concatenate([np.stack(around, 1), *ends])


def _raised(outline: np.ndarray, y: float) -> np.ndarray:
    return np.stack([outline[:, 0], np.full(len(outline), y), outline[:, 1]], 1)


def post(bottom: float, top: float, radius: float, tip: float | None = None, sides: int = 8) -> np.ndarray:
    """An upright cylinder, or a cone that ends with the radius `tip`."""
    return pipe(np.array([0.0, 0, bottom]), np.array([0.0, 0, top]), radius, radius if tip is None else tip, sides)


def pipe(start: np.ndarray, end: np.ndarray, radius: float, tip: float, sides: int = 8) -> np.ndarray:
    """The mantle between two circles, closed at both ends."""
    axis = (end - start) / np.linalg.norm(end - start)
    one = np.cross(axis, (1.0, 0, 0) if abs(axis[0]) < 0.7 else (0, 1.0, 0))
    one /= np.linalg.norm(one)
    angle = 2 * np.pi * np.arange(sides + 1) / sides
    circle = np.cos(angle)[:, None] * one + np.sin(angle)[:, None] * np.cross(axis, one)
    low, high = start + radius * circle, end + tip * circle
    rings = np.broadcast_to(start, low.shape), low, high, np.broadcast_to(end, low.shape)
    return np.concatenate([np.stack([a[:-1], a[1:], b[1:], b[:-1]], 1) for a, b in pairwise(rings)])


def car(rng: np.random.Generator) -> np.ndarray:
    """Seen from above it points along x; one in twelve is a truck."""
    truck = rng.uniform() < 1 / 12
    size = rng.uniform((0.9, 0.85, 0.95), (1.08, 1.0, 1.35 if not truck else 1.1))
    profile, half = (TRUCK, 1.25) if truck else (CAR, 0.9)
    body = extruded(profile * size[[0, 2]], -half * size[1], half * size[1])
    circle = 0.32 * np.stack([np.cos(np.arange(8) * np.pi / 4), np.sin(np.arange(8) * np.pi / 4)], 1)
    sides = [(x * size[0], side * half) for x in WHEELS for side in (-1, 1)]
    wheels = [extruded(circle + (x, 0.32), 0.87 * y, y) for x, y in sides]
    return np.concatenate([body, *wheels])


def tree(rng: np.random.Generator, tall: float) -> np.ndarray:
    """A trunk, some branches, and a rough crown of leaves in clumps through which rays may pass."""
    foot, spread = tall * rng.uniform(0.28, 0.45), tall * rng.uniform(0.2, 0.32)
    trunk = post(-0.3, foot + 0.3 * tall, 0.022 * tall, 0.01 * tall)
    clumps = foot + 0.55 * (tall - foot)
    middles = _within_ball(rng, rng.integers(6, 11)) * (spread, spread, 0.45 * (tall - foot)) + (0, 0, clumps)
    branches = [pipe(np.array([0, 0, foot]), middle, 0.008 * tall, 0.02, 5) for middle in middles[:5]]
    ends = np.repeat(middles, 40, axis=0)
    leaves = _leaves(ends + 0.42 * spread * _within_ball(rng, len(ends)), 0.012 * tall + 0.06, rng)
    return np.concatenate([trunk, *branches, leaves])


def bush(rng: np.random.Generator, size: float) -> np.ndarray:
    middles = _within_ball(rng, 110) * (size, size * rng.uniform(0.5, 1), 0.55 * size) + (0, 0, 0.5 * size)
    return _leaves(middles, 0.13, rng)


def _leaves(middles: np.ndarray, size: float, rng: np.random.Generator) -> np.ndarray:
    """Squares that lie anyhow, of half edges about `size`."""
    a, b = rng.standard_normal((2, len(middles), 3))
    b = np.cross(a, b)
    a, b = (size * rng.uniform(0.6, 1.4, (len(v), 1)) * v / np.linalg.norm(v, axis=1, keepdims=True) for v in (a, b))
    return middles[:, None] + np.stack([-a - b, a - b, a + b, b - a], 1)


def _within_ball(rng: np.random.Generator, count: int) -> np.ndarray:
    direction = rng.standard_normal((count, 3))
    return direction * (rng.uniform(0.1, 1, count) ** (1 / 3) / np.linalg.norm(direction, axis=1))[:, None]


def facade(width: float, height: float, rng: np.random.Generator, front: bool = True) -> np.ndarray:
    """A wall along x from 0, outside is y < 0: windows in rows, doors on the ground, balconies in the front."""
    columns, rows = max(1, round(width / rng.uniform(2.6, 4.0))), max(1, round(height / 3.1))
    x, z = np.linspace(0, width, columns + 1), np.linspace(0, height, rows + 1)
    left, low = (a.ravel() for a in np.meshgrid(x[:-1], z[:-1], indexing="ij"))
    right, high = left + width / columns, low + height / rows
    margin, sill, depth = rng.uniform(0.5, 0.9), rng.uniform(0.5, 1.0), rng.choice((0.08, 0.15, 0.3))
    bottom = np.where((low == 0) & (rng.uniform(size=len(low)) < 0.25), 0.05, low + sill)
    outer = _corners(left, right, low, high, 0.0)
    inner, pane = (_corners(left + margin, right - margin, bottom, high - 0.5, y) for y in (0.0, depth))
    quads = [pane]
    for k in range(4):
        j = (k + 1) % 4
        quads += [np.stack([a[:, k], a[:, j], b[:, j], b[:, k]], 1) for a, b in ((outer, inner), (inner, pane))]
    if front and rng.uniform() < 0.4:
        deep, chosen = rng.uniform(0.8, 1.5), np.flatnonzero((low > 0) & (np.round(left / width * columns) % 2 == 0))
        for k in chosen:
            quads += balcony(left[k] + 0.2, right[k] - 0.2, low[k], deep)
    return np.concatenate(quads)


def _corners(left, right, low, high, y: float) -> np.ndarray:
    y = np.full(left.shape, y)
    return np.stack([np.stack(p, -1) for p in ((left, y, low), (right, y, low), (right, y, high), (left, y, high))], 1)


def balcony(left: float, right: float, z: float, deep: float) -> list[np.ndarray]:
    """A slab and its parapet."""
    slab, parapet = box((left, -deep, z - 0.15), (right, 0, z)), box((left, -deep, z), (right, -deep + 0.08, z + 1.0))
    return [slab, parapet, *(box((x, -deep, z), (x + 0.05, 0, z + 1.0)) for x in (left, right - 0.05))]


def building(width: float, deep: float, height: float, rng: np.random.Generator) -> np.ndarray:
    """A house with its front along x from 0, the back at y = deep, under a gabled or a flat roof."""
    sides = (0, 0, 0, width), (width, 0, np.pi / 2, deep), (width, deep, np.pi, width), (0, deep, -np.pi / 2, deep)
    walls = [placed(facade(w, height, rng, k == 0), x, y, 0, yaw) for k, (x, y, yaw, w) in enumerate(sides)]
    rise, over = rng.choice((0.0, rng.uniform(1.5, 4.0))), 0.4
    gable = np.array([(-over, height), (deep / 2, height + rise + 0.1), (deep + over, height)])
    return np.concatenate([*walls, extruded(gable, 0, width)[..., (1, 0, 2)]])


def solid(primitive: Primitive) -> np.ndarray:
    """The surface of one of the solids of fieldalign's simulated rooms, a sphere as a rough ball."""
    if isinstance(primitive, Box):
        half = np.array(primitive.size) / 2
        return placed(box(tuple(-half), tuple(half)), *primitive.center, primitive.yaw)
    if isinstance(primitive, Cylinder):
        return pipe(np.array(primitive.start), np.array(primitive.end), primitive.radius, primitive.radius, 16)
    angle = np.linspace(-np.pi / 2, np.pi / 2, 9)
    rings = primitive.reach * np.stack([np.cos(angle), np.sin(angle)], 1)
    bands = [pipe(np.array([0, 0, low]), np.array([0, 0, high]), r, q, 16) for (r, low), (q, high) in pairwise(rings)]
    return np.concatenate(bands) + primitive.center
