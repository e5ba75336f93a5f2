"""A cloud at another size, so that clouds whose unit is not the same can be compared."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .fields import DistanceField, FieldSample, PointField, sampled, spread_over
from .fields.protocol import Floats, Planes, planes_near
from .lazy import lazy
from .prepared import PreparedCloud
from .scale import Scale
from .surface import Surface


class ScaledCloud(PreparedCloud):
    """A prepared cloud with all lengths times `factor`; what is known of the cloud is scaled, not worked out again."""

    def __init__(self, cloud: PreparedCloud, factor: float) -> None:
        self.original, self.factor = cloud, factor
        field = cloud.field
        super().__init__(
            PointField(factor * np.asarray(field.points, float), threads=cloud.threads)
            if isinstance(field, PointField) else ScaledField(field, factor),
            cloud.dropped, cloud.threads, None if cloud.eye is None else factor * cloud.eye,
        )

    @lazy
    def fine(self) -> PointField:
        """The surface as points."""
        if self.original.fine is self.original.field:
            assert isinstance(self.field, PointField)
            return self.field
        return PointField(self.factor * np.asarray(self.original.fine.points, float), threads=self.threads)

    @lazy
    def scale(self) -> Scale:
        """The lengths that the cloud itself suggests."""
        return self.original.scale.scaled(self.factor)

    def surface(self, voxel: float) -> Surface:
        """The surfels at about this voxel."""
        return scaled_surface(self.original, self.factor, voxel)


def scaled_surface(cloud: PreparedCloud, factor: float, voxel: float) -> Surface:
    """The surfels of a cloud at `factor` times its size, at about a voxel of that size."""
    return cloud.surface(voxel / factor).scaled(factor)


class ScaledField:
    """A distance field with all lengths times `factor`."""

    def __init__(self, field: DistanceField, factor: float) -> None:
        self.field, self.factor = field, factor
        self.signed = field.signed
        self.bounds: Floats = factor * np.asarray(field.bounds, float)

    def sample(self, x: ArrayLike) -> FieldSample:
        """value (L,), gradient (L, 3), foot (L, 3) and normal (L, 3) at the places x (L, 3)."""
        at = sampled(self.field, np.asarray(x, float) / self.factor)
        return FieldSample(self.factor * at.value, at.gradient, self.factor * at.foot, lambda: at.normal)

    def planes(self, x: Floats, neighbours: int, last: Planes | None = None) -> Planes:
        """As planes_near()."""
        found = planes_near(self.field, x / self.factor, neighbours)
        factor = self.factor
        return Planes(factor * found.mean, found.normal, factor * found.thickness, factor * found.width)

    def spread(self, count: int) -> Floats:
        """About `count` places (n, 3) on the surface, spread evenly."""
        return self.factor * spread_over(self.field, count)
