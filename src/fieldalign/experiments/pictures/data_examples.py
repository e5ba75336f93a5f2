"""The paper's Fig. 5: examples of every data set, a row for each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...fields.protocol import Floats
from ...motions import apply
from ...reports import views
from .. import figures
from ..case import spread
from ..data_sets import kitti, modelnet, shapenet, three_d_match
from ..data_sets.kitti_sequences import ScanPair
from ..data_sets.shapes import Shape
from ..data_sets.three_d_match import FragmentPair
from ..request import Report, Request

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SURFACE_COLOR, _POINT_COLOR = (0.80, 0.83, 0.87), (0.15, 0.15, 0.17)
_SOURCE_COLOR, _TARGET_COLOR = (1.0, 0.58, 0.28), (0.42, 0.70, 0.95)  # of painting.py, lighter, since they are shaded
_SURFACE, _POINTS = 120_000, 700  # points of a mesh's surface, and of those that are drawn black
_SHAPES, _PAIRS = 4, 2  # in a row
_STREET = 42.0, 20.0  # metres along and across the drive that are shown, to either side of the sensor
_LEFT, _GAP, _BELOW = 0.17, 0.04, 0.05  # inches: for the rows' names, between panels, below them
_ROWS = (0.74, 0.74, 1.12, 1.30)  # inches, the heights of the rows
_HEIGHT = sum(_ROWS) + (len(_ROWS) - 1) * _GAP + _BELOW


def data_examples(request: Request) -> Report:
    """Draws shapes of ModelNet40 and ShapeNet, and pairs of 3DMatch and of KITTI at their true poses."""
    others = shapenet.shapes(request.data)
    stand_in = others[0].category == "procedural"
    objects = {"ModelNet40": modelnet.shapes(request.data), "meshes" if stand_in else "ShapeNet": others}
    shapes = {name: _drawn(found, request.seed) for name, found in objects.items()}
    rooms = spread(three_d_match.pairs(request.data)[2:], _PAIRS)
    street = kitti.metres_apart(request.data)[0]

    figure = figures.new_figure(figures.COLUMN, _HEIGHT)
    rows = [_row(figure, row, count) for row, count in enumerate((_SHAPES, _SHAPES, _PAIRS, 1))]
    for panels, (name, found) in zip(rows, shapes.items(), strict=False):
        _name_row(panels[0], name)
        for axes, shape in zip(panels, found, strict=False):
            _draw_shape(axes, shape, request.seed)
    _name_row(rows[2][0], "3DMatch")
    for axes, pair in zip(rows[2], rooms, strict=False):
        _draw_room(axes, pair)
    _name_row(rows[3][0], "KITTI")
    _draw_street(rows[3][0], street)
    for axes in (axes for panels in rows for axes in panels if not axes.images):
        axes.set_axis_off()
    shown = {name: [shape.name for shape in found] for name, found in shapes.items()}
    shown |= {"3DMatch": [pair.name for pair in rooms], "KITTI": [street.name]}
    return figures.write_picture(
        request, "data-examples", "Examples of every data set (Fig. 5 of the paper)",
        (f"Shapes: {_POINTS} of the points in black, and the surface.",
         "Pairs of scans at their true poses: target blue, source orange.",
         *(f"{name}: {', '.join(names)}." for name, names in shown.items())),
        figure, shown,
    )


def _drawn(found: Sequence[Shape], seed: int) -> list[Shape]:
    """A few shapes, of as many categories as there are."""
    rng = np.random.default_rng(seed)
    mixed = [found[k] for k in rng.permutation(len(found))]
    rank = {id(shape): sum(other.category == shape.category for other in mixed[:k]) for k, shape in enumerate(mixed)}
    return sorted(mixed, key=lambda shape: rank[id(shape)])[:_SHAPES]


def _row(figure: Figure, row: int, count: int) -> list[Axes]:
    """Empty panels side by side."""
    wide, high = figures.COLUMN, _HEIGHT
    bottom = high - sum(_ROWS[: row + 1]) - row * _GAP
    width = (wide - _LEFT - count * _GAP) / count
    return [figure.add_axes(((_LEFT + k * (width + _GAP)) / wide, bottom / high, width / wide, _ROWS[row] / high))
            for k in range(count)]


def _name_row(axes: Axes, name: str) -> None:
    axes.set_ylabel(name, fontsize=figures.LARGE, color=figures.INK, labelpad=2)


def _draw_shape(axes: Axes, shape: Shape, seed: int) -> None:
    """The surface, and some of the points on it."""
    meshed = shape.read().triangles is not None
    surface = shape.sample(_SURFACE, seed) if meshed else shape.vertices()
    points = surface[np.random.default_rng(seed).choice(len(surface), min(_POINTS, len(surface)), replace=False)]
    up = np.array([0.0, 0.0, 1.0])
    view = views.obliquely(up, np.array([0.0, 1.0, 0.0]))
    width, height = _inches(axes)
    window = figures.framed(surface, view, height / width)
    layers = [figures.layer(surface, _SURFACE_COLOR, figures.CLOSED),
              figures.balls(points, _POINT_COLOR, 0.005 * window.width)]
    figures.show_layers(axes, layers, view, window, width)


def _draw_room(axes: Axes, pair: FragmentPair) -> None:
    """Two fragments without the ceiling, from behind the target's camera."""
    clouds = _together(pair)
    both = np.concatenate(clouds)
    up = views.level(both, np.array([0.0, -1.0, 0.0]))  # the y axis of a camera looks down
    top = views.ceiling(both @ up)
    view = views.obliquely(up, views.ahead(np.zeros(3), both, up))
    _draw_clouds(axes, [cloud[cloud @ up < top] for cloud in clouds], view, figures.CLOSED)


def _draw_street(axes: Axes, pair: ScanPair) -> None:
    """Two scans around the sensor, the drive from left to right."""
    up, drive = np.array([0.0, 0.0, 1.0]), pair.T_target_source[:3, 3] * [1, 1, 0]
    across = np.cross(up, drive / np.linalg.norm(drive))
    frame = np.stack([-np.cross(up, across), across])
    clouds = [cloud[(np.abs(cloud @ frame.T) < _STREET).all(axis=1)] for cloud in _together(pair)]
    _draw_clouds(axes, clouds, views.obliquely(up, across), figures.SCAN)


def _together(pair: FragmentPair | ScanPair) -> list[Floats]:
    """Source and target at the true pose."""
    source, target = pair.clouds()
    return [apply(pair.T_target_source, source), target]


def _draw_clouds(axes: Axes, clouds: Sequence[Floats], view: Floats, covered: float) -> None:
    width, height = _inches(axes)
    window = figures.framed(np.concatenate(clouds), view, height / width)
    layers = [figures.layer(cloud, color, covered)
              for cloud, color in zip(clouds, (_SOURCE_COLOR, _TARGET_COLOR), strict=True)]
    figures.show_layers(axes, layers, view, window, width)


def _inches(axes: Axes) -> tuple[float, float]:
    """Width and height of a panel."""
    width, height = axes.get_position().size
    return float(width) * figures.COLUMN, float(height) * _HEIGHT
