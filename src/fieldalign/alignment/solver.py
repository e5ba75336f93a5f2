"""The paper's method: two fixed fields, and pseudo points that move between them (Fig. 3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..fields import DistanceField, FieldSample, sampled
from ..fields.protocol import Floats
from ..motions import apply, exp_twist, inverse, nearest_rotation, translation
from ..settings import Settings
from .residual import jacobian, residual
from .truncation import Mask, truncate
from .weights import linear_step


@dataclass(frozen=True, eq=False)
class Step:
    """One iteration: its increment (6,), the mean |residual| (unit^2), how many pseudo points were kept."""

    increment: Floats
    cost: float
    kept: int


@dataclass(frozen=True, eq=False)
class Alignment:
    """Where the loop ended: the motion, each iteration, and what the last one saw of the source's field."""

    T_target_source: Floats
    steps: tuple[Step, ...]
    at_source: FieldSample
    kept: Mask
    strict: bool  # the kept ones passed truncation without its rules being relaxed
    weights: Floats


def align(
    source: DistanceField,
    target_features: FieldSample,
    pseudo: Floats,
    T_start: Floats,
    centres: tuple[Floats, Floats],
    settings: Settings,
) -> Alignment:
    """Moves the pseudo points (L, 3) of the target's frame until both fields say the same of them.

    target_features is phi(P_tau, P_a), the target's field at `pseudo`; T_start (4, 4) the first guess of
    T_target_source; centres (3,) those of source and target, about which the increments turn.
    """
    in_source, in_target = translation(centres[0]), translation(centres[1])
    P_a = apply(inverse(in_target), pseudo)
    G_inv = inverse(inverse(in_target) @ T_start @ in_source)  # G^-1(xi): target -> source, both centred
    weights = np.full(len(pseudo), settings.unit**-2)  # 1 in the settings' unit, so that no other unit changes a bit
    per_unit = np.array([1, 1, 1, *3 * [1 / settings.unit]])
    steps: list[Step] = []
    at_source = None
    for _ in range(settings.max_iterations):
        x = apply(G_inv, P_a)                                             # G^-1(xi_) P_a
        at_source = sampled(source, x + centres[0], at_source)            # phi(P_S, G^-1(xi_) P_a), eq. (9)
        r = residual(at_source, target_features)                          # eq. (11)
        kept, strict = truncate(at_source, target_features, G_inv[:3, :3], settings)  # Sec. IV-D
        J, r = jacobian(at_source, x)[kept], r[kept]                      # eq. (14), (15)
        dx, weights[kept] = linear_step(J, r, weights[kept], settings)    # eq. (16), Sec. IV-C
        G_inv = exp_twist(dx) @ G_inv
        steps.append(Step(dx, float(np.abs(r).mean()), len(r)))
        if np.linalg.norm(dx * per_unit) < settings.tolerance:
            break
    G_inv[:3, :3] = nearest_rotation(G_inv[:3, :3])
    T = in_target @ inverse(G_inv) @ inverse(in_source)
    assert at_source is not None  # at least one iteration
    return Alignment(T, tuple(steps), at_source, kept, strict, weights)
