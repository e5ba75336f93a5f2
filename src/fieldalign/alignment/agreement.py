"""How well surfaces agree in some poses, and which poses differ."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..fields.protocol import Floats
from ..motions import inverse
from ..surface import Surface
from .residual import row_dot

MIN_COSINE = 0.8  # between normals that agree


@dataclass(frozen=True, eq=False)
class Agreement:
    """How the moving surfels lie on the held surface, for each pose (B,), as shares of all of them.

    agreeing, met: of the surfels' weights: those that agree, by how well, and those near the other surface at all,
    agreeing or not. on: of their number, within a voxel of the other surface.
    """

    agreeing: Floats
    met: Floats
    on: Floats

    def of(self, k: int) -> Agreement:
        """That of one pose."""
        return Agreement(self.agreeing[k : k + 1], self.met[k : k + 1], self.on[k : k + 1])

    @property
    def score(self) -> Floats:
        """0 to 1: the agreeing share, times the agreeing share of those that meet the other surface at all.

        Planes that slide over planes agree widely, but contradict each other widely too.
        """
        return self.agreeing * self.purity

    @property
    def purity(self) -> Floats:
        """The agreeing share of what meets the other surface, 0 to 1."""
        return np.asarray(self.agreeing / np.maximum(self.met, 1e-12))


def agreement(
    held: Surface, moving: Surface, poses: Floats, threads: int, rows: NDArray[np.int64] | slice = slice(None)
) -> Agreement:
    """The moving surfels, or some rows of them, on the held surface, for poses (B, 4, 4)."""
    voxel = max(held.voxel, moving.voxel)
    places, normals, weights = moving.places[rows], moving.normals[rows], moving.weights[rows]
    shares = held.coarse_grid.agreement(
        places, normals, weights / weights.sum(), np.ascontiguousarray(poses), voxel, MIN_COSINE, 3 * voxel,
        held.faces(moving), threads,
    )
    return Agreement(*shares.T)


def both_ways(held: Surface, moving: Surface, poses: Floats, threads: int) -> tuple[Agreement, Agreement]:
    """The moving surface on the held one, for poses (B, 4, 4), and the held one on the moving one."""
    back = np.stack([inverse(G) for G in poses])
    return agreement(held, moving, poses, threads), agreement(moving, held, back, threads)


def mutual_score(there: Agreement, back: Agreement) -> Floats:
    """The geometric mean of the scores of both ways (B,)."""
    return np.asarray(np.sqrt(there.score * back.score))


@dataclass(frozen=True)
class Apart:
    """Poses differ where they turn by an angle of less than this cosine, or are so many voxels apart."""

    cosine: float
    voxels: float

    def differ(self, poses: Floats, G: Floats, middle: Floats, voxel: float) -> NDArray[np.bool_]:
        """Which of the poses (B, 4, 4) differ from G, seen from the middle (3,) of what they move."""
        cosines = (np.einsum("bij,ij->b", poses[:, :3, :3], G[:3, :3]) - 1) / 2
        shifts = poses[:, :3, 3] - G[:3, 3] + (poses[:, :3, :3] - G[:3, :3]) @ middle
        return np.asarray((cosines < self.cosine) | (row_dot(shifts, shifts) > (self.voxels * voxel) ** 2))


def best_distinct(
    poses: Floats, found: Floats, middle: Floats, apart: Apart, voxel: float, count: int
) -> list[int]:
    """The rows of the best poses (B, 4, 4), best first, without those that do not differ from a better one."""
    chosen: list[int] = []
    for k in np.argsort(-found, kind="stable"):
        if apart.differ(poses[chosen], poses[k], middle, voxel).all():
            chosen.append(int(k))
        if len(chosen) == count:
            break
    return chosen
