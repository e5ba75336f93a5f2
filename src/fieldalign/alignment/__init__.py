"""Alignment: the paper's method, and the robust one, on two distance fields."""

from .paper import Alignment, align
from .solver import Step, descend

__all__ = ["Alignment", "Step", "align", "descend"]
