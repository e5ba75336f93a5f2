"""What a registration answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np

from .alignment import Step
from .fields.protocol import Floats


class Reason(Enum):
    """Why a result is accepted or not; str() is a sentence."""

    ACCEPTED = "accepted"
    LOW_OVERLAP = "low_overlap"
    AMBIGUOUS = "ambiguous"
    DEGENERATE = "degenerate"
    NOT_CONVERGED = "not_converged"

    def __str__(self) -> str:
        return _SENTENCES[self]


_SENTENCES = {
    Reason.ACCEPTED: "Accepted: enough of the pseudo points and of the surfaces agree, and the last step was small.",
    Reason.LOW_OVERLAP: "Not accepted: too few pseudo points, or too little surface, agree in both clouds.",
    Reason.AMBIGUOUS: "Not accepted: another, clearly different pose agrees as well.",
    Reason.DEGENERATE: "Not accepted: the clouds may slide or turn on each other without a difference.",
    Reason.NOT_CONVERGED: "Not accepted: the last step was still large.",
}


@dataclass(frozen=True, eq=False)
class RegistrationResult:
    """The motion between two clouds, and whether it may be used.

    T_target_source: (4, 4), maps source points into the target frame.
    accepted, reason: may this pose be used, and why (not).
    overlap, overlap_target: share of the source's / the target's points with a point of the other nearby, 0 to 1.
    information: (6, 6), twist order (w, v), a left perturbation in the target frame about reference_point, at this
        pose; 1 / (rad, unit)^2; zeros along unobservable directions. It takes pseudo points as independent: not
        calibrated yet.
    covariance: (6, 6), its pseudo-inverse. unobservable: (6, k), basis of the directions without information.
    reference_point: (3,), centroid of the pseudo points that were kept, in the target frame.
    alternatives: other poses that the data cannot tell from this one, each a result.
    iterations: how many. rmse: root mean square difference of the two distances at the kept pseudo points (unit).
    seconds: time by stage. history: the iterations, each a Step. dropped: NaN rows left out of (source, target).
    """

    T_target_source: Floats
    accepted: bool
    reason: Reason
    overlap: float
    overlap_target: float
    information: Floats
    covariance: Floats
    unobservable: Floats
    reference_point: Floats
    iterations: int
    rmse: float
    seconds: Mapping[str, float]
    history: tuple[Step, ...]
    dropped: tuple[int, int] = (0, 0)
    alternatives: tuple[RegistrationResult, ...] = field(default=())

    def to_dict(self) -> dict[str, Any]:
        """The result in lists, numbers and strings, ready for JSON."""
        arrays = ("T_target_source", "information", "covariance", "unobservable", "reference_point")
        plain: dict[str, Any] = {name: getattr(self, name).tolist() for name in arrays}
        for name in ("accepted", "overlap", "overlap_target", "iterations", "rmse"):
            plain[name] = getattr(self, name)
        plain["reason"] = self.reason.value
        plain["message"] = str(self.reason)
        plain["dropped"] = {"source": self.dropped[0], "target": self.dropped[1]}
        plain["seconds"] = dict(self.seconds)
        plain["history"] = [{"increment": s.increment.tolist(), "cost": s.cost, "kept": s.kept} for s in self.history]
        plain["alternatives"] = [other.to_dict() for other in self.alternatives]
        return plain

    def __repr__(self) -> str:
        pose = np.array2string(self.T_target_source, precision=6, suppress_small=True)
        return (
            f"RegistrationResult(accepted={self.accepted}, overlap={self.overlap:.2f}, rmse={self.rmse:.3g}, "
            f"iterations={self.iterations}, T_target_source=\n{pose})"
        )
