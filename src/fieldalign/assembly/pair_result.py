"""What is kept of the registration of one pair among many."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..fields.protocol import Floats
from ..result import RegistrationResult
from ..verdict import Evidence, Reason

_ARRAYS = ("T_target_source", "information", "reference_point")
_NUMBERS = ("overlap", "overlap_target", "rmse")


@dataclass(frozen=True, eq=False)
class PairResult:
    """What is kept of a registration: each attribute is what it is in a RegistrationResult.

    source, target: the clouds' names.
    T_target_source: (4, 4), maps source points into the target frame; (3, 3) of clouds in the plane.
    accepted, reason: may this pose be used, and why (not).
    overlap, overlap_target: share of the source's / the target's points with a point of the other nearby, 0 to 1.
    information: (6, 6), twist order (w, v), a left perturbation in the target frame about reference_point (3,), at this
        pose; 1 / (rad, unit)^2; zeros along unobservable directions. (7, 7) with scale, (3, 3) in the plane.
    rmse: root mean square difference of the two distances at the kept pseudo points (unit).
    evidence: what the verdict rests on, in numbers; None of method "paper".
    seconds: time by stage.
    error: of a pair that failed, the sentence that says why; its reason is FAILED and all its numbers are NaN.
    """

    source: str
    target: str
    T_target_source: Floats
    accepted: bool
    reason: Reason
    overlap: float
    overlap_target: float
    information: Floats
    reference_point: Floats
    rmse: float
    evidence: Evidence | None = None
    seconds: Mapping[str, float] = field(default_factory=dict)
    error: str | None = None

    @classmethod
    def of(cls, source: str, target: str, result: RegistrationResult) -> PairResult:
        """What is kept of a result."""
        kept = {name: getattr(result, name) for name in _ARRAYS}
        kept |= {name: float(getattr(result, name)) for name in _NUMBERS}
        return cls(
            source, target, accepted=bool(result.accepted), reason=result.reason, evidence=result.evidence,
            seconds=dict(result.seconds), **kept,
        )

    @classmethod
    def failed(cls, source: str, target: str, error: str) -> PairResult:
        """Of a pair for which there is no result, since `error`."""
        shapes = zip(_ARRAYS, ((4, 4), (6, 6), (3,)), strict=True)
        nothing: dict[str, Any] = {name: np.full(shape, np.nan) for name, shape in shapes}
        nothing |= dict.fromkeys(_NUMBERS, np.nan)
        return cls(source, target, accepted=False, reason=Reason.FAILED, error=error, **nothing)

    @property
    def verdict(self) -> str:
        """The reason and what it rests on, in sentences."""
        grounds = self.error or self.evidence
        return str(self.reason) if grounds is None else f"{self.reason} {grounds}"

    def to_dict(self) -> dict[str, Any]:
        """The result in lists, numbers and strings, ready for JSON; from_dict() gives the same bits back."""
        plain: dict[str, Any] = {"source": self.source, "target": self.target}
        plain |= {"accepted": self.accepted, "reason": self.reason.value, "error": self.error}
        if self.error is not None:
            return plain
        plain |= {name: getattr(self, name).tolist() for name in _ARRAYS}
        plain |= {name: getattr(self, name) for name in _NUMBERS}
        plain["evidence"] = None if self.evidence is None else self.evidence.to_dict()
        plain["seconds"] = dict(self.seconds)
        return plain

    @classmethod
    def from_dict(cls, plain: Mapping[str, Any]) -> PairResult:
        """The result that to_dict() gave."""
        if plain["error"] is not None:
            return cls.failed(plain["source"], plain["target"], plain["error"])
        kept = dict(plain) | {name: np.array(plain[name], float) for name in _ARRAYS}
        kept["reason"] = Reason(plain["reason"])
        if plain["evidence"] is not None:
            numbers = {name: value for name, value in plain["evidence"].items() if name != "strength"}
            kept["evidence"] = Evidence(**numbers)
        return cls(**kept)

    def __repr__(self) -> str:
        numbers = "" if self.error else f", overlap={self.overlap:.2f}, rmse={self.rmse:.3g}"
        return f"PairResult({self.source!r} -> {self.target!r}, {self.reason.value}{numbers})"
