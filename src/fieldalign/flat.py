"""Clouds in the plane: points (N, 2) stand up as walls, and a motion in SE(2) is one of SE(3) with three freedoms.

A point becomes a column of points, so that a curve becomes a wall whose surfels lie upright. Walls know nothing of
height: the result's turn about z and its shift along x and y are the plane's.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from .arguments import as_array, as_square
from .clouds.checks import Checked, checked_points
from .dof import Dof
from .errors import ArgumentError
from .fields import PointField
from .fields.protocol import Floats, Planes, planes_near
from .lazy import lazy
from .prepared import PreparedCloud
from .result import RegistrationResult
from .scale import scale_of
from .verdict import Freedom

PLANAR = Dof("planar")
_CELLS = 1000   # occupied cells along the curves
_STOREYS = 3    # cells that a wall is high
_FINER = 4      # points to a cell, along a wall and up: as many as the last level of an alignment can use
_MOST = 20_000  # columns: of more points, only the thinned ones stand up
_PSEUDO = 5000  # pseudo points of the last level
_IN_PLANE = np.array([2, 3, 4])  # of a twist (w, v): the turn about z, the shift along x and y


class FlatCloud:
    """Points (N, 2) that can stand up as walls of any height; what was made of them is kept.

    points: (N, 2). dropped: NaN rows that were left out.
    """

    def __init__(self, points: Any, name: str, threads: int, drop_nonfinite: bool) -> None:
        on_floor = as_array(points, name, "an (N, 2) array of numbers")
        if on_floor.dtype.kind not in "fiu":
            raise ArgumentError(f"{name} must be an (N, 2) array of real numbers, but has dtype {on_floor.dtype}")
        checked = checked_points(np.c_[on_floor, np.zeros(len(on_floor))], name, threads, drop_nonfinite)
        self.checked, self.dropped, self.threads = checked, checked.dropped, threads
        scale = scale_of(checked.points, threads, _CELLS)
        self.cell = max(scale.voxel, 2 * scale.finest)
        self._walls: dict[float, Walls] = {}

    @property
    def points(self) -> Floats:
        """(N, 2)."""
        return np.asarray(self.checked.points[:, :2])

    def walls(self, cell: float) -> Walls:
        """The cloud as walls for surfels of a size, ready for registration."""
        if cell not in self._walls:
            self._walls[cell] = Walls(self.checked, cell, self.threads)
        return self._walls[cell]


class Walls(PreparedCloud):
    """A cloud in the plane, each point a column."""

    def __init__(self, floor: Checked, cell: float, threads: int) -> None:
        sparse = _core.thin(floor.points, floor.bounds, cell / _FINER, threads)[0]
        sparse[:, 2] = 0
        self._sparse, self._cell = sparse, cell
        columns = floor.points if len(floor.points) <= _MOST else sparse
        super().__init__(_standing(columns, cell, threads), floor.dropped, threads)

    @lazy
    def fine(self) -> PointField:
        """The walls, no denser along than up."""
        return _standing(self._sparse, self._cell, self.threads)

    @lazy
    def exact(self) -> PointField:
        """What the last level asks: three points to a column, so that planes are laid through several columns."""
        return _standing(self._sparse, self._cell, self.threads, half=1)

    def pseudo_planes(self, neighbours: int, single: bool = False) -> Planes:
        """Pseudo points on the floor alone: what stands above says nothing else."""
        if (neighbours, single) not in self._pseudo:
            places = self._sparse[:: max(1, len(self._sparse) // _PSEUDO)]
            self._pseudo[neighbours, single] = planes_near(self.exact, places, neighbours)
        return self._pseudo[neighbours, single]


def _standing(floor: Floats, cell: float, threads: int, half: int = _STOREYS * _FINER // 2) -> PointField:
    """Columns on places (N, 3) of the floor, so many points up and down."""
    columns = np.repeat(floor[:, None], 2 * half + 1, axis=1)
    columns[:, :, 2] = np.arange(-half, half + 1) * cell / _FINER
    return PointField(columns.reshape(-1, 3), threads=threads)


def is_flat(cloud: Any) -> bool:
    """Whether a cloud is one in the plane: points (N, 2), or prepared from such."""
    if isinstance(cloud, FlatCloud):
        return True
    shape = np.shape(cloud) if isinstance(cloud, np.ndarray | list | tuple) and _is_regular(cloud) else ()
    return len(shape) == 2 and shape[1] == 2


def standing(source: FlatCloud, target: FlatCloud, scaled: bool) -> tuple[PreparedCloud, PreparedCloud]:
    """Both clouds as walls, equally high unless their scales are not to be compared."""
    larger = max(source.cell, target.cell)
    cells = (source.cell, target.cell) if scaled else (larger, larger)
    return source.walls(cells[0]), target.walls(cells[1])


def upright(T: ArrayLike, name: str) -> Floats:
    """The (4, 4) motion of a (3, 3) one in the plane; raises ArgumentError where it is none."""
    flat = as_square(T, name, 3, " for clouds in the plane")
    lifted = np.eye(4)
    lifted[:2, :2], lifted[:2, 3], lifted[3, [0, 1, 3]] = flat[:2, :2], flat[:2, 2], flat[2]
    with np.errstate(over="ignore"):
        size = float(np.sqrt(abs(np.linalg.det(flat[:2, :2]))))
    lifted[2, 2] = size if size > 0 else 1.0
    return lifted


def planar(dof: Dof | None) -> Dof:
    """What is free in the plane; raises ArgumentError where a dof names more."""
    if dof is None:
        return PLANAR
    beyond = sorted(set(dof.free) - set(PLANAR.free))
    if beyond or dof.axis is not None:
        raise ArgumentError(f"dof of clouds in the plane must be among rz, x, y, without an axis, but has {dof.free!r}")
    return dof


def laid_down(result: RegistrationResult) -> RegistrationResult:
    """The result in the plane: T_target_source (3, 3), information of (w, vx, vy), and of a growth if there is one."""
    rows = np.r_[_IN_PLANE, np.arange(6, len(result.information))]
    T = result.T_target_source[np.ix_([0, 1, 3], [0, 1, 3])]
    return replace(
        result,
        T_target_source=T,
        information=result.information[np.ix_(rows, rows)],
        covariance=result.covariance[np.ix_(rows, rows)],
        unobservable=result.unobservable[rows],
        reference_point=result.reference_point[:2],
        freedoms=tuple(Freedom(f.kind, f.axis, f.point * [1, 1, 0]) for f in result.freedoms),
        alternatives=tuple(laid_down(other) for other in result.alternatives),
    )


def _is_regular(cloud: Any) -> bool:
    try:
        np.shape(cloud)
    except ValueError:  # ragged rows: for the check of points to tell
        return False
    return True
