"""fieldalign plot FILES...: clouds and trajectories as a figure, in the terminal, or for the Rerun viewer."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import ArgumentError
from .files import check_folder, check_picture
from .poses import read_pose, read_poses
from .progress import file_size, stages

if TYPE_CHECKING:
    from ..odometry.trajectory import Trajectory
    from ..reports.plotted import Plotted

_INCHES = {"cm": 1 / 2.54, "mm": 1 / 25.4, "in": 1.0}
_VIEWS = ("above", "front", "side", "oblique")


class Width(click.ParamType):  # type: ignore[type-arg,unused-ignore]  # generic since click 8.3
    """A length in print, in inches."""

    name = "width"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """8.5cm, 85mm or 3.35in; a number alone is in cm."""
        text = str(value).strip().lower()
        unit = text[-2:] if text[-2:] in _INCHES else "cm"
        try:
            inches = float(text.removesuffix(unit)) * _INCHES[unit]
        except ValueError:
            self.fail(f"{value!r} is no width such as 8.5cm, 85mm or 3.35in", param, ctx)
        if not 0.5 <= inches <= 50:
            self.fail(f"{value!r} is not from 0.5 to 50 inches", param, ctx)
        return inches


@click.command("plot")
@click.argument("files", type=click.Path(), nargs=-1, required=True)
@click.option("--output", type=click.Path(dir_okay=False),
              help="Write .png, .svg or .pdf, or .rrd for the Rerun viewer; without it, draw in the terminal.")
@click.option("--pose", metavar="POSE",
              help="Of two clouds: T_target_source (.txt, .npy, .json of register, or 16 numbers): before and after.")
@click.option("--after-only", is_flag=True, help="With --pose: without the clouds before.")
@click.option("--poses", type=click.Path(), help="JSON {scan: 4 x 4}, as `assemble --poses-to` writes it.")
@click.option("--truth", type=click.Path(), help="Of one trajectory: the true one, and draw the errors.")
@click.option("--view", "views", type=click.Choice(_VIEWS), multiple=True,
              help="From where; several make several rows.  [default: oblique]")
@click.option("--up", metavar="X,Y,Z", help="About upward, in the last frame.  [default: z, or as a camera held it]")
@click.option("--color", type=click.Choice(["cloud", "file", "distance"]), default="cloud", show_default=True,
              help="One colour a cloud; as the files have it; or by the distance of the first from the second.")
@click.option("--limit", type=click.FloatRange(min=0, min_open=True),
              help="With --color distance: where colours are full.  [default: what 95 % keep to]")
@click.option("--width", type=Width(), default="8.5cm", show_default=True, help="In cm, mm or in, as 3.35in.")
@click.option("--dpi", type=click.FloatRange(30, 2400), default=300, show_default=True, help="Pixels in an inch.")
@click.option("--point-size", type=click.FloatRange(0, 20, min_open=True),
              help="Diameter of a point, in 1/72 inch.  [default: by how many there are]")
@click.option("--title", default="", help="One line above.")
def command(
    files: tuple[str, ...], output: str | None, pose: str | None, after_only: bool, poses: str | None,
    truth: str | None, views: tuple[str, ...], up: str | None, color: str, limit: float | None, width: float,
    dpi: float, point_size: float | None, title: str,
) -> int:
    """Draw FILES: a cloud; SOURCE and TARGET, with --pose before and after it; scans with --poses; or trajectories
    (TUM, KITTI), with --truth and the errors.

    \b
    fieldalign plot source.ply target.ply --pose result.json --output figure.pdf
    fieldalign plot out/trajectory_tum.txt --truth truth.txt --output drive.svg
    fieldalign plot out/map.ply

    Without --output it is drawn with characters, as wide as the terminal; NO_COLOR=1 leaves the colours out.
    """
    from ..reports import plotted

    is_recording = output is not None and Path(output).suffix.lower() == ".rrd"
    (check_folder if is_recording else check_picture)(output)
    size = file_size(*files)
    with stages({"reading": size, "drawing": 2 * size}) as stage:
        stage()
        ways = _trajectories(files)
        if ways:
            _refuse(pose=pose, poses=poses, after_only=after_only, limit=limit, view=views, point_size=point_size)
            if truth is not None and len(ways) > 1:
                raise ArgumentError(f"--truth belongs to one trajectory, but there are {len(ways)}")
            drawn: Plotted = plotted.Ways(ways, truth, title)
        else:
            _refuse(truth=truth)
            moved = None if pose is None else read_pose(pose, "--pose", scaled=True)
            placed = None if poses is None else read_poses(poses, files)
            drawn = plotted.Clouds(
                files, moved, placed, before=not after_only, color=color, limit=limit,
                up=None if up is None else _direction(up), sides=views or ("oblique",), title=title,
            )
        stage()
        if output is None:
            text = drawn.characters(_columns(), _is_colored(), _knows_braille())
        elif is_recording:
            drawn.record(output)
        else:
            drawn.draw(output, width, dpi, point_size)
    if output is None:
        click.echo(text, color=True)
    return 0


def _trajectories(files: Sequence[str]) -> dict[str, Trajectory]:
    """The files by their names, where all are trajectories; else none. A cloud (.txt) has no rigid pose in each row."""
    from ..odometry.trajectory_files import read_trajectory

    ways = {}
    for path in files:
        if Path(path).suffix.lower() not in (".txt", ".tum", ".kitti", ""):
            return {}
        try:
            ways[path] = read_trajectory(path)
        except ArgumentError:
            return {}
    return ways


def _refuse(**options: Any) -> None:
    """Raises for an option that says nothing about what is drawn."""
    for name, value in options.items():
        if value:
            wanted = "trajectories (TUM, KITTI)" if name == "truth" else "clouds"
            raise ArgumentError(f"--{name.replace('_', '-')} belongs to {wanted}, but FILES are none")


def _direction(text: str) -> list[float]:
    try:
        up = [float(word) for word in text.replace(",", " ").split()]
    except ValueError:
        up = []
    if len(up) != 3 or not any(up) or not all(abs(value) < float("inf") for value in up):
        raise ArgumentError(f"--up must be a direction X,Y,Z, but is {text!r}")
    return up


def _columns() -> int:
    """Of the terminal; 80 where there is none."""
    import shutil

    return max(10, shutil.get_terminal_size((80, 24)).columns - 1)


def _is_colored() -> bool:
    """See https://no-color.org."""
    import os

    return sys.stdout.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def _knows_braille() -> bool:
    try:
        "⣿●".encode(sys.stdout.encoding or "ascii")
    except UnicodeEncodeError:
        return False
    return True
