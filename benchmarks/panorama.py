"""A panoramic scanner on a tripod, in a world of many solids: a million rays among ten thousand solids in a second.

    scanner = Panorama(1_000_000)
    points = scanner.scan(World(solids), world_from_sensor, noise=0.002, rng=rng)      # (N, 3) float32, sensor frame

All rays of one column of the panorama share an azimuth and all of one row a slope, the sensor being level. With ranges
measured along the floor, an upright box or cylinder is met between what its outline says of the column and what its
bottom and top say of the row: two numbers a column, two a row, and a minimum for each ray. Other solids are asked for
the rays of their window. What lies behind all that has been met already, by blocks of rays, is not looked at.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from fieldalign.clouds.simulated import Box, Cylinder, Primitive

BLOCK = 16  # rays, along rows and columns, whose farthest range is kept
LOWEST, HIGHEST = np.radians((-60.0, 89.9))
NEAREST, FARTHEST = 0.4, 60.0  # metres along the ray
EVERY = 50  # solids, after which the farthest ranges of the blocks are looked up again


@dataclass(frozen=True)
class Footprint:
    """A solid seen from above: its outline and its heights.

    middle: (2,); half: half edges (2,), or the radius twice; yaw; round: a circle; upright: the solid fills all between
    bottom and top over its outline.
    """

    middle: np.ndarray
    half: np.ndarray
    yaw: float
    bottom: float
    top: float
    round: bool
    upright: bool

    @classmethod
    def of(cls, solid: Primitive) -> Footprint:
        x, y, z = solid.center
        if isinstance(solid, Box):
            a, b, c = np.array(solid.size) / 2
            return cls(np.array([x, y]), np.array([a, b]), solid.yaw, z - c, z + c, False, True)
        if isinstance(solid, Cylinder) and solid.start[:2] == solid.end[:2]:
            bottom, top = sorted((solid.start[2], solid.end[2]))
            return cls(np.array([x, y]), np.full(2, solid.radius), 0.0, bottom, top, True, True)
        r = solid.reach
        return cls(np.array([x, y]), np.full(2, r), 0.0, z - r, z + r, True, False)

    def distance(self, x: float, y: float) -> float:
        """From a place to the outline, along the floor; 0 within."""
        offset = self._turned_back(x - self.middle[0], y - self.middle[1])
        if self.round:
            return max(0.0, float(np.hypot(*offset)) - self.half[0])
        return float(np.hypot(*np.maximum(np.abs(offset) - self.half, 0)))

    def azimuths(self, x: float, y: float) -> tuple[float, float]:
        """The middle and half the width (rad) of the window in which the outline is seen from outside."""
        dx, dy = self.middle[0] - x, self.middle[1] - y
        ahead = float(np.arctan2(dy, dx))
        if self.round:
            return ahead, float(np.arcsin(min(1.0, self.half[0] / max(np.hypot(dx, dy), 1e-9))))
        c, s = np.cos(self.yaw), np.sin(self.yaw)
        corners = np.array([(i * self.half[0], j * self.half[1]) for i in (-1, 1) for j in (-1, 1)])
        u, v = dx + c * corners[:, 0] - s * corners[:, 1], dy + s * corners[:, 0] + c * corners[:, 1]
        off = (np.arctan2(v, u) - ahead + np.pi) % (2 * np.pi) - np.pi
        return ahead + float(off.min() + off.max()) / 2, float(off.max() - off.min()) / 2

    def crossed(self, x: float, y: float, cos: np.ndarray, sin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where rays from (x, y), seen from above, enter and leave the outline; entered after left where they miss."""
        start, step = self._turned_back(x - self.middle[0], y - self.middle[1]), self._turned_back(cos, sin)
        if self.round:
            middle = -(start[0] * step[0] + start[1] * step[1])
            square = self.half[0] ** 2 - (start[0] + middle * step[0]) ** 2 - (start[1] + middle * step[1]) ** 2
            half = np.sqrt(np.maximum(square, 0))
            return np.where(square > 0, middle - half, np.inf), middle + half
        enter, leave = -np.inf, np.inf
        for h, o, d in zip(self.half, start, step, strict=True):
            d = np.where(d == 0, 1e-200, d)
            one, other = (-h - o) / d, (h - o) / d
            enter, leave = np.maximum(enter, np.minimum(one, other)), np.minimum(leave, np.maximum(one, other))
        return enter, leave

    def _turned_back(self, x, y) -> tuple:
        c, s = np.cos(self.yaw), np.sin(self.yaw)
        return c * x + s * y, c * y - s * x


class World:
    """Solids, with what a scanner asks of them."""

    def __init__(self, solids: Iterable[Primitive]) -> None:
        self.solids = list(solids)
        self.footprints = [Footprint.of(solid) for solid in self.solids]
        self._middle = np.array([f.middle for f in self.footprints])
        self._reach = np.array([np.hypot(*f.half) for f in self.footprints])
        self._heights = np.array([(f.bottom, f.top) for f in self.footprints])

    def within(self, x: float, y: float, reach: float) -> np.ndarray:
        """Which solids may have outlines within reach of a place."""
        return np.flatnonzero(np.hypot(*(self._middle - (x, y)).T) < self._reach + reach)

    def from_near_to_far(self, place: np.ndarray) -> list[int]:
        """Places of the solids in the list, the nearest first, up to the farthest range."""
        x, y, z = place
        along = np.array([f.distance(x, y) for f in self.footprints])
        up = np.maximum(0, np.maximum(self._heights[:, 0] - z, z - self._heights[:, 1]))
        distance = np.hypot(along, up)
        return [int(k) for k in np.argsort(distance, kind="stable") if distance[k] < FARTHEST]

    def clearance(self, x: float, y: float, floor: float) -> float:
        """How far a tripod on the floor stands from all that is higher than a doorstep and lower than a lintel."""
        near = [f for f in (self.footprints[k] for k in self.within(x, y, 1.0)) if self._stands_in(f, floor)]
        return min((f.distance(x, y) for f in near), default=1.0)

    @staticmethod
    def _stands_in(f: Footprint, floor: float) -> bool:
        return f.top > floor + 0.05 and f.bottom < floor + 1.9


class Panorama:
    """The rays of the scanner: rows of one slope, columns of one azimuth; about `points` of them meet something."""

    def __init__(self, points: int) -> None:
        rays = 1.12 * points / BLOCK**2
        rows = np.sqrt(rays * (HIGHEST - LOWEST) / (2 * np.pi))
        self.rows, self.columns = BLOCK * int(np.ceil(rows)), BLOCK * int(np.ceil(rays / np.ceil(rows)))
        self.slope = np.tan(LOWEST + (np.arange(self.rows) + 0.5) * (HIGHEST - LOWEST) / self.rows)
        self.azimuth = (np.arange(self.columns) + 0.5) * 2 * np.pi / self.columns

    def scan(self, world: World, world_from_sensor: np.ndarray, noise: float, rng: np.random.Generator) -> np.ndarray:
        """The points (N, 3), float32, that a level sensor at the pose (4, 4) sees, in its own frame, row by row.

        noise: standard deviation of the range, metres.
        """
        yaw = float(np.arctan2(world_from_sensor[1, 0], world_from_sensor[0, 0]))
        along = self.ranges(world, world_from_sensor[:3, 3], yaw)
        slant = np.sqrt(1 + self.slope**2).astype(np.float32)[:, None]
        ranges = along * slant
        row, column = np.nonzero((ranges > NEAREST) & (ranges < FARTHEST))
        ranges = ranges[row, column]
        along = along[row, column] * (1 + np.float32(noise) * rng.standard_normal(len(ranges), np.float32) / ranges)
        cos, sin, slope = (a.astype(np.float32) for a in (np.cos(self.azimuth), np.sin(self.azimuth), self.slope))
        return np.stack([along * cos[column], along * sin[column], along * slope[row]], axis=1)

    def ranges(self, world: World, place: np.ndarray, yaw: float) -> np.ndarray:
        """How far along the floor (rows, columns) each ray of a sensor at the place (3,) gets; inf: for ever."""
        found = np.full((self.rows, self.columns), np.inf, np.float32)
        farthest = np.full((self.rows // BLOCK, self.columns // BLOCK), np.inf, np.float32)
        cast = 0
        for k in world.from_near_to_far(place):
            cast += self._cast(world.solids[k], world.footprints[k], place, yaw, found, farthest)
            if cast >= EVERY:
                farthest, cast = self._farthest(found), 0
        return found

    def _farthest(self, found: np.ndarray) -> np.ndarray:
        by_row = found.reshape(self.rows // BLOCK, BLOCK, self.columns).max(axis=1)
        return by_row.reshape(len(by_row), -1, BLOCK).max(axis=2)

    def _cast(self, solid: Primitive, f: Footprint, place, yaw: float, found, farthest) -> bool:
        """Cut the ranges at one solid; whether any ray was looked at."""
        x, y, z = place
        low, high, distance = f.bottom - z, f.top - z, f.distance(x, y)
        rows, near = self._rows_of(low, high, distance, float(np.hypot(*(f.middle - (x, y))) + np.hypot(*f.half)))
        looked = False
        for columns in self._columns_of(f, x, y, yaw, distance) if rows.start < rows.stop else ():
            blocks = farthest[_blocks(rows), _blocks(columns)]
            if not (blocks > near[:, None]).any():
                continue
            looked = True
            azimuth, slope, window = self.azimuth[columns] + yaw, self.slope[rows], found[rows, columns]
            if f.upright:
                _cut_upright(window, f.crossed(x, y, np.cos(azimuth), np.sin(azimuth)), _between(low, high, slope))
            else:
                _cut(window, solid, place, azimuth, slope)
        return looked

    def _rows_of(self, low: float, high: float, near: float, far: float) -> tuple[slice, np.ndarray]:
        """The rows in which heights from low to high are seen, and for each block of them the least possible range."""
        near = max(near, 1e-6)
        first = np.searchsorted(self.slope, low / (near if low < 0 else far))
        last = np.searchsorted(self.slope, high / (near if high > 0 else far), side="right")
        a, b = first // BLOCK * BLOCK, min(self.rows, -(-last // BLOCK) * BLOCK)
        if first >= last:
            return slice(0, 0), np.empty(0)
        least = np.maximum(near, _between(low, high, self.slope[a:b])[0])
        return slice(int(first), int(last)), least.reshape(-1, BLOCK).min(axis=1)

    def _columns_of(self, f: Footprint, x: float, y: float, yaw: float, distance: float) -> list[slice]:
        """The columns in which the outline is seen: one run of them, or two where it lies across the seam."""
        if distance < 1e-6:
            return [slice(0, self.columns)]
        middle, half = f.azimuths(x, y)
        step = 2 * np.pi / self.columns
        first = int(np.floor(((middle - half - yaw) % (2 * np.pi)) / step - 0.5))
        last = first + int(np.ceil(2 * half / step)) + 2
        runs = [(max(first, 0), min(last, self.columns)), (0, last - self.columns)]
        return [slice(a, b) for a, b in runs if a < b] + ([slice(self.columns - 1, self.columns)] if first < 0 else [])


def _blocks(rays: slice) -> slice:
    """The blocks that these rows or columns lie in."""
    return slice(rays.start // BLOCK, -(-rays.stop // BLOCK))


def _between(low: float, high: float, slope: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where rays of these slopes are between two heights: from and up to which range along the floor."""
    one, other = low / slope, high / slope
    return np.minimum(one, other), np.maximum(one, other)


def _cut_upright(window: np.ndarray, across: tuple, up: tuple) -> None:
    enter = np.maximum(across[0].astype(np.float32), up[0].astype(np.float32)[:, None])
    leave = np.minimum(across[1].astype(np.float32), up[1].astype(np.float32)[:, None])
    enter[(enter >= leave) | (enter <= 0)] = np.inf
    np.minimum(window, enter, out=window)


def _cut(window: np.ndarray, solid: Primitive, place: np.ndarray, azimuth: np.ndarray, slope: np.ndarray) -> None:
    flat = np.broadcast_to((1 / np.sqrt(1 + slope**2))[:, None], window.shape)
    directions = np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), flat * slope[:, None]], axis=-1)
    met = solid.intersect(np.asarray(place), directions.reshape(-1, 3)).reshape(window.shape)
    np.minimum(window, (met * flat).astype(np.float32), out=window)
