"""Scans in the coordinates of a map lie far from the origin of their frame: within, each is seen from a place nearby.

A pose over a distance d is known to the rounding of d, 2^-52 of it; products and inverses of such poses add up many,
where the least of them, twice this, is all that must be lost.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..fields.protocol import Floats
from ..motions import adjoint
from .pair_result import PairResult
from .world import Given

Told = tuple[int, int, PairResult]


class Origins:
    """What is known of scans as seen from their origins (n, 3), told in their own frames. given: as the caller gave
    it."""

    def __init__(self, origins: Floats, given: Given) -> None:
        self._given = given
        self._there = np.tile(np.eye(4), (len(origins), 1, 1))  # own frame from what is seen from the origin
        self._there[:, :3, 3] = origins
        self._back = self._there.copy()
        self._back[:, :3, 3] = -origins

    def world(self, members: Sequence[int]) -> Floats:
        """What takes the frame of a component into its world (4, 4): that of given poses, or its first scan's own."""
        has_given = any(self._given.poses[k] is not None for k in members)
        return np.eye(4) if has_given else self._there[members[0]]

    def poses(self, poses: Sequence[Floats | None]) -> list[Floats | None]:
        """world_from_cloud (4, 4) of each scan; of those that are fixed, to the last bit."""
        told = [None if T is None else T @ back for T, back in zip(poses, self._back, strict=True)]
        return [self._given.poses[k] if k in self._given.fixed and T is not None else T for k, T in enumerate(told)]

    def covariances(self, covariances: Sequence[Floats | None]) -> list[Floats | None]:
        """(6, 6) of each, on the right of its pose."""
        moved = [adjoint(there) for there in self._there]
        return [None if C is None else Ad @ C @ Ad.T for C, Ad in zip(covariances, moved, strict=True)]

    def pairs(self, told: Sequence[Told]) -> list[Told]:
        """Pairs (i, j, result), where T maps cloud j into the frame of cloud i."""
        return [(i, j, self._told(i, j, result)) for i, j, result in told]

    def _told(self, i: int, j: int, result: PairResult) -> PairResult:
        T = self._there[i] @ result.T_target_source @ self._back[j]
        return replace(result, T_target_source=T, reference_point=result.reference_point + self._there[i, :3, 3])
