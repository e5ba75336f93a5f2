"""fieldalign evaluate TRAJECTORY TRUTH: how far a trajectory is from the truth."""

from __future__ import annotations

from pathlib import Path

import click

from .answers import as_json, write_json
from .files import check_folder, check_picture
from .progress import file_size, stages

_FORMATS = click.Choice(["auto", "tum", "kitti"])


@click.command("evaluate")
@click.argument("trajectory", type=click.Path())
@click.argument("truth", type=click.Path())
@click.option("--format", "form", type=_FORMATS, default="auto", show_default=True,
              help="Of TRAJECTORY: tum (8 columns) or kitti (12).")
@click.option("--truth-format", type=_FORMATS, default="auto", show_default=True, help="Of TRUTH.")
@click.option("--max-difference", type=float, default=0.01, show_default=True,
              help="Seconds between poses that belong together.")
@click.option("--by-row", is_flag=True, help="Poses belong together row for row, whatever their times.")
@click.option("--calib", type=click.Path(),
              help="KITTI's calib.txt: TRAJECTORY is the lidar's, TRUTH the camera's, as KITTI's poses are.")
@click.option("--align", type=click.Choice(["positions", "origin", "none"]), default="positions", show_default=True,
              help="For ATE: by all positions (Umeyama, without scale), by the first pose, or not at all.")
@click.option("--delta", type=float, default=1, show_default=True, help="For RPE: how far two poses are apart.")
@click.option("--unit", type=click.Choice(["frames", "metres"]), default="frames", show_default=True,
              help="Of --delta.")
@click.option("--all-pairs", is_flag=True, help="For RPE: from every pose on; else pairs follow on each other.")
@click.option("--json", "json_path", type=click.Path(allow_dash=True), help="Write the numbers as JSON; - for stdout.")
@click.option("--plot", type=click.Path(), help="Draw both from above, the height and the errors (.png, .svg, .pdf).")
def command(
    trajectory: str,
    truth: str,
    form: str,
    truth_format: str,
    max_difference: float,
    by_row: bool,
    calib: str | None,
    align: str,
    delta: float,
    unit: str,
    all_pairs: bool,
    json_path: str | None,
    plot: str | None,
) -> int:
    """Measure how far TRAJECTORY is from TRUTH, each a file in TUM's or KITTI's format, in metres.

    KITTI's drift (mean over all segments of 100 to 800 m, in % and deg / 100 m), the absolute error (ATE) and the
    relative one (RPE).
    """
    import numpy as np

    from ..evaluation import evaluate
    from ..motions import inverse
    from ..odometry.sequences.kitti import read_calibration
    from ..odometry.trajectory_files import read_trajectory

    check_picture(plot)
    check_folder(json_path)
    T_camera_sensor = np.eye(4) if calib is None else read_calibration(calib)
    size = file_size(trajectory, truth)
    with stages({"reading": size, "measuring": size} | ({} if plot is None else {"drawing": size})) as stage:
        stage()
        found = read_trajectory(trajectory, form).of_sensor(T_camera_sensor)
        truly = read_trajectory(truth, truth_format)
        stage()
        evaluation = evaluate(
            found, truly, max_difference=None if by_row else max_difference, alignment=align,
            delta=int(delta) if unit == "frames" and delta.is_integer() else delta, unit=unit, all_pairs=all_pairs,
        )
        if plot is not None:
            from ..reports.trajectory_picture import trajectory_picture

            stage()
            # A camera looks along z; in the lidar's world, z is up.
            ways = (way.in_world(inverse(T_camera_sensor)) for way in (evaluation.trajectory, evaluation.truth))
            trajectory_picture(next(ways), plot, next(ways), f"{Path(trajectory).name} and the truth")
    write_json(evaluation, json_path)
    click.echo(as_json(evaluation) if json_path == "-" else str(evaluation))
    return 0
