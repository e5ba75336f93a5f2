"""The paper's method: two fixed fields, and pseudo points that move between them (Fig. 3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..dof import Allowed
from ..fields import DistanceField, FieldSample, sampled
from ..fields.protocol import Floats
from ..motions import apply, exp_twist, inverse, nearest_rotation, translation
from ..settings import Settings
from .residual import jacobian, residual
from .solver import Step, descend
from .truncation import Mask, truncate
from .weights import linear_step


@dataclass(frozen=True, eq=False)
class Alignment:
    """Where the loop ended: the motion, each iteration, and what the last one saw of the source's field."""

    T_target_source: Floats
    steps: tuple[Step, ...]
    at_source: FieldSample
    kept: Mask
    strict: bool  # the kept ones passed truncation without its rules being relaxed
    weights: Floats


class PaperStage:
    """The paper's iteration on one pose G^-1, which takes the target's frame into the source's, both centred."""

    def __init__(
        self, source: DistanceField, centre: Floats, at_target: FieldSample, P_a: Floats, settings: Settings,
        allowed: Allowed | None = None,
    ):
        self.source, self.centre, self.at_target, self.P_a, self.settings = source, centre, at_target, P_a, settings
        self.iterations, self.allowed = settings.max_iterations, allowed
        self.weights = np.full(len(P_a), settings.unit**-2)  # 1 in the settings' unit: no other unit changes a bit
        self.at_source: FieldSample | None = None
        self.kept: Mask = np.ones(len(P_a), bool)
        self.strict = True

    def step(self, poses: Floats) -> tuple[Floats, Step]:
        """One iteration of Fig. 3."""
        (G_inv,) = poses
        x = apply(G_inv, self.P_a)                                             # G^-1(xi_) P_a
        self.at_source = sampled(self.source, x + self.centre, self.at_source)  # phi(P_S, G^-1(xi_) P_a), eq. (9)
        r = residual(self.at_source, self.at_target)                           # eq. (11)
        kept, strict = truncate(self.at_source, self.at_target, G_inv[:3, :3], self.settings)  # Sec. IV-D
        J, r = jacobian(self.at_source, x)[kept], r[kept]                      # eq. (14), (15)
        if self.allowed is not None:
            free = self.allowed.twists(poses)[0]
            J = np.einsum("la,ab->lb", J, free)  # not by a BLAS, whose order of summing may change with its threads
        dx, self.weights[kept] = linear_step(J, r, self.weights[kept], self.settings)  # eq. (16), Sec. IV-C
        self.kept, self.strict = kept, strict
        dx = dx if self.allowed is None else free @ dx
        poses = (exp_twist(dx) @ G_inv)[None]
        return poses if self.allowed is None else self.allowed.nearest(poses), Step(dx, float(np.abs(r).mean()), len(r))

    def is_still(self, step: Step) -> bool:
        """Whether the increment is smaller than the settings' tolerance."""
        per_unit = np.array([1, 1, 1, *3 * [1 / self.settings.unit]])
        return bool(np.linalg.norm(step.increment * per_unit) < self.settings.tolerance)


def align(
    source: DistanceField,
    target_features: FieldSample,
    pseudo: Floats,
    T_start: Floats,
    centres: tuple[Floats, Floats],
    settings: Settings,
    allowed: Allowed | None = None,
) -> Alignment:
    """Moves the pseudo points (L, 3) of the target's frame until both fields say the same of them.

    target_features is phi(P_tau, P_a), the target's field at `pseudo`; T_start (4, 4) the first guess of
    T_target_source; centres (3,) those of source and target, about which the increments turn.
    allowed: the poses G^-1 to stay among.
    """
    in_source, in_target = translation(centres[0]), translation(centres[1])
    stage = PaperStage(source, centres[0], target_features, apply(inverse(in_target), pseudo), settings, allowed)
    start = inverse(inverse(in_target) @ T_start @ in_source)[None]  # G^-1(xi): target -> source, both centred
    (G_inv,), steps = descend(stage, start if allowed is None else allowed.nearest(start))
    G_inv[:3, :3] = nearest_rotation(G_inv[:3, :3])
    T = in_target @ inverse(G_inv) @ inverse(in_source)
    assert stage.at_source is not None  # at least one iteration
    return Alignment(T, steps, stage.at_source, stage.kept, stage.strict, stage.weights)
