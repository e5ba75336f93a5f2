"""Poses that agree best with all the relative poses between them: Gauss-Newton on a sparse graph.

A pose T_world_scan (4, 4) is perturbed on its right, T Exp(x), so that no step depends on where the world's origin
lies. SciPy's sparse LU solves each step: kept up, everywhere, and quick enough for some ten thousand scans; what is
special to scans (whom to believe) is not the solver's business.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..dof import Allowed
from ..fields.protocol import Floats
from ..motions import adjoint, exp_twist, inverse, left_jacobian_inverse, log_motion, orthonormal, reach_of, translation

_ITERATIONS = 50
_STILL = 1e-10   # of the lever: a step that moves no scan further is the last
_DOUBT = 5.0     # standard deviations of an edge's error at which it counts half


@dataclass(frozen=True, eq=False)
class Edge:
    """What is known of two scans: T_ij (4, 4) maps scan j into the frame of scan i; information (6, 6) of a twist
    (w, v) on its left, about `reference` (3,), in the frame of scan i. strength: of the evidence for it."""

    i: int
    j: int
    T_ij: Floats
    information: Floats
    reference: Floats
    strength: float = 1.0

    def error(self, poses: Floats) -> Floats:
        """The twist (6,), about the reference, by which the poses (n, 4, 4) differ from what the edge says."""
        return self.error_of(inverse(poses[self.i]) @ poses[self.j])

    def error_of(self, T_ij: Floats) -> Floats:
        """The same for a relative pose (4, 4)."""
        to_reference = translation(-self.reference)
        return log_motion(to_reference @ T_ij @ inverse(self.T_ij) @ inverse(to_reference))

    def jacobians(self, poses: Floats) -> tuple[Floats, Floats]:
        """Derivatives (6, 6) of the error by the perturbations of pose i and of pose j, where the error is small."""
        to_reference = translation(-self.reference)
        T_ij = inverse(poses[self.i]) @ poses[self.j]
        return -adjoint(to_reference), adjoint(to_reference @ T_ij)


class NormalEquations:
    """H and g of the perturbations of all poses, added up from terms of one or two of them."""

    def __init__(self, poses: Floats, fixed: Sequence[int], allowed: Allowed | None) -> None:
        self._poses = poses
        self._bases = np.tile(np.eye(6), (len(poses), 1, 1))
        if allowed is not None:  # on the left of a pose; on its right they are seen from the scan
            seen_from_scan = np.stack([adjoint(T) for T in inverse(poses)])
            self._bases = seen_from_scan @ allowed.twists(poses)
        self._bases[list(fixed)] = 0
        self._g = np.zeros((len(poses), 6))
        self._blocks: list[tuple[int, int, Floats]] = []

    def add(self, jacobians: dict[int, Floats], H: Floats, g: Floats) -> None:
        """A term 1/2 e^T H e + g^T e of e = sum A_k x_k; jacobians: A_k (6, 6) by pose."""
        seen = {k: A @ self._bases[k] for k, A in jacobians.items()}
        for k, A in seen.items():
            self._g[k] += A.T @ g
            self._blocks += [(k, m, A.T @ H @ B) for m, B in seen.items()]

    def step(self) -> Floats:
        """The perturbations (n, 6) that minimise the sum of all terms."""
        y = self._factor().solve(-self._g.ravel()).reshape(-1, 6)
        return np.asarray(np.einsum("kab,kb->ka", self._bases, y))

    def covariances(self) -> Floats:
        """Covariance (n, 6, 6) of each pose's perturbation, if H is the information of them all."""
        factor, n = self._factor(), len(self._bases)
        blocks = np.zeros((n, 6, 6))
        for k in range(n):
            columns = np.zeros((6 * n, 6))
            columns[6 * k : 6 * k + 6] = np.eye(6)
            blocks[k] = factor.solve(columns)[6 * k : 6 * k + 6]
        free = np.einsum("kab->kb", np.abs(self._bases)) > 0
        blocks *= free[:, :, None] * free[:, None]  # what is not free has a pivot of its own
        return _no_less_than_nothing(self._bases @ blocks @ np.swapaxes(self._bases, 1, 2))

    def _factor(self) -> Any:
        from scipy.sparse import csc_matrix, diags
        from scipy.sparse.linalg import splu

        size = 6 * len(self._bases)
        rows = np.array([6 * k for k, _, _ in self._blocks], int)[:, None, None] + np.arange(6)[:, None]
        columns = np.array([6 * m for _, m, _ in self._blocks], int)[:, None, None] + np.arange(6)
        rows, columns = np.broadcast_arrays(rows, columns)
        values = np.stack([block for _, _, block in self._blocks])
        H: Any = csc_matrix((values.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size))
        pivots = np.where(H.diagonal() > 0, 0.0, 1.0)  # of what is not free
        return splu(csc_matrix(H + diags(pivots)))


def _no_less_than_nothing(covariances: Floats) -> Floats:
    """Covariances (n, 6, 6) without the rounding that makes the least of their variances negative."""
    variances, axes = np.linalg.eigh((covariances + np.swapaxes(covariances, 1, 2)) / 2)
    return np.asarray(axes * np.maximum(variances, 0)[:, None] @ np.swapaxes(axes, 1, 2))


@dataclass(frozen=True, eq=False)
class Anchors:
    """What holds poses in the world. fixed: rows of those that do not move. priors: by row, a pose (4, 4) and the
    information (6, 6) of the turn from it and of the shift, both in its own frame. allowed: what the dof leaves free,
    or None."""

    fixed: Sequence[int]
    priors: Mapping[int, tuple[Floats, Floats]] = field(default_factory=dict)
    allowed: Allowed | None = None

    def system(self, poses: Floats) -> NormalEquations:
        """The normal equations about some poses, with the terms of the priors."""
        system = NormalEquations(poses, self.fixed, self.allowed)
        for k, (pose, information) in self.priors.items():
            error, jacobian = _off(inverse(pose) @ poses[k])
            system.add({k: jacobian}, information, information @ error)
        return system

    def moved(self, poses: Floats, step: Floats) -> Floats:
        """Poses (n, 4, 4) after perturbations (n, 6)."""
        poses = np.stack([orthonormal(T @ exp_twist(x)) for T, x in zip(poses, step, strict=True)])
        return poses if self.allowed is None else self.allowed.nearest(poses)


def _off(T: Floats) -> tuple[Floats, Floats]:
    """The rotation vector and the shift (6,) of a motion (4, 4), and how a perturbation on its right changes them.

    Not a twist, whose shift grows with the turn: a place that is known says nothing of the turn.
    """
    w = log_motion(T)[:3]
    jacobian = np.zeros((6, 6))
    jacobian[:3, :3] = left_jacobian_inverse(w).T  # on the right: of -w
    jacobian[3:, 3:] = T[:3, :3]
    return np.r_[w, T[:3, 3]], jacobian


def optimise(poses: Floats, edges: Sequence[Edge], anchors: Anchors) -> Floats:
    """The poses (n, 4, 4) that agree best with the edges, from some that are near.

    An edge that is many standard deviations off counts little (Geman & McClure).
    """
    lever = max(float(np.abs(edge.reference).max()) for edge in edges) + 1e-300
    for _ in range(_ITERATIONS):
        step = linearised(poses, edges, anchors).step()
        poses = anchors.moved(poses, step)
        if max(reach_of(x, 2 * lever) for x in step) < _STILL * lever:
            break
    return poses


def doubt(chi_squared: float) -> float:
    """The weight of an edge whose error, squared, is so many variances."""
    return float((1 + chi_squared / (6 * _DOUBT**2)) ** -2)


def linearised(poses: Floats, edges: Sequence[Edge], anchors: Anchors) -> NormalEquations:
    """All that edges and priors say of perturbations of the poses (n, 4, 4)."""
    system = anchors.system(poses)
    for edge in edges:
        error, (A_i, A_j) = edge.error(poses), edge.jacobians(poses)
        H = doubt(float(error @ edge.information @ error)) * edge.information
        system.add({edge.i: A_i, edge.j: A_j}, H, H @ error)
    return system
