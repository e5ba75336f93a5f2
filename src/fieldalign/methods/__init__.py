"""The two ways to register a pair, each told on one screen."""

from .paper import register_by_paper
from .robust import register_robust

__all__ = ["register_by_paper", "register_robust"]
