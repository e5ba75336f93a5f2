"""The plan of the building: storeys of rooms on both sides of a corridor, and the places that it is scanned from.

    plan = Plan(scans=200, seed=0)
    plan.solids, plan.places     # (n, 3) eyes of the scanner, world frame, metres, z up

All storeys have the same corridor, walls, windows, pillars and stairwells; which room is an office, a meeting room or a
kitchen, on which side its door is, where the open plan lies and how each is furnished differs. The corridor lies along
x, from 0, with its middle at y = 0.
"""

from __future__ import annotations

from itertools import product
from math import pi

import building_rooms as rooms
import numpy as np
from building_rooms import CLEAR, DEPTH, WIDTH, bays
from panorama import World

from fieldalign.clouds.simulated import Sphere
from fieldalign.clouds.simulated.furniture import block, disc, placed

STOREY, SLAB = 3.4, 0.4  # metres, from floor to floor; the slab between CLEAR and the next floor
HALF, WALL, FACADE = 1.1, 0.15, 0.3  # half the corridor's width; thickness of its walls and of the outer ones
DOOR, LINTEL = (0.5, 1.5), 2.1
SPAN = 3  # rooms that an open plan takes the place of
LANDING, STEPS, TREAD = 1.7, 10, 0.27  # of a stairwell: from the corridor to the first step; of a flight
RISE = STOREY / 2 / STEPS
EYE = 1.5


class Plan:
    """solids: of the whole building and what can be seen from its windows. places: (n, 3), as many as asked for."""

    def __init__(self, scans: int, seed: int) -> None:
        self.storeys = 3 if scans >= 100 else 2 if scans >= 50 else 1
        count = max(2, scans // (6 * self.storeys) - 1)
        while True:  # the least number of rooms on a side that has enough places
            self._rng = np.random.default_rng([seed, count])
            self.solids, self._open, self._asked = [], [], []
            self._build(count)
            if len(self._asked) >= scans:
                break
            count += 1
        self.places = self._chosen(scans)

    def _build(self, count: int) -> None:
        length = count * WIDTH
        stairs = {1, count - 2} if count >= 8 else {1} if self.storeys > 1 else set()
        self._edges = {south: self._divided(count, stairs if south else set()) for south in (True, False)}
        for storey in range(self.storeys):
            first = int(self._rng.integers(0, count - SPAN + 1)) if count >= 6 else count
            self._corridor(storey, count, length)
            for slot in range(count):
                (self._stairwell if slot in stairs else self._room)(storey, slot, south=True)
                if not first <= slot < first + SPAN:
                    self._room(storey, slot, south=False)
            if first < count:
                self._open_plan(storey, first)
        roof = self.storeys * STOREY - SLAB
        self._add(block((-FACADE, -9, roof), (length + FACADE, 9, roof + SLAB)))
        self._outside(length)
        world = World(self.solids)
        self._asked = [(rank, eye) for rank, *where in self._open if (eye := self._standing(world, *where)) is not None]

    def _divided(self, count: int, stairs: set) -> np.ndarray:
        """Where the rooms of a side begin and end: each a little wider or narrower, the same on all storeys."""
        widths = np.array([WIDTH if slot in stairs else self._rng.uniform(4.0, 5.1) for slot in range(count)])
        rooms_alone = [slot not in stairs for slot in range(count)]
        widths[rooms_alone] *= WIDTH * sum(rooms_alone) / widths[rooms_alone].sum()
        return np.concatenate([[0.0], np.cumsum(widths)])

    # -------------------------------------------------------------------------------------------- where to stand

    def _stand(self, rank: int, low: tuple, high: tuple, floor: float, clear: float = 0.45) -> None:
        """A place somewhere between two corners; those of a high rank are the first to be left out."""
        self._open.append((rank, low, high, floor, clear))

    def _standing(self, world: World, low: tuple, high: tuple, floor: float, clear: float) -> np.ndarray | None:
        for _ in range(60):
            x, y = self._rng.uniform(low, high)
            if world.clearance(x, y, floor) >= clear:
                return np.array([x, y, floor + EYE + self._rng.uniform(-0.1, 0.1)])
        return None

    def _chosen(self, scans: int) -> np.ndarray:
        """The places that are kept, in random order."""
        order = sorted(self._rng.permutation(len(self._asked)), key=lambda k: self._asked[k][0])[:scans]
        return np.stack([self._asked[k][1] for k in self._rng.permutation(order)])

    # -------------------------------------------------------------------------------------------- storeys

    def _corridor(self, storey: int, count: int, length: float) -> None:
        """Its floor, lamps, beams and cable tray, the gables, one with a window, and a place every few metres."""
        z = storey * STOREY
        self._add(block((-FACADE, -HALF - WALL, z - SLAB), (length + FACADE, HALF + WALL, z)))
        self._add(block((0, 0.7, z + 2.5), (length, HALF - 0.05, z + 2.62)))
        self._add(block((length, -9, z), (length + FACADE, 9, z + CLEAR)))
        pieces = (-9, 9, 0, 0.9), (-9, 9, 2.3, CLEAR), (-9, -0.7, 0.9, 2.3), (0.7, 9, 0.9, 2.3)
        for left, right, low, high in pieces:
            self._add(block((-FACADE, left, z + low), (0, right, z + high)))
        for slot in range(count):
            x = slot * WIDTH
            self._add(block((x + 1.5, -0.15, z + CLEAR - 0.1), (x + 2.8, 0.15, z + CLEAR - 0.03)))
            if slot % 2:
                self._add(block((x - 0.15, -HALF, z + CLEAR - 0.3), (x + 0.15, HALF, z + CLEAR)))
        for x in np.linspace(1.2, length - 1.2, max(2, round(length / 4.6))):
            self._stand(0, (x - 0.5, -0.45), (x + 0.5, 0.45), z)

    def _room(self, storey: int, slot: int, south: bool) -> None:
        here, width = self._seen_from(storey, slot, south, turned=self._rng.uniform() < 0.5)
        self._slab(here, width)
        self._frame(here, width, [DOOR])
        kind = self._rng.choice((rooms.office, rooms.office, rooms.office, rooms.office, rooms.meeting, rooms.kitchen))
        leaf = placed([block((0, -0.04, 0.01), (0.95, 0, 2.05))], DOOR[0], 0.02, self._rng.uniform(1.6, 2.6))
        self._add(*here([*kind(self._rng, width), *rooms.corridor(self._rng, width), *leaf]))
        self._standing_in(here, 0, (0.98, -0.1), (1.05, 0.0), storey, 0.35)
        self._standing_in(here, 1, (1.0, 1.6), (width - 0.8, DEPTH - 0.8), storey)
        if self._rng.uniform() < 0.5:
            self._standing_in(here, 2, (0.8, DEPTH - 2.2), (width - 0.6, DEPTH - 0.6), storey)

    def _open_plan(self, storey: int, slot: int) -> None:
        here, width = self._seen_from(storey, slot, south=False, span=SPAN)
        doors = [(1.5, 3.5), (width - 3.5, width - 1.5)]
        self._slab(here, width)
        self._frame(here, width, doors)
        self._add(*here(rooms.open_plan(self._rng, width)))
        for left, _ in doors:
            self._standing_in(here, 0, (left + 0.9, -0.1), (left + 1.1, 0.0), storey, 0.35)
        for x, y in product(np.linspace(0.6, width - 2.6, 3), (0.5, DEPTH / 2 + 0.2)):
            self._standing_in(here, 1 if y > 1 else 2, (x, y), (x + 2, y + 2.2), storey)

    def _stairwell(self, storey: int, slot: int, south: bool) -> None:
        """Two flights and the landing between them, up to the next storey; on the last one a railing at the shaft."""
        here, width = self._seen_from(storey, slot, south)
        self._slab(here, width, hole=storey > 0)
        self._frame(here, width, [(1.4, 3.1)])
        end = LANDING + STEPS * TREAD
        self._standing_in(here, 0, (1.0, 0.5), (3.5, 1.0), storey)
        if storey + 1 == self.storeys:
            rail = [block((x, LANDING, 0), (x + 0.03, LANDING + 0.03, 1.0)) for x in np.arange(0.1, 2.2, 0.15)]
            self._add(*here([*rail, block((0.1, LANDING - 0.01, 1.0), (2.25, LANDING + 0.04, 1.05))]))
            return
        solids = [block((0, end, STOREY / 2 - 0.25), (WIDTH, DEPTH, STOREY / 2))]
        for step in range(STEPS):
            y, top = LANDING + step * TREAD, (step + 1) * RISE
            back = end - (step + 1) * TREAD
            solids.append(block((0.1, y, top - 0.3), (2.1, y + TREAD, top)))
            solids.append(block((2.4, back, STOREY / 2 + top - 0.3), (4.4, back + TREAD, STOREY / 2 + top)))
        self._add(*here(solids))
        for rank, low, high, up in (
            (0, (1.0, end + 0.5), (3.5, DEPTH - 0.5), STOREY / 2),
            (0, (0.9, LANDING + 4.3 * TREAD), (1.3, LANDING + 4.7 * TREAD), 5 * RISE),
            (0, (3.2, end - 4.7 * TREAD), (3.6, end - 4.3 * TREAD), STOREY / 2 + 5 * RISE),
        ):
            self._standing_in(here, rank, low, high, storey, clear=-1, up=up)

    def _standing_in(self, here, rank, low, high, storey: int, clear: float = 0.45, up: float = 0.0) -> None:
        """A place between two corners in the frame of a room."""
        corners = np.array([here([Sphere((*corner, 0.0), 0.1)])[0].center[:2] for corner in (low, high)])
        self._stand(rank, tuple(corners.min(axis=0)), tuple(corners.max(axis=0)), storey * STOREY + up, clear)

    # -------------------------------------------------------------------------------------------- walls

    def _frame(self, here, width: float, doors: list) -> None:
        """The walls of a room: the corridor's with its doors, the sides, the facade with windows and pillars."""
        edges = [0, *(edge for door in doors for edge in door), width]
        solids = [block((a, -WALL, 0), (b, 0, CLEAR)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
        solids += [block((a, -WALL, LINTEL), (b, 0, CLEAR)) for a, b in doors]
        solids += [block((x - 0.06, 0, 0), (x + 0.06, DEPTH, CLEAR)) for x in (0, width)]
        outer = DEPTH + FACADE
        solids += [block((0, DEPTH, low), (width, outer, high)) for low, high in ((0, 0.9), (2.3, CLEAR))]
        step = width / len(bays(width))
        for x, windows in bays(width):
            ends = [x, *(edge for window in windows for edge in window), x + step]
            solids += [block((a, DEPTH, 0.9), (b, outer, 2.3)) for a, b in zip(ends[::2], ends[1::2], strict=True)]
            bars = [(a + b) / 2 for a, b in windows]
            solids += [block((bar - 0.03, DEPTH + 0.12, 0.9), (bar + 0.03, DEPTH + 0.18, 2.3)) for bar in bars]
            solids += [block((x - 0.2, DEPTH - 0.3, 0), (x + 0.2, DEPTH, CLEAR))]
        self._add(*here(solids))

    def _slab(self, here, width: float, hole: bool = False) -> None:
        """The floor of a room, or, where stairs come up, of its first metres."""
        self._add(*here([block((0, 0, -SLAB), (width, LANDING if hole else DEPTH + FACADE, 0))]))

    def _outside(self, length: float) -> None:
        """The ground, trees, and houses across the street."""
        self._add(block((-80, -80, -1.3), (length + 80, 80, -0.5)))
        for x in np.arange(-10, length + 10, 9.0):
            for side in (-1, 1):
                if self._rng.uniform() < 0.6:
                    place = x + self._rng.uniform(0, 6), side * self._rng.uniform(13, 20)
                    crown = Sphere((0, 0, 4.6), self._rng.uniform(1.3, 2.4))
                    self._add(*placed([disc(0, 0, -0.6, 0.18, 4.0), crown], *place))
                size = self._rng.uniform((4, 5, 4), (8, 9, 13))
                if self._rng.uniform() < 0.7:
                    self._add(*placed([block((0, 0, -0.6), tuple(size))], x, side * 32, self._rng.normal(0, 0.2)))

    def _seen_from(self, storey: int, slot: int, south: bool, turned: bool = False, span: int = 1):
        """What puts solids of a room's frame into the world, and the room's width. turned: the other way round."""
        begin, end = self._edges[south][[slot, slot + span]]
        corner, yaw = (end, pi) if south else (begin, 0.0)
        place = corner, (-1 if south else 1) * (HALF + WALL), yaw, storey * STOREY
        width = float(end - begin)
        return lambda solids: placed(rooms.mirrored(solids, width) if turned else solids, *place), width

    def _add(self, *solids) -> None:
        self.solids += solids
