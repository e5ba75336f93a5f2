"""The two ways to register a pair, each told on one screen."""

from .paper import register_by_paper
from .robust import Start, register_robust, verify_robust

__all__ = ["Start", "register_by_paper", "register_robust", "verify_robust"]
