"""fieldalign odometry SEQUENCE --output FOLDER: a drive becomes a trajectory, a map and a report."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import fieldalign as fa

from ..errors import MissingExtraError
from .files import check_picture, check_report, is_page_path
from .progress import bar

if TYPE_CHECKING:
    from ..odometry.drive import Drive

_SHOWN = 8  # frames that are told by their numbers


@click.command("odometry")
@click.argument("sequence", type=click.Path())
@click.option("--output", type=click.Path(file_okay=False), required=True,
              help="The folder for the trajectory, the map, the frames and the report.")
@click.option("--topic", help="Of a bag, which; needed where it holds several with PointCloud2.")
@click.option("--sweep", type=click.Choice(["clockwise", "counterclockwise"]),
              help="The sensor spins this way, seen from above: its points get their times from their azimuth.")
@click.option("--no-deskew", is_flag=True, help="Take each scan for what is seen at one moment.")
@click.option("--loops", is_flag=True, help="At the end, close the loops of a drive that comes back.")
@click.option("--truth", type=click.Path(), help="A trajectory (TUM, KITTI) of the same sensor to measure against.")
@click.option("--report", type=click.Path(),
              help="Draw the trajectory here (.png, .svg, .pdf), or write a page with it, the map, the errors and the "
              "frames that were not tracked (.html).  [default: FOLDER/trajectory.png]")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of every random draw.")
def command(
    sequence: str,
    output: str,
    topic: str | None,
    sweep: str | None,
    no_deskew: bool,
    loops: bool,
    truth: str | None,
    report: str | None,
    seed: int,
) -> int:
    """Follow the sensor of SEQUENCE, scan by scan, and map what it saw.

    SEQUENCE is a KITTI folder, a folder of clouds, or a bag (.bag, .mcap, .db3, a ROS 2 folder). Into FOLDER go
    trajectory_tum.txt, trajectory_kitti.txt, frames.csv, map.ply, summary.json and trajectory.png; with --loops, the
    first two and the map are those after the loops were closed, and odometry_tum.txt is the trajectory before. Ctrl-C
    ends the drive after the frame at hand, and all is written up to there.

    Exit status 0: every frame was tracked; 3: some were not; 130 and 143: ended by Ctrl-C and by SIGTERM.
    """
    from ..odometry import drive as drives

    is_page = report is not None and is_page_path(report)
    (check_report if is_page else check_picture)(report)
    truly = None if truth is None else fa.read_trajectory(truth)
    frames = fa.read_sequence(sequence, topic=topic, sweep=sweep)
    odometry = fa.Odometry(deskew=not no_deskew, whole=True)
    with bar() as tell:
        tell("frames", 0, frames.length)
        drive = drives.run(frames, odometry, output, lambda done, of: tell("frames", done, of), prefetch=True)
        closed = fa.close_loops(odometry, seed=seed, progress=tell) if loops else None
        tell("writing", 0, None)
        trajectory = drive.trajectory
        if closed is not None:
            trajectory = fa.Trajectory(trajectory.times, closed.trajectory.poses, closed.trajectory.covariances,
                                       trajectory.has_times)
            _write_closed(Path(output), drive.trajectory, trajectory, closed)
        evaluation = None if truly is None else _evaluated(trajectory, truly)
        if evaluation is not None:
            drives.add_to_summary(output, evaluation=evaluation.to_dict())
        tell("drawing", 0, None)
        if is_page:
            _write_page(str(report), drive, trajectory, odometry.map if closed is None else closed.map, evaluation)
            report = None
        picture = Path(output, "trajectory.png") if report is None else Path(report)
        missing = _draw(picture, trajectory, evaluation, report is None)
    _tell(drive, closed, evaluation)
    click.echo(missing, nl=bool(missing))
    if drive.interrupted:
        return 128 + drive.signal
    return 0 if drive.tracked else 3


def _write_closed(folder: Path, before: fa.Trajectory, after: fa.Trajectory, closed: fa.ClosedLoops) -> None:
    from ..odometry import drive as drives

    fa.write_trajectory(folder / "odometry_tum.txt", before)
    for form in ("tum", "kitti"):
        fa.write_trajectory(folder / f"trajectory_{form}.txt", after, form)
    fa.write_cloud(folder / "map.ply", closed.map)
    drives.add_to_summary(folder, loops=closed.to_dict())


def _evaluated(trajectory: fa.Trajectory, truth: fa.Trajectory) -> fa.Evaluation:
    """By their times, or row for row, where one of both has none."""
    has_both = trajectory.has_times == truth.has_times
    return fa.evaluate(trajectory, truth, max_difference=0.01 if has_both else None)


def _tell(drive: Drive, closed: fa.ClosedLoops | None, evaluation: fa.Evaluation | None) -> None:
    said: dict[str, Any] = drive.to_dict()
    each = said["seconds_a_frame"]
    click.echo(f"{said['frames']} frames over {said['length']:.6g} m{', interrupted' if drive.interrupted else ''}; "
               f"{1e3 * each['step']:.1f} ms a frame, and {1e3 * each['read']:.1f} ms waiting for it (medians)")
    tracked = {reason.value for reason in fa.Tracking if reason.is_tracked}
    lost = [row for row in drive.rows if row.reason not in tracked]
    for reason in Counter(row.reason for row in lost):
        click.echo(f"{reason}: {_numbers([row.frame for row in lost if row.reason == reason])}")
    for row in [row for row in drive.rows if row.message][:_SHOWN]:
        click.echo(f"frame {row.frame}: {row.message}")
    if closed is not None:
        click.echo(f"loops: {len(closed.loops)} of {closed.tried} pairs accepted; the trajectory was "
                   f"{'mended' if closed.mended else 'left as it was'}")
    if evaluation is not None:
        click.echo(str(evaluation))


def _numbers(frames: Sequence[int]) -> str:
    """How many, and which, the first of them."""
    shown = ", ".join(map(str, frames[:_SHOWN])) + (", ..." if len(frames) > _SHOWN else "")
    return f"{len(frames)} frame{'s' if len(frames) > 1 else ''} ({shown})"


def _write_page(
    path: str, drive: Drive, trajectory: fa.Trajectory, world: fa.PointCloud, evaluation: fa.Evaluation | None
) -> None:
    from ..reports import write_odometry_report

    reasons = [row.reason for row in drive.rows]
    title = f"{drive.sequence.name}: {len(reasons)} frames"
    write_odometry_report(trajectory, path, reasons=reasons, world=world, evaluation=evaluation, title=title)


def _draw(path: Path, trajectory: fa.Trajectory, evaluation: fa.Evaluation | None, is_optional: bool) -> str:
    """The picture; where nobody asked for it and it cannot be drawn, a sentence that says so."""
    from ..reports.trajectory_picture import trajectory_picture

    try:
        if evaluation is None:
            trajectory_picture(trajectory, path)
        else:
            trajectory_picture(evaluation.trajectory, path, evaluation.truth)
    except MissingExtraError as error:
        if not is_optional:
            raise
        return f"no picture: {error}"
    return ""
