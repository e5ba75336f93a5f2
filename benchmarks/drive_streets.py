"""The worlds of simulated drives in the open: hilly land with roads, and what stands along them.

    land = Land([curve, *side_streets], seed=0)
    site = Site(land, seed=0)
    site.town(curve), site.tunnel(curve, 600, 1300), site.woods(), site.ground()
    site.soup.arrays()           # triangles
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import drive_shapes as shapes
import numpy as np
from drive_route import Curve
from scipy.spatial import cKDTree

KERB = 0.12
CELL, REACH = 1.0, 80.0  # metres, of the ground's mesh: its cells, and how far it goes beside roads
KINDS = 24  # of trees, bushes and cars that are told apart


class Land:
    """Heights of the ground, with hills, and with a kerb along the roads."""

    def __init__(self, roads: Sequence[Curve], seed: int, half: float = 5.5, slope: float = 0.04) -> None:
        """half: half the width of the roads, metres. slope: deviation of the steepness, rise over run."""
        rng = np.random.default_rng([seed, 20])
        self.roads, self.half = list(roads), half
        self._tree = cKDTree(np.concatenate([road.xy[::5] for road in roads]))
        length, way = rng.uniform(250, 700, 6), rng.uniform(0, 2 * np.pi, 6)
        self._waves = 2 * np.pi * np.stack([np.cos(way), np.sin(way)]) / length
        self._phase, self._swell = rng.uniform(0, 2 * np.pi, 6), slope * length / (2 * np.pi * 3**0.5)
        small, turn = rng.uniform(6, 30, 6), rng.uniform(0, 2 * np.pi, 6)
        self._bumps, self._bump_phase = 2 * np.pi * np.stack([np.cos(turn), np.sin(turn)]) / small, rng.uniform(0, 6, 6)

    def __call__(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        at = np.stack([x, y], -1)
        hills = np.sin(at @ self._waves + self._phase) @ self._swell
        bumps = 0.008 * np.sin(at @ self._bumps + self._bump_phase).sum(axis=-1)
        return hills + bumps + KERB * (self.aside(at) > 0)

    def aside(self, xy: np.ndarray) -> np.ndarray:
        """Metres from the edge of the nearest road; negative on it."""
        return self._tree.query(xy)[0] - self.half


class Site:
    """Puts things on the land, never on a road, nor where something stands already."""

    def __init__(self, land: Land, seed: int) -> None:
        self.land, self.soup, self._rng = land, shapes.Soup(), np.random.default_rng([seed, 21])
        self._taken: list[tuple[float, float, float]] = []
        rng = self._rng
        self._trees = [shapes.tree(rng, tall) for tall in rng.uniform(4.5, 12, KINDS)]
        self._bushes = [shapes.bush(rng, size) for size in rng.uniform(0.5, 1.3, KINDS)]
        self._cars = [shapes.car(rng) for _ in range(KINDS)]

    # -------------------------------------------------------------------------------------------- along roads

    def town(self, road: Curve, begin: float = 0.0, end: float = np.inf) -> None:
        """Houses on both sides, garden walls, parked cars, posts, trees and bushes."""
        rng, half = self._rng, self.land.half
        for side in (-1, 1):
            for arc, width in self._along(road, begin, end, (9, 24), (1.0, 8.0)):
                self._house(road, arc, side * (half + rng.uniform(3.0, 7.0)), width)
            for arc, width in self._along(road, begin, end, (2, 9), (3, 40)):
                self._wall(road, arc, side * (half + rng.uniform(2.2, 2.8)), width)
            for arc, _ in self._along(road, begin, end, (5.0, 6.0), (0.5, 9)):
                self._at(road, arc, side * (half - 1.15), self._cars, clear=-1.6, yaw=rng.choice((0, np.pi)))
            for arc, _ in self._along(road, begin, end, (0.3, 0.3), (14, 32)):
                self._at(road, arc, side * (half + 0.6), [self._post()], clear=0.3)
            for arc, _ in self._along(road, begin, end, (1.0, 1.0), (7, 26)):
                kind = self._trees if rng.uniform() < 0.7 else self._bushes
                self._at(road, arc, side * (half + rng.uniform(1.3, 2.6)), kind, clear=0.9)

    def tunnel(self, road: Curve, begin: float, end: float) -> None:
        """An arched tube, with lamps and fans above; markers and cabinets at the walls tell how far one has come."""
        rng, half = self._rng, self.land.half + 0.8
        angle = np.linspace(0, np.pi, 13)
        arch = np.stack([half * np.cos(angle), 3.0 + 3.4 * np.sin(angle)], 1)
        profile = np.concatenate([[(half, -0.5)], arch, [(-half, -0.5)]])
        arcs = np.arange(begin, end, 2.0)
        rings = np.stack([self._points(road, arcs, left, up) for left, up in profile], 1)
        rings += rng.normal(0, 0.008, rings.shape)
        self.soup.quads(np.stack([rings[:-1, :-1], rings[1:, :-1], rings[1:, 1:], rings[:-1, 1:]], -2))
        lamp = shapes.box((-0.6, -0.12, 0), (0.6, 0.12, 0.18))
        cabinet = shapes.box((-0.6, -0.35, -0.3), (0.6, 0.35, 2.1))
        marker = shapes.box((-0.12, -0.1, 0.6), (0.12, 0.1, 1.1))
        fan = shapes.pipe(np.array([-1.6, 0, 0.0]), np.array([1.6, 0, 0]), 0.45, 0.45, 12)
        for things, every, left, up in (
            (lamp, 12, 3.2, 5.4), (lamp, 12, -3.2, 5.4), (fan, 90, 0.0, 5.6), (marker, 25, half, 0.0),
            (marker, 25, -half, 0.0), (cabinet, 50, half - 0.2, 0.0), (cabinet, 50, 0.2 - half, 0.0),
        ):  # fmt: skip
            for arc in np.arange(begin + rng.uniform(0, every), end, every):
                (yaw,) = road.at(np.array([arc]))[1]
                self.soup.quads(shapes.placed(things, *self._points(road, np.array([arc]), left, up)[0], yaw))

    def _along(self, road: Curve, begin: float, end: float, width: tuple, gap: tuple) -> Iterator[tuple[float, float]]:
        """Where along the road something begins, and how long it is."""
        arc = begin + self._rng.uniform(*gap)
        while arc < min(end, road.length) - width[1]:
            wide = self._rng.uniform(*width)
            yield arc, wide
            arc += wide + self._rng.uniform(*gap)

    def _points(self, road: Curve, arcs: np.ndarray, left: float, up: float) -> np.ndarray:
        """Places beside the road and above its middle (n, 3)."""
        middle, (xy, _) = road.at(arcs)[0], road.at(arcs, left)
        return np.column_stack([xy, self.land(*middle.T) + up])

    def _house(self, road: Curve, arc: float, left: float, width: float) -> None:
        """Its front is a chord of the road."""
        rng = self._rng
        ends, _ = road.at(np.array([arc, arc + width]), left)
        if left > 0:
            ends = ends[::-1]
        along = (ends[0] - ends[1]) / np.linalg.norm(ends[1] - ends[0])
        inward = np.array([-along[1], along[0]])
        width, deep = float(np.linalg.norm(ends[1] - ends[0])), rng.uniform(8, 13)
        corners = [ends[1] + a * width * along + b * deep * inward for a in (0, 0.5, 1) for b in (0, 0.5, 1)]
        middle = corners[4]
        if self.land.aside(np.array(corners)).min() < 2.0 or not self._free(*middle, 0.42 * max(width, deep)):
            return
        floor = self.land(*np.array(corners).T).min() - 0.1
        house = shapes.building(width, deep, rng.choice((4.5, 7, 10, 13, 16)) + rng.uniform(-0.6, 0.6), rng)
        self.soup.quads(shapes.placed(house, *ends[1], floor, float(np.arctan2(along[1], along[0]))))

    def _wall(self, road: Curve, arc: float, left: float, width: float) -> None:
        (start, stop), _ = road.at(np.array([arc, arc + width]), left)
        if self.land.aside(np.array([start, stop])).min() < 1.5:
            return
        z, along = float(self.land(*((start + stop) / 2))), stop - start
        wall = shapes.box((0, -0.12, -0.8), (float(np.linalg.norm(along)), 0.12, self._rng.uniform(0.7, 1.9)))
        self.soup.quads(shapes.placed(wall, *start, z, float(np.arctan2(along[1], along[0]))))

    def _post(self) -> np.ndarray:
        """A lamp post, or a sign on its post."""
        rng = self._rng
        if rng.uniform() < 0.6:
            top = rng.uniform(5, 8)
            arm = shapes.box((-0.1, -1.4, top - 0.1), (0.1, 0, top))
            return np.concatenate([shapes.post(-0.2, top, 0.09, 0.05), arm])
        wide, top = rng.uniform(0.25, 0.5), rng.uniform(2.2, 3.2)
        return np.concatenate([shapes.post(-0.2, top, 0.04), shapes.box((-0.02, -wide, top - 0.7), (0.02, wide, top))])

    def _at(self, road: Curve, arc: float, left: float, kinds: list, clear: float, yaw: float = 0.0) -> None:
        """One of the kinds, if nothing is there yet."""
        (place,), (heading,) = road.at(np.array([arc]), left)
        if self.land.aside(place) > clear and self._free(*place, 0.4):
            self._put(kinds, *place, heading + yaw + self._rng.normal(0, 0.03))

    def _put(self, kinds: list, x: float, y: float, yaw: float) -> None:
        kind = kinds[self._rng.integers(len(kinds))]
        self.soup.quads(shapes.placed(kind, x, y, float(self.land(x, y)) - 0.05, yaw))

    def _free(self, x: float, y: float, radius: float) -> bool:
        """Whether nothing stands within the radius; it is taken from now on."""
        taken = np.array(self._taken or [(np.inf, 0, 0)])
        free = bool((np.hypot(taken[:, 0] - x, taken[:, 1] - y) > taken[:, 2] + radius).all())
        if free:
            self._taken.append((x, y, radius))
        return free

    # -------------------------------------------------------------------------------------------- everywhere

    def woods(self, per_hectare: float, reach: float = 45.0, bushes: float = 0.4) -> None:
        """Trees and bushes anywhere beside the roads, some benches' worth of boxes among them."""
        rng = self._rng
        roads = np.concatenate([road.xy for road in self.land.roads])
        low, high = roads.min(axis=0) - reach, roads.max(axis=0) + reach
        places = rng.uniform(low, high, (round(per_hectare * np.prod(high - low) / 1e4), 2))
        aside = self.land.aside(places)
        for x, y in places[(aside > 0.8) & (aside < reach)]:
            if self._free(x, y, 0.8):
                self._put(self._bushes if rng.uniform() < bushes else self._trees, x, y, rng.uniform(0, 2 * np.pi))

    def ground(self, rough: float = 0.02) -> None:
        """The mesh of the land beside the roads. rough: deviation of heights off the roads, a quarter of it on them."""
        roads = np.concatenate([road.xy for road in self.land.roads])
        low, high = roads.min(axis=0) - REACH, roads.max(axis=0) + REACH
        axes = (np.arange(a, b, CELL) for a, b in zip(low, high, strict=True))
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
        aside = self.land.aside(grid)
        lumps = rough * np.where(aside > 0, 1, 0.25) * self._rng.standard_normal(aside.shape)
        z = self.land(grid[..., 0], grid[..., 1]) + lumps
        number = np.arange(aside.size).reshape(aside.shape)
        corners = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
        a, b, c, d = (corner[aside[:-1, :-1] < REACH] for corner in corners)
        self.soup.add(np.dstack([grid, z]), np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))


def side_streets(road: Curve, every: float, seed: int, length: float = 110.0) -> list[Curve]:
    """Streets that cross the road, bent a little."""
    rng, streets = np.random.default_rng([seed, 22]), []
    for arc in np.arange(every / 2, road.length - 30, every) + rng.uniform(-0.2, 0.2) * every:
        (place,), (yaw,) = road.at(np.array([arc]))
        turn = yaw + np.pi / 2 + rng.uniform(-0.4, 0.4)
        ahead = np.array([np.cos(turn), np.sin(turn)])
        bend = rng.uniform(-25, 25) * np.array([np.cos(yaw), np.sin(yaw)])
        streets.append(Curve([place - length * ahead + bend, place, place + length * ahead - bend], 15))
    return streets

