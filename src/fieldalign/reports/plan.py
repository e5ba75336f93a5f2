"""A cloud from above as the ground of an SVG: what is drawn on it lies in the frame of its places."""

from __future__ import annotations

import numpy as np

from ..fields.protocol import Floats
from . import views

WIDE = 720.0
_HIGHEST, _MARGIN = 560.0, 24.0
_STRAYS = 0.2  # per cent of the points on each side that may lie outside


class Plan:
    """points: (N, 3), the cloud; the world's x points to the right. within: (M, 3), places that must lie in the frame,
    whatever strays. most: so many points are drawn at most. up: (3,), upwards; None: as all of it tells.

    height: of the frame, which is WIDE wide. backdrop: the points as a path of strokes without a length.
    """

    def __init__(self, points: Floats, within: Floats, most: int, up: Floats | None = None) -> None:
        up = views.upright(np.concatenate([points, within])) if up is None else up
        self._axes = views.from_above(up, views.northward(up))[:2]
        seen, must = points @ self._axes.T, within @ self._axes.T
        corners = np.percentile(seen, (_STRAYS, 100 - _STRAYS), axis=0) if len(seen) else np.empty((0, 2))
        corners = np.concatenate([corners, must])
        low, high = corners.min(axis=0), corners.max(axis=0)
        size = np.maximum(high - low, max(1e-9 * float(np.abs(corners).max()), 1e-300))
        self.scale = float(min((WIDE - 2 * _MARGIN) / size[0], (_HIGHEST - 2 * _MARGIN) / size[1]))
        self.height = self.scale * float(size[1]) + 2 * _MARGIN
        self._middle = (low + high) / 2
        self.backdrop = self._dots(points, up, most)

    def at(self, places: Floats) -> Floats:
        """Where places (..., 3) lie in the frame, (..., 2), x to the right and y downward."""
        return np.asarray((WIDE / 2, self.height / 2) + self.scale * (places @ self._axes.T - self._middle) * (1, -1))

    def svg(self, story: str, drawing: str) -> str:
        """The frame with the cloud and a drawing on it; story: escaped text for who cannot see it."""
        return (
            f'<svg class="plan" viewBox="0 0 {WIDE:.0f} {self.height:.0f}" role="img" aria-label="{story}">'
            f'<path class="backdrop" d="{self.backdrop}"/>{drawing}</svg>'
        )

    def _dots(self, points: Floats, up: Floats, most: int) -> str:
        """Some of the points, without those of a ceiling."""
        if not len(points):
            return ""
        heights = points @ up
        seen = points[heights < views.ceiling(heights)]
        return "".join(f"M{x:.1f} {y:.1f}h0" for x, y in self.at(seen[:: max(1, len(seen) // most)]))


def path_of(places: Floats) -> str:
    """Places (n, 2) of a frame as a path from each to the next."""
    return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in places)
