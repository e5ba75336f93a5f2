"""What speaks for a pose and what against it, in numbers, and the reason that follows."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from .reason import Reason

# How they were found, and what they mean as levels of a test: docs/verdict.md.
MIN_MARGIN = 2.5         # one wrong pose in 260 is so much better than all others
MIN_AGREEING = 0.25      # of what meets: planes that lie on other planes by chance contradict each other elsewhere
MIN_MET = 0.33           # of a surface: with less in contact, what agrees may be chance
MIN_HOLD = 3e-3          # of the best held direction's: less is what noise gives
MAX_SEEN_THROUGH = 0.03  # of a surface: more than furniture that was moved
MAX_OFF = 1.5            # voxels


@dataclass(frozen=True)
class Evidence:
    """What the verdict on a pose rests on. Shares count every plane alike, however much of the surface lies in it.

    met: share of the surface that comes near the other cloud's, of the cloud of which more does.
    agreeing: share of what meets that agrees, the two clouds' geometric mean.
    margin: by what factor the pose agrees better than the best clearly different one.
    searched: whether those others were searched for in all poses; otherwise they only lie around a guess.
    seen_through: share of one cloud's surface that lies where the other's sensor looked through, the larger of both;
        None where it is not known where a sensor stood.
    hold: what holds the direction that is held least, as a share of what holds the best, rotations and shifts made
        comparable by a quarter of the extent.
    off: by how much the last step still moved the cloud, at most, in voxels of the search.
    """

    met: float
    agreeing: float
    margin: float
    searched: bool
    seen_through: float | None
    hold: float
    off: float

    @property
    def factors(self) -> dict[str, float]:
        """By what factor each piece of evidence exceeds what is asked of it: enough from 1 on."""
        return {
            "met": self.met / MIN_MET,
            "agreeing": self.agreeing / MIN_AGREEING,
            "margin": self.margin / MIN_MARGIN,
            "seen_through": MAX_SEEN_THROUGH / max(self.seen_through or 0.0, 1e-9),
            "hold": self.hold / MIN_HOLD,
            "off": MAX_OFF / max(self.off, 1e-9),
        }

    @property
    def strength(self) -> float:
        """The smallest of the factors by which the evidence exceeds what is asked of it: accepted from 1 on."""
        factors = self.factors.values()
        return 0.0 if any(np.isnan(factor) for factor in factors) else float(min(factors))

    @property
    def reason(self) -> Reason:
        """The verdict: what speaks against the pose most, or that nothing does."""
        # What is not a number speaks against the pose, too.
        if not (self.met >= MIN_MET and self.agreeing >= MIN_AGREEING):
            return Reason.LOW_OVERLAP
        if not self.hold >= MIN_HOLD:
            return Reason.DEGENERATE
        if not (self.seen_through or 0.0) <= MAX_SEEN_THROUGH:
            return Reason.CONTRADICTED
        if not self.margin >= MIN_MARGIN:
            return Reason.AMBIGUOUS
        if not self.off <= MAX_OFF:
            return Reason.NOT_CONVERGED
        return Reason.ACCEPTED if self.searched else Reason.ACCEPTED_NEAR_INIT

    def __str__(self) -> str:
        """The numbers in a sentence."""
        others = "any clearly different pose" if self.searched else "clearly different poses around the guess"
        margin = f"{self.margin:.1f}" if self.margin < 1000 else "over 1000"
        looked = "" if self.seen_through is None else f", {self.seen_through:.1%} was looked through by its sensor"
        return (
            f"{self.met:.0%} of the surface meets the other{looked}; {self.agreeing:.0%} of that agrees, "
            f"{margin} times as well as in {others}; the direction that is held least has "
            f"{max(self.hold, 0):.1%} of the best one's hold; the last step was {self.off:.2g} voxels."
        )

    def to_dict(self) -> dict[str, Any]:
        """The numbers by name."""
        return asdict(self) | {"strength": self.strength}
