"""The loop of every alignment: linearise at the pose, take the step, until it is still (paper Fig. 3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from ..fields.protocol import Floats


@dataclass(frozen=True, eq=False)
class Step:
    """One iteration: its increment (6,), the mean |residual| (squared unit in the paper's method, else unit), how many
    pseudo points were kept."""

    increment: Floats
    cost: float
    kept: int


class Stage(Protocol):
    """What differs between methods: residual, truncation and weights in `step`, the schedule in the rest."""

    iterations: int

    def step(self, poses: Floats) -> tuple[Floats, Step]:
        """Poses (B, 4, 4) after one Gauss-Newton step each, and what it was for the first."""
        ...

    def is_still(self, step: Step) -> bool:
        """Whether the step was too small to go on."""
        ...


def descend(stage: Stage, poses: Floats) -> tuple[Floats, tuple[Step, ...]]:
    """Poses (B, 4, 4) of the pseudo points after as many steps as the stage wants, and the steps of the first."""
    steps: list[Step] = []
    for _ in range(stage.iterations):
        poses, step = stage.step(poses)
        steps.append(step)
        if stage.is_still(step):
            break
    return poses, tuple(steps)
