"""The field of a volume: signed or unsigned distances on a grid, as fusion, medical images and networks give them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from ..arguments import as_count, check_one_of, check_positive
from ..errors import ArgumentError, FieldError
from .blocks import Blocks
from .points import PointField
from .protocol import FieldSample, Floats, as_places, newton_foot, unit
from .volume_checks import checked_mask, checked_numbers, checked_origin, checked_spacing, known_values

_TAPS = {"linear": 2, "cubic": 4}
_STEPS = 3   # of Newton's, to the zero of what is nearly a distance
_ON = 0.01   # steps of the grid: a place so near to the zero lies on the surface
_NEXT = 0.8191725134, 0.6710436067, 0.5497004779  # steps of an even sequence in the cube (Roberts' R3)


class VolumeField:
    """The distance field of a volume; immutable.

    values: (I, J, K), distances to the surface in the unit of the places, negative inside where the volume knows a
        side; values[i, j, k] lies at origin + spacing * (i, j, k). NaN: nobody has seen that place. float32 stays so.
    origin: (3,). spacing: a positive number, or one for each axis.
    seen: (I, J, K) bool, False where the value means nothing (in fusion, weight 0); None: all but NaN.
    truncation: a value of this size or more says only "at least so far"; in the unit of the values (those of a volume
        that is scaled to -1..1 must be multiplied by its truncation first). None: values are not truncated.
    signed: whether the sign says a side; False: it says nothing, and is left out; None: whether some are negative.
    interpolation: "linear", or "cubic": closer where the surface is curved, at two to three times the time.
    bounds: the corners (2, 3) of a box around the surface, a step of the grid wider than what was seen of it.

    Between eight nodes that are seen and not truncated, the volume answers by its interpolation: the value, its exact
    derivative, and feet a Newton step away. Anywhere else (outside, unseen, truncated, on the ridges between two parts
    of the surface) the answer is the distance to the nearest of the places where the volume is zero, about one for each
    cell of the grid that the surface crosses; its sign is the nearest node's. An unsigned volume has no zero between
    its nodes but a kink that no interpolation shows: nearer than a cell it answers by planes through such places.

    Raises ArgumentError for arguments of a wrong kind, and FieldError for values of a wrong shape or kind, infinity, a
    volume without anything seen, constant, or without a surface in it.
    """

    def __init__(
        self,
        values: ArrayLike,
        origin: ArrayLike = (0.0, 0.0, 0.0),
        spacing: ArrayLike = 1.0,
        *,
        seen: ArrayLike | None = None,
        truncation: float | None = None,
        signed: bool | None = None,
        interpolation: str = "linear",
    ) -> None:
        grid = checked_numbers(values, "values", "(I, J, K)", 3)
        mask = None if seen is None else checked_mask(seen, grid.shape)[None]
        self._build(grid[None], np.zeros((1, 3), np.int64), origin, spacing, mask, truncation, signed, interpolation)

    @classmethod
    def from_blocks(
        cls,
        blocks: ArrayLike,
        block_indices: ArrayLike,
        origin: ArrayLike = (0.0, 0.0, 0.0),
        spacing: ArrayLike = 1.0,
        *,
        seen: ArrayLike | None = None,
        truncation: float | None = None,
        signed: bool | None = None,
        interpolation: str = "linear",
    ) -> VolumeField:
        """The field of a volume of which only some blocks are there, as hashed fusion gives it; the rest is unseen.

        blocks: (B, n, n, n), block b holds the values from n * block_indices[b] on, each index (3,) whole and given
        once. seen: (B, n, n, n). All else as for a dense volume, whose answers are the same to the bit.
        """
        numbers = checked_numbers(blocks, "blocks", "(B, n, n, n)", 4)
        mask = None if seen is None else checked_mask(seen, numbers.shape)
        indices = np.array(block_indices)
        if indices.shape != (len(numbers), 3) or indices.dtype.kind not in "iu":
            raise FieldError(
                f"block_indices of a VolumeField must be ({len(numbers)}, 3) whole numbers, one row for each block, "
                f"but have shape {indices.shape} and dtype {indices.dtype}"
            )
        field = cls.__new__(cls)
        field._build(numbers, indices.astype(np.int64), origin, spacing, mask, truncation, signed, interpolation)
        return field

    def _build(
        self,
        numbers: NDArray[Any],
        indices: NDArray[np.int64],
        origin: ArrayLike,
        spacing: ArrayLike,
        seen: NDArray[np.bool_] | None,
        truncation: float | None,
        signed: bool | None,
        interpolation: str,
    ) -> None:
        check_one_of("interpolation", interpolation, tuple(_TAPS))
        if truncation is not None:
            check_positive("truncation", truncation)
        if signed not in (True, False, None):
            raise ArgumentError(f"signed must be True, False or None, but is {signed!r}")
        self.origin, self.spacing = checked_origin(origin), checked_spacing(spacing)
        known = known_values(numbers, seen, truncation)
        self.signed = bool((known < 0).any()) if signed is None else bool(signed)
        self._grid = Blocks(known if self.signed else np.abs(known), indices, _TAPS[interpolation])
        # Nearer to an unsigned surface, an interpolation may ask nodes on both sides of it.
        self._near = -np.inf if self.signed else self._grid.taps / 2 * float(self.spacing.max())
        places = self._zeros() if self.signed else self._feet_of_cells()
        self._surface = _as_points(places)
        self._surface_normals = unit(self._interpolated(places)[1]) if self.signed else self._surface.normals(places)
        self.bounds: Floats = self._surface.bounds + [-self.spacing, self.spacing]

    def sample(self, x: ArrayLike) -> FieldSample:
        """value (L,), gradient (L, 3), foot (L, 3) and normal (L, 3) at the places x (L, 3)."""
        places = as_places(x)
        value, gradient = self._interpolated(places)
        foot = newton_foot(places, value, gradient)
        lost = self._lost(value, gradient)
        if len(lost):
            value[lost], gradient[lost], foot[lost] = self._by_surface(places[lost], value[lost])
        return FieldSample(value, gradient, foot, lambda: self._normals(foot))

    def spread(self, count: int) -> Floats:
        """About `count` places (n, 3) on the surface, spread evenly; the same at every call."""
        places = self._surface.spread(len(self._surface))  # all, along a curve
        each = -(-as_count(count, "count", 1) // len(places))
        if each > 1:  # there is about one for each cell: that many from the cell around it
            around = self.spacing * (np.outer(np.arange(each), _NEXT) % 1 - 0.5)
            near = (places[:, None] + around).reshape(-1, 3)
            places = self._projected(near) if self.signed else self._by_surface(near, np.zeros(len(near)))[2]
        stride = max(1.0, len(places) / count)
        return np.asarray(places[np.arange(stride / 2, len(places), stride).astype(int)])

    def _interpolated(self, places: Floats, taps: int | None = None) -> tuple[Floats, Floats]:
        """value (L,) and gradient (L, 3) of the volume; NaN where it knows none."""
        u = (places - self.origin) / self.spacing
        value, gradient = self._grid.interpolated(u, taps)
        unknown = np.flatnonzero(~np.isfinite(value))
        if len(unknown) and taps is None and self._grid.taps > 2:  # fewer nodes may do
            value[unknown], gradient[unknown] = self._grid.interpolated(u[unknown], 2)
            unknown = np.flatnonzero(~np.isfinite(value))
        value[unknown], gradient[unknown] = np.nan, np.nan
        return value, gradient / self.spacing

    def _lost(self, value: Floats, gradient: Floats) -> NDArray[np.intp]:
        """The rows from which no Newton step leads to the surface: NaN, an unsigned surface nearby, or a ridge, where
        the slope is so small that the step may end more than a cell too far."""
        return np.flatnonzero(~self._leads(value, gradient) | (value < self._near))

    def _leads(self, value: Floats, gradient: Floats) -> NDArray[np.bool_]:
        slope, step = np.sqrt(np.einsum("li,li->l", gradient, gradient)), float(self.spacing.max())
        return np.asarray(np.maximum(np.abs(value), step) * (1 - slope) <= step * slope)

    def _by_surface(self, places: Floats, value: Floats) -> tuple[Floats, Floats, Floats]:
        """value, gradient and foot by the nearest places on the surface, where the value is NaN or leads nowhere."""
        rows = self._nearest(places)
        foot, normal = self._surface.points[rows], self._surface_normals[rows]
        height = np.einsum("li,li->l", places - foot, normal)
        near = value < self._near
        foot[near] = places[near] - height[near, None] * normal[near]
        away = places - foot
        side = self._side(places, height) if self.signed else np.ones(len(places))
        return side * np.linalg.norm(away, axis=1), side[:, None] * unit(away), foot

    def _side(self, places: Floats, height: Floats) -> Floats:
        """1 or -1: the sign of the nearest node, which truncation leaves; of the height where that node is unseen."""
        node = self._grid.at(np.rint((places - self.origin) / self.spacing))
        return np.where(np.where(np.isnan(node), height, node) < 0, -1.0, 1.0)

    def _nearest(self, places: Floats) -> NDArray[np.int64]:
        """Rows (L,) of the places on the surface that are nearest to other places (L, 3)."""
        return self._surface.nearest(places)[1][:, 0]

    def _normals(self, feet: Floats) -> Floats:
        """Unit normals (L, 3): the volume's own gradient where it has one."""
        value, gradient = self._interpolated(feet)
        lost = self._lost(value, gradient)
        if len(lost):
            gradient[lost] = self._surface_normals[self._nearest(feet[lost])]
        return unit(gradient)

    def _zeros(self) -> Floats:
        """Places (n, 3) where a signed volume is zero."""
        return self._projected(self.origin + self.spacing * _one_per_cell(self._grid.crossings()))

    def _projected(self, places: Floats) -> Floats:
        """Where Newton steps from places (m, 3) near the surface end on it (n, 3)."""
        for _ in range(_STEPS):
            value, gradient = self._interpolated(places)
            places = newton_foot(places, value, gradient)[np.isfinite(value)]
        value, gradient = self._interpolated(places)
        reach = _ON * self.spacing.min() * np.linalg.norm(gradient, axis=1)
        return np.asarray(places[np.abs(value) <= reach])

    def _feet_of_cells(self) -> Floats:
        """Places (n, 3) on the surface of an unsigned volume: feet of the middles of cells that it does not cross but
        that lie next to those."""
        step = float(self.spacing.max())  # the surface lies nearer to the middles of the cells that it crosses
        middles = self.origin + self.spacing * (self._grid.below(3 * step) + 0.5)
        value, gradient = self._interpolated(middles, 2)
        chosen = (step <= value) & (value <= 2 * step) & self._leads(value, gradient)
        feet = newton_foot(middles, value, gradient)[chosen]
        places = self.origin + self.spacing * _one_per_cell((feet - self.origin) / self.spacing)
        return places[self._interpolated(places, 2)[0] <= step]


def _one_per_cell(u: Floats) -> Floats:
    """The means (n, 3) of the places (m, 3), in steps of the grid, that lie in the same cell, or cube as large."""
    if not len(u):
        return u
    bounds, _ = _core.survey(u, 1)
    return _core.thin(u, bounds, 1.0, 1)[0]


def _as_points(places: Floats) -> PointField:
    try:
        return PointField(places)
    except ArgumentError as error:
        raise FieldError(
            "VolumeField needs a surface in its volume, but between values that are known there is none: check the "
            "truncation and the sign, and that values and spacing are in one unit"
        ) from error
