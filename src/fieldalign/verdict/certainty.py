"""How well a pose is determined: its covariance, and along which axes nothing holds it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..fields.protocol import Floats

_STRAIGHT = 0.05  # of a twist, turns and shifts made comparable: a turn by less is a slide that noise bends


@dataclass(frozen=True, eq=False)
class Certainty:
    """What is known of a pose, left perturbation (w, v) in the target's frame about reference_point (3,), of n = 6
    freedoms, or of 7 with a growth.

    information: (n, n), zeros along what is open or was not free. covariance: (n, n), its pseudo-inverse. observable,
    unobservable: bases (n, .) of what is free and known, and of what is free and open. hold: ascending, of the free
    directions, shares of the hold of the best of all. length: the lever over which turns and shifts are compared.
    """

    information: Floats
    covariance: Floats
    observable: Floats
    unobservable: Floats
    reference_point: Floats
    hold: Floats
    length: float

    def open_part(self, twist: Floats) -> Floats:
        """The part of a twist (6,) about the reference point that nothing holds."""
        basis = np.linalg.qr(self.unobservable / self.lever)[0]
        return np.asarray(basis @ (basis.T @ (twist / self.lever[:, 0]))) * self.lever[:, 0]

    @property
    def lever(self) -> Floats:
        """What the parts of a twist are divided by to be compared (n, 1)."""
        return _lever(len(self.information), self.length)


@dataclass(frozen=True, eq=False)
class Freedom:
    """A motion that the data do not see, in the target's frame.

    kind: "slide" along `axis` (3,), "turn" about the line along `axis` through `point` (3,), or "grow" about `point`.
    """

    kind: str
    axis: Floats
    point: Floats

    def __str__(self) -> str:
        axis, point = (", ".join(f"{value:.3g}" for value in vector) for vector in (self.axis, self.point))
        if self.kind == "grow":
            return f"grow about ({point})"
        return f"slide along ({axis})" if self.kind == "slide" else f"turn about ({axis}) through ({point})"


def split(
    curvature: Floats, scatter: Floats, hold: Floats, reference: Floats, length: float, least: float,
    free: Floats | None = None,
) -> Certainty:
    """What is known of a pose: its covariance A^-1 S A^-1 on the observable part, and the rest.

    curvature, scatter: A and S (n, n), derivative and covariance of the gradient (Huber, Robust Statistics, 6.3).
    hold: (n, n), what holds the pose; open are directions with less than `least` of the best one's. Rotations and
    translations are compared over a lever of `length`. free: columns (n, m) of what the pose may do; None: all.
    """
    n = len(hold)
    if not (all(np.isfinite(M).all() for M in (curvature, scatter, hold)) and hold.any() and length > 0):
        everything = np.eye(n) if free is None else _span(free)
        return Certainty(
            np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, 0)), everything, reference, np.zeros(n), 1.0
        )
    lever = _lever(n, length)
    scale = lever * lever.T
    among = np.eye(n) if free is None else _span(free / lever)
    held = among.T @ (hold * scale) @ among
    values, vectors = np.linalg.eigh(held)
    best = values[-1] if free is None else np.linalg.eigvalsh(hold * scale)[-1]
    vectors = among @ vectors
    seen = values > least * best
    known = vectors[:, seen]
    A, S = (known.T @ (M * scale) @ known for M in (curvature, scatter))
    undo = np.linalg.pinv(A, hermitian=True)
    covariance = undo @ S @ undo
    information = known @ np.linalg.pinv(covariance, hermitian=True) @ known.T / scale
    unobservable = np.linalg.qr(vectors[:, ~seen] * lever)[0]
    spread = known @ covariance @ known.T * scale
    return Certainty(information, spread, known * lever, unobservable, reference, values / best, length)


def _lever(n: int, length: float) -> Floats:
    """What n freedoms are multiplied by to become comparable (n, 1): a growth is, as a turn is."""
    return np.array([1, 1, 1, length, length, length, 1])[:n, None]


def _span(columns: Floats) -> Floats:
    """An orthonormal basis of what the columns span."""
    lengths = np.linalg.norm(columns, axis=0)
    left, sizes, _ = np.linalg.svd(columns[:, lengths > 0] / lengths[lengths > 0], full_matrices=False)
    return np.asarray(left[:, sizes > 1e-9 * sizes[0]])


def freedoms(known: Certainty) -> tuple[Freedom, ...]:
    """The axes along which the clouds may slide, and about which they may turn, without a difference."""
    if not known.unobservable.size:
        return ()
    basis = np.linalg.qr(known.unobservable / known.lever)[0]
    reference, lever = known.reference_point, known.lever[:6]
    found = []
    if len(basis) == 7:
        grows, basis = _parted(basis, basis[6:])
        found += [Freedom("grow", np.zeros(3), reference - (z[:6] * lever[:, 0])[3:] / z[6]) for z in grows.T]
    # Slides are the combinations that hardly turn; the turns are what is left, each about its own line.
    turns, slides = (part[:6] * lever for part in _parted(basis, basis[:3]))
    found += [Freedom("slide", v / np.linalg.norm(v), reference) for v in slides[3:].T]
    for w, v in zip(turns[:3].T, turns[3:].T, strict=True):
        found.append(Freedom("turn", w / np.linalg.norm(w), reference + np.cross(w, v) / (w @ w)))
    return tuple(found)


def _parted(basis: Floats, rows: Floats) -> tuple[Floats, Floats]:
    """The combinations of a basis (n, k) that show in some of its rows (., k), and those that hardly do."""
    _, sizes, mix = np.linalg.svd(rows)
    rank = int((sizes > _STRAIGHT).sum())
    return basis @ mix[:rank].T, basis @ mix[rank:].T
