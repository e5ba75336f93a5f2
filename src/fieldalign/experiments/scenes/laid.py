"""Pairs of real scans, as they lie or moved: what the experiments on scenes register."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, TypeAlias

import numpy as np
from scipy.spatial.transform import Rotation

from ...clouds.thinning import thin
from ...errors import DataSetError
from ...fields.protocol import Floats
from ...motions import Matrix, apply, exp_twist, inverse
from ..case import Case


class Pair(Protocol):
    """Two clouds with a known motion between them; see data_sets/three_d_match.py and kitti_sequences.py."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def group(self) -> str: ...  # noqa: D102
    @property
    def T_target_source(self) -> Matrix: ...  # noqa: D102
    def clouds(self) -> tuple[Matrix, Matrix]: ...  # noqa: D102


Motions: TypeAlias = Callable[[np.random.Generator, Sequence[Pair]], Iterable[Matrix]]


@dataclass(frozen=True, eq=False)
class Laid:
    """A pair whose source is moved.

    motion: (4, 4), maps the source's points to where they are given. every: of each cloud every so many-th point.
    voxel: both are thinned at this length; None: not at all.
    """

    pair: Pair
    motion: Matrix
    every: int = 1
    voxel: float | None = None

    @property
    def T_target_source(self) -> Matrix:
        """The answer."""
        return self.pair.T_target_source @ inverse(self.motion)

    def of_pair(self, T: Matrix) -> Matrix:
        """A pose of the moved source as one of the source as it lies."""
        return T @ self.motion

    def __call__(self) -> tuple[Floats, Floats]:
        """Source and target."""
        source, target = (self._fewer(cloud) for cloud in self.pair.clouds())
        return apply(self.motion, source), target

    def _fewer(self, points: Floats) -> Floats:
        points = points[:: self.every]
        return points if self.voxel is None else np.asarray(thin(points, self.voxel, threads=1).points)


def as_case(laid: Laid, draw: int) -> Case:
    """The case of a pair that is laid so. draw: of how many with this pair; it is part of the name and of the seed."""
    return Case(f"{laid.pair.name}/{draw}", laid.pair.group, laid, laid.T_target_source, seed=draw)


@dataclass(frozen=True)
class LaidCases:
    """The cases of an experiment (see Comparison.cases): pairs of a folder, each with a motion.

    pairs: pairs(folder). motions: motions(rng, pairs), one for each. every, voxel: see Laid. least: where there are
    fewer pairs, they are taken several times, all equally often, until there are so many cases or more.
    """

    pairs: Callable[[Path], Sequence[Pair]]
    motions: Motions
    every: int = 1
    voxel: float | None = None
    least: int = 1

    def __call__(self, data: Path, seed: int) -> list[Case]:
        """All cases; each draw of all pairs comes after the draw before. Raises DataSetError where there is none."""
        once = self.pairs(data)
        if not once:
            raise DataSetError(f"{data} holds clouds, but no pair of them that is as far apart as asked for")
        pairs = [*once] * -(-self.least // len(once))
        motions = self.motions(np.random.default_rng(seed), pairs)
        return [
            as_case(Laid(pair, motion, self.every, self.voxel), k // len(once))
            for k, (pair, motion) in enumerate(zip(pairs, motions, strict=True))
        ]


def as_they_lie(rng: np.random.Generator, pairs: Sequence[Pair]) -> Iterable[Matrix]:
    """No motion."""
    return [np.eye(4)] * len(pairs)


def turned(rng: np.random.Generator, pairs: Sequence[Pair]) -> Iterable[Matrix]:
    """Rotations from all of SO(3), each as likely as any other."""
    return map(_turn, Rotation.random(len(pairs), random_state=rng))


def turned_about_z(rng: np.random.Generator, pairs: Sequence[Pair]) -> Iterable[Matrix]:
    """Rotations about z, by any angle alike."""
    return (_turn(Rotation.from_rotvec([0.0, 0.0, angle])) for angle in rng.uniform(0, 2 * np.pi, len(pairs)))


def aligned_then(draw: Callable[[np.random.Generator, int], Matrix]) -> Motions:
    """Sources are laid on their targets by the truth, then moved by a drawn twist in the target's frame: the answer is
    its inverse, and the identity the guess of who knows that it is small. draw: draw(rng, count), (count, 6)."""

    def motions(rng: np.random.Generator, pairs: Sequence[Pair]) -> Iterable[Matrix]:
        twists = draw(rng, len(pairs))
        return [exp_twist(twist) @ pair.T_target_source for twist, pair in zip(twists, pairs, strict=True)]

    return motions


def _turn(rotation: Rotation) -> Matrix:
    T = np.eye(4)
    T[:3, :3] = rotation.as_matrix()
    return T
