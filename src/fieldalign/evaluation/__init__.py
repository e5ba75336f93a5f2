"""Evaluation: how far a pose is from the truth."""

from .pose_error import rotation_error, translation_error

__all__ = ["rotation_error", "translation_error"]
