"""A furnished living room: one inventory, arranged by the seed."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from . import furniture
from .furniture import Solids, block, placed
from .primitives import Vector
from .scene import Scene, generator

_THICK = 0.3  # of walls, floor and ceiling; they overlap at the edges, so that no ray slips out


@dataclass(frozen=True)
class Room(Scene):
    """A closed room that spans from the origin to `size` (x, y, z), metres, z up."""

    size: Vector


@dataclass(frozen=True)
class _Opening:
    """A rectangular recess in a wall: window, door or niche."""

    left: float
    right: float
    bottom: float
    top: float
    depth: float


def simulate_room(seed: int = 0) -> Room:
    """A room of about 6 x 5 x 2.7 m with window, door, niche, beam and furniture; same seed, same room.

    Raises ArgumentError for a negative seed.
    """
    rng = generator(seed)
    length, width, height = rng.uniform((5.7, 4.8, 2.6), (6.3, 5.3, 2.8))
    solids = [
        *_shell(length, width, height, rng),
        *_along_walls(length, width, height, rng),
        *_on_the_floor(length, width, height, rng),
    ]
    return Room(tuple(solids), (float(length), float(width), float(height)))


def _shell(length: float, width: float, height: float, rng: np.random.Generator) -> Solids:
    """Floor, ceiling with a beam, and walls: window to the north, niche to the east, door to the south."""
    window = rng.uniform(1.9, 2.3)
    niche = rng.uniform(0.7, 1.1)
    door = rng.uniform(0.5, 0.9)
    beam = rng.uniform(0.55, 0.65) * length
    return [
        block((-_THICK, -_THICK, -_THICK), (length + _THICK, width + _THICK, 0)),
        block((-_THICK, -_THICK, height), (length + _THICK, width + _THICK, height + _THICK)),
        block((beam - 0.1, 0, height - 0.25), (beam + 0.1, width, height)),
        *placed(_wall(length, height, _Opening(window, window + 1.6, 0.9, 2.2, 0.22)), 0, width),
        *placed(_wall(width, height, _Opening(niche, niche + 0.9, 0.8, 2.0, 0.25)), length, width, -pi / 2),
        *placed(_wall(length, height, _Opening(door, door + 0.9, 0.0, 2.05, 0.1)), length, 0, pi),
        *placed(_wall(width, height), 0, 0, pi / 2),
    ]


def _wall(length: float, height: float, opening: _Opening | None = None) -> Solids:
    """A wall along x, its inner face at y = 0 towards -y, in one piece or around an opening with a back."""
    a, b = -_THICK, length + _THICK
    if opening is None:
        return [block((a, 0, 0), (b, _THICK, height))]
    o = opening
    return [
        block((a, 0, 0), (o.left, _THICK, height)),
        block((o.right, 0, 0), (b, _THICK, height)),
        block((o.left, 0, -_THICK), (o.right, _THICK, o.bottom)),
        block((o.left, 0, o.top), (o.right, _THICK, height)),
        block((o.left, o.depth, o.bottom), (o.right, _THICK, o.top)),
    ]


def _along_walls(length: float, width: float, height: float, rng: np.random.Generator) -> Solids:
    """Shelf and chimney to the west, radiator to the north, sideboard to the east, sofa to the south."""
    window = rng.uniform(2.1, 2.4)
    frame = block((0, -0.03, 1.35), (0.7, 0, 1.85))
    return [
        *placed(furniture.shelf(rng), 0, rng.uniform(0.9, 1.3), pi / 2),
        block((0, width - 0.9, 0), (0.45, width, height)),
        *placed(furniture.radiator(), window, width),
        *placed(furniture.sideboard(), length, rng.uniform(2.6, 2.9), -pi / 2),
        *placed(furniture.sofa(rng), rng.uniform(2.1, 2.7), 0.05, pi + rng.uniform(-0.05, 0.05)),
        *placed([frame, frame.moved((0.9, 0, 0.1))], rng.uniform(2.6, 3.2), 0, pi),
    ]


def _on_the_floor(length: float, width: float, height: float, rng: np.random.Generator) -> Solids:
    """Dining table with chairs to the north, coffee table on a rug before the sofa, lamps, plant, pouffe."""
    x, y, yaw = rng.uniform((2.2, width - 1.75, -0.25), (2.7, width - 1.55, 0.25))
    seats = ((-0.4, -0.65, pi), (0.45, -0.6, pi), (-0.35, 0.65, 0), (0.4, 0.7, 0), (1.1, 0.0, -pi / 2))
    chairs = [s for cx, cy, turn in seats for s in placed(furniture.chair(), cx, cy, turn + rng.uniform(-0.3, 0.3))]
    rug = block((-1.1, -0.75, 0), (1.1, 0.75, 0.015))
    return [
        *placed([*furniture.table(rng), *chairs], x, y, yaw),
        *placed([rug, *furniture.coffee_table()], rng.uniform(2.2, 2.6), 1.75, rng.uniform(-0.2, 0.2)),
        *placed(furniture.standing_lamp(), rng.uniform(3.8, 4.0), 0.4),
        *placed(furniture.plant(rng), length - 0.45, width - 0.45),
        *placed([furniture.disc(0, 0, 0, 0.28, 0.4)], length - rng.uniform(1.2, 1.6), rng.uniform(1.4, 1.9)),
        *placed(furniture.ceiling_lamp(height), x, y),
    ]
