"""The verdict of the paper's method, which has one pose and no others to compare it with."""

from __future__ import annotations

import numpy as np

from .. import _core
from ..alignment import Alignment
from ..alignment.residual import feature_gradient, row_dot
from ..dof import Dof, allowed_poses
from ..fields import FieldSample, sampled
from ..fields.protocol import Floats
from ..motions import apply, inverse, reach_of, rotate, translation
from ..prepared import PreparedCloud
from ..verdict import Certainty, Reason, split

STILL = 1e-3  # of the extent: a last increment that moves some point further has not converged
COARSE = 0.05  # of the smaller extent: places further apart are never the same, however sparse the points are
MIN_OVERLAP = 0.2  # of either surface: with less, what agrees may be chance


def judge(alignment: Alignment, source: PreparedCloud, overlap: tuple[float, float]) -> Reason:
    """Whether enough pseudo points and surface remain, and the last increment moves no point of the source far."""
    moves = reach_of(alignment.steps[-1].increment, source.extent)
    if not alignment.strict or max(overlap) < MIN_OVERLAP:
        return Reason.LOW_OVERLAP
    return Reason.NOT_CONVERGED if moves > STILL * source.extent else Reason.ACCEPTED


def overlaps(source: PreparedCloud, target: PreparedCloud, T_target_source: Floats) -> tuple[float, float]:
    """Share of the source's surface that lies on the target's, and of the target's that lies on the source's."""
    smaller = min(source.extent, target.extent)
    near = min(source.probes[1] + target.probes[1] or STILL * smaller, COARSE * smaller)

    def share(of: PreparedCloud, on: PreparedCloud, T: Floats) -> float:
        distances = sampled(on.field, apply(T, of.probes[0])).value
        return float((np.abs(distances) <= near).mean())

    return share(source, target, T_target_source), share(target, source, inverse(T_target_source))


def rmse(at_source: FieldSample, at_target: FieldSample, alignment: Alignment) -> float:
    """Root mean square difference of the two distances at the kept pseudo points, in the cloud's unit."""
    off = (np.abs(at_source.value) - np.abs(at_target.value))[alignment.kept]
    return float(np.sqrt(np.mean(off**2)))


def certainty(
    at_source: FieldSample, pseudo: Floats, alignment: Alignment, r: Floats, dof: Dof | None, guess: Floats | None
) -> Certainty:
    """Information of a left perturbation (w, v) in the target frame, from the residuals' own spread.

    Gauss-Newton's J^T W J / s^2 over the kept pseudo points, s^2 = sum w r^2 / (n - 6), as if they were independent.
    """
    kept = alignment.kept
    places = pseudo[kept]
    reference = places.mean(axis=0)
    places = places - reference
    R = alignment.T_target_source[:3, :3]
    gradient = rotate(R, feature_gradient(at_source)[kept])
    J = _core.moment_rows(places, gradient)
    w = alignment.weights[kept]
    freedom = max(len(w) - 6, 1)
    # Copies of one cloud agree to the last bit: a resolution of float64 stands in for their noise.
    scale = float(np.max(at_source.value**2)) or 1.0
    variance = max(float((w * r[kept] ** 2).sum()) / freedom, w.mean() * (1e-12 * scale) ** 2)
    information = _core.information(J, w) / variance
    length = float(np.sqrt(row_dot(places, places).mean()))
    free = None
    if dof is not None:
        allowed = allowed_poses(dof, guess, reference, np.zeros(3), target_is_held=True)
        free = allowed.twists(translation(-reference) @ alignment.T_target_source[None])[0]
    return split(information, information, information, reference, length, 1e-9, free)
