"""What a registration answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .alignment import Step
from .fields.protocol import Floats
from .verdict import Evidence, Freedom, Reason


@dataclass(frozen=True, eq=False)
class RegistrationResult:
    """The motion between two clouds, and whether it may be used.

    T_target_source: (4, 4), maps source points into the target frame.
    accepted, reason: may this pose be used, and why (not).
    overlap, overlap_target: share of the source's / the target's points with a point of the other nearby, 0 to 1.
    information: (6, 6), twist order (w, v), a left perturbation in the target frame about reference_point, at this
        pose; 1 / (rad, unit)^2; zeros along unobservable directions. Of method "robust" it is calibrated
        (docs/verdict.md); of "paper" it takes the pseudo points for independent.
    covariance: (6, 6), its pseudo-inverse, turns and shifts compared over a quarter of the extent.
    unobservable: (6, k), basis of the directions that nothing holds: there the pose is the guess's, or arbitrary.
    freedoms: the same as axes: where the clouds may slide, and about which lines they may turn, each a Freedom.
    reference_point: (3,), centroid of the overlap, in the target frame.
    evidence: what the verdict rests on, in numbers; None of method "paper", which knows no other pose.
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
    evidence: Evidence | None = None
    freedoms: tuple[Freedom, ...] = ()
    dropped: tuple[int, int] = (0, 0)
    alternatives: tuple[RegistrationResult, ...] = field(default=())

    @property
    def verdict(self) -> str:
        """The reason, the numbers behind it, and what may slide or turn, in sentences."""
        sentences = [str(self.reason)] + ([str(self.evidence)] if self.evidence else [])
        if self.reason is Reason.DEGENERATE:
            sentences.append(f"It may {' or '.join(map(str, self.freedoms))}.")
        return " ".join(sentences)

    def to_dict(self) -> dict[str, Any]:
        """The result in lists, numbers and strings, ready for JSON."""
        arrays = ("T_target_source", "information", "covariance", "unobservable", "reference_point")
        plain: dict[str, Any] = {name: getattr(self, name).tolist() for name in arrays}
        for name in ("accepted", "overlap", "overlap_target", "iterations", "rmse"):
            plain[name] = getattr(self, name)
        plain["reason"] = self.reason.value
        plain["message"] = self.verdict
        plain["evidence"] = None if self.evidence is None else self.evidence.to_dict()
        plain["freedoms"] = [
            {"kind": f.kind, "axis": f.axis.tolist(), "point": f.point.tolist()} for f in self.freedoms
        ]
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
