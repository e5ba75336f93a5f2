"""The robust alignment: pseudo points annealed along the normals, from coarse to fine, many poses at once.

The residual is the paper's (eq. 11) on signed distances to planes instead of squared distances; weights and truncation
stand in cpp/linearise.hpp.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import _core
from ..dof import Allowed
from ..fields.protocol import DistanceField, Floats, Planes, planes_near
from ..motions import apply, exp_twist, reach_of, rotate
from ..surface import Surface
from .agreement import MIN_COSINE, Apart, agreement, best_distinct, both_ways, mutual_score
from .residual import row_dot
from .solver import Step, descend
from .steps import LARGEST_TURN, minimisers, take_steps


@dataclass(frozen=True)
class Level:
    """How far pseudo points lie from the surface (standard deviation, voxels), how many they are, how many steps they
    take, and how many poses go on from here, best first."""

    spread: float
    count: int
    iterations: int
    keep: int


LEVELS = (Level(2.0, 240, 5, 24), Level(1.0, 300, 4, 12), Level(0.4, 700, 4, 8))
_LEAST_SPREAD = 0.1   # of the typical variance: no plane is taken for more exact
_SHARPEST = 0.3       # voxels: no coarse level weighs residuals by less
_SCORED = 600         # surfels that a pruning goes by
_SAME = Apart(0.9986, 1.0)  # 3 degrees and a voxel: poses that came to the same place
_RESOLUTION = 1e-14   # of coordinates: where surfaces meet without noise, what is left of residuals is rounding
_LEAST_SHRINKAGE = 0.3  # of the scale, from step to step: residuals that shrink more slowly count on
_FEW = 30             # runs of pseudo points: too few to tell a scatter


class GridStage:
    """One level: pseudo points about the moving surface, all poses at once, against the grid of the held one."""

    def __init__(
        self, held: Surface, moving: Surface, level: Level, rng: np.random.Generator, threads: int,
        allowed: Allowed | None = None,
    ) -> None:
        self.allowed = allowed
        voxel = max(held.voxel, moving.voxel)
        rows = rng.integers(0, len(moving), level.count)
        self.offsets = rng.normal(0, level.spread * voxel, level.count)
        self.normals = moving.normals[rows]
        self.places = moving.places[rows] + self.offsets[:, None] * self.normals
        self.grid = held.coarse_grid if level.spread > 1 else held.fine_grid
        self.loss = (
            max(level.spread, _SHARPEST) * voxel, MIN_COSINE, 3 * (level.spread + 1) * voxel, held.faces(moving),
        )
        self.iterations, self.threads = level.iterations, threads

    def step(self, poses: Floats) -> tuple[Floats, Step]:
        """A Gauss-Newton step of every pose."""
        H, g, totals = self.grid.robust_sums(self.places, self.normals, self.offsets, poses, *self.loss, self.threads)
        twists, poses = take_steps(poses, H, g, _core.stretch(totals), self.allowed)
        return poses, Step(twists[0], _rms(totals[0]), int(totals[0, 3]))

    def is_still(self, step: Step) -> bool:
        """Never: the levels are short, and every pose takes its own steps."""
        return False


def anneal(
    held: Surface, moving: Surface, poses: Floats, seed: int, threads: int, allowed: Allowed | None = None
) -> tuple[Floats, Floats]:
    """The best few of many poses (B, 4, 4), refined level by level, best first, and their scores."""
    poses = poses if allowed is None else allowed.nearest(poses)
    rng = np.random.default_rng(seed)
    for level in LEVELS:
        poses, _ = descend(GridStage(held, moving, level, rng, threads, allowed), poses)
        if len(poses) > 1:
            found = agreement(held, moving, poses, threads, rng.integers(0, len(moving), _SCORED)).score
            poses = poses[best_distinct(poses, found, moving.middle, _SAME, moving.voxel, level.keep)]
    found = mutual_score(*both_ways(held, moving, poses, threads))
    order = np.argsort(-found, kind="stable")
    return poses[order], found[order]


class FieldStage:
    """The last level: pseudo points on the moving surface itself, one pose, against planes of the exact other field.

    Beside the pose it knows the growth of what moves: a seventh freedom, where it is asked for.
    """

    def __init__(
        self, field: DistanceField, centre: Floats, planes: Planes, neighbours: int, reach: float, extent: float,
        deviations: float, allowed: Allowed | None = None, grows: bool = False,
    ) -> None:
        """field: the held one, whose place `centre` (3,) is the origin of the poses. planes: the moving cloud's, about
        its own origin. reach: from a pseudo point to its partner, a length. extent: of the cloud, a length.
        deviations: a residual of so many standard deviations has a quarter of the weight."""
        self.field, self.centre, self.planes, self.neighbours = field, centre, planes, neighbours
        self.reach, self.extent, self.deviations = reach, extent, deviations
        self.allowed, self.grows, self.growth = allowed, grows, 1.0
        self.resolution = _RESOLUTION * (extent + float(np.abs(centre).max()))
        self.scale = 0.0
        self.H: Floats = np.zeros((7, 7))
        self.hold: Floats = np.zeros((7, 7))
        self.scatter: Floats = np.zeros((7, 7))
        self.totals: Floats = np.zeros(4)
        self.gradient: Floats = np.zeros(7)
        self.increment: Floats = np.zeros(7)
        self.take(np.inf, 1, 0.0)

    def take(self, count: float, iterations: int, patience: float) -> FieldStage:
        """From here on with about `count` of the pseudo points, for so many steps, or until one is smaller than
        `patience` standard errors."""
        self.taken = self.planes[:: max(1, round(len(self.planes) / count))]
        self.iterations, self.patience = iterations, patience
        self.partners: Planes | None = None
        return self

    def step(self, poses: Floats) -> tuple[Floats, Step]:
        """A Gauss-Newton step; the scale of the weights is that of the residuals themselves."""
        (G,) = poses
        x, normals = self._moved(G), rotate(G[:3, :3], self.taken.normal)
        self.partners = planes_near(self.field, x + self.centre, self.neighbours, self.partners)
        # Where most of a surface lies in one plane, that plane alone would set the scale, and hide all else.
        least_scale = max(self.resolution, _LEAST_SHRINKAGE * self.scale)
        (H, g, totals), self.hold, self.scatter, self.scale = _core.robust_sums(
            x, normals, self.partners.mean - self.centre, self.partners.normal, _spread(self.taken, self.partners),
            MIN_COSINE, self.reach, self.deviations, least_scale,
        )
        self.H, self.gradient, self.totals = H[0], g[0], totals[0]
        # Far from the end the scale shrinks with the residuals, and a longer step would leap over the end for ever.
        turns_back = g[0] @ self.increment > 0
        stretch = np.ones(1) if turns_back else _core.stretch(totals)
        self.increment = np.zeros(7)
        if self.grows:
            poses = self._grown(poses, H, g, stretch)
        else:
            (self.increment[:6],), poses = take_steps(poses, H[:, :6, :6], g[:, :6], stretch, self.allowed)
        return poses, Step(self.increment[: 6 + self.grows], self.rmse, int(self.totals[3]))

    def basis(self, poses: Floats) -> Floats:
        """What the pose may do in a step, as free_twists() has it."""
        return free_twists(self.allowed, poses, self.growth if self.grows else None)

    def _grown(self, poses: Floats, H: Floats, g: Floats, stretch: Floats) -> Floats:
        """The poses (1, 4, 4) after a step of seven freedoms; what moves has grown by the seventh."""
        (step,) = minimisers(H, g, self.basis(poses)[None]) * stretch[:, None]
        self.increment = step * min(1, LARGEST_TURN / max(float(np.linalg.norm(step[:3])), abs(step[6]), LARGEST_TURN))
        moved = exp_twist(self.increment[:6]) @ poses[0]
        growth = float(np.exp(self.increment[6]))
        # The growth is about the origin of the poses; the twist undoes what it moves of the centre.
        moved[:3, 3] *= growth
        self.growth *= growth
        poses = np.asarray(moved[None])
        return poses if self.allowed is None else self.allowed.grown(self.growth).nearest(poses)

    def _moved(self, G: Floats) -> Floats:
        return apply(G, self.taken.mean if self.growth == 1 else self.growth * self.taken.mean)

    def distances(self, G: Floats) -> Floats:
        """From the pseudo points to the other surface's planes (L,); infinite where no plane nearby agrees."""
        x, normals = self._moved(G), rotate(G[:3, :3], self.taken.normal)
        partners = planes_near(self.field, x + self.centre, self.neighbours)
        away = x + self.centre - partners.mean
        is_on = (row_dot(away, away) <= self.reach**2) & (np.abs(row_dot(normals, partners.normal)) >= MIN_COSINE)
        return np.where(is_on, np.abs(row_dot(away, partners.normal)), np.inf)

    def overlap(self, G: Floats) -> Floats:
        """Centroid (3,) of the pseudo points that have a partner; of all where none has."""
        x = self._moved(G)
        assert self.partners is not None
        away = x - (self.partners.mean - self.centre)
        near = row_dot(away, away) < self.reach**2
        return np.asarray(x[near].mean(axis=0) if near.any() else x.mean(axis=0))

    @property
    def curvature(self) -> Floats:
        """Derivative (7, 7) of the gradient by a twist and a growth: H, less what the loss bends."""
        return np.asarray(self.H / _core.stretch(self.totals[None]))

    @property
    def gradient_scatter(self) -> Floats:
        """Covariance (7, 7) of the gradient: from runs of neighbouring pseudo points, and where these are few, from the
        residuals as if each were independent."""
        runs = self.totals[3] / _core.RUN
        independent = (self.rmse**2 + (1e-12 * self.extent) ** 2) / _core.stretch(self.totals[None]) ** 2 * self.H
        return np.asarray((runs * self.scatter + _FEW * independent) / (runs + _FEW))

    @property
    def roughness(self) -> float:
        """Thickness of the planes over their width, root mean square of both clouds' medians."""
        assert self.partners is not None
        ratios = [np.median(p.thickness / np.maximum(p.width, 1e-300)) for p in (self.taken, self.partners)]
        return float(np.sqrt((ratios[0] ** 2 + ratios[1] ** 2) / 2))

    @property
    def rmse(self) -> float:
        """Root of the weighted mean square of the residuals, a length."""
        return _rms(self.totals)

    def is_still(self, step: Step) -> bool:
        """Whether the step moved nothing by more than a share of what the residuals leave open."""
        moved = reach_of(step.increment, self.extent)
        open_by = step.cost / np.sqrt(max(step.kept, 1))
        return bool(moved <= max(self.patience * open_by, 1e-14 * self.extent))


def free_twists(allowed: Allowed | None, poses: Floats, growth: float | None) -> Floats:
    """What a pose (1, 4, 4) may do, in columns (7, m): twists on its left, and, unless the growth so far is None, the
    growth about the centre of the dof."""
    if allowed is None:
        return np.eye(7)[:, : 6 if growth is None else 7]
    allowed = allowed if growth is None else allowed.grown(growth)
    twists = allowed.twists(poses)[0]
    basis = np.concatenate([twists, np.zeros((1, twists.shape[1]))])
    if growth is None:
        return basis
    growing = np.r_[np.zeros(3), -allowed.centres(poses)[0], 1.0]
    return np.concatenate([basis, growing[:, None]], axis=1)


def _spread(own: Planes, other: Planes) -> Floats:
    """How widely the residual of each pair of planes scatters (L,), to a common factor.

    Both thicknesses count; the other's more where its points lie sparser, for then several residuals share its noise.
    """
    shared = np.ones(len(own.width))
    np.divide(other.width, own.width, out=shared, where=(own.width > 0) & np.isfinite(own.width + other.width))
    variance = own.thickness**2 + other.thickness**2 * np.clip(shared**2, 0.1, 10)
    typical = float(np.median(variance))
    return np.sqrt(_LEAST_SPREAD + variance / typical) if typical > 0 else np.ones(len(variance))


def _rms(totals: Floats) -> float:
    return float(np.sqrt(totals[1] / totals[0])) if totals[0] > 0 else 0.0
