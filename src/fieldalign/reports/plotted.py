"""What `fieldalign plot` draws: clouds or trajectories, as a figure, with characters, or as a recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np

from ..clouds.cloud import PointCloud
from ..errors import ArgumentError
from ..evaluation.evaluate import evaluate
from ..fields import DistanceField, spread_over
from ..fields.files import read_shape
from ..inspection import deviation
from ..motions import Matrix, apply
from ..odometry.trajectory import Trajectory
from ..odometry.trajectory_files import read_trajectory
from . import characters
from .cloud_picture import (
    COLORS,
    VIEWS,
    Layer,
    Style,
    clouds_picture,
    distance_colors,
    frame_of,
    joined,
    windows_of,
    without_ceiling,
)
from .painting import Array, window_of
from .picture import comparable, viewpoint
from .recording import write_clouds_recording, write_trajectory_recording
from .trajectory_picture import trajectories_picture

_MOST_POINTS = 400_000  # of all clouds: a figure of 8.5 cm has a million pixels
_SPREAD = 60_000  # places that stand for a surface
_STEP = 0.002  # of its extent: between the points that stand for a way in a terminal


class Plotted(Protocol):
    """What can be drawn."""

    def draw(self, path: str, width: float, dpi: float, point_size: float | None) -> None:
        """Writes a figure (.png, .svg, .pdf), so many inches wide."""

    def characters(self, columns: int, colored: bool, braille: bool) -> str:
        """Lines of so many characters."""
        ...

    def record(self, path: str) -> None:
        """Writes a recording for Rerun (.rrd)."""


class Clouds:
    """Clouds, meshes or volumes from files, in one frame or with what brings them there.

    pose: of two, T_target_source. poses: of any number, world_from_scan; those without one are left out. before: with
    a pose, also as they came. color: "cloud", "file" or "distance" (of the first from the second). limit: at which
    distance colours are full. up: (3,), or None: as they tell. sides: of VIEWS.
    """

    def __init__(
        self, files: Sequence[str], pose: Matrix | None, poses: Sequence[Matrix | None] | None, *, before: bool,
        color: str, limit: float | None, up: Sequence[float] | None, sides: Sequence[str], title: str,
    ) -> None:
        _check(files, pose, poses, color, limit)
        self._title, self._sides, self._limit, self._signed = title, sides, limit, False
        if poses is not None:
            kept = [k for k, T in enumerate(poses) if T is not None]
            if not kept:
                raise ArgumentError("--poses must place a scan, but places none")
            files, poses = [files[k] for k in kept], [poses[k] for k in kept]
        shapes = [read_shape(file) for file in files]
        clouds = [_cloud_of(shape) for shape in shapes]
        self._poses = [pose, None] if pose is not None else list(poses or [None] * len(files))
        names = [Path(file).name for file in files]
        self._layers = [
            Layer(name, *_thinned(cloud, k, len(clouds), color == "file", name))
            for k, (name, cloud) in enumerate(zip(names, clouds, strict=True))
        ]
        if color == "distance":
            hidden = Layer(names[1], np.empty((0, 3)), np.empty((0, 3)))
            self._layers = [self._by_distance(shapes[1]), hidden]
        after = [layer if T is None else layer._replace(points=apply(T, layer.points))
                 for layer, T in zip(self._layers, self._poses, strict=True)]
        columns = {"before": self._layers, "after": after} if pose is not None and before else {"": after}
        everything = after[-1].points if len(files) == 2 and len(after[-1].points) else joined(after)[0]
        self._frame = frame_of(everything, None if up is None else np.asarray(up), viewpoint(clouds[-1]))
        self._columns = without_ceiling(columns, self._frame.up)

    def draw(self, path: str, width: float, dpi: float, point_size: float | None) -> None:
        """See Plotted."""
        style = Style(width, dpi, point_size, self._title, self._limit, self._signed)
        clouds_picture(self._columns, path, self._frame, self._sides, style)

    def characters(self, columns: int, colored: bool, braille: bool) -> str:
        """See Plotted; panels stand below each other."""
        lines = [self._title] if self._title else []
        for side, windows in zip(self._sides, windows_of(self._columns, self._frame, self._sides), strict=True):
            for (name, layers), window in zip(self._columns.items(), windows, strict=True):
                heading = " ".join(([side] if len(self._sides) > 1 else []) + ([name] if name else []))
                lines += [heading + ":"] if heading else []
                lines.append(characters.draw(layers, VIEWS[side](*self._frame), window, columns, colored, braille))
        if self._limit is None and len(self._layers) > 1:
            lines.append("  ".join(characters.named(layer.name, layer.colors[0], colored, braille)
                                   for layer in self._layers))
        return "\n".join(lines)

    def record(self, path: str) -> None:
        """See Plotted."""
        layers = [layer for layer in self._layers if len(layer.points)]
        write_clouds_recording(layers, self._poses[: len(layers)], path, self._title or layers[0].name)

    def _by_distance(self, target: PointCloud | DistanceField) -> Layer:
        """The first layer in the colours of its distances from the target."""
        layer = self._layers[0]
        found = deviation(layer.points, target, self._poses[0])
        self._limit, self._signed = self._limit or max(found.limit, 1e-300), found.signed
        return layer._replace(colors=distance_colors(found.values, self._limit))


class Ways:
    """Trajectories by the names of their files; truth: the file of the true one, of one."""

    def __init__(self, trajectories: Mapping[str, Trajectory], truth: str | None, title: str) -> None:
        self._title, self._truth = title, None
        self._ways = {Path(file).name: way for file, way in trajectories.items()}
        if len(self._ways) < len(trajectories):
            self._ways = dict(trajectories)
        if truth is not None:
            name, way = next(iter(self._ways.items()))
            truly = read_trajectory(truth)
            has_both = way.has_times == truly.has_times
            evaluation = evaluate(way, truly, max_difference=0.01 if has_both else None)
            self._ways, self._truth = {name: evaluation.trajectory}, evaluation.truth

    def draw(self, path: str, width: float, dpi: float, point_size: float | None) -> None:
        """See Plotted."""
        trajectories_picture(self._ways, path, self._truth, self._title or None, width=width, dpi=dpi)

    def characters(self, columns: int, colored: bool, braille: bool) -> str:
        """See Plotted: from above."""
        ways = self._ways if self._truth is None else {"truth": self._truth, **self._ways}
        layers = [Layer(name, *_dots(way, number)) for number, (name, way) in enumerate(ways.items())]
        view = np.eye(3)
        window = comparable([window_of([layer.points for layer in layers], view)])[0]
        lines = [self._title] if self._title else []
        lines.append(characters.draw(layers, view, window, columns, colored, braille))
        for (name, way), layer in zip(ways.items(), layers, strict=True):
            told = f"{name}: {len(way)} poses over {way.distances[-1]:.4g} m"
            lines.append(characters.named(told, layer.colors[0], colored, braille))
        return "\n".join(lines)

    def record(self, path: str) -> None:
        """See Plotted."""
        write_trajectory_recording(self._ways, path, self._title or next(iter(self._ways)), self._truth)


def _check(
    files: Sequence[str], pose: Matrix | None, poses: Sequence[Matrix | None] | None, color: str, limit: float | None
) -> None:
    if pose is not None and (len(files) != 2 or poses is not None):
        raise ArgumentError("--pose belongs to two clouds, SOURCE and TARGET, and excludes --poses")
    if color == "distance" and (len(files) != 2 or poses is not None):
        raise ArgumentError(f"--color distance belongs to two clouds without --poses, but there are {len(files)} files")
    if limit is not None and color != "distance":
        raise ArgumentError("--limit belongs to --color distance")


def _cloud_of(shape: PointCloud | DistanceField) -> PointCloud:
    return shape if isinstance(shape, PointCloud) else PointCloud(spread_over(shape, _SPREAD))


def _thinned(cloud: PointCloud, number: int, of: int, own_colors: bool, name: str) -> tuple[Array, Array]:
    """Some of the finite points (N, 3) of one of several clouds, the same ones each time, and colors (N, 3)."""
    rows = np.flatnonzero(np.isfinite(cloud.points).all(axis=1))
    if not len(rows):
        raise ArgumentError(f"{name} must have finite points to draw, but has none")
    if own_colors and cloud.colors is None:
        raise ArgumentError(f"--color file needs colours, but {name} has none")
    most = max(1000, _MOST_POINTS // of)
    if len(rows) > most:
        rows = np.random.default_rng(0).choice(rows, most, replace=False, shuffle=False)
    if own_colors:
        return np.asarray(cloud.points[rows], float), np.asarray(cloud.colors)[rows, :3] / 255
    color = COLORS[1] if of == 1 else COLORS[number % len(COLORS)]
    return np.asarray(cloud.points[rows], float), np.tile(color, (len(rows), 1))


def _dots(way: Trajectory, number: int) -> tuple[Array, Array]:
    """Points (N, 3) along a way, close together, in one color."""
    steps = np.linalg.norm(np.diff(way.positions[:, :2], axis=0), axis=1)
    gone = np.concatenate([[0.0], np.cumsum(steps)])
    extent = float(np.ptp(way.positions[:, :2], axis=0).max())
    count = int(np.clip(gone[-1] / max(_STEP * extent, 1e-300), 1, 10**6))
    at = np.linspace(0, gone[-1], count + 1)
    x, y = (np.interp(at, gone, column) for column in way.positions.T[:2])
    points = np.stack([x, y, np.full(len(at), float(number))], axis=1)
    return points, np.tile(COLORS[(number + 1) % len(COLORS)], (len(at), 1))
