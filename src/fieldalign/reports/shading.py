"""A cloud painted as a surface: lit from beside the viewer, and dark where something nearer begins.

The darkening is eye-dome lighting (Boucheny 2009): it needs depths alone, so that it tells edges where normals cannot.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .painting import Array, Image, Window, visible

_LIGHT = np.array([-0.4, 0.55, 0.73])  # along the view's axes: right, up, to the viewer
_AMBIENT = 0.6  # the brightness of what no light falls on
_REACH = 2  # pixels in which something nearer darkens
_STEEP = 2.0  # a surface that rises by less, as a tangent, darkens itself nowhere
_STEP = 0.008  # of the window's width: how much nearer darkens by 1 / e


class Layer(NamedTuple):
    """Points (N, 3) that are painted together, their normals (N, 3), of either sign, and their colors (N, 3), 0..1.

    covered: the share of the image that they would cover, side by side; more closes the surface of few points.
    """

    points: Array
    normals: Array
    colors: Array
    covered: float = 0.6


def paint_surfaces(layers: Sequence[Layer], view: Array, window: Window, columns: int) -> Image:
    """The image (rows, columns, 4) of the window, RGBA, clear where there is nothing.

    Of all layers the nearest point is seen. view: (3, 3), as in views.py.
    """
    shape = round(window.height * columns / window.width), columns
    depth, colors = np.full(shape, -np.inf), np.zeros((*shape, 3))
    for layer in layers:
        seen = layer.points @ view.T
        point = visible(seen, window, columns, layer.covered)
        nearer = (point >= 0) & (seen[point, 2] > depth)
        depth[nearer] = seen[point[nearer], 2]
        colors[nearer] = (layer.colors * _lit(layer.normals @ view.T)[:, None])[point[nearer]]
    image = np.zeros((*shape, 4), np.uint8)
    image[..., :3] = 255 * np.clip(colors * _dome(depth, window)[..., None], 0, 1)
    image[..., 3] = 255 * np.isfinite(depth)
    return image


def _lit(normals: Array) -> Array:
    """The brightness of each normal, turned to the viewer."""
    facing = normals * np.where(normals[:, 2:] < 0, -1.0, 1.0)
    return np.asarray(_AMBIENT + (1 - _AMBIENT) * np.clip(facing @ (_LIGHT / np.linalg.norm(_LIGHT)), 0, 1))


def _dome(depth: Array, window: Window) -> Array:
    """How much of its brightness each pixel keeps beside nearer ones; depth grows to the viewer, -inf is nothing."""
    padded = np.pad(depth, _REACH, constant_values=-np.inf)
    rows, columns = depth.shape
    nearer: NDArray[np.float64] = np.zeros(depth.shape)
    for step in (1, _REACH):
        slope = _STEEP * step * window.width / columns  # what a surface itself rises by from pixel to pixel
        for down, right in ((0, step), (0, -step), (step, 0), (-step, 0)):
            beside = padded[_REACH + down :, _REACH + right :][:rows, :columns]
            with np.errstate(invalid="ignore"):  # nothing beside nothing
                nearer += np.clip(np.nan_to_num(beside - depth, nan=0.0) - slope, 0, 2 * _STEP * window.width)
    return np.asarray(np.exp(-nearer / (8 * _STEP * window.width)))
