"""The third set on real clouds: uniform, in the neighbourhood of the surface, and of keypoints (paper Sec. V-E to V-I).

The paper shows such a picture in its supplement.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ...fields import PointField
from ...fields.protocol import Floats
from ...pseudo import draw_pseudo_points
from ...reports import views
from ...settings import PRESETS, Settings
from .. import figures
from ..data_sets import kitti, modelnet, three_d_match
from ..data_sets.files import points_of
from ..request import Report, Request

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_CLOUD_COLOR = 0.80, 0.83, 0.87
_PSEUDO_COLOR = 1.0, 0.48, 0.10  # vermillion, lighter, since it is shaded
_RADIUS = 0.0065  # of a pseudo point as it is drawn, as a share of the panel's width
_STREET = 22.0  # metres around the sensor that are shown
_SHAPE = 0.78  # height over width of a panel


@dataclass(frozen=True, eq=False)
class PseudoSet:
    """A cloud (N, 3), pseudo points (L, 3) of it as the settings have it, and which way is up."""

    title: str
    source: str
    settings: Settings
    points: Floats
    pseudo: Floats
    up: Floats


def pseudo_sets(request: Request) -> Report:
    """Draws the pseudo sets of the paper on a shape, a room and a street."""
    sets = drawn_sets(request)
    height = 2 * (figures.COLUMN / 2 * _SHAPE + 0.22)
    figure = figures.new_figure(figures.COLUMN, height)
    grid = figure.subplots(2, 2, gridspec_kw={"left": 0.01, "right": 0.99, "top": 0.995, "bottom": 0.075,
                                              "wspace": 0.03, "hspace": 0.16})
    for axes, letter, found in zip(grid.ravel(), "abcd", sets, strict=True):
        _draw(axes, found)
        figures.name_panel(axes, letter, found.title)
    return figures.write_picture(
        request, "pseudo-sets", "Pseudo sets on real clouds",
        ("Orange: 1000 pseudo points, drawn as the paper's method draws them; grey: the target cloud.",
         *(f"({letter}) {s.title}: {s.source}, {_in_words(s.settings)}."
           for letter, s in zip("abcd", sets, strict=True))),
        figure, {"sets": [_said(s) for s in sets]},
    )


def drawn_sets(request: Request) -> list[PseudoSet]:
    """What is shown."""
    shape = modelnet.shapes(request.data)[0]
    pair = figures.example(three_d_match.pairs(request.data))
    drive = kitti.successive(request.data)[0]
    room, street = points_of(pair.target), points_of(drive.target)
    down = np.array([0.0, 1.0, 0.0])  # of the cameras of 3DMatch
    indoor, z = PRESETS["indoor"], np.array([0.0, 0.0, 1.0])
    uniform = Settings("uniform", half_width=indoor.half_width)
    chosen: list[tuple[str, str, Settings, Floats, Floats]] = [
        ("uniform, object", f"ModelNet40 {shape.name}", PRESETS["object"], shape.read().points, z),
        ("uniform, room", f"3DMatch {pair.name}", uniform, room, -down),
        ("neighbourhood, room", f"3DMatch {pair.name}", indoor, room, -down),
        ("keypoints, street", f"KITTI {drive.sequence}, scan {drive.i}", PRESETS["outdoor"], street, z),
    ]
    found = []
    for title, source, settings, points, up in chosen:
        field = PointField(points)
        pseudo = draw_pseudo_points(field, field.centre, settings, request.seed)
        found.append(PseudoSet(title, source, settings, points, pseudo, up))
    return found


def _in_words(settings: Settings) -> str:
    if settings.pseudo_set == "uniform":
        return f"in the cube of half width {settings.half_width:g} about the mean"
    where = "along the normals of drawn points" if settings.pseudo_set == "neighbourhood" else "around ISS keypoints"
    return f"{where}, sigma {settings.spread:g}"


def _said(s: PseudoSet) -> dict[str, Any]:
    distances = PointField(s.points).sample(s.pseudo).value
    return {"title": s.title, "source": s.source, "points": len(s.points), "pseudo_points": len(s.pseudo),
            "set": _in_words(s.settings), "distance_median": float(np.median(distances))}


def _draw(axes: Axes, found: PseudoSet) -> None:
    """The cloud and, as little balls, the pseudo points; what lies behind is hidden."""
    points, pseudo = found.points, found.pseudo
    street = found.settings.pseudo_set == "keypoints"
    if street:
        points, pseudo = (c[np.abs(c[:, :2]).max(axis=1) < _STREET] for c in (points, pseudo))
    up = views.level(points, found.up)
    view = views.obliquely(up, views.ahead(np.zeros(3), points, up))
    below = points @ up < views.ceiling(points @ up)
    window = figures.framed(np.concatenate([points[below], pseudo]), view, _SHAPE)
    layers = [figures.layer(points[below], _CLOUD_COLOR, figures.SCAN if street else figures.CLOSED),
              figures.balls(pseudo, _PSEUDO_COLOR, _RADIUS * window.width)]
    figures.show_layers(axes, layers, view, window, figures.COLUMN / 2)
