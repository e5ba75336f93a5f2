"""Why a pose may be used, or not."""

from __future__ import annotations

from enum import Enum


class Reason(Enum):
    """Why a result is accepted or not; str() is a sentence."""

    ACCEPTED = "accepted"
    ACCEPTED_NEAR_INIT = "accepted_near_init"
    LOW_OVERLAP = "low_overlap"
    CONTRADICTED = "contradicted"
    AMBIGUOUS = "ambiguous"
    DEGENERATE = "degenerate"
    NOT_CONVERGED = "not_converged"
    FAILED = "failed"

    def __str__(self) -> str:
        return _SENTENCES[self]

    @property
    def accepts(self) -> bool:
        """Whether the pose may be used."""
        return self in (Reason.ACCEPTED, Reason.ACCEPTED_NEAR_INIT)


_SENTENCES = {
    Reason.ACCEPTED: "Accepted: the surfaces agree where they meet, and with no clearly different pose nearly as well.",
    Reason.ACCEPTED_NEAR_INIT: "Accepted near the guess: the surfaces agree where they meet; poses far from it "
    "were not searched, so whether one of them agrees as well is not known.",
    Reason.LOW_OVERLAP: "Not accepted: too little of the surfaces meets, or too little agrees of what meets.",
    Reason.CONTRADICTED: "Not accepted: one cloud has surface where the other's sensor looked through.",
    Reason.AMBIGUOUS: "Not accepted: a clearly different pose agrees nearly as well, or better.",
    Reason.DEGENERATE: "Not accepted: the clouds may slide or turn on each other without a difference; that part of "
    "the motion is the guess's, or arbitrary without one.",
    Reason.NOT_CONVERGED: "Not accepted: the surfaces agree better a step further, so the pose is not exact.",
    Reason.FAILED: "Not accepted: there is no pose, since a cloud cannot be read or the work on the pair went wrong.",
}
