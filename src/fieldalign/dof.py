"""Which motions are allowed: some of the six freedoms, in the target's axes or about a given axis."""

from __future__ import annotations

import copy
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .arguments import as_vector
from .errors import ArgumentError
from .fields.protocol import Floats
from .motions import adjoint, inverse, quaternions_of, rotation_between, rotations_of, translation

NAMES = ("rx", "ry", "rz", "x", "y", "z")
WORDS = {
    "yaw": ("rz",),
    "planar": ("rz", "x", "y"),
    "levelled": ("rz", "x", "y", "z"),
    "rotation": ("rx", "ry", "rz"),
    "translation": ("x", "y", "z"),
}


@dataclass(frozen=True, eq=False)
class Dof:
    """Some of the six freedoms of T_target_source, counted from the guess, or from the identity where there is none.

    free: any of "rx", "ry", "rz" (turns about the axes) and "x", "y", "z" (shifts along them), as one string or
        several, or a word for some: "yaw" (rz), "planar" (rz x y), "levelled" (rz x y z), "rotation", "translation".
    axis: (3,), in the target's frame: then rz turns about it, z shifts along it, and x and y shift across it; None: the
        axes are the target's own.
    centre: (3,), in the target's frame: the place about which turns are counted; None: the origin.

    What is allowed, exactly: the motion since the guess shifts the centre along free axes only, and turns by a rotation
    vector made of free axes only.

    Raises ArgumentError for names that are none, no name at all, and an axis or a centre that is no vector.
    """

    free: str | Iterable[str]
    axis: ArrayLike | None = None
    centre: ArrayLike | None = None

    def __post_init__(self) -> None:
        given = self.free
        if isinstance(given, str):
            given = given.replace(",", " ").split()
        try:
            words = list(given)
        except TypeError:
            words = []
        names = [name for word in words for name in (WORDS.get(word, (word,)) if isinstance(word, str) else (None,))]
        if not names or any(name not in NAMES for name in names):
            allowed = ", ".join((*NAMES, *WORDS))
            raise ArgumentError(f"dof must name freedoms among {allowed}, but is {self.free!r}")
        axis = None if self.axis is None else as_vector(self.axis, "axis of dof")
        if axis is not None and not axis.any():
            raise ArgumentError("axis of dof must have a direction, but is (0, 0, 0)")
        centre = np.zeros(3) if self.centre is None else as_vector(self.centre, "centre of dof")
        for name, value in (("free", tuple(n for n in NAMES if n in names)), ("axis", axis), ("centre", centre)):
            object.__setattr__(self, name, value)

    @property
    def frame(self) -> Floats:
        """The frame whose axes are meant, target_from_frame (4, 4)."""
        T = np.eye(4)
        if self.axis is not None:
            T[:3, :3] = rotation_between(np.array([0.0, 0.0, 1.0]), np.asarray(self.axis))
        T[:3, 3] = self.centre
        return T

    def about(self, place: Floats) -> Dof:
        """The same freedoms about a place (3,) of the target, where the centre makes no difference: without turns, or
        with one, and shifts across its axis. So a centre that is far away, as the origin of UTM is, loses no digits."""
        return Dof(self.free, self.axis, place) if self.is_anywhere else self

    def between(self, guess: Floats, place: Floats, onto: Floats) -> Floats:
        """The guess (4, 4), shifted so that it lays a place (3,) of the source on one of the target as far as shifts
        are free, where that makes no difference to what is allowed: no motion from there is long then."""
        if not self.is_anywhere:
            return guess
        axes = self.frame[:3, :3]
        way = onto - (guess[:3, :3] @ place + guess[:3, 3])
        return translation(axes @ (self.mask[3:] * (axes.T @ way))) @ guess

    @property
    def is_anywhere(self) -> bool:
        """Whether the centre makes no difference: there are no turns, or one, and shifts across its axis are free."""
        turns, shifts = self.mask[:3], self.mask[3:]
        return bool(turns.sum() <= 1 and (not turns.any() or shifts[turns == 0].all()))

    @property
    def mask(self) -> Floats:
        """1 for each freedom (6,) that is free, in the order of NAMES, else 0."""
        return np.array([float(name in self.free) for name in NAMES])


def as_dof(dof: Dof | str | Iterable[str] | None) -> Dof | None:
    """Dof of what a caller says; None where all six are free. Raises ArgumentError for what says nothing."""
    if dof is None or isinstance(dof, Dof):
        chosen = dof
    elif isinstance(dof, Iterable):
        chosen = Dof(dof)
    else:
        raise ArgumentError(f"dof must be names of freedoms, or fa.Dof(names, axis, centre), but is {dof!r}")
    return None if chosen is not None and chosen.mask.all() else chosen


class Allowed:
    """The allowed poses G (4, 4) of a pair, whose motion since the guess is D = L G R, or the inverse of that.

    D is in the frame of the dof, its centre the origin. As a quaternion and a shift, D has zeros where it is not free:
    the nearest such motion is D with these parts set to zero, and the quaternion's length to one.
    """

    def __init__(self, dof: Dof, left: Floats, right: Floats, inverted: bool) -> None:
        self.turns, self.shifts = dof.mask[:3], dof.mask[3:]
        self.left, self.right, self.inverted = left, right, inverted

    def grown(self, growth: float) -> Allowed:
        """The same for what moves, `growth` times as large."""
        assert not self.inverted
        other = copy.copy(self)
        other.right = self.right.copy()
        other.right[:3, 3] *= growth
        return other

    @property
    def packed(self) -> tuple[Floats, bool, Floats]:
        """As the core takes it."""
        return np.stack([self.left, self.right]), self.inverted, np.r_[self.turns, self.shifts]

    def nearest(self, poses: Floats) -> Floats:
        """The allowed poses (B, 4, 4) nearest to any."""
        D = self._motions(poses)
        q = quaternions_of(D[:, :3, :3]) * np.r_[1, self.turns]
        length = np.linalg.norm(q, axis=1, keepdims=True)
        D[:, :3, :3] = rotations_of(np.where(length > 0, q / np.maximum(length, 1e-300), [1.0, 0, 0, 0]))
        D[:, :3, 3] *= self.shifts
        return np.asarray(inverse(self.left) @ (inverse(D) if self.inverted else D) @ inverse(self.right))

    def twists(self, poses: Floats) -> Floats:
        """For each allowed pose (B, 4, 4) a matrix (6, 6) whose columns are the allowed twists on its left, turns
        first; the column of what is not free is zero."""
        D = self._motions(poses)
        columns = np.zeros((len(D), 6, 6))
        columns[:, :3, :3] = _tangents(quaternions_of(D[:, :3, :3]), self.turns)
        # The turns are about the centre where it is now, D's shift: they leave it there.
        columns[:, 3:, :3] = np.cross(D[:, None, :3, 3], columns[:, :3, :3], axisb=1, axisc=1)
        columns[:, 3:, 3:] = np.diag(self.shifts)
        return np.asarray(np.stack([adjoint(T) for T in self._undone(D)]) @ columns)

    def centres(self, poses: Floats) -> Floats:
        """Where the poses (B, 4, 4) lay the centre, (B, 3): it is seen from where the poses lead to."""
        D = self._motions(poses)
        at = np.einsum("bij,bj->bi", self._undone(D), np.c_[D[:, :3, 3], np.ones(len(D))])
        return np.asarray(at[:, :3])

    def _undone(self, D: Floats) -> Floats:
        """What takes twists on the left of D (B, 4, 4) to the left of the poses."""
        return inverse(self.left) @ inverse(D) if self.inverted else np.broadcast_to(inverse(self.left), D.shape)

    def _motions(self, poses: Floats) -> Floats:
        E = self.left @ poses @ self.right
        return inverse(E) if self.inverted else E


def allowed_poses(
    dof: Dof, guess: Floats | None, held: Floats, moving: Floats, target_is_held: bool
) -> Allowed:
    """The allowed among poses that take one cloud's frame, moved so that `moving` (3,) is its origin, into the other's,
    whose origin is then `held` (3,). guess: T_target_source (4, 4), None: the identity."""
    source, target = (moving, held) if target_is_held else (held, moving)
    frame = dof.about(target).frame
    guess = dof.between(np.eye(4) if guess is None else guess, source, target)
    left, right = translation(held), translation(-moving)
    if target_is_held:
        return Allowed(dof, inverse(frame) @ left, right @ inverse(guess) @ frame, inverted=False)
    return Allowed(dof, inverse(frame) @ guess @ left, right @ frame, inverted=True)


class Remaining(Allowed):
    """Poses that only some twists lead to, within what a dof allows, if there is one.

    basis: (6, k), these twists, on the left of the poses.
    """

    def __init__(self, basis: Floats, among: Allowed | None) -> None:
        self.basis, self.among = basis, among

    def nearest(self, poses: Floats) -> Floats:
        """The allowed poses (B, 4, 4) nearest to any."""
        return poses if self.among is None else self.among.nearest(poses)

    def twists(self, poses: Floats) -> Floats:
        """The basis (B, 6, k), for each pose the same."""
        return np.broadcast_to(self.basis, (len(poses), *self.basis.shape))


def _tangents(q: Floats, turns: Floats) -> Floats:
    """Rotation vectors (B, 3, 3), in columns, that keep zero what is zero in unit quaternions q (B, 4): directions
    across q among those with these zeros; zero columns for the other turns."""
    free = np.flatnonzero(np.r_[1, turns])
    r = q[:, free]
    v = r + np.where(r[:, :1] < 0, -1.0, 1.0) * np.eye(len(free))[0]  # the reflection that takes q to the first axis
    across = np.eye(len(free)) - 2 * v[:, :, None] * v[:, None] / (v**2).sum(axis=1)[:, None, None]
    dq = np.zeros((len(q), 4, 4))
    dq[:, free[:, None], free] = across
    # The vector part of 2 dq q^*.
    w, u = q[:, 0, None, None], q[:, 1:, None]
    return np.asarray(2 * (w * dq[:, 1:, 1:] - u * dq[:, :1, 1:] - np.cross(dq[:, 1:, 1:], u, axis=1)))
