"""How well a pose is determined: its covariance, and along which axes nothing holds it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..fields.protocol import Floats

_STRAIGHT = 0.05  # of a twist, turns and shifts made comparable: a turn by less is a slide that noise bends


@dataclass(frozen=True, eq=False)
class Certainty:
    """What is known of a pose, left perturbation (w, v) in the target's frame about reference_point (3,).

    information: (6, 6), zeros along what is open. covariance: (6, 6), its pseudo-inverse. unobservable: (6, k), basis
    of what is open. hold: (6,), ascending, shares of the best held direction's hold. length: the lever over which turns
    and shifts are compared.
    """

    information: Floats
    covariance: Floats
    unobservable: Floats
    reference_point: Floats
    hold: Floats
    length: float

    @property
    def observable(self) -> Floats:
        """Basis (6, 6 - k) of the twists that leave what is open as it is."""
        return np.linalg.svd((self.unobservable / self.lever).T)[2][self.unobservable.shape[1] :].T * self.lever

    def open_part(self, twist: Floats) -> Floats:
        """The part of a twist (6,) about the reference point that nothing holds."""
        basis = np.linalg.qr(self.unobservable / self.lever)[0]
        return np.asarray(basis @ (basis.T @ (twist / self.lever[:, 0]))) * self.lever[:, 0]

    @property
    def lever(self) -> Floats:
        """What the parts of a twist are divided by to be compared (6, 1)."""
        return np.array([1, 1, 1, self.length, self.length, self.length])[:, None]


@dataclass(frozen=True, eq=False)
class Freedom:
    """A motion that the data do not see, in the target's frame.

    kind: "slide" along `axis` (3,), or "turn" about the line along `axis` through `point` (3,).
    """

    kind: str
    axis: Floats
    point: Floats

    def __str__(self) -> str:
        axis, point = (", ".join(f"{value:.3g}" for value in vector) for vector in (self.axis, self.point))
        return f"slide along ({axis})" if self.kind == "slide" else f"turn about ({axis}) through ({point})"


def split(
    curvature: Floats, scatter: Floats, hold: Floats, reference: Floats, length: float, least: float
) -> Certainty:
    """What is known of a pose: its covariance A^-1 S A^-1 on the observable part, and the rest.

    curvature, scatter: A and S (6, 6), derivative and covariance of the gradient (Huber, Robust Statistics, 6.3).
    hold: (6, 6), what holds the pose; open are directions with less than `least` of the best one's. Rotations and
    translations are compared over a lever of `length`.
    """
    if not (all(np.isfinite(M).all() for M in (curvature, scatter, hold)) and hold.any() and length > 0):
        return Certainty(np.zeros((6, 6)), np.zeros((6, 6)), np.eye(6), reference, np.zeros(6), 1.0)
    scale = np.array([1, 1, 1, length, length, length])
    lever = scale[:, None] * scale
    values, vectors = np.linalg.eigh(hold * lever)
    seen = values > least * values[-1]
    known = vectors[:, seen]
    A, S = (known.T @ (M * lever) @ known for M in (curvature, scatter))
    undo = np.linalg.pinv(A, hermitian=True)
    covariance = undo @ S @ undo
    information = known @ np.linalg.pinv(covariance, hermitian=True) @ known.T / lever
    basis = np.linalg.qr(vectors[:, ~seen] * scale[:, None])[0]
    return Certainty(information, known @ covariance @ known.T * lever, basis, reference, values / values[-1], length)


def freedoms(known: Certainty) -> tuple[Freedom, ...]:
    """The axes along which the clouds may slide, and about which they may turn, without a difference."""
    if not known.unobservable.size:
        return ()
    basis = np.linalg.qr(known.unobservable / known.lever)[0]
    # Slides are the combinations that hardly turn; the turns are what is left, each about its own line.
    _, sizes, mix = np.linalg.svd(basis[:3])
    rank = int((sizes > _STRAIGHT).sum())
    turns, slides = basis @ mix[:rank].T * known.lever, basis @ mix[rank:].T
    found = [Freedom("slide", v / np.linalg.norm(v), known.reference_point) for v in slides[3:].T]
    for w, v in zip(turns[:3].T, turns[3:].T, strict=True):
        found.append(Freedom("turn", w / np.linalg.norm(w), known.reference_point + np.cross(w, v) / (w @ w)))
    return tuple(found)
