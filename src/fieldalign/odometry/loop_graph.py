"""What loops tell of a drive: the keyframes' poses that agree best with them and with the way from each to the next.

The odometry's errors are taken to add up like independent ones, each of the size that the step's covariance states, but
for one factor on all of them, which the loops tell: the drift that they close.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from ..assembly.pose_graph import Anchors, Edge, linearised, optimise
from ..fields.protocol import Floats
from ..motions import adjoint, exp_twist, inverse, log_motion, translation

_LEAST = 1e-12       # of the largest variance of a step: none is less
_SIGNIFICANT = 16.8  # chi squared of 6 degrees of freedom: one loop in a hundred is as far off by its own error alone


@dataclass(frozen=True, eq=False)
class Chain:
    """Keyframes' poses (n, 4, 4), and covariances (n - 1, 6, 6) of the way from each to the next: about the later one's
    place, in the world's axes."""

    poses: Floats
    covariances: Floats

    def edges(self, factor: float) -> list[Edge]:
        """What the odometry says of each keyframe and the next; its variances times a factor."""
        relative = inverse(self.poses[:-1]) @ self.poses[1:]
        return [
            Edge(i, i + 1, T, np.asarray(np.linalg.inv(factor * _turned(C, self.poses[i].T)), float), T[:3, 3])
            for i, (T, C) in enumerate(zip(relative, self.covariances, strict=True))
        ]

    def between(self, i: int, j: int, place: Floats) -> Floats:
        """Covariance (6, 6) of the way from keyframe i to j > i, about a place (3,), in the world's axes."""
        moved = [adjoint(translation(p - place)) for p in self.poses[i + 1 : j + 1, :3, 3]]
        return np.asarray(sum(A @ C @ A.T for A, C in zip(moved, self.covariances[i:j], strict=True)))

    def odds(self, loop: Edge) -> float:
        """Chi squared over 6 of how far a loop finds the chain off, by the covariance of the way between."""
        place = self.poses[loop.i, :3, :3] @ loop.reference + self.poses[loop.i, :3, 3]
        C = _turned(self.between(loop.i, loop.j, place), self.poses[loop.i].T)
        error = loop.error(self.poses)
        return float(error @ np.linalg.solve(C + np.linalg.inv(loop.information), error)) / 6


def chain_of(poses: Floats, rows: Sequence[int], covariances: Floats) -> Chain:
    """Of keyframes at some poses (k, 4, 4), which are rows of all frames; the covariances (n, 6, 6) of these add up."""
    added = np.array([covariances[a + 1 : b + 1].sum(axis=0) for a, b in pairwise(rows)])
    largest = np.array([[C[:3, :3].diagonal().max()] * 3 + [C[3:, 3:].diagonal().max()] * 3 for C in added])
    floor = _LEAST * np.where(largest > 0, largest, 1.0)
    return Chain(poses, added + floor[:, :, None] * np.eye(6))


def closed(chain: Chain, loops: Sequence[Edge]) -> tuple[Floats, Floats] | None:
    """The poses (n, 4, 4) with the loops closed, and their covariances (n, 6, 6), in the world's axes about each place;
    None where nothing is to be mended.

    That is where no loop is farther off than its own error lets it be, or where loops that were left out are not met
    better after the others were closed.
    """
    off = [_chi_squared(loop, chain.poses) for loop in loops]
    if not off or max(off) < _SIGNIFICANT or not _are_met(chain, loops):
        return None
    poses, edges = _settled(chain, loops)
    found = linearised(poses, edges, Anchors([0])).covariances()
    return poses, np.stack([_turned(C, T) for C, T in zip(found, poses, strict=True)])


def _settled(chain: Chain, loops: Sequence[Edge]) -> tuple[Floats, list[Edge]]:
    factor = max(float(np.median([chain.odds(loop) for loop in loops])), 1e-6)
    edges = chain.edges(factor) + list(loops)
    return optimise(chain.poses, edges, Anchors([0])), edges


def _are_met(chain: Chain, loops: Sequence[Edge]) -> bool:
    """Whether half of the loops are met better than before when the others are closed, either way round."""
    if len(loops) < 2:
        return True
    before = after = 0.0
    for part in (0, 1):
        poses, _ = _settled(chain, loops[part::2])
        left_out = loops[1 - part :: 2]
        before += float(np.median([_chi_squared(loop, chain.poses) for loop in left_out]))
        after += float(np.median([_chi_squared(loop, poses) for loop in left_out]))
    return after < before


def _chi_squared(edge: Edge, poses: Floats) -> float:
    error = edge.error(poses)
    return float(error @ edge.information @ error)


def _turned(covariance: Floats, pose: Any) -> Floats:
    """A covariance (6, 6) in axes turned by the rotation of a pose (4, 4)."""
    R = np.zeros((6, 6))
    R[:3, :3] = R[3:, 3:] = pose[:3, :3]
    return R @ covariance @ R.T


def between_keyframes(poses: Floats, rows: Sequence[int], corrections: Floats) -> Floats:
    """All poses (n, 4, 4) after those of some rows were corrected by motions (k, 4, 4) of the world: what the next
    correction changes is spread evenly over the way to it; before the first and after the last they stay the same."""
    new = np.array(poses)
    new[: rows[0]] = corrections[0] @ poses[: rows[0]]
    new[rows[-1] :] = corrections[-1] @ poses[rows[-1] :]
    for (begin, end), C, D in zip(pairwise(rows), corrections[:-1], corrections[1:], strict=True):
        bend = log_motion(inverse(C @ poses[end]) @ D @ poses[end])
        for f in range(begin, end):
            new[f] = C @ poses[f] @ exp_twist(bend * ((f - begin) / (end - begin)))
    return new
