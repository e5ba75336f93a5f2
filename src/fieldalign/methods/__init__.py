"""The ways to register a pair, each told on one screen."""

from .paper import register_by_paper
from .robust import Start, register_robust, verify_robust
from .similar import register_similar

__all__ = ["Start", "register_by_paper", "register_robust", "register_similar", "verify_robust"]
