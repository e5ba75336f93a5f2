"""Which cloud of a pair is held and which moves, and what their poses are in the clouds' own frames."""

from __future__ import annotations

from dataclasses import dataclass

from ..fields.protocol import Floats
from ..motions import inverse, translation
from ..prepared import PreparedCloud
from ..surface import Surface


@dataclass(frozen=True, eq=False)
class Pair:
    """Two clouds, one held and one whose pseudo points move; poses G take the moving one into the held one's frame.

    As in the paper, the source is held and the target's pseudo points move, so G is the inverse of T_target_source;
    unless the source is much smaller: a small cloud's points all find partners in a large one, not the other way round.
    """

    source: PreparedCloud
    target: PreparedCloud
    voxel: float

    @property
    def is_swapped(self) -> bool:
        """Whether the target is held."""
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

    @property
    def middle(self) -> Floats:
        """Of the moving surface (3,), about its origin."""
        return self.surfaces()[1].middle

    def motion(self, G: Floats) -> Floats:
        """T_target_source of a pose between the surfaces' origins."""
        held, moving = self.surfaces()
        whole = translation(held.origin) @ G @ translation(-moving.origin)
        return whole if self.is_swapped else inverse(whole)

    def pose(self, T_target_source: Floats) -> Floats:
        """The pose between the surfaces' origins of a T_target_source."""
        held, moving = self.surfaces()
        whole = T_target_source if self.is_swapped else inverse(T_target_source)
        return translation(-held.origin) @ whole @ translation(moving.origin)
