"""Numbers on a grid, kept in blocks, and what lies between them: how a volume is stored and interpolated."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import FieldError
from .protocol import Floats

Numbers = NDArray[Any]  # float32 or float64, as they came
Rows = NDArray[np.int64]

_PIECE = 4096    # places at a time: what is gathered for them stays in the cache
_ROUNDED = 1e-6  # of a step, beyond the outermost nodes: a place that lies on them but for rounding
_MOST = 2**27    # blocks in the box around all of them: the table of their rows is dense


class Blocks:
    """Numbers at the nodes of a grid, in blocks; a node in no block has NaN. Places are counted in steps of the grid.

    blocks: (B, n0, n1, n2), sides of at least 2. indices: (B, 3); block b begins at node indices[b] * n.
    taps: how many nodes along each axis an interpolation asks: 2, linear, or 4, cubic.

    Each block is kept with a rim of the nodes around it, so that all that an interpolation asks stands in one block.
    """

    def __init__(self, blocks: Numbers, indices: Rows, taps: int) -> None:
        self.taps = taps
        self._sides = np.array(blocks.shape[1:])
        self._before = taps // 2 - 1
        self._lowest = indices.min(axis=0) - 1  # there and beyond is no block
        self._starts = indices * self._sides
        self._table = _table_of_rows(indices - self._lowest)
        self._rimmed = _with_rims(blocks, indices - self._lowest, self._table, taps)
        self._flat = self._rimmed.reshape(-1)
        first, last = self._starts.min(axis=0)[:, None], self._starts.max(axis=0)[:, None] + self._sides[:, None] - 1.0
        self._box = first, np.nextafter(last, -np.inf)  # the last node belongs to the cell before it

    @property
    def nodes(self) -> Numbers:
        """The numbers of the blocks (B, n0, n1, n2)."""
        return self._ahead((0, 0, 0))

    def at(self, nodes: Floats) -> Numbers:
        """The numbers (L,) at whole-numbered places (L, 3)."""
        return self._flat.take(self._standing(nodes.T, 0))

    def interpolated(self, u: Floats, taps: int | None = None) -> tuple[Floats, Floats]:
        """value (L,) and its derivative (L, 3) at the places u (L, 3); not finite where a number that it needs is not.

        Cubic is Keys' convolution (IEEE TASSP 1981), which passes through the numbers and asks those nearby alone: a
        spline's value depends on all of them, also on those that nobody has seen.
        """
        pieces = [self._piece(u[k : k + _PIECE].T, taps or self.taps) for k in range(0, max(len(u), 1), _PIECE)]
        value, gradient = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
        return value, gradient

    def crossings(self) -> Floats:
        """Where finite numbers of opposite sign meet on the straight line between neighbouring nodes (m, 3), in an
        order that does not depend on the blocks."""
        found = []
        for step in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
            here, ahead = self.nodes, self._ahead(step)
            rows = np.nonzero((here < 0) != (ahead < 0))
            one, other = here[rows].astype(float), ahead[rows].astype(float)
            known = np.isfinite(one) & np.isfinite(other)
            share = one[known] / (one[known] - other[known])
            found.append(self._places(rows)[known] + share[:, None] * step)
        return _in_order(np.concatenate(found))

    def below(self, level: float) -> Floats:
        """The nodes with numbers below a level (m, 3), in an order that does not depend on the blocks."""
        return _in_order(self._places(np.nonzero(self.nodes < level)))

    def _ahead(self, step: tuple[int, int, int]) -> Numbers:
        """As `nodes`, of the nodes a step ahead."""
        first = self._before + np.array(step)
        i, j, k = (slice(start, start + side) for start, side in zip(first, self._sides, strict=True))
        return self._rimmed[1:, i, j, k]

    def _places(self, rows: tuple[NDArray[np.intp], ...]) -> Floats:
        """Places (m, 3) of nodes, from their rows in `nodes`."""
        return np.asarray(self._starts[rows[0]] + np.stack(rows[1:], axis=1), float)

    def _piece(self, u: Floats, taps: int) -> tuple[Floats, Floats]:
        """interpolated() at the places u (3, L)."""
        inner = np.clip(u, *self._box)
        cell = np.floor(np.where(np.abs(u - inner) < _ROUNDED, inner, u))
        stencil = np.indices((taps, taps, taps)).reshape(3, -1).T @ self._steps[1:]
        stands = self._standing(cell, taps // 2 - 1) + stencil[:, None]
        numbers = self._flat.take(stands).reshape(taps, taps, taps, -1)
        (x, dx), (y, dy), (z, dz) = (_weights(along, taps) for along in u - cell)
        with np.errstate(invalid="ignore"):  # infinite numbers, which make the answer so
            by_z = _sum(numbers, z)
            by_yz = _sum(by_z, y)
            slopes = _sum(by_yz, dx), _sum(_sum(by_z, dy), x), _sum(_sum(_sum(numbers, dz), y), x)
            return _sum(by_yz, x), np.stack(slopes, axis=1)

    @property
    def _steps(self) -> NDArray[np.intp]:
        """From a number to the next block's, and to the next along each axis (4,)."""
        return np.array(self._rimmed.strides) // self._rimmed.itemsize

    def _standing(self, nodes: Floats, back: int) -> NDArray[np.intp]:
        """Where the numbers (L,) stand that lie so many steps back, along each axis, from the nodes (3, L)."""
        sides = self._sides.astype(float)[:, None]  # floating numbers are divided faster than whole ones
        last = np.array(self._table.shape)[:, None] * sides - 1
        inside = np.clip(nodes - self._lowest[:, None] * sides, 0, last)
        block = np.floor(inside / sides)
        local = inside - block * sides + (self._before - back)
        row = self._table.take(_dot(np.array(self._table.strides) // self._table.itemsize, block))
        return np.asarray(row * self._steps[0] + _dot(self._steps[1:], local))


def _table_of_rows(at: Rows) -> NDArray[np.int32]:
    """Which row in the storage each block has that lies at places (B, 3) of the table; 0: absent."""
    shape = at.max(axis=0) + 2
    if np.prod(shape.astype(float)) > _MOST:
        box = " x ".join(map(str, shape - 2))
        raise FieldError(f"blocks of a VolumeField must lie together, but the box around them would hold {box}")
    table, rows = np.zeros(shape, np.int32), np.arange(1, len(at) + 1)
    table[tuple(at.T)] = rows
    if not np.array_equal(table[tuple(at.T)], rows):
        raise FieldError("block_indices of a VolumeField must differ, but a block is given twice")
    return table


def _with_rims(blocks: Numbers, at: Rows, table: NDArray[np.int32], taps: int) -> Numbers:
    """The blocks (B + 1, ...) with the nodes around them that `taps` need: NaN where these lie in no block. Row 0 is of
    NaN, for all absent blocks."""
    before, after, sides = taps // 2 - 1, taps // 2, blocks.shape[1:]
    rimmed = np.full((len(blocks) + 1, *(side + taps - 1 for side in sides)), np.nan, blocks.dtype)
    for step in product((0, 1, -1), repeat=3):
        overlaps = (_overlap(side, ahead, before, after) for side, ahead in zip(sides, step, strict=True))
        (to_i, i), (to_j, j), (to_k, k) = overlaps
        if any(step):
            rows = table[tuple((at + step).T)]
            here = np.flatnonzero(rows)
            rimmed[here + 1, to_i, to_j, to_k] = blocks[rows[here] - 1, i, j, k]
        else:
            rimmed[1:, to_i, to_j, to_k] = blocks
    return rimmed


def _overlap(side: int, ahead: int, before: int, after: int) -> tuple[slice, slice]:
    """Along an axis: the nodes of a rimmed block that lie in the block so many ahead, as counted here and there."""
    first, end = {0: (0, side), 1: (0, after), -1: (side - before, side)}[ahead]
    shift = before + ahead * side
    return slice(first + shift, end + shift), slice(first, end)


def _weights(f: Floats, taps: int) -> tuple[Floats, Floats]:
    """What each of the nodes along an axis counts for (taps, L) at shares f (L,) of the way between the two in the
    middle, and the derivative of that."""
    if taps == 2:
        return np.stack([1 - f, f]), np.stack([-np.ones_like(f), np.ones_like(f)])
    weights = ((2 - f) * f - 1) * f, (3 * f - 5) * f * f + 2, ((4 - 3 * f) * f + 1) * f, (f - 1) * f * f
    slopes = (4 - 3 * f) * f - 1, (9 * f - 10) * f, (8 - 9 * f) * f + 1, (3 * f - 2) * f
    return np.stack(weights) / 2, np.stack(slopes) / 2


def _sum(numbers: Numbers, weights: Floats) -> Floats:
    """The weighted sum (..., L) along the last axis of the grid that is left, (..., taps, L)."""
    return np.asarray(np.einsum("...tl,tl->...l", numbers, weights))


def _dot(steps: NDArray[np.intp], counts: Floats) -> NDArray[np.intp]:
    """Sums (L,) of so many steps (3,) along the axes (3, L)."""
    return np.asarray(steps[0] * counts[0] + steps[1] * counts[1] + steps[2] * counts[2], np.intp)


def _in_order(places: Floats) -> Floats:
    return np.ascontiguousarray(places[np.lexsort(places.T)])
