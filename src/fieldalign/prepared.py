"""What a cloud is turned into before it is registered, and what can be kept for the next registration."""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np

from . import _core
from .alignment.residual import row_dot
from .fields import DistanceField, FieldSample, PointField, sampled, spread_over
from .fields.protocol import Floats, Planes, bounds_of, exact_planes, planes_near
from .lazy import lazy
from .pseudo import draw_pseudo_points
from .scale import Scale, scale_of, within
from .settings import Settings
from .surface import Surface
from .threads import resolve_threads
from .verdict.sight import Sight

_KEPT = 8  # pseudo sets that a prepared cloud remembers
_FINE = 50_000  # points: more are thinned before the last level of an alignment
_PSEUDO = 5_000  # pseudo points of the last level: with 10 to 20 neighbours each they see nearly every fine point
_SINGLE = 100_000  # and against an exact surface
_FINER = 4.0    # to voxels so much smaller than the search's
_SURFACE_SAMPLES = 30_000  # places that stand for a field that is no cloud
_PROBES = 200  # surface points that stand for the whole where an overlap is measured


class PreparedCloud:
    """A cloud with its distance field, and the pseudo points and their features that were asked of it so far.

    field: its DistanceField. centre: (3,), mean of the points, or middle of the bounds. extent: diagonal of the bounds.
    dropped: how many NaN rows were left out. eye: (3,), where the sensor stood, in the cloud's frame, or None.
    factor: what its lengths were multiplied by, where its scale is sought.
    """

    factor = 1.0

    def __init__(
        self, field: DistanceField, dropped: int = 0, threads: int | None = None, eye: Floats | None = None
    ) -> None:
        self.field = field
        self.dropped = dropped
        self.eye = eye
        self.threads = resolve_threads(threads)
        self._features: dict[Hashable, tuple[Floats, FieldSample]] = {}
        self._surfaces: dict[int, Surface] = {}
        self._pseudo: dict[tuple[int, bool], Planes] = {}

    @property
    def is_points(self) -> bool:
        """Whether the surface is known by points alone."""
        return isinstance(self.field, PointField)

    @lazy
    def centre(self) -> Floats:
        """Where the cloud lies, (3,): its mean, or the middle of a field's bounds."""
        if isinstance(self.field, PointField):
            return self.field.centre
        return np.asarray(np.mean(bounds_of(self.field), axis=0))

    @lazy
    def extent(self) -> float:
        """The diagonal of the bounding box."""
        low, high = bounds_of(self.field)
        return float(np.linalg.norm(high - low))

    @lazy
    def probes(self) -> tuple[Floats, float]:
        """Places on the surface (200, 3), and within which distance another cloud's surface counts as the same."""
        rng = np.random.default_rng(0)  # a sample of the cloud itself, alike for every registration
        if isinstance(self.field, PointField):
            places = self.field.drawn(_PROBES, rng)
            return places, 3 * float(np.median(self.field.spacing(places)))
        return self.fine.drawn(_PROBES, rng), 0.0

    def build(self) -> None:
        """Builds the search tree of all its points, if it has any: the paper's method asks nothing else."""
        if isinstance(self.field, PointField):
            _ = self.field.tree

    @lazy
    def fine(self) -> PointField:
        """The surface as points, no denser than the last level of an alignment can use: the cloud's own or thinned."""
        if not isinstance(self.field, PointField):
            return PointField(spread_over(self.field, _SURFACE_SAMPLES), threads=self.threads)
        points, scale = self.field.points, self._whole_scale
        inside = within(scale.core, points, self.field.bounds)
        if len(inside) > _FINE:
            bounds, _ = _core.survey(inside, self.threads)
            inside = _core.thin(inside, bounds, max(scale.voxel / _FINER, scale.finest), self.threads)[0]
        return self.field if inside is points else PointField(inside, threads=self.threads)

    @lazy
    def scale(self) -> Scale:
        """The lengths that the cloud itself suggests."""
        return self._whole_scale if self.fine is self.field else scale_of(self.fine.points, self.threads)

    @lazy
    def _whole_scale(self) -> Scale:
        """The scale of all points of a cloud, before any thinning."""
        assert isinstance(self.field, PointField)
        return scale_of(self.field.points, self.threads)

    def surface(self, voxel: float) -> Surface:
        """The surfels at about this voxel, kept for the next pair: at the nearest rung of a ladder of quarter octaves
        from the cloud's own voxel."""
        rung = round(4 * float(np.log2(voxel / self.scale.voxel)))
        if rung not in self._surfaces:
            self._surfaces[rung] = Surface(
                self.fine.points, self.scale.voxel * 2.0 ** (rung / 4), self.threads, self.eye
            )
        return self._surfaces[rung]

    @property
    def exact(self) -> DistanceField:
        """What the last level of an alignment asks: the fine points, or the field itself where it is no cloud."""
        return self.fine if isinstance(self.field, PointField) else self.field

    @lazy
    def sight(self) -> Sight | None:
        """How far the sensor saw in each direction, where it is known where it stood."""
        return None if self.eye is None else Sight(np.asarray(self.fine.points, float), self.eye)

    def pseudo_planes(self, neighbours: int, single: bool = False) -> Planes:
        """Pseudo points of the last level: places spread over the surface, and the planes there.

        single: the cloud's own points, each with its own noise, for a last level against an exact surface.
        """
        if (neighbours, single) not in self._pseudo:
            self._pseudo[neighbours, single] = self._drawn_planes(neighbours, single)
        return self._pseudo[neighbours, single]

    def _drawn_planes(self, neighbours: int, single: bool) -> Planes:
        if not single:
            return planes_near(self.exact, self.fine.spread(_PSEUDO), neighbours)
        assert isinstance(self.field, PointField)
        points = self.field.spread(_SINGLE)
        return exact_planes(points, self.fine.surfels(points, neighbours)[1])

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

    @property
    def last_pseudo_points(self) -> Floats | None:
        """The pseudo points (L, 3) that the paper's method asked of this cloud last; None: none yet."""
        known = list(self._features.values())
        return known[-1][0] if known else None


def _moments(cloud: PointField) -> Floats:
    """Mean squared and mean fourth power of the distances to the mean, (2,): no motion and no order changes them."""
    away = np.asarray(cloud.points, float) - cloud.centre
    squared = row_dot(away, away)
    return np.array([squared.mean(), (squared**2).mean()])
