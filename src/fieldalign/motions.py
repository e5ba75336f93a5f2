"""Rigid motions as (4, 4) matrices, and twists (w, v): rotation vector first, then translation.

SciPy's RigidTransform says the same in 100 to 200 microseconds a call; inside the solver's loop that would be more than
half of the time, so these few lines stand here, with SciPy as their oracle in the tests.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .arguments import LARGEST, as_square
from .errors import ArgumentError

Matrix = NDArray[np.float64]


def exp_twist(twist: Matrix) -> Matrix:
    """Exp of a twist (6,): the motion (4, 4) that it generates (Rodrigues' formula)."""
    return _core.exp_twist(np.ascontiguousarray(twist, float))


def log_motion(T: Matrix) -> Matrix:
    """The twist (6,) of a rigid motion (4, 4): Exp(log_motion(T)) = T, turning by at most pi."""
    return _core.log_motion(np.ascontiguousarray(T, float))


def left_jacobian_inverse(w: Matrix) -> Matrix:
    """(3, 3): by what the rotation vector w (3,) changes when Exp(w) is turned a little on its left; it is also what
    makes v of a twist (w, v) from the shift of its motion (Barfoot, State Estimation for Robotics, 7.1.3)."""
    turn = exp_twist(np.r_[w, 0.0, 0.0, 0.0])
    return np.stack([log_motion(translation(axis) @ turn)[3:] for axis in np.eye(3)], axis=1)


def inverse(T: Matrix) -> Matrix:
    """The inverse of rigid motions (..., 4, 4)."""
    back = np.swapaxes(T[..., :3, :3], -1, -2)
    inverted = np.zeros(T.shape)
    inverted[..., :3, :3] = back
    inverted[..., :3, 3] = -np.einsum("...ij,...j->...i", back, T[..., :3, 3])
    inverted[..., 3, 3] = 1
    return inverted


def angles_between(T: ArrayLike, other: ArrayLike) -> Matrix:
    """The angles (...), rad, between the rotations of motions (..., 4, 4).

    By the chord, 2 asin(|R - R_other|_F / (2 sqrt 2)): the usual arccos of the trace cannot see below 1e-8.
    """
    chord = np.linalg.norm(np.asarray(T)[..., :3, :3] - np.asarray(other)[..., :3, :3], axis=(-2, -1))
    return np.asarray(2 * np.arcsin(np.minimum(chord / np.sqrt(8), 1.0)))


def translation(offset: ArrayLike) -> Matrix:
    """The motion (4, 4) that shifts by `offset` (3,)."""
    T = np.eye(4)
    T[:3, 3] = offset
    return T


def apply(T: Matrix, points: Matrix) -> Matrix:
    """Points (N, 3) moved by T (4, 4); not by a BLAS, whose order of summing may change with its threads."""
    R, t = np.ascontiguousarray(T[:3, :3]), np.ascontiguousarray(T[:3, 3])
    return _core.transform(R, t, np.ascontiguousarray(points))


def rotate(R: Matrix, vectors: Matrix) -> Matrix:
    """Vectors (N, 3) turned by R (3, 3)."""
    return _core.transform(np.ascontiguousarray(R), np.zeros(3), np.ascontiguousarray(vectors))


def growth(factor: float) -> Matrix:
    """The similarity (4, 4) that multiplies all places by a factor."""
    return np.diag([factor, factor, factor, 1.0])


def size_of(T: Matrix) -> float:
    """By what a similarity (4, 4) multiplies lengths."""
    with np.errstate(all="ignore"):  # of what is none
        return float(np.cbrt(np.linalg.det(T[:3, :3])))


def adjoint(T: Matrix) -> Matrix:
    """Ad (6, 6) of a motion: T Exp(x) T^-1 = Exp(Ad x) for twists x = (w, v)."""
    R, t = T[:3, :3], T[:3, 3]
    Ad = np.zeros((6, 6))
    Ad[:3, :3] = Ad[3:, 3:] = R
    Ad[3:, :3] = np.cross(t, R.T).T  # [t]_x R
    return Ad


def seen_from(T: Matrix, scale: float, place: Matrix) -> Matrix:
    """Twists and growths (7, 7) after a motion x -> scale R x + t, as seen before it, where `place` (3,) is the point
    that they turn about and grow from."""
    back = T[:3, :3].T
    seen = np.zeros((7, 7))
    seen[:3, :3] = back
    seen[3:6, :3] = np.cross(place, back, axisb=0, axisc=0)
    seen[3:6, 3:6] = back / scale
    seen[3:6, 6] = -place
    seen[6, 6] = 1
    return seen


def reach_of(twist: Matrix, extent: float) -> float:
    """How far a twist (6,), or a twist and a growth (7,), moves places of a cloud of this extent about its middle, at
    most."""
    grows = float(np.abs(twist[6:]).sum())
    return float((np.linalg.norm(twist[:3]) + grows) * extent / 2 + np.linalg.norm(twist[3:6]))


def nearest_rotation(R: Matrix) -> Matrix:
    """The rotation (3, 3) nearest to R; for one that is nearly a rotation, it undoes the rounding of many products."""
    U, _, Vt = np.linalg.svd(R)
    U[:, 2] *= np.linalg.det(U) * np.linalg.det(Vt)  # no reflection
    return np.asarray(U @ Vt)


def orthonormal(T: Matrix) -> Matrix:
    """T (4, 4) with the rotation nearest to its upper left part."""
    rigid = T.copy()
    rigid[:3, :3] = nearest_rotation(T[:3, :3])
    return rigid


def best_motion(places: Matrix, onto: Matrix) -> Matrix:
    """The motion (4, 4) that lays places (n, 3) on others with the least sum of squares (Kabsch, Acta Cryst. 1976);
    about a line that all of them lie on, it turns by anything."""
    middle, onto_middle = places.mean(axis=0), onto.mean(axis=0)
    T = np.eye(4)
    T[:3, :3] = nearest_rotation(np.einsum("ni,nj->ij", onto - onto_middle, places - middle))
    T[:3, 3] = onto_middle - T[:3, :3] @ middle
    return T


def quaternions_of(R: Matrix) -> Matrix:
    """Unit quaternions (B, 4), scalar first, of rotations (B, 3, 3)."""
    xx, yy, zz = R[:, 0, 0], R[:, 1, 1], R[:, 2, 2]
    squares = np.stack([1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz], axis=1)
    x, y, z = R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]
    yz, zx, xy = R[:, 2, 1] + R[:, 1, 2], R[:, 0, 2] + R[:, 2, 0], R[:, 1, 0] + R[:, 0, 1]
    a, b, c, d = squares.T
    products = np.array([[a, x, y, z], [x, b, xy, zx], [y, xy, c, yz], [z, zx, yz, d]])  # 4 q q^T
    largest = np.argmax(squares, axis=1)
    q = products[largest, :, np.arange(len(R))]
    return np.asarray(q / np.linalg.norm(q, axis=1, keepdims=True))


def rotations_of(q: Matrix) -> Matrix:
    """Rotations (B, 3, 3) of unit quaternions (B, 4), scalar first."""
    w, v = q[:, 0], q[:, 1:]
    K = np.cross(np.eye(3), v[:, None])  # K x = v cross x
    stretch = (w**2 - (v**2).sum(axis=1))[:, None, None] * np.eye(3)
    return np.asarray(stretch + 2 * v[:, :, None] * v[:, None] + 2 * w[:, None, None] * K)


def rotation_between(a: Matrix, b: Matrix) -> Matrix:
    """The smallest rotation (3, 3) that turns the direction of a (3,) into that of b (3,)."""
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    half = a + b
    if half @ half < 1e-8:  # nearly opposite: half a turn about something across a, and what is left
        across = np.cross(a, np.eye(3)[np.argmin(np.abs(a))])
        across = across / np.linalg.norm(across)
        return np.asarray(rotation_between(-a, b) @ (2 * np.outer(across, across) - np.eye(3)))
    if a @ b < 0:  # two reflections: what follows divides by a small difference
        half = half / np.linalg.norm(half)
        return np.asarray((np.eye(3) - 2 * np.outer(half, half)) @ (np.eye(3) - 2 * np.outer(a, a)))
    K = np.cross(np.eye(3), np.cross(a, b))
    return np.asarray(np.eye(3) + K + K @ K / (1 + a @ b))


def as_similar(T: ArrayLike, name: str) -> Matrix:
    """T as a similarity (4, 4), float64: a rigid motion of places times a positive factor; raises ArgumentError."""
    matrix = _as_pose(T, name)
    size = size_of(matrix)
    if not 0 < size < LARGEST:
        return as_rigid(T, name)  # which says what is wrong
    return as_rigid(matrix @ growth(1 / size), name) @ growth(size)


def as_rigid(T: ArrayLike, name: str) -> Matrix:
    """T as a rigid motion (4, 4), float64; raises ArgumentError that names the argument where it is none."""
    matrix = _as_pose(T, name)
    if not np.allclose(matrix[3], [0, 0, 0, 1], atol=1e-9):
        raise ArgumentError(f"{name} must end in the row 0 0 0 1, but ends in {matrix[3]}")
    R = matrix[:3, :3]
    off, grown = np.abs(R @ R.T - np.eye(3)).max(), size_of(matrix)
    if off > 1e-3 or grown < 0:
        raise ArgumentError(
            f"{name} must be rigid, but its upper left 3 x 3 part is no rotation "
            f"(R R^T differs from the identity by {off:.3g}, determinant {grown**3:.3g})"
        )
    matrix[:3, :3] = nearest_rotation(R)  # a pose that was written with few digits
    matrix[3] = [0, 0, 0, 1]
    return matrix


def _as_pose(T: ArrayLike, name: str) -> Matrix:
    """A (4, 4) matrix of numbers of which none is so large that products of two overflow."""
    matrix = as_square(T, name, 4)
    if np.abs(matrix).max() > LARGEST:
        raise ArgumentError(f"{name} must hold numbers below {LARGEST:g}, but holds {np.abs(matrix).max():g}")
    return matrix
