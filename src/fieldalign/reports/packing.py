"""Clouds as a page holds them: coordinates in 16 bits, other values in few, all in base64."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..fields.protocol import Floats
from . import views

Packed = dict[str, Any]
Rows = NDArray[np.int64] | slice


def quantised(places: Floats, origin: Floats) -> Packed:
    """Places (n, 3) as 16-bit steps from the middle of their bounds; a step is the same length along all axes."""
    low, high = places.min(axis=0), places.max(axis=0)
    middle, half = (low + high) / 2, max(float((high - low).max()) / 2, 1e-300)
    steps = np.rint((places - middle) / half * 32767).astype("<i2")
    return {"points": as_base64(steps), "centre": (middle - origin).tolist(), "half": half}


def cloud(places: Floats, normals: Floats, origin: Floats) -> Packed:
    """Places (n, 3) and the normals there, in 8 bits, and about how far the places lie apart."""
    reach = float(np.mean((places - np.median(places, axis=0)) ** 2))
    return quantised(places, origin) | {
        "normals": as_base64(np.rint(127 * normals).astype(np.int8)),
        "spacing": float(np.sqrt(12 * reach / len(places))),
    }


def beads(ways: Sequence[Floats], spacing: float, origin: Floats) -> Packed:
    """Ways, each through places (n, 3), as beads so far apart: a line that is as thick as it should be."""
    places = np.concatenate([_along(way, spacing) for way in ways])
    return quantised(places, origin) | {"spacing": 1.5 * spacing}


def _along(way: Floats, spacing: float) -> Floats:
    """Places (m, 3) from a way's first place to its last, about so far apart."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1))])
    at = np.linspace(0, along[-1], int(along[-1] / spacing) + 2)
    return np.stack([np.interp(at, along, axis) for axis in way.T], axis=1)


def outlook(up: Floats, ahead: Floats, heights: Floats) -> Packed:
    """Where a viewer looks from: up and ahead are units (3,); heights (n,): along up, of all that is shown."""
    ceiling = views.ceiling(heights)
    return {
        "up": up.tolist(), "oblique": views.obliquely(up, ahead)[2].tolist(), "side": (-ahead).tolist(),
        "ceiling": ceiling if np.isfinite(ceiling) else None,
    }


def some(count: int, most: int) -> Rows:
    """At most so many of `count` rows, the same ones each time, in their order."""
    if count <= most:
        return slice(None)
    return np.sort(np.random.default_rng(0).choice(count, most, replace=False))


def as_base64(array: NDArray[Any]) -> str:
    """The bytes of an array."""
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")
