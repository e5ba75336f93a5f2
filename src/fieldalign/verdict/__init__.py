"""Whether a pose may be used, how well it is known, and why (not)."""

from .certainty import Certainty, Freedom, freedoms, split
from .evidence import MIN_HOLD, MIN_MARGIN, Evidence
from .reason import Reason
from .sight import Sight

__all__ = ["MIN_HOLD", "MIN_MARGIN", "Certainty", "Evidence", "Freedom", "Reason", "Sight", "freedoms", "split"]
