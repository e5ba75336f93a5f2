"""Pieces of furniture: each is a list of solids that stands on the floor at its frame's origin, z up, metres.

What belongs to a wall has its back at y = 0 and its front towards -y; the rest stands around the origin.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product
from math import cos, pi, sin

import numpy as np

from .primitives import Box, Cylinder, Primitive, Sphere, Vector

Solids = list[Primitive]


def placed(solids: Iterable[Primitive], x: float, y: float, yaw: float = 0.0, z: float = 0.0) -> Solids:
    """The solids turned by `yaw` (rad) and set down at (x, y, z)."""
    return [solid.moved((x, y, z), yaw) for solid in solids]


def block(low: Vector, high: Vector) -> Box:
    """The box between two corners."""
    center = tuple((a + b) / 2 for a, b in zip(low, high, strict=True))
    size = tuple(b - a for a, b in zip(low, high, strict=True))
    return Box((center[0], center[1], center[2]), (size[0], size[1], size[2]))


def disc(x: float, y: float, z: float, radius: float, height: float) -> Cylinder:
    """An upright cylinder that stands at height z."""
    return Cylinder((x, y, z), (x, y, z + height), radius)


def legs(width: float, depth: float, height: float, thickness: float) -> Solids:
    """Four square legs under the corners of width x depth."""
    dx, dy = (width - thickness) / 2, (depth - thickness) / 2
    return [Box((x * dx, y * dy, height / 2), (thickness, thickness, height)) for x, y in product((-1, 1), (-1, 1))]


def table(rng: np.random.Generator) -> Solids:
    """A dining table, with a bowl of fruit, a mug, a bottle and a laptop."""
    top = 0.75
    laptop = [block((-0.17, -0.12, 0), (0.17, 0.12, 0.02)), block((-0.17, 0.12, 0.02), (0.17, 0.135, 0.24))]
    fruit = [Sphere((0.07 * cos(a), 0.07 * sin(a), 0.1), 0.045) for a in (0.3, 1.9, 3.6, 5.1)]
    return [
        Box((0, 0, top - 0.02), (1.6, 0.85, 0.04)),
        *legs(1.5, 0.75, top - 0.04, 0.07),
        *placed([disc(0, 0, 0, 0.13, 0.07), *fruit], 0.1, 0.05, z=top),
        *placed(laptop, -0.5, 0.0, rng.uniform(-0.6, 0.6), top),
        disc(0.5, rng.uniform(-0.25, 0.0), top, 0.04, 0.1),
        disc(0.6, 0.2, top, 0.04, 0.2),
        disc(0.6, 0.2, top + 0.2, 0.015, 0.1),
    ]


def chair() -> Solids:
    """A chair that faces -y."""
    posts = [Box((x, 0.2, 0.7), (0.04, 0.04, 0.46)) for x in (-0.2, 0.2)]
    slats = [Box((0, 0.2, z), (0.38, 0.02, 0.09)) for z in (0.65, 0.86)]
    return [Box((0, 0, 0.455), (0.44, 0.44, 0.04)), *legs(0.44, 0.44, 0.435, 0.04), *posts, *slats]


def sofa(rng: np.random.Generator) -> Solids:
    """A sofa for three, with a bolster and two cushions."""
    arms = [block((x - 0.1, -0.9, 0), (x + 0.1, 0, 0.6)) for x in (-0.95, 0.95)]
    seats = [block((x - 0.415, -0.92, 0.3), (x + 0.415, -0.22, 0.46)) for x in (-0.42, 0.42)]
    cushions = [Box((x, -0.36, 0.62), (0.4, 0.12, 0.32), rng.uniform(-0.5, 0.5)) for x in (-0.5, 0.05)]
    bolster = Cylinder((0.72, -0.8, 0.56), (0.72, -0.32, 0.56), 0.1)
    return [
        block((-0.85, -0.88, 0.08), (0.85, 0, 0.3)),
        block((-0.85, -0.22, 0.3), (0.85, 0, 0.82)),
        *arms,
        *seats,
        *cushions,
        bolster,
    ]


def shelf(rng: np.random.Generator) -> Solids:
    """A bookshelf, 1.8 m wide and 2 m high, its boards filled in part."""
    width, depth, height = 1.8, 0.32, 2.0
    uprights = [block((x - 0.015, -depth, 0), (x + 0.015, 0, height)) for x in (0.015, width / 2, width - 0.015)]
    levels = (0.06, 0.45, 0.84, 1.23, 1.62, height - 0.03)
    boards = [block((0, -depth, z), (width, 0, z + 0.03)) for z in levels]
    bays = product(levels[:-1], (0.03, width / 2 + 0.015))
    things = [solid for z, x in bays for solid in placed(_in_bay(rng), x, 0, z=z + 0.03)]
    return [block((0, -0.01, 0), (width, 0, height)), *uprights, *boards, *things]


def _in_bay(rng: np.random.Generator) -> Solids:
    """What stands in one bay of the shelf (0.85 x 0.36 m): blocks of books, and a box, vase or ball."""
    solids: Solids = []
    x = rng.uniform(0, 0.15)
    while x < 0.5:
        width, height, depth = rng.uniform((0.05, 0.18, 0.15), (0.2, 0.32, 0.26))
        solids.append(block((x, -depth, 0), (x + width, -0.01, height)))
        x += width + rng.choice((0.0, 0.1))
    ornaments: Solids = [
        Box((0, -0.15, 0.1), (0.16, 0.2, 0.2), rng.uniform(-0.4, 0.4)),
        disc(0, -0.15, 0, 0.06, 0.25),
        Sphere((0, -0.15, 0.08), 0.08),
    ]
    return [*solids, *placed([ornaments[rng.integers(3)]], 0.74, 0)]


def coffee_table() -> Solids:
    """A low round table with a stack of magazines and a vase."""
    magazines = [
        Box((0.1, -0.1, 0.43), (0.22, 0.3, 0.02), 0.4),
        Box((0.1, -0.1, 0.455), (0.21, 0.28, 0.03), 0.7),
    ]
    return [
        disc(0, 0, 0, 0.2, 0.03),
        disc(0, 0, 0.03, 0.04, 0.35),
        disc(0, 0, 0.38, 0.4, 0.04),
        *magazines,
        disc(-0.15, 0.1, 0.42, 0.05, 0.22),
    ]


def standing_lamp() -> Solids:
    """A lamp on a pole with a globe."""
    return [disc(0, 0, 0, 0.14, 0.03), disc(0, 0, 0.03, 0.015, 1.5), Sphere((0, 0, 1.65), 0.17)]


def ceiling_lamp(ceiling: float) -> Solids:
    """A shade that hangs from the ceiling."""
    return [disc(0, 0, ceiling - 0.6, 0.012, 0.6), disc(0, 0, ceiling - 0.8, 0.22, 0.2)]


def plant(rng: np.random.Generator) -> Solids:
    """A pot with a stem and a crown of round leaves."""
    angles = rng.uniform(0, 2 * pi, 9)
    heights = np.linspace(0.65, 1.35, 9)
    crown: Solids = [
        Sphere((0.17 * cos(a), 0.17 * sin(a), float(z)), float(rng.uniform(0.07, 0.15)))
        for a, z in zip(angles, heights, strict=True)
    ]
    return [disc(0, 0, 0, 0.19, 0.36), disc(0, 0, 0.36, 0.025, 0.9), *crown]


def sideboard() -> Solids:
    """A low cupboard with a television, a loudspeaker and a globe."""
    doors = [block((x + 0.01, -0.44, 0.12), (x + 0.51, -0.42, 0.58)) for x in (0.0, 0.52, 1.04)]
    return [
        block((0, -0.42, 0.1), (1.56, 0, 0.6)),
        block((0.1, -0.38, 0), (1.46, -0.05, 0.1)),
        *doors,
        block((0.15, -0.2, 0.68), (1.1, -0.16, 1.24)),
        block((0.5, -0.28, 0.6), (0.75, -0.1, 0.68)),
        block((1.2, -0.3, 0.6), (1.38, -0.1, 0.92)),
        Sphere((1.46, -0.2, 0.7), 0.1),
    ]


def radiator() -> Solids:
    """A radiator with its two pipes."""
    ribs = [block((x, -0.12, 0.15), (x + 0.05, -0.04, 0.7)) for x in np.linspace(0, 1.05, 8)]
    pipes = [Cylinder((-0.1, -0.08, z), (1.1, -0.08, z), 0.015) for z in (0.2, 0.65)]
    return [*ribs, *pipes]
