"""Alignment: the paper's method on two distance fields."""

from .solver import Alignment, Step, align

__all__ = ["Alignment", "Step", "align"]
