"""Which cloud of a pair is held and which moves, and what their poses are in the clouds' own frames."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..dof import Allowed, Dof, allowed_poses
from ..fields.protocol import Floats, Planes
from ..lazy import lazy
from ..motions import angles_between, apply, growth, inverse, rotate, size_of, translation
from ..prepared import PreparedCloud
from ..surface import Surface

_SLACK = np.radians(2)  # beyond an angle around the guess, at which a pose may end
_LOOKED_AT = 10_000  # surfels, about, of which it is asked whether a sensor looked through them


@dataclass(frozen=True, eq=False)
class Pair:
    """Two clouds, one held and one whose pseudo points move; poses G take the moving one into the held one's frame.

    As in the paper, the source is held and the target's pseudo points move, so G is the inverse of T_target_source;
    unless the source is much smaller: a small cloud's points all find partners in a large one, not the other way round.
    Of points and a field that knows its surface exactly (a mesh, a volume), the points move: their own distances are 0.
    """

    source: PreparedCloud
    target: PreparedCloud
    voxel: float
    dof: Dof | None = None
    guess: Floats | None = None  # of T_target_source; from it the dof's motions are counted, None: from the identity
    grows: bool = False          # whether the scale is sought, too

    @property
    def is_swapped(self) -> bool:
        """Whether the target is held."""
        if self.grows and self.dof is not None:
            return True  # so that what grows is the source, about the centre in the target
        if self.source.is_points != self.target.is_points:
            return self.source.is_points
        return len(self.source.surface(self.voxel)) < 0.5 * len(self.target.surface(self.voxel))

    @property
    def held(self) -> PreparedCloud:
        """The cloud whose field is asked."""
        return self.target if self.is_swapped else self.source

    @property
    def moving(self) -> PreparedCloud:
        """The cloud whose pseudo points move."""
        return self.source if self.is_swapped else self.target

    def surfaces(self) -> tuple[Surface, Surface]:
        """Of the held and of the moving cloud."""
        return self.held.surface(self.voxel), self.moving.surface(self.voxel)

    def pseudo_planes(self, neighbours: int) -> Planes:
        """The pseudo points of the last level, on the moving surface, and the planes there."""
        return self.moving.pseudo_planes(neighbours, single=self.moving.is_points and not self.held.is_points)

    @lazy
    def allowed(self) -> Allowed | None:
        """The poses that the dof allows; None: all."""
        if self.dof is None:
            return None
        held, moving = self.surfaces()
        return allowed_poses(self.dof, self.rigid_guess, held.origin, moving.origin, self.is_swapped)

    @property
    def middle(self) -> Floats:
        """Of the moving surface (3,), about its origin."""
        return self.surfaces()[1].middle

    def motion(self, G: Floats) -> Floats:
        """The rigid motion from the source, as large as it is in this pair, to the target, of a pose between the
        surfaces' origins."""
        held, moving = self.surfaces()
        whole = translation(held.origin) @ G @ translation(-moving.origin)
        return whole if self.is_swapped else inverse(whole)

    def pose(self, motion: Floats) -> Floats:
        """The pose between the surfaces' origins of a motion from source to target."""
        held, moving = self.surfaces()
        whole = motion if self.is_swapped else inverse(motion)
        return translation(-held.origin) @ whole @ translation(moving.origin)

    def similarity(self, G: Floats, grown: float) -> Floats:
        """T_target_source of the source as it came, where what moves has grown by a factor, too."""
        held, moving = self.surfaces()
        to_held, from_moving = translation(held.origin), translation(-moving.origin)
        if self.is_swapped:
            whole = to_held @ G @ growth(grown) @ from_moving
        else:
            whole = inverse(from_moving) @ growth(1 / grown) @ inverse(G) @ inverse(to_held)
        return whole @ growth(self.source.factor)

    def seen_through(self, T: Floats) -> float | None:
        """The larger share of one cloud's surface that the other's sensor looked through, where the source is moved by
        T (4, 4); None where no sensor is known."""
        shares = []
        for seen, by, motion in ((self.source, self.target, T), (self.target, self.source, inverse(T))):
            if by.sight is not None:
                surface = seen.surface(self.voxel)
                some = slice(None, None, max(1, len(surface) // _LOOKED_AT))
                places = apply(motion, surface.places[some] + surface.origin)
                normals = rotate(motion[:3, :3], surface.normals[some])
                shares.append(float(by.sight.looked_through(places, self.voxel, normals).mean()))
        return max(shares, default=None)

    def is_within(self, angle: float, T: Floats) -> bool:
        """Whether a motion T_target_source (4, 4) turns by no more than an angle (rad) from the guess, but for some
        slack; where there is none, any does."""
        return self.guess is None or bool(angles_between(T, self.rigid_guess) <= angle + _SLACK)

    @property
    def guessed_pose(self) -> Floats | None:
        """The guess between the surfaces' origins."""
        return None if self.guess is None else self.pose(self.rigid_guess)

    @lazy
    def rigid_guess(self) -> Floats:
        """The guess, or the identity, as a motion of the source as large as it is in this pair: it turns as the guess
        does, and takes the centre of the dof, or of the source, to where the guess takes it."""
        guess = np.eye(4) if self.guess is None else self.guess
        if not self.grows:
            return guess
        size = size_of(guess)
        rigid = guess @ growth(1 / size)
        centre = self.source.centre / self.source.factor
        if self.dof is not None:
            centre = apply(inverse(rigid), self.dof.about(self.surfaces()[0].origin).frame[None, :3, 3])[0] / size
        rigid[:3, 3] += rigid[:3, :3] @ ((size - self.source.factor) * centre)
        return rigid
