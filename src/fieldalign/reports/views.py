"""How to look at a cloud that one knows nothing about: which way is up, where a ceiling is, from where.

A view is a (3, 3) matrix; its rows are the picture's axes in the cloud's frame: right, up, to the viewer.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..fields import PointField

Array = NDArray[np.float64]

_UP, _CAMERA_UP = np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0])
_IN_VIEW, _HALF_VIEW = 0.95, np.cos(np.radians(60))  # so many of a camera's points lie within 60 degrees of its gaze
_STANDS_OFF = 0.1  # of the median depth: nothing is nearer to a camera
_ALIKE = np.radians(10)  # a normal is along the vertical, or across it
_NOD, _TILT = np.cos(np.radians(40)), np.cos(np.radians(20))  # how far the vertical may be off a camera's, and off z
_CLEARLY = 1.15  # times as many normals fit
_TRIES = 3000  # directions, all over the sphere
_ENOUGH = 5000  # points for a histogram of heights
# Steps of the search for the level, as tangents, each with the thickness of a layer as a share of the cloud's
# size: a floor of that size fills one layer once the direction is right to about one step.
_STEPS = ((0.1, 0.04), (0.03, 0.02), (0.01, 0.006))
_TELLS = 1.25  # times as crowded as along the direction at hand: less is no layer, but a cloud seen along its length
_LAYERS = 50
_CEILING = 0.05  # share of the points in one layer of fifty: more than twice what walls put there
_ELEVATION = np.radians(38)  # of the oblique view: enough to see the floor, little enough to see heights
_ASIDE = np.radians(28)  # the oblique view is turned off the sensor's gaze, so that a corner looks like one


def upright(points: Array, seen: Array | None = None) -> Array:
    """The unit (3,) that is upwards in the frame of points (N, 3), as far as they tell, levelled: z, or for what a
    camera has seen (y down, z ahead) the vertical of its floors and walls near -y.

    seen: (M, 3), those that were seen from the frame's own sensor; None: all.
    """
    own = points if seen is None or not len(seen) else seen
    sample = own[:: max(1, len(own) // _ENOUGH)]
    return level(points, _upward_of_camera(sample) if _is_of_camera(sample) else _UP)


def _is_of_camera(points: Array) -> bool:
    """Whether all lies ahead along z, at a distance, as in no frame that is levelled."""
    depths = points[:, 2]
    ahead = depths > _HALF_VIEW * np.linalg.norm(points, axis=1)
    near, middle = np.percentile(depths, (1, 50))
    return bool(ahead.mean() >= _IN_VIEW and near > _STANDS_OFF * middle)


def _upward_of_camera(points: Array) -> Array:
    """The direction near -y that most normals are along or across: those of floors and of walls; z, where these fit it
    clearly better."""
    tries = sphere(_TRIES)
    cosines = np.abs(PointField(points).normals(points) @ tries.T)
    fits = np.mean((cosines > np.cos(_ALIKE)) | (cosines < np.sin(_ALIKE)), axis=0)
    near_camera, near_z = tries @ _CAMERA_UP > _NOD, tries @ _UP > _TILT
    if fits[near_z].max() > _CLEARLY * fits[near_camera].max():
        return _UP
    return np.asarray(tries[near_camera][np.argmax(fits[near_camera])])


def level(points: Array, up: Array) -> Array:
    """The unit (3,), within 20 degrees or so of `up`, along which points (N, 3) lie most in few thin layers.

    Floors, ceilings and streets are such layers, so this is the vertical even where the sensor was tilted. Where no
    direction stands out, it is `up` itself.
    """
    sample = points[:: max(1, len(points) // _ENOUGH)]
    size = float(np.linalg.norm(np.std(sample, axis=0)))
    best = np.asarray(up / np.linalg.norm(up))
    for step, thickness in _STEPS:
        tries = _around(best, step)
        heights = (sample - sample[0]) @ tries.T
        layers = np.floor(heights / max(thickness * size, 1e-300))
        crowding = np.array([_crowding(column) for column in layers.T])
        if crowding.max() > _TELLS * crowding[len(tries) // 2]:
            best = tries[np.argmax(crowding)]
    return best


def ceiling(heights: Array) -> float:
    """The height below which points stay when a ceiling and what hangs from it go; inf without a ceiling.

    A ceiling is a layer near the top that holds far more points than walls would.
    """
    low, high = np.percentile(heights, (0.5, 99.5))
    if not low < high:
        return float("inf")
    counts, edges = np.histogram(heights, bins=_LAYERS, range=(low, high))
    is_ceiling = counts[-_LAYERS // 5 :].max() > _CEILING * len(heights)
    return float(edges[3 * _LAYERS // 4]) if is_ceiling else float("inf")


def ahead(position: Array, points: Array, up: Array) -> Array:
    """The horizontal unit (3,) from a sensor to the middle of its points; any, if it stands in the middle."""
    offset = np.median(points, axis=0) - position
    offset = offset - (offset @ up) * up
    if np.linalg.norm(offset) <= 0.05 * np.linalg.norm(np.std(points, axis=0)):
        offset = _across(up)
    return np.asarray(offset / np.linalg.norm(offset))


def northward(up: Array) -> Array:
    """The horizontal unit (3,) that has x to its right: y where z is upwards."""
    ahead = np.cross(up, np.eye(3)[0] if abs(up[0]) < 0.9 else np.eye(3)[1])
    return np.asarray(ahead / np.linalg.norm(ahead))


def from_above(up: Array, ahead: Array) -> Array:
    """The view straight down, with `ahead` at the top of the picture."""
    return np.stack([np.cross(ahead, up), ahead, up])


def obliquely(up: Array, ahead: Array) -> Array:
    """The view from behind and above, turned a little to the side."""
    gaze = np.cos(_ASIDE) * ahead + np.sin(_ASIDE) * np.cross(ahead, up)
    right = np.cross(gaze, up)
    down = np.cos(_ELEVATION) * gaze - np.sin(_ELEVATION) * up
    return np.stack([right, np.cross(right, down), -down])


def from_front(up: Array, ahead: Array) -> Array:
    """The level view along `ahead`."""
    return np.stack([np.cross(ahead, up), up, -ahead])


def from_side(up: Array, ahead: Array) -> Array:
    """The level view from the right of who looks along `ahead`."""
    return np.stack([ahead, up, np.cross(ahead, up)])


def sphere(count: int) -> Array:
    """Unit directions (count, 3), evenly over the sphere along a spiral."""
    z = 1 - (2 * np.arange(count) + 1) / count
    turn = np.pi * (1 + np.sqrt(5)) * np.arange(count)
    return np.stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z], axis=1)


def _around(direction: Array, step: float) -> Array:
    """Unit directions (49, 3) in a grid of tangent `step` around the given one, itself among them."""
    first = _across(direction)
    second = np.cross(direction, first)
    a, b = np.meshgrid(step * np.arange(-3, 4), step * np.arange(-3, 4))
    tries = direction + a.reshape(-1, 1) * first + b.reshape(-1, 1) * second
    return np.asarray(tries / np.linalg.norm(tries, axis=1, keepdims=True))


def _crowding(layers: Array) -> int:
    """Sum over the layers of the square of their number of points: large where few layers hold most."""
    _, counts = np.unique(layers, return_counts=True)
    return int(np.sum(counts**2))


def _across(direction: Array) -> Array:
    """A unit vector (3,) perpendicular to the given one."""
    across = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
    return np.asarray(across / np.linalg.norm(across))
