"""What the viewer of a model draws: the fused cloud of a component and its scans, or a map with the ways through it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..assembly.assembly import Assembly
from ..clouds.cloud import PointCloud
from ..fields import PointField
from ..fields.protocol import Floats
from . import packing, views

_POINTS = 150_000   # of all components together, or of a map: 2 MB
_LARGE = 1.4         # times as far as they lie apart
_FINE = 600         # beads side by side along all that is shown
_MOST_BEADS = 20_000


def component_models(assembly: Assembly, names: Sequence[str], most: int) -> list[packing.Packed]:
    """The fused clouds of the first so many components, each in its own frame, with the scan that each point is of."""
    shown = list(zip(assembly.components, assembly.models, strict=True))[:most]
    whole = sum(len(model.points) for _, model in shown)
    return [
        _component(model, members, names, max(1000, _POINTS * len(model.points) // max(whole, 1)))
        for members, model in shown
    ]


def component_up(model: PointCloud, members: Sequence[int]) -> Floats:
    """The unit (3,) that is upwards in the frame of a component, as its first scan tells, whose frame it is."""
    points, scans = np.asarray(model.points, float), np.asarray(model.attributes["scan"])
    return views.upright(points, points[scans == members[0]])


def _component(model: PointCloud, members: Sequence[int], names: Sequence[str], most: int) -> packing.Packed:
    places, normals, rows = _drawn(model, most)
    origin, up = np.median(places, axis=0), component_up(model, members)
    order = np.zeros(max(members) + 1, "<u2")
    order[list(members)] = np.arange(len(members))
    cloud = _cloud(places, normals, origin) | {
        "scans": packing.as_base64(order[np.asarray(model.attributes["scan"])[rows]]),
    }
    heights = (places - origin) @ up
    return packing.outlook(up, views.ahead(np.zeros(3), places, up), heights) | {
        "layers": {"cloud": cloud}, "names": [f"{k + 1} {names[k]}" for k in members],
        "story": f"The model of {len(members)} scans in 3D, {len(places):,} of its points. The tables say in words "
        "how the scans hang together and how well each is placed.",
    }


@dataclass(frozen=True, eq=False)
class Way:
    """A line to be drawn: parts through places (n, 3) each, the class of its colour, what it is, and how many pixels
    wide it is at least."""

    parts: Sequence[Floats]
    swatch: str
    words: str
    wide: float = 5.0


def drive_model(world: PointCloud | None, ways: Mapping[str, Way]) -> packing.Packed:
    """A map and the ways through it, by the names of their layers, of which "way" is one; where several run in one
    place the first is seen."""
    everywhere = np.concatenate([places for way in ways.values() for places in way.parts])
    origin = np.median(everywhere, axis=0)
    shown, layers = everywhere, {}
    if world is not None and len(world.points):
        places, normals, _ = _drawn(world, _POINTS)
        layers["cloud"] = _cloud(places, normals, origin)
        shown = np.concatenate([places, everywhere])
    up = views.upright(shown)
    length = sum(float(np.linalg.norm(np.diff(part, axis=0), axis=1).sum()) for part in ways["way"].parts)
    spacing = max(float(np.ptp(shown, axis=0).max()) / _FINE, length / _MOST_BEADS, 1e-300)
    for name, way in ways.items():
        layers[name] = packing.beads(way.parts, spacing, origin) | {"swatch": way.swatch, "wide": way.wide}
    return packing.outlook(up, views.northward(up), (shown - origin) @ up) | {
        "layers": layers,
        "story": f"The way of the sensor in 3D, {length:.4g} m long, over the map. The charts and the table say the "
        "same in words.",
    }


def _cloud(places: Floats, normals: Floats, origin: Floats) -> packing.Packed:
    """What all else is on; its points are drawn large, so that it closes to surfaces."""
    packed = packing.cloud(places, normals, origin)
    return packed | {"swatch": "map", "spacing": _LARGE * packed["spacing"]}


def _drawn(cloud: PointCloud, most: int) -> tuple[Floats, Floats, packing.Rows]:
    """Some points of a cloud, their normals, and which rows they are."""
    points, rows = np.asarray(cloud.points, float), packing.some(len(cloud.points), most)
    if cloud.normals is not None:
        return points[rows], np.asarray(cloud.normals, float)[rows], rows
    return points[rows], PointField(points).normals(points[rows]), rows

