"""What stands in the rooms of the building: each room is furnished by its seed alone, in its own frame.

A room spans x from 0 to its width along the corridor, y from 0 (the corridor's wall) to DEPTH (the facade), z from 0.
Offices are alike: their walls, doors, windows, lamps and radiators; their furniture is of one catalogue, arranged anew.
"""

from __future__ import annotations

from math import pi

import numpy as np

from fieldalign.clouds.simulated import Box, Cylinder, Primitive, Sphere
from fieldalign.clouds.simulated.furniture import (
    block,
    chair,
    coffee_table,
    disc,
    legs,
    placed,
    plant,
    radiator,
    shelf,
    sideboard,
    sofa,
    standing_lamp,
    table,
)

Solids = list[Primitive]
WIDTH, DEPTH, CLEAR = 4.5, 6.0, 3.0  # of a room, the width about, and its height; metres


def bays(width: float) -> list[tuple[float, tuple]]:
    """Where each bay of the facade begins, and its two windows, each from x to x."""
    count = max(1, round(width / WIDTH))
    step = width / count
    begins = [k * step for k in range(count)]
    return [(x, ((x + 0.6, x + step / 2 - 0.25), (x + step / 2 + 0.25, x + step - 0.6))) for x in begins]


def mirrored(solids: Solids, width: float) -> Solids:
    """The room the other way round."""
    return [_mirrored(solid, width) for solid in solids]


def _mirrored(solid: Primitive, width: float) -> Primitive:
    x, y, z = solid.center
    if isinstance(solid, Box):
        return Box((width - x, y, z), solid.size, -solid.yaw)
    if isinstance(solid, Cylinder):
        (a, *start), (b, *end) = solid.start, solid.end
        return Cylinder((width - a, *start), (width - b, *end), solid.radius)
    return Sphere((width - x, y, z), solid.reach)


def office(rng: np.random.Generator, width: float = WIDTH) -> Solids:
    """One to three desks, shelves along the walls, some of what collects in offices; the door is at x < 1.6."""
    sides = [(0.09, 1.9, pi / 2), (0.09, 4.0, pi / 2), (width - 0.09, 2.6, -pi / 2), (width - 0.09, 4.9, -pi / 2)]
    things = [_at_the_wall(rng) for _ in sides]
    solids = [s for (x, y, yaw), thing in zip(sides, things, strict=True) for s in _along(thing, x, y, yaw, rng)]
    for _ in range(rng.integers(1, 4)):
        x, y = rng.uniform((1.3, 2.2), (width - 1.3, DEPTH - 1.3))
        solids += placed([*_desk(rng), *_seat(rng)], x, y, rng.choice((0, pi / 2, pi, -pi / 2)) + rng.normal(0, 0.08))
    if rng.uniform() < 0.5:
        solids += placed(plant(rng), rng.uniform(2.2, width - 0.5), DEPTH - 0.5)
    if rng.uniform() < 0.5:
        solids += placed(_crates(rng), rng.uniform(2.2, width - 0.8), 0.45, rng.normal(0, 0.3))
    return [*solids, *_whiteboard(rng, width), *fixed(rng, width)]


def meeting(rng: np.random.Generator, width: float = WIDTH) -> Solids:
    """A long table with chairs, a sideboard and a screen."""
    length, x, y = rng.uniform(2.2, 3.2), width / 2 + rng.uniform(-0.3, 0.3), DEPTH / 2 + rng.uniform(0, 0.5)
    top = [Box((0, 0, 0.73), (1.2, length, 0.05)), *placed(legs(1.0, length - 0.3, 0.7, 0.08), 0, 0)]
    places = [(side * 0.85, along) for side in (-1, 1) for along in np.arange(-length / 2 + 0.4, length / 2, 0.75)]
    taken = [p for p in places if rng.uniform() < 0.85]
    chairs = [
        s for cx, cy in taken for s in placed(chair(), cx, cy, (-pi / 2 if cx > 0 else pi / 2) + rng.normal(0, 0.25))
    ]
    screen = block((0.8, -0.12, 0.9), (2.4, -0.05, 1.85))
    corner = placed(plant(rng) if rng.uniform() < 0.5 else standing_lamp(), width - 0.5, DEPTH - 0.5)
    board = placed(sideboard(), 0.09, rng.uniform(2.2, 3.8), pi / 2)
    return [*placed([*top, *chairs], x, y), *placed([screen], width, 4.2, -pi / 2), *board, *corner, *fixed(rng, width)]


def kitchen(rng: np.random.Generator, width: float = WIDTH) -> Solids:
    """A kitchenette along one wall, dining tables, a sofa."""
    counter = [block((0, -0.62, 0), (2.4, 0, 0.9)), block((0, -0.36, 1.45), (2.4, 0, 2.15))]
    fridge = block((2.4, -0.66, 0), (3.0, 0, 1.85))
    on_top = [disc(x, -0.3, 0.9, rng.uniform(0.05, 0.12), rng.uniform(0.1, 0.35)) for x in (0.3, 0.8, 1.3, 1.9)]
    round_table = placed([*coffee_table(), disc(0.1, 0.05, 0.4, 0.09, 0.2)], width - 1.6, 1.6)
    dining = placed([*table(rng), *_chairs_around(rng)], 2.5, 3.9, rng.uniform(-0.3, 0.3))
    seats = placed(sofa(rng), width - 0.1, 1.9, -pi / 2 + rng.normal(0, 0.03))
    return [*placed([*counter, fridge, *on_top], 0.09, 1.9, pi / 2), *round_table, *dining, *seats, *fixed(rng, width)]


def open_plan(rng: np.random.Generator, width: float) -> Solids:
    """Groups of four desks with low screens between them, round pillars, cupboards as islands."""
    solids: Solids = []
    for x in np.arange(2.6, width - 2, 4.3):
        for y in (1.7, 4.3):
            solids += placed(_island(rng), x + rng.uniform(-0.4, 0.4), y + rng.uniform(-0.2, 0.2), rng.normal(0, 0.05))
    pillars = [disc(x, DEPTH / 2, 0, 0.2, CLEAR) for x in np.arange(WIDTH, width - 1, WIDTH)]
    cupboards = placed(shelf(rng), 0.09, 2.0, pi / 2) + placed(sideboard(), width - 0.09, 4.2, -pi / 2)
    return [*solids, *pillars, *cupboards, *fixed(rng, width)]


def corridor(rng: np.random.Generator, width: float = WIDTH) -> Solids:
    """What stands before the wall beside a door: in the frame of the room behind, y < 0 is the corridor."""
    wide, board, notice = rng.uniform((0.8, 0.5, 0.6), (1.6, 1.2, 1.8))
    things = (
        (wide, [block((0, -0.42, 0), (wide, 0, rng.uniform(0.8, 1.9)))]),
        (1.5, [block((0, -0.4, 0.4), (1.5, 0, 0.46)), *placed(legs(1.4, 0.34, 0.4, 0.05), 0.75, -0.2)]),
        (0.65, [block((0, -0.6, 0), (0.65, 0, 1.0)), block((0.1, -0.5, 1.0), (0.5, -0.05, 1.2))]),
        (0.9, placed(plant(rng), 0.45, -0.3)),
        (board, [disc(0.3, -0.12, 0.6, 0.09, 0.5), block((0, -0.03, 1.2), (board, 0, 1.9))]),
        (notice, [block((0, -0.04, 0.9), (notice, 0, 2.0))]),
    )
    solids, x = [], 1.7 + rng.uniform(0, 0.5)
    for k in rng.permutation(len(things))[: rng.integers(1, 4)]:
        length, thing = things[k]
        if x + length < width - 0.1:
            solids += placed(thing, x, -0.15)
            x += length + rng.uniform(0.1, 0.6)
    return solids


def fixed(rng: np.random.Generator, width: float) -> Solids:
    """What all rooms have: radiators below the windows, two rows of lamps; blinds that hang as they were left."""
    solids: Solids = []
    for _, windows in bays(width):
        for left, right in windows:
            drop = rng.choice((0.0, 0.0, 0.3, 0.7))
            solids += placed(radiator(), left + 0.1, DEPTH)
            solids += [block((left, DEPTH + 0.02, 2.3 - drop), (right, DEPTH + 0.04, 2.31))]
            lamp = block((left + 0.3, 0, CLEAR - 0.25), (left + 0.6, 1.3, CLEAR - 0.19))
            solids += [*placed([lamp], 0, 0.9), *placed([lamp], 0, 3.6)]
    return solids


# ------------------------------------------------------------------------------------------------ pieces


def _at_the_wall(rng: np.random.Generator) -> Solids:
    kind = rng.integers(6)
    if kind == 0:
        return shelf(rng)
    if kind == 1:
        return sideboard()
    if kind == 2:
        return [block((0, -0.45, 0), (rng.uniform(0.8, 1.8), 0, rng.uniform(0.7, 2.0)))]
    if kind == 3:
        return placed(sofa(rng), 1.0, 0.0)
    if kind == 4:
        return [block((x, -0.6, 0), (x + 0.46, 0, rng.choice((0.7, 1.3)))) for x in (0.0, 0.5, 1.0)]
    return [block((0, -0.02, 1.2), (rng.uniform(0.5, 1.5), 0, 1.9))] if rng.uniform() < 0.5 else []


def _along(solids: Solids, x: float, y: float, yaw: float, rng: np.random.Generator) -> Solids:
    """Something with its back to a side wall, about two metres of which are its own."""
    return placed(solids, x, y + rng.uniform(-0.25, 0.1), yaw)


def _desk(rng: np.random.Generator) -> Solids:
    """A desk with screens, a drawer and paper; one sits at y < 0."""
    length = rng.choice((1.4, 1.6, 1.8))
    solids: Solids = [Box((0, 0, 0.72), (length, 0.8, 0.04)), *legs(length - 0.1, 0.7, 0.7, 0.06)]
    solids += [block((length / 2 - 0.5, -0.3, 0), (length / 2 - 0.08, 0.3, 0.6))]
    for x in rng.uniform(-0.15, 0.15) + np.array(((0.0,), (-0.32, 0.32))[rng.integers(2)]):
        screen = [Box((0, 0, 0.36), (0.56, 0.03, 0.34)), Box((0, 0.04, 0.1), (0.06, 0.05, 0.24))]
        solids += placed(screen, x, 0.2, rng.normal(0, 0.2), 0.74)
    for _ in range(rng.integers(1, 4)):
        x, y, h = rng.uniform((-length / 2 + 0.15, -0.25, 0.02), (length / 2 - 0.15, 0.0, 0.2))
        solids.append(Box((x, y, 0.74 + h / 2), (0.22, 0.3, h), rng.uniform(-0.5, 0.5)))
    return solids


def _seat(rng: np.random.Generator) -> Solids:
    """An office chair that was left before the desk."""
    x, y, yaw = rng.normal((0, -0.75, pi), (0.15, 0.1, 0.6))
    star = [Box((0, 0, 0.06), (0.6, 0.06, 0.06), turn) for turn in (0.2, 1.25, 2.3)]
    return placed([*star, disc(0, 0, 0.06, 0.03, 0.4), Box((0, 0, 0.48), (0.48, 0.48, 0.08)),
                   Box((0, 0.22, 0.82), (0.44, 0.06, 0.5))], x, y, yaw)  # fmt: skip


def _chairs_around(rng: np.random.Generator) -> Solids:
    seats = ((-0.4, -0.65, pi), (0.45, -0.65, pi), (-0.35, 0.7, 0.0), (0.4, 0.7, 0.0))
    taken = [seat for seat in seats if rng.uniform() < 0.8]
    return [s for x, y, yaw in taken for s in placed(chair(), x, y, yaw + rng.normal(0, 0.3))]


def _island(rng: np.random.Generator) -> Solids:
    """Four desks, or three, two by two around a low screen."""
    solids: Solids = [block((-1.6, -0.02, 0.3), (1.6, 0.02, rng.choice((1.2, 1.45))))]
    for x in (-0.8, 0.8):
        for yaw in (0.0, pi):
            if rng.uniform() < 0.9:
                desk = [*_desk(rng), *_seat(rng)]
                solids += placed(placed(desk, 0, -0.45), x, 0, yaw)
    return solids


def _crates(rng: np.random.Generator) -> Solids:
    heights = np.cumsum(rng.uniform(0.25, 0.4, rng.integers(1, 4)))
    return [
        Box((0, 0, top - h / 2), (0.5, 0.38, h), rng.normal(0, 0.15))
        for top, h in zip(heights, np.diff(heights, prepend=0), strict=True)
    ] + ([Sphere((0.0, 0.0, float(heights[-1]) + 0.12), 0.12)] if rng.uniform() < 0.3 else [])


def _whiteboard(rng: np.random.Generator, width: float) -> Solids:
    left = rng.uniform(1.9, width - 1.9)
    return [block((left, 0, 0.9), (left + 1.6, 0.03, 2.0))] if rng.uniform() < 0.6 else []
