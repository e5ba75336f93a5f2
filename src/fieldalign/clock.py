"""Seconds by stage."""

from __future__ import annotations

from time import perf_counter


class Clock:
    """What a registration took, stage by stage."""

    def __init__(self) -> None:
        self.laps: dict[str, float] = {}
        self._last = perf_counter()

    def lap(self, stage: str) -> None:
        """Ends a stage; the next one begins."""
        now = perf_counter()
        self.laps[stage], self._last = self.laps.get(stage, 0.0) + now - self._last, now
