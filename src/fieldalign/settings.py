"""Every choice of the paper's method, and its presets."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from .arguments import MAX_NEIGHBOURS, MAX_PLACES, as_count, check_one_of, check_positive, is_number
from .clouds.cloud import as_points
from .errors import ArgumentError

PseudoSet = Literal["uniform", "neighbourhood", "keypoints"]
DirectionRule = Literal["feet", "normals", "none"]


@dataclass(frozen=True, eq=False)
class Settings:
    """Settings of the paper's method (Yuan & Nüchter, RA-L 2022); lengths in the clouds' unit, metres in the presets.

    The third set:
    pseudo_set: "uniform" in a cube about the target's centre, "neighbourhood" of target points, along their normals, or
        of ISS "keypoints", in all directions (Sec. V-E, V-H, V-I).
    pseudo_count: L, how many pseudo points (1000 in all of the paper's experiments).
    half_width: s, half the edge of the cube (length).
    sigma: deviation from the surface for the other two sets (length); None: s / 5, as the authors' program has it.
    pseudo_points: (L, 3), pseudo points in the target's frame, used instead of drawn ones.
    The solution:
    irls: iteratively reweighted least squares for the sum of |residual| (Sec. IV-C); False: solved directly, eq. (16).
    irls_distance: residuals below the square of this distance (length) are weighted alike; keeps weights finite.
    irls_steps, irls_tolerance: at most so many reweightings; stop where the twist changes by less.
    Truncation, tested anew in each iteration (Sec. IV-D, V-D):
    share_limit: drop a pseudo point whose foot serves more than so many of them, in either cloud; None: no such rule.
    direction: "feet": keep where the directions to the feet in both clouds agree, as the authors' program does;
        "normals": keep where the foot lies along the surface's normal in both clouds, as the paper's text says; "none".
    min_cosine: of the angle that the direction rule allows; lowered by 0.1 until min_kept pseudo points remain.
    min_kept: how many pseudo points must remain.
    The field:
    neighbours: k of the mean feature against noise (Sec. V-G.2); 1: the distance field itself.
    normal_neighbours: points in a normal's plane.
    Stopping:
    max_iterations: at most so many (10 on synthetic, 20 on real data in the paper).
    tolerance: stop where the norm of the increment is smaller.
    unit: the length that counts as 1 beside a radian where increments are measured; 1 m in the paper.

    Raises ArgumentError for a value out of its range.
    """

    pseudo_set: PseudoSet = "neighbourhood"
    pseudo_count: int = 1000
    half_width: float = 2.0
    sigma: float | None = None
    pseudo_points: ArrayLike | None = None
    irls: bool = True
    irls_distance: float = 0.1
    irls_steps: int = 1000
    irls_tolerance: float = 1e-3
    share_limit: int | None = 3
    direction: DirectionRule = "feet"
    min_cosine: float = 0.9
    min_kept: int = 10
    neighbours: int = 1
    normal_neighbours: int = 10
    max_iterations: int = 20
    tolerance: float = 1e-6
    unit: float = 1.0

    def __post_init__(self) -> None:
        check_one_of("pseudo_set", self.pseudo_set, ("uniform", "neighbourhood", "keypoints"))
        check_one_of("direction", self.direction, ("feet", "normals", "none"))
        for name in ("half_width", "irls_distance", "irls_tolerance", "tolerance", "unit"):
            check_positive(name, getattr(self, name))
        if self.sigma is not None:
            check_positive("sigma", self.sigma)
        for name, lowest in (("pseudo_count", 6), ("irls_steps", 1), ("min_kept", 6), ("max_iterations", 1)):
            as_count(getattr(self, name), name, lowest, MAX_PLACES)
        as_count(self.neighbours, "neighbours", 1, MAX_NEIGHBOURS)
        as_count(self.normal_neighbours, "normal_neighbours", 3, MAX_NEIGHBOURS)
        if self.share_limit is not None:
            as_count(self.share_limit, "share_limit", 1, MAX_PLACES)
        if not is_number(self.min_cosine) or not -1 <= self.min_cosine < 1:
            raise ArgumentError(f"min_cosine must be a number in [-1, 1), but is {self.min_cosine!r}")
        if not isinstance(self.irls, bool):
            raise ArgumentError(f"irls must be True or False, but is {self.irls!r}")
        if self.pseudo_points is not None:
            points = as_points(self.pseudo_points, "pseudo_points").astype(float)
            if len(points) < 6 or not np.isfinite(points).all():
                raise ArgumentError(f"pseudo_points must be at least 6 finite points, but are {len(points)} rows")
            object.__setattr__(self, "pseudo_points", points)

    def __eq__(self, other: object) -> bool:
        """Equal in every field; pseudo points by their values."""
        if not isinstance(other, Settings):
            return NotImplemented
        return all(np.array_equal(getattr(self, f.name), getattr(other, f.name)) for f in fields(self))

    @property
    def spread(self) -> float:
        """How far pseudo points lie from the surface, as a standard deviation (length)."""
        return self.half_width / 5 if self.sigma is None else self.sigma

    def scaled(self, factor: float) -> Settings:
        """The same settings for clouds in another unit or of another size: every length times `factor`."""
        check_positive("factor", factor)
        lengths = ("half_width", "sigma", "irls_distance", "unit", "pseudo_points")
        given = {f.name: getattr(self, f.name) for f in fields(self) if f.name in lengths}
        return replace(self, **{name: value * factor for name, value in given.items() if value is not None})


PRESETS = {
    # The paper's experiments: objects of about unit size, rooms and streets in metres. Where the text is silent, as the
    # authors' program has it; it has nothing for streets, so s is ours there.
    "object": Settings("uniform", half_width=1.0, share_limit=None, direction="none", max_iterations=10),
    "indoor": Settings("neighbourhood", half_width=2.0),
    "outdoor": Settings("keypoints", half_width=5.0),
    # The same with the half width that the authors' program takes for ModelNet; and with more pseudo points.
    "object-near": Settings("uniform", half_width=0.5, share_limit=None, direction="none", max_iterations=10),
    "indoor-dense": Settings("neighbourhood", half_width=2.0, pseudo_count=3000),
}


def as_settings(settings: Settings | str | None) -> Settings:
    """A preset by name, or the settings given; None is "indoor". Raises ArgumentError for any other name."""
    if isinstance(settings, Settings):
        return settings
    name = "indoor" if settings is None else settings
    if not isinstance(name, str) or name not in PRESETS:
        raise ArgumentError(f"settings must be a Settings object or one of {', '.join(PRESETS)}, but is {settings!r}")
    return PRESETS[name]
