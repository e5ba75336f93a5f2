"""One registration with a known answer."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias, TypeVar

import numpy as np

from ..fields.protocol import Floats
from ..motions import Matrix, apply

Clouds: TypeAlias = Callable[[], tuple[Floats, Floats]]


@dataclass(frozen=True, eq=False)
class Case:
    """One registration with a known answer.

    name: unlike any other's of the experiment. group: what it is summed up with (a category, a scene, a noise level).
    clouds: gives source and target, (N, 3) and (M, 3), the same ones each time; pickles, since it is called where the
        work is.
    T_target_source: (4, 4), the answer. T_guess: (4, 4), what is known beforehand.
    seed: joins the experiment's, so that cases of one pair do not share their pseudo points.
    shape: gives points (K, 3) of the shape itself in the source's frame, where it may be like itself when it is turned:
        errors are then given modulo that, too. None: it is not. Pickles.
    """

    name: str
    group: str
    clouds: Clouds
    T_target_source: Matrix
    T_guess: Matrix = field(default_factory=lambda: np.eye(4))
    shape: Callable[[], Floats] | None = None
    seed: int = 0


@dataclass(frozen=True, eq=False)
class Moved:
    """A cloud, and the same points moved by T (4, 4); the cloud is the source."""

    points: Callable[[], Floats]
    T: Matrix

    def __call__(self) -> tuple[Floats, Floats]:
        """Source and target."""
        source = self.points()
        return source, apply(self.T, source)


Item = TypeVar("Item")


def spread(items: Sequence[Item], limit: int | None) -> list[Item]:
    """At most so many of the items, evenly spread; None: all."""
    if limit is None or limit >= len(items):
        return list(items)
    return [items[k * len(items) // limit] for k in range(limit)]
