"""How far the points of a scan lie from the surface that they should lie on."""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arguments import LARGEST, check_positive
from .clouds.checks import warn_of_lost_precision
from .clouds.cloud import PointCloud, as_points
from .clouds.files import read_cloud
from .errors import ArgumentError
from .fields import DistanceField, sampled
from .fields.protocol import Floats
from .lazy import lazy
from .motions import apply, as_rigid
from .prepare import CloudLike, prepare_named
from .prepared import PreparedCloud

_PIECE = 2**16  # points at a time, so that what a field makes room for stays small
_INSIDE, _ON, _OUTSIDE, _MISSING = np.array([(32, 84, 190), (222, 222, 222), (196, 30, 42), (120, 120, 120)])


@dataclass(frozen=True)
class Statistics:
    """Of the deviations of all points that are there, in their unit.

    count: of these points. missing: NaN rows. percentile_95: of the absolute deviations. within: the share of the
    points whose deviation is at most the tolerance, 0 to 1; None without a tolerance.
    """

    count: int
    missing: int
    mean: float
    standard_deviation: float
    root_mean_square: float
    median: float
    percentile_95: float
    minimum: float
    maximum: float
    within: float | None


@dataclass(frozen=True, eq=False)
class Deviation:
    """How far N points lie from a surface, row for row.

    values: (N,), the distance to the surface, in the unit of the points; negative inside where `signed`; NaN for
        missing returns.
    feet: (N, 3), the nearest place on the surface to each point, in the reference's frame.
    signed: whether the reference knows inside from outside; points and open meshes do not.
    T_reference_cloud: (4, 4), what the points were moved by before. tolerance: in the same unit, or None.
    """

    values: Floats
    feet: Floats
    signed: bool
    T_reference_cloud: Floats
    tolerance: float | None = None

    def __len__(self) -> int:
        return len(self.values)

    @lazy
    def statistics(self) -> Statistics:
        """The deviations in a few numbers."""
        values = self.values[np.isfinite(self.values)]
        size = np.abs(values)
        return Statistics(
            count=len(values),
            missing=len(self) - len(values),
            mean=float(values.mean()),
            standard_deviation=float(values.std()),
            root_mean_square=float(np.sqrt(np.mean(values**2))),
            median=float(np.median(values)),
            percentile_95=float(np.percentile(size, 95)),
            minimum=float(values.min()),
            maximum=float(values.max()),
            within=None if self.tolerance is None else float(np.mean(size <= self.tolerance)),
        )

    def colored(self, cloud: PointCloud | ArrayLike, limit: float | None = None) -> PointCloud:
        """The cloud of these points, or its (N, 3) points, with the deviations as colours and as an attribute.

        Blue inside, red outside, pale on the surface, fully coloured at `limit` (the tolerance; without one what 95 %
        of the points keep to); missing returns are dark grey. Raises ArgumentError for a cloud of another length, and
        for a limit that is not positive.
        """
        if limit is not None:
            check_positive("limit", limit)
        given = cloud if isinstance(cloud, PointCloud) else PointCloud(as_points(cloud, "cloud"))
        if len(given) != len(self):
            raise ArgumentError(f"cloud must have the {len(self)} points of these deviations, but has {len(given)}")
        colors = diverging_colors(self.values, self.limit if limit is None else limit)
        return replace(given, colors=colors, attributes={**given.attributes, "deviation": self.values})

    @property
    def limit(self) -> float:
        """The deviation at which colours are full: the tolerance, or what 95 % of the points keep to."""
        return self.statistics.percentile_95 if self.tolerance is None else self.tolerance

    def to_dict(self) -> dict[str, Any]:
        """What is known of all points together in lists and numbers, ready for JSON."""
        return {
            "signed": self.signed,
            "tolerance": self.tolerance,
            "T_reference_cloud": self.T_reference_cloud.tolist(),
            "statistics": asdict(self.statistics),
        }

    def __repr__(self) -> str:
        s = self.statistics
        return (
            f"Deviation({len(self)} points, signed={self.signed}, mean={s.mean:.3g}, "
            f"root_mean_square={s.root_mean_square:.3g}, tolerance={self.tolerance})"
        )

    def __str__(self) -> str:
        s, side = self.statistics, "negative inside" if self.signed else "without a side: the reference knows none"
        lines = [
            f"{s.count} deviations, {side}",
            f"mean {s.mean:.4g}, standard deviation {s.standard_deviation:.4g}, root mean square "
            f"{s.root_mean_square:.4g}",
            f"median {s.median:.4g}, from {s.minimum:.4g} to {s.maximum:.4g}; 95 % within {s.percentile_95:.4g}",
        ]
        lines += [] if s.within is None else [f"{_percent(s.within)} within the tolerance of {self.tolerance:.4g}"]
        lines += [f"{s.missing} missing returns (NaN) left out"] if s.missing else []
        return "\n".join(lines)


def deviation(
    cloud: PointCloud | ArrayLike | str | os.PathLike[str],
    reference: CloudLike,
    T_reference_cloud: ArrayLike | None = None,
    *,
    tolerance: float | None = None,
) -> Deviation:
    """How far the points of a cloud lie from a reference: a mesh, a volume, any distance field, or other points.

    cloud: points (N, 3), a PointCloud or a path (of a mesh, its vertices). NaN rows are missing returns.
    reference: a DistanceField, a path, points (N, 3), a PointCloud or a prepared cloud, in the cloud's unit. Against
        points the deviation is the distance to the nearest one, which is no less than their noise and spacing.
    T_reference_cloud: (4, 4), moves the cloud's points into the reference's frame: a registration's T_target_source;
        None: they lie there already.
    tolerance: in the same unit; with it, the statistics say which share of the points keeps to it.

    A closed mesh, and a volume or a function that is negative somewhere, tell inside (negative) from outside; against
    an open mesh and points, deviations have no sign.

    Raises ArgumentError for a cloud of the wrong shape, with infinity or without a point, a pose that is not rigid and
    a tolerance that is not positive; CloudFileError for a file that cannot be read.
    """
    if tolerance is not None:
        check_positive("tolerance", tolerance)
    T = np.eye(4) if T_reference_cloud is None else as_rigid(T_reference_cloud, "T_reference_cloud")
    points = _points_of(cloud)
    field = _field_of(reference)
    values, feet = np.full(len(points), np.nan), np.full((len(points), 3), np.nan)
    for start in range(0, len(points), _PIECE):
        rows = slice(start, start + _PIECE)
        values[rows], feet[rows] = _from_field(field, apply(T, np.asarray(points[rows], float)))
    return Deviation(values, feet, bool(field.signed), T, None if tolerance is None else float(tolerance))


def diverging_colors(values: Floats, limit: float) -> NDArray[np.uint8]:
    """Colours (N, 3) of deviations (N,): blue below zero, red above, full from the limit on; NaN dark grey."""
    colors = np.empty((len(values), 3), np.uint8)
    for start in range(0, len(values), _PIECE):
        part = values[start : start + _PIECE, None]
        size = np.minimum(np.abs(part) / max(limit, 1e-290), 1.0)
        mixed = _ON + size * (np.where(part < 0, _INSIDE, _OUTSIDE) - _ON)
        colors[start : start + _PIECE] = np.rint(np.where(np.isnan(part), _MISSING, mixed))
    return colors


def _points_of(cloud: PointCloud | ArrayLike | str | os.PathLike[str]) -> NDArray[Any]:
    """Points (N, 3), NaN rows among them; raises ArgumentError where none is there or one is infinite."""
    given: Any = read_cloud(cloud) if isinstance(cloud, str | os.PathLike) else cloud
    points = given.points if isinstance(given, PointCloud) else as_points(given, "cloud")
    infinite = np.isinf(points).any(axis=1)
    if infinite.any():
        row = int(np.argmax(infinite))
        raise ArgumentError(f"cloud must be finite, or NaN where nothing returned, but row {row} is {points[row]}")
    largest = float(np.nanmax(np.abs(points), initial=0))
    if largest > LARGEST:
        raise ArgumentError(f"cloud must have coordinates below {LARGEST:g}, but has {largest:g}")
    if np.isnan(points).any(axis=1).all():
        raise ArgumentError(f"cloud must have points, but none of its {len(points)} rows is one")
    warn_of_lost_precision(points, np.array([np.nanmin(points, axis=0), np.nanmax(points, axis=0)]), "cloud")
    return points


def _field_of(reference: CloudLike) -> DistanceField:
    prepared = prepare_named(reference, "reference", None, True)
    if isinstance(prepared, PreparedCloud):
        return prepared.field
    raise ArgumentError("reference must be a surface or points in space, but is a cloud in the plane")


def _from_field(field: DistanceField, places: Floats) -> tuple[Floats, Floats]:
    """Deviations (L,) and feet (L, 3) of places (L, 3), NaN where these are."""
    value, feet = np.full(len(places), np.nan), np.full(places.shape, np.nan)
    seen = ~np.isnan(places).any(axis=1)
    if seen.any():
        sample = sampled(field, places[seen])
        value[seen], feet[seen] = sample.value, sample.foot
    return value, feet


def _percent(share: float) -> str:
    """Never 100 % where a point is beyond."""
    return f"{min(100 * share, 99.99) if share < 1 else 100:.4g} %"
