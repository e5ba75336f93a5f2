"""What a cloud is turned into before it is registered, and what can be kept for the next registration."""

from __future__ import annotations

import os
from collections.abc import Hashable
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from .alignment.residual import row_dot
from .clouds.checks import checked_points
from .clouds.cloud import PointCloud
from .errors import ArgumentError
from .fields import DistanceField, FieldSample, PointField, sampled
from .fields.protocol import Floats, Planes, planes_near
from .lazy import lazy
from .pseudo import draw_places, draw_pseudo_points
from .scale import Scale, scale_of, within
from .settings import Settings
from .surface import Surface
from .threads import resolve_threads
from .verdict.sight import Sight

_KEPT = 8  # pseudo sets that a prepared cloud remembers
_FINE = 50_000  # points: more are thinned before the last level of an alignment
_PSEUDO = 5_000  # pseudo points of the last level: with 10 to 20 neighbours each they see nearly every fine point
_FINER = 4.0    # to voxels so much smaller than the search's
_SURFACE_SAMPLES = 20_000  # places that stand for a field that is no cloud
_PROBES = 200  # surface points that stand for the whole where an overlap is measured


class PreparedCloud:
    """A cloud with its distance field, and the pseudo points and their features that were asked of it so far.

    field: its DistanceField. centre: (3,), mean of the points, or middle of the bounds. extent: diagonal of the bounds.
    dropped: how many NaN rows were left out. eye: (3,), where the sensor stood, in the cloud's frame, or None.
    """

    def __init__(
        self, field: DistanceField, dropped: int = 0, threads: int | None = None, eye: Floats | None = None
    ) -> None:
        self.field = field
        self.dropped = dropped
        self.eye = eye
        self._threads = resolve_threads(threads)
        self._features: dict[Hashable, tuple[Floats, FieldSample]] = {}
        self._surfaces: dict[int, Surface] = {}
        self._pseudo: dict[int, Planes] = {}

    @lazy
    def centre(self) -> Floats:
        """Where the cloud lies, (3,): its mean, or the middle of a field's bounds."""
        if isinstance(self.field, PointField):
            return self.field.centre
        return np.asarray(np.mean(_bounds(self.field), axis=0))

    @lazy
    def extent(self) -> float:
        """The diagonal of the bounding box."""
        low, high = _bounds(self.field)
        return float(np.linalg.norm(high - low))

    @lazy
    def probes(self) -> tuple[Floats, float]:
        """Places on the surface (200, 3), and within which distance another cloud's surface counts as the same."""
        rng = np.random.default_rng(0)  # a sample of the cloud itself, alike for every registration
        places = draw_places(self.field, _PROBES, rng)
        if isinstance(self.field, PointField):
            return places, 3 * float(np.median(self.field.spacing(places)))
        return places, 0.0

    def build(self) -> None:
        """Builds the search tree of all its points, if it has any: the paper's method asks nothing else."""
        if isinstance(self.field, PointField):
            _ = self.field.tree

    @lazy
    def fine(self) -> PointField:
        """The surface as points, no denser than the last level of an alignment can use: the cloud's own or thinned."""
        if not isinstance(self.field, PointField):
            places = draw_places(self.field, _SURFACE_SAMPLES, np.random.default_rng(0))
            return PointField(places, threads=self._threads)
        points, scale = self.field.points, self._whole_scale
        inside = within(scale.core, points, self.field.bounds)
        if len(inside) > _FINE:
            bounds, _ = _core.survey(inside, self._threads)
            inside = _core.thin(inside, bounds, max(scale.voxel / _FINER, scale.finest), self._threads)[0]
        return self.field if inside is points else PointField(inside, threads=self._threads)

    @lazy
    def scale(self) -> Scale:
        """The lengths that the cloud itself suggests."""
        return self._whole_scale if self.fine is self.field else scale_of(self.fine.points, self._threads)

    @lazy
    def _whole_scale(self) -> Scale:
        """The scale of all points of a cloud, before any thinning."""
        assert isinstance(self.field, PointField)
        return scale_of(self.field.points, self._threads)

    def surface(self, voxel: float) -> Surface:
        """The surfels at about this voxel, kept for the next pair: at the nearest rung of a ladder of quarter octaves
        from the cloud's own voxel."""
        rung = round(4 * float(np.log2(voxel / self.scale.voxel)))
        if rung not in self._surfaces:
            self._surfaces[rung] = Surface(self.fine.points, self.scale.voxel * 2.0 ** (rung / 4), self._threads)
        return self._surfaces[rung]

    @property
    def exact(self) -> DistanceField:
        """What the last level of an alignment asks: the fine points, or the field itself where it is no cloud."""
        return self.fine if isinstance(self.field, PointField) else self.field

    @lazy
    def sight(self) -> Sight | None:
        """How far the sensor saw in each direction, where it is known where it stood."""
        return None if self.eye is None else Sight(np.asarray(self.fine.points, float), self.eye)

    def pseudo_planes(self, neighbours: int) -> Planes:
        """Pseudo points of the last level: places spread over the surface, and the planes there."""
        if neighbours not in self._pseudo:
            self._pseudo[neighbours] = planes_near(self.exact, self.fine.spread(_PSEUDO), neighbours)
        return self._pseudo[neighbours]

    def is_copy_of(self, other: PreparedCloud) -> bool:
        """Whether both are the same points but for a motion and the order, as far as two moments tell: of the fine
        points, which are few but thinned differently, then of all."""
        clouds = self.field, other.field
        if not (isinstance(clouds[0], PointField) and isinstance(clouds[1], PointField)):
            return False
        if len(clouds[0]) != len(clouds[1]):
            return False
        fine = _moments(self.fine), _moments(other.fine)
        return np.allclose(*fine, rtol=0.03) and np.allclose(_moments(clouds[0]), _moments(clouds[1]), rtol=1e-5)

    def sampled_by(self, settings: Settings, threads: int | None) -> DistanceField:
        """The field as the settings want it sampled."""
        if isinstance(self.field, PointField):
            return self.field.using(settings.neighbours, settings.normal_neighbours, threads)
        return self.field

    def features(self, settings: Settings, seed: int, threads: int | None) -> tuple[Floats, FieldSample]:
        """Pseudo points P_a (L, 3) and phi(P_tau, P_a), with this cloud as the target: worked out once and kept."""
        handed = None if settings.pseudo_points is None else np.asarray(settings.pseudo_points).tobytes()
        drawn = (settings.pseudo_set, settings.pseudo_count, settings.half_width, settings.spread, seed)
        key = (handed or drawn, settings.neighbours, settings.normal_neighbours)
        known = self._features.get(key)
        if known is None:
            field = self.sampled_by(settings, threads)
            pseudo = draw_pseudo_points(field, self.centre, settings, seed)
            known = pseudo, sampled(field, pseudo)
            # A new dictionary, so that calls from several threads never see one change under them.
            self._features = dict([*self._features.items(), (key, known)][-_KEPT:])
        return known


CloudLike: TypeAlias = ArrayLike | PointCloud | DistanceField | str | os.PathLike[str] | PreparedCloud


def prepare(cloud: CloudLike, *, threads: int | None = None, drop_nonfinite: bool = True) -> PreparedCloud:
    """A cloud made ready for registration; accepted wherever a cloud is, and worth it where one serves many times.

    cloud: points (N, 3), a PointCloud, a path, a DistanceField, or a prepared cloud, which is returned as it is.
    threads: None means all cores. drop_nonfinite: NaN rows are missing returns, dropped and counted; infinity raises.

    Raises ArgumentError for points of a wrong shape, with infinity, or fewer than 3 distinct ones, and CloudFileError
    for a file that cannot be read.
    """
    return prepare_named(cloud, "cloud", threads, drop_nonfinite)


def prepare_pair(
    source: CloudLike, target: CloudLike, threads: int, drop_nonfinite: bool
) -> tuple[PreparedCloud, PreparedCloud]:
    """prepare() of both clouds of a pair."""
    return (
        prepare_named(source, "source", threads, drop_nonfinite),
        prepare_named(target, "target", threads, drop_nonfinite),
    )


def prepare_named(cloud: CloudLike, name: str, threads: int | None, drop_nonfinite: bool) -> PreparedCloud:
    """prepare(), with the argument's own name in its errors."""
    if isinstance(cloud, PreparedCloud):
        return cloud
    if isinstance(cloud, DistanceField):
        return PreparedCloud(cloud, threads=threads)
    points, eye = _parts_of(cloud)
    checked = checked_points(points, name, resolve_threads(threads), drop_nonfinite)
    return PreparedCloud(PointField(checked, threads=threads), checked.dropped, threads, eye)


def _parts_of(cloud: Any) -> tuple[Any, Floats | None]:
    """The points, and the place (3,) of the sensor where the cloud knows it."""
    if isinstance(cloud, str | Path | os.PathLike):
        from .clouds.files import read_cloud  # the libraries behind it load only where a file is read

        cloud = read_cloud(cloud)
    if not isinstance(cloud, PointCloud):
        return cloud, None
    return cloud.points, None if cloud.viewpoint is None else np.ascontiguousarray(cloud.viewpoint[:3, 3])


def _moments(cloud: PointField) -> Floats:
    """Mean squared and mean fourth power of the distances to the mean, (2,): no motion and no order changes them."""
    away = np.asarray(cloud.points, float) - cloud.centre
    squared = row_dot(away, away)
    return np.array([squared.mean(), (squared**2).mean()])


def _bounds(field: DistanceField) -> Floats:
    bounds = np.asarray(field.bounds, float)
    if bounds.shape != (2, 3) or not np.isfinite(bounds).all() or not (bounds[0] <= bounds[1]).all():
        raise ArgumentError(f"{type(field).__name__}.bounds must be (2, 3), lowest and highest corner, but is {bounds}")
    return bounds
