"""Two clouds painted into an image: the nearer points over the farther ones, whichever cloud they belong to.

Painting with numpy takes a fourth of the time of a scatter plot and hides no cloud behind the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
Clouds = tuple[Array, Array]  # source and target, each (N, 3), in one frame

# Vermillion and blue of Okabe and Ito: told apart by every kind of colour vision.
SOURCE_COLOR = (0.835, 0.369, 0.0)
TARGET_COLOR = (0.0, 0.447, 0.698)

FADE = 0.55  # how far towards white the farthest points go: a cloud of one colour looks flat without
_COVERED = 0.6  # share of the image that the points' discs would cover, side by side
_SMALLEST, _LARGEST = 1.5, 9  # radius of such a disc in pixels


@dataclass(frozen=True)
class Window:
    """The part of a view's plane that is painted: its middle, width and height, in the clouds' unit."""

    middle: Array
    width: float
    height: float


def window_of(clouds: Sequence[Array], view: Array) -> Window:
    """The window that holds all but a few strays of the clouds, with a margin."""
    seen = np.concatenate(clouds) @ view[:2].T
    low, high = np.percentile(seen, (0.1, 99.9), axis=0)
    nothing = 1e-9 * float(np.abs(seen).max()) + 1e-300  # a width for clouds that are seen as a line
    width, height = 1.08 * np.maximum(high - low, nothing)
    return Window((low + high) / 2, float(width), float(height))


def paint(clouds: Clouds, view: Array, window: Window, columns: int) -> Image:
    """The image (rows, columns, 4) of the window, RGBA, white where there is nothing."""
    colors = np.repeat([SOURCE_COLOR, TARGET_COLOR], [len(cloud) for cloud in clouds], axis=0)
    return paint_points(np.concatenate(clouds), colors, view, window, columns)


def paint_points(
    points: Array, colors: Array, view: Array, window: Window, columns: int, radius: float | None = None,
    fade: float = FADE,
) -> Image:
    """The same of points (N, 3) in colors (N, 3), 0..1. radius: of a point's disc in pixels; None: by how many there
    are. fade: how far towards white the farthest points go."""
    seen = points @ view.T
    point = visible(seen, window, columns, radius=radius)
    shown = np.append(_shaded(colors, seen[:, 2], fade), np.uint32(2**32 - 1))  # the last one, white, is for -1
    return np.ascontiguousarray(shown[point]).view(np.uint8).reshape(*point.shape, 4)


def visible(
    seen: Array, window: Window, columns: int, covered: float = _COVERED, radius: float | None = None
) -> NDArray[np.int32]:
    """Which point each pixel of the window shows, (rows, columns); -1: none.

    seen: (N, 3), the points along the view's axes: right, up, to the viewer. covered: the share of the image that the
    points' discs would cover, side by side. radius: of a disc in pixels, where that is not to choose it.
    """
    scale = columns / window.width
    rows = round(window.height * scale)
    x, y = (seen[:, :2] - window.middle).T * scale
    column, row = np.floor(columns / 2 + x), np.floor(rows / 2 - y)
    inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
    nearer_last = np.argsort(seen[:, 2], kind="stable")
    nearer_last = nearer_last[inside[nearer_last]]

    radius = _radius(len(seen), covered * rows * columns) if radius is None else radius
    margin = int(radius)  # so that a disc at the edge needs no test
    canvas = np.full((rows + 2 * margin, columns + 2 * margin), -1, np.int32)
    wide = canvas.shape[1]
    middles = ((row + margin) * wide + column + margin)[nearer_last].astype(np.int64)
    pixels = middles[:, None] + _disc(radius) @ (1, wide)
    canvas.ravel()[pixels] = nearer_last[:, None]  # of equal pixels the last one stays
    return canvas[margin : margin + rows, margin : margin + columns].copy()


def _shaded(colors: Array, depth: Array, fade: float) -> NDArray[np.uint32]:
    """Each point's colour, its four bytes as one number; paler the farther it is."""
    colors = np.concatenate([colors, np.ones((len(colors), 1))], axis=1)
    far, near = np.percentile(depth, (2, 98))
    white = fade * np.clip((near - depth) / max(near - far, 1e-300), 0, 1)[:, None]
    bytes_of_each = (255 * (colors * (1 - white) + white)).astype(np.uint8)
    return np.asarray(bytes_of_each.view(np.uint32)).ravel()


def _radius(points: int, pixels: float) -> float:
    """Of one point's disc, so that all points together have so many pixels, within bounds."""
    return float(np.clip(np.sqrt(pixels / (np.pi * points)), _SMALLEST, _LARGEST))


def _disc(radius: float) -> NDArray[np.int64]:
    """The offsets (M, 2) of the pixels of a disc."""
    reach = np.arange(-int(radius), int(radius) + 1)
    offsets = np.stack(np.meshgrid(reach, reach), axis=-1).reshape(-1, 2)
    return np.asarray(offsets[np.sum(offsets**2, axis=1) <= radius**2])
