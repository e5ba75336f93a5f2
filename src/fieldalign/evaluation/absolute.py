"""Absolute trajectory error (ATE): how far each pose is from the truth's, once both lie in one world."""

from __future__ import annotations

import numpy as np

from ..arguments import check_one_of
from ..motions import Matrix, best_motion, inverse
from .pose_error import PoseErrors

ALIGNMENTS = ("positions", "origin", "none")


def absolute_errors(truth: Matrix, poses: Matrix, alignment: str = "positions") -> tuple[PoseErrors, Matrix]:
    """The errors of poses (n, 4, 4), and the motion T (4, 4) before them: T P_k is compared with the truth.

    alignment: "positions": the motion with the least squares over all positions (Umeyama, PAMI 1991, without scale);
        where they lie on one line, it turns about it by anything, which the errors of rotation show. "origin": the
        first poses are laid on each other. "none": both are in one world.
    """
    T = aligning(truth, poses, alignment)
    return PoseErrors.between(T @ poses, truth), T


def aligning(truth: Matrix, poses: Matrix, alignment: str) -> Matrix:
    """The motion (4, 4) that takes the world of poses (n, 4, 4) into the truth's."""
    check_one_of("alignment", alignment, ALIGNMENTS)
    if alignment == "positions":
        return best_motion(poses[:, :3, 3], truth[:, :3, 3])
    return np.eye(4) if alignment == "none" else truth[0] @ inverse(poses[0])
