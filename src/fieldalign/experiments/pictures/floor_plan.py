"""A simulated map of an office floor, as a robot's laser leaves it: rooms around a ring of corridors."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ...fields.protocol import Floats

_SIZE = np.array([30.0, 21.0])  # metres
_DEPTH, _CORRIDOR = 5.0, 2.0  # of the outer rooms, and how wide the corridor is
_ROOM = 2.6, 5.0  # the width of a room
_DOOR = 0.95
_MARGIN = 0.3  # kept free between a door or a desk and the corners of its room
_SPACING, _NOISE = 0.04, 0.012  # of the points along the walls, and off them

Walls = list[tuple[Floats, Floats]]  # from, to


def floor_plan(seed: int) -> Floats:
    """Points (N, 2) in metres, on walls, open doors and furniture."""
    rng = np.random.default_rng(seed)
    walls = _box(np.zeros(2), _SIZE)
    corner, along = np.zeros(2), np.array([1.0, 0.0])
    for length in (_SIZE[0], _SIZE[1], _SIZE[0], _SIZE[1]):  # the sides, each with its inner side on the left
        frame = np.stack([along, _left_of(along)])
        row = _row_of_rooms(np.array([_DEPTH, 0.0]), np.array([length - _DEPTH, _DEPTH]), rng)
        row += _with_door(np.array([_DEPTH, 0.0]), np.array([_DEPTH, _DEPTH]), rng)  # into the corner's room
        row += _furniture(np.zeros(2), np.full(2, _DEPTH), rng)
        walls += [(corner + a @ frame, corner + b @ frame) for a, b in row]
        corner, along = corner + length * along, _left_of(along)
    low, high = np.full(2, _DEPTH + _CORRIDOR), _SIZE - _DEPTH - _CORRIDOR
    middle = (low[1] + high[1]) / 2
    for back, front in ((middle, high[1]), (middle, low[1])):
        walls += _row_of_rooms(np.array([low[0], back]), np.array([high[0], front]), rng)
        walls.append((np.array([low[0], back]), np.array([low[0], front])))
    walls.append((np.array([low[0], middle]), np.array([high[0], middle])))
    return np.concatenate([_seen(a, b, rng) for a, b in walls])


def _row_of_rooms(back: Floats, front: Floats, rng: np.random.Generator) -> Walls:
    """Rooms side by side between two opposite corners of a strip, with doors in the wall of the second corner."""
    widths = rng.uniform(*_ROOM, max(1, round(2 * (front[0] - back[0]) / sum(_ROOM))))
    edges = back[0] + (front[0] - back[0]) * np.r_[0, np.cumsum(widths) / widths.sum()]
    walls: Walls = [(np.array([x, back[1]]), np.array([x, front[1]])) for x in edges[1:]]
    for left, right in pairwise(edges):
        walls += _with_door(np.array([left, front[1]]), np.array([right, front[1]]), rng)
        low, high = sorted((back[1], front[1]))
        walls += _furniture(np.array([left, low]), np.array([right, high]), rng)
    return walls


def _with_door(a: Floats, b: Floats, rng: np.random.Generator) -> Walls:
    """A wall with a door in it, which stands open, to either side."""
    length = float(np.linalg.norm(b - a))
    along = (b - a) / length
    hinge = a + rng.uniform(_MARGIN, length - _DOOR - _MARGIN) * along
    leaf = rng.choice([-1.0, 1.0]) * _left_of(along) + rng.uniform(-0.6, 0.6) * along
    return [(a, hinge), (hinge + _DOOR * along, b), (hinge, hinge + _DOOR * leaf / np.linalg.norm(leaf))]


def _furniture(low: Floats, high: Floats, rng: np.random.Generator) -> Walls:
    """A few desks and cupboards in a room, apart from each other."""
    boxes: list[tuple[Floats, Floats]] = []
    for _ in range(rng.integers(2, 6)):
        size = rng.permutation(rng.uniform((0.5, 0.8), (0.8, 1.6)))
        corner = rng.uniform(low + _MARGIN, high - size - _MARGIN)
        if all((corner > b + _MARGIN).any() or (corner + size < a - _MARGIN).any() for a, b in boxes):
            boxes.append((corner, corner + size))
    return [wall for box in boxes for wall in _box(*box)]


def _box(low: Floats, high: Floats) -> Walls:
    corners = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
    return list(zip(corners, np.roll(corners, -1, axis=0), strict=True))


def _left_of(along: Floats) -> Floats:
    return np.array([-along[1], along[0]])


def _seen(a: Floats, b: Floats, rng: np.random.Generator) -> Floats:
    """Points along a wall, with noise."""
    share = np.linspace(0, 1, max(2, round(float(np.linalg.norm(b - a)) / _SPACING)))[:, None]
    return np.asarray(a + share * (b - a) + rng.normal(0, _NOISE, (len(share), 2)))
