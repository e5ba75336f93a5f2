"""Evaluation: how far a pose, or a whole trajectory, is from the truth."""

from .absolute import absolute_errors
from .association import associated
from .evaluate import Evaluation, evaluate
from .pose_error import PoseErrors, rotation_error, rotation_errors, translation_error, translation_errors
from .relative import relative_errors
from .segments import SegmentErrors, segment_errors

__all__ = [
    "Evaluation",
    "PoseErrors",
    "SegmentErrors",
    "absolute_errors",
    "associated",
    "evaluate",
    "relative_errors",
    "rotation_error",
    "rotation_errors",
    "segment_errors",
    "translation_error",
    "translation_errors",
]
