"""A walk through a storey of the building that benchmarks/building.py scans: the corridor, and room after room."""

from __future__ import annotations

import drive_shapes as shapes
import numpy as np
from building_plan import Plan
from drive_route import Curve
from panorama import Footprint, World
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

CELL = 0.15  # metres, of the grid in which the way is sought
NARROW, ROOMY = 0.3, 0.6  # metres: the least clearance of the way, and what is no further attraction
SCANS = 48  # places of the plan, on one storey
ROUNDING = 0.2


def storey(seed: int) -> tuple[shapes.Soup, Curve]:
    """The triangles, and a way through the rooms that ends in the corridor where it began."""
    plan, soup = Plan(SCANS, seed), shapes.Soup()
    for solid in plan.solids:
        soup.quads(shapes.solid(solid))
    return soup, Curve(_tour(World(plan.solids), plan.places), ROUNDING)


def _tour(world: World, places: np.ndarray) -> np.ndarray:
    """The shortest ways (n, 2) from each place to the nearest one that is left, and back to the first."""
    low, high = places[:, :2].min(axis=0) - 1, places[:, :2].max(axis=0) + 1
    x, y = (np.arange(a, b, CELL) for a, b in zip(low, high, strict=True))
    clear = _clearance(world, x, y)
    links = _links(clear)
    cells = np.round((places[:, :2] - low) / CELL).astype(int)
    here, left = np.ravel_multi_index(tuple(cells[cells[:, 0].argmin()]), clear.shape), {*map(tuple, cells)}
    first, way = here, []
    while True:
        far, before = dijkstra(links, indices=here, return_predecessors=True)
        left = {cell for cell in left if 0 < far[np.ravel_multi_index(cell, clear.shape)] < np.inf}
        near = min(left, key=lambda cell: far[np.ravel_multi_index(cell, clear.shape)], default=None)
        there = first if near is None else int(np.ravel_multi_index(near, clear.shape))
        way += _back(before, here, there)
        if near is None:
            return np.stack(np.unravel_index(way, clear.shape), 1) * CELL + low
        here = there


def _back(before: np.ndarray, here: int, there: int) -> list[int]:
    """The cells from here to there."""
    cells = [there]
    while cells[-1] != here:
        cells.append(int(before[cells[-1]]))
    return cells[::-1]


def _clearance(world: World, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Metres from each place of the grid (nx, ny) to what is higher than a doorstep and lower than a head."""
    clear = np.full((len(x), len(y)), ROOMY)
    for f in world.footprints:
        if f.top > 0.05 and f.bottom < 1.9:
            reach = float(np.hypot(*f.half)) + ROOMY
            i, j = (slice(*np.searchsorted(a, (m - reach, m + reach))) for a, m in zip((x, y), f.middle, strict=True))
            np.minimum(clear[i, j], _distance(f, x[i, None], y[None, j]), out=clear[i, j])
    return clear


def _distance(f: Footprint, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """From places to the outline of a solid; 0 within."""
    dx, dy, c, s = x - f.middle[0], y - f.middle[1], np.cos(f.yaw), np.sin(f.yaw)
    if f.round:
        return np.maximum(np.hypot(dx, dy) - f.half[0], 0)
    u, v = np.abs(c * dx + s * dy) - f.half[0], np.abs(c * dy - s * dx) - f.half[1]
    return np.hypot(np.maximum(u, 0), np.maximum(v, 0))


def _links(clear: np.ndarray) -> coo_array:
    """Costs of the steps between neighbouring cells: their lengths, dearer where it is narrow."""
    number = np.where(clear > NARROW, np.arange(clear.size).reshape(clear.shape), -1)
    dear = 1 + 2 * (ROOMY - clear).ravel() / ROOMY
    pairs = [
        np.stack([a.ravel(), b.ravel(), np.full(a.size, length)])
        for a, b, length in (
            (number[1:], number[:-1], 1.0), (number[:, 1:], number[:, :-1], 1.0),
            (number[1:, 1:], number[:-1, :-1], 2**0.5), (number[1:, :-1], number[:-1, 1:], 2**0.5),
        )
    ]  # fmt: skip
    one, other, length = np.concatenate(pairs, axis=1)
    free = (one >= 0) & (other >= 0)
    one, other, length = one[free].astype(int), other[free].astype(int), length[free]
    cost = CELL * length * (dear[one] + dear[other]) / 2
    both = np.concatenate([one, other]), np.concatenate([other, one])
    return coo_array((np.tile(cost, 2), both), shape=(clear.size, clear.size)).tocsr()
