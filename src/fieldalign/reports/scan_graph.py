"""The scans of a component as a graph, drawn from above over the model that they make."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray

from ..clouds.cloud import PointCloud
from ..fields.protocol import Floats
from .model_scene import component_up
from .plan import Plan, path_of

_BACKDROP = 4000  # points of the model


@dataclass(frozen=True)
class Edge:
    """A pair of scans. row: of the table, by which a click shows it. kind: "strong", "weak" or "doubted"."""

    i: int
    j: int
    row: int
    kind: str
    name: str


def scan_graph(model: PointCloud, members: Sequence[int], names: Sequence[str], edges: Sequence[Edge]) -> str:
    """A component as SVG. model: its fused cloud, with the attribute "scan"; names: of all scans."""
    points, scans = np.asarray(model.points, float), np.asarray(model.attributes["scan"])
    middles = np.stack([_middle(points, scans, k) for k in members])
    plan = Plan(points, middles, _BACKDROP, component_up(model, members))
    nodes = dict(zip(members, plan.at(middles), strict=True))
    own = [edge for edge in edges if edge.i in nodes and edge.j in nodes]
    weak = sum(edge.kind != "strong" for edge in own)
    story = f"{len(members)} scans from above, joined by {len(own)} pairs, {weak} weak or not believed: see the table"
    lines = "".join(_line(edge, np.stack([nodes[edge.i], nodes[edge.j]])) for edge in own)
    return plan.svg(story, lines + "".join(_node(k, nodes[k], names[k]) for k in members))


def _middle(points: Floats, scans: NDArray[np.int64], k: int) -> Floats:
    """The middle (3,) of what a scan shows; of one that others hide in the model, the middle of all."""
    own = points[scans == k]
    return np.asarray(np.median(own if len(own) else points, axis=0))


def _line(edge: Edge, ends: Floats) -> str:
    return (
        f'<path class="edge {edge.kind}" data-pair="{edge.row}" d="{path_of(ends)}">'
        f"<title>{escape(edge.name)}</title></path>"
    )


def _node(k: int, place: Floats, name: str) -> str:
    x, y = place
    return (
        f'<g class="node"><title>{escape(name)}</title><circle cx="{x:.1f}" cy="{y:.1f}" r="10"/>'
        f'<text x="{x:.1f}" y="{y + 3.6:.1f}" text-anchor="middle">{k + 1}</text></g>'
    )
