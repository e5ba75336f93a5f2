"""What a cloud is turned into before it is registered, and what can be kept for the next registration."""

from __future__ import annotations

import os
from collections.abc import Hashable
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from .clouds.checks import checked_points
from .clouds.cloud import PointCloud
from .errors import ArgumentError
from .fields import DistanceField, FieldSample, PointField, sampled
from .fields.protocol import Floats
from .pseudo import draw_places, draw_pseudo_points
from .settings import Settings
from .threads import resolve_threads

_KEPT = 8  # pseudo sets that a prepared cloud remembers
_PROBES = 200  # surface points that stand for the whole where an overlap is measured


class PreparedCloud:
    """A cloud with its distance field, and the pseudo points and their features that were asked of it so far.

    field: its DistanceField. centre: (3,), mean of the points, or middle of the bounds. extent: diagonal of the bounds.
    dropped: how many NaN rows were left out.
    """

    def __init__(self, field: DistanceField, dropped: int = 0) -> None:
        self.field = field
        self.dropped = dropped
        self._features: dict[Hashable, tuple[Floats, FieldSample]] = {}

    @cached_property
    def centre(self) -> Floats:
        """Where the cloud lies, (3,): its mean, or the middle of a field's bounds."""
        if isinstance(self.field, PointField):
            return self.field.centre
        return np.asarray(np.mean(_bounds(self.field), axis=0))

    @cached_property
    def extent(self) -> float:
        """The diagonal of the bounding box."""
        low, high = _bounds(self.field)
        return float(np.linalg.norm(high - low))

    @cached_property
    def probes(self) -> tuple[Floats, float]:
        """Places on the surface (200, 3), and within which distance another cloud's surface counts as the same."""
        rng = np.random.default_rng(0)  # a sample of the cloud itself, alike for every registration
        places = draw_places(self.field, _PROBES, rng)
        if isinstance(self.field, PointField):
            return places, 3 * float(np.median(self.field.spacing(places)))
        return places, 0.0

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
    """prepare() of both clouds of a pair, side by side: two trees of half the threads each are built sooner than one
    after the other by all threads, which then wait for each other."""
    if threads == 1 or _is_ready(source) or _is_ready(target):
        return (
            prepare_named(source, "source", threads, drop_nonfinite),
            prepare_named(target, "target", threads, drop_nonfinite),
        )
    jobs = [(cloud, name, threads // 2, drop_nonfinite) for cloud, name in ((source, "source"), (target, "target"))]
    with ThreadPoolExecutor(2) as pool:
        moving, fixed = (pool.submit(prepare_named, *job) for job in jobs)
        return moving.result(), fixed.result()


def _is_ready(cloud: CloudLike) -> bool:
    """Whether preparing it takes no time worth a thread."""
    few = isinstance(cloud, np.ndarray) and len(cloud) < 20_000
    return few or isinstance(cloud, PreparedCloud | DistanceField)


def prepare_named(cloud: CloudLike, name: str, threads: int | None, drop_nonfinite: bool) -> PreparedCloud:
    """prepare(), with the argument's own name in its errors."""
    if isinstance(cloud, PreparedCloud):
        return cloud
    if isinstance(cloud, DistanceField):
        return PreparedCloud(cloud)
    checked = checked_points(_points_of(cloud), name, resolve_threads(threads), drop_nonfinite)
    return PreparedCloud(PointField(checked, threads=threads), checked.dropped)


def _points_of(cloud: Any) -> Any:
    if isinstance(cloud, str | Path | os.PathLike):
        from .clouds.files import read_cloud  # the libraries behind it load only where a file is read

        cloud = read_cloud(cloud)
    return cloud.points if isinstance(cloud, PointCloud) else cloud


def _bounds(field: DistanceField) -> Floats:
    bounds = np.asarray(field.bounds, float)
    if bounds.shape != (2, 3) or not np.isfinite(bounds).all() or not (bounds[0] <= bounds[1]).all():
        raise ArgumentError(f"{type(field).__name__}.bounds must be (2, 3), lowest and highest corner, but is {bounds}")
    return bounds
