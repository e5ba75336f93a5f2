"""fieldalign deviation ALIGNED PART: how far the points of a scan lie from a surface."""

from __future__ import annotations

from pathlib import Path

import click

import fieldalign as fa

from ..errors import ArgumentError
from .answers import as_json, write_json
from .files import check_folder, check_picture
from .poses import read_pose
from .progress import file_size, stages


@click.command("deviation")
@click.argument("aligned", type=click.Path())
@click.argument("part", type=click.Path())
@click.option("--pose", help="Moves ALIGNED into PART's frame first: .txt, .npy, .json (of register), or 16 numbers.")
@click.option("--tolerance", type=float, help="What each point may be off, in the unit of both.")
@click.option("--output", type=click.Path(), help="Write the points in PART's frame, coloured, to this file.")
@click.option("--csv", type=click.Path(), help="Write x,y,z,deviation of each point, in PART's frame (.csv).")
@click.option("--picture", type=click.Path(), help="Draw a histogram (.png, .svg, .pdf).")
@click.option("--json", "json_path", type=click.Path(allow_dash=True), help="Write the numbers as JSON; - for stdout.")
def command(
    aligned: str,
    part: str,
    pose: str | None,
    tolerance: float | None,
    output: str | None,
    csv: str | None,
    picture: str | None,
    json_path: str | None,
) -> int:
    """Measure how far the points of the scan ALIGNED lie from PART: a mesh (.stl, .ply, .obj, .off), a volume (.nrrd,
    .nhdr, .npz with `values`), or another scan.

    Exit status 0: all points are within the tolerance, or none is given; 3: some are beyond it.
    """
    from ..fields.files import read_field

    T = None if pose is None else read_pose(pose, "pose")
    _check_outputs(output, csv, picture, json_path)
    scan, other = file_size(aligned), file_size(part)
    with stages({"reading scan": scan, "reading part": other, "measuring": 10 * scan, "writing": scan}) as stage:
        stage()
        cloud = fa.read_cloud(aligned)
        stage()
        field = read_field(part)
        stage()
        found = fa.deviation(cloud, field, T, tolerance=tolerance)
        stage()
        placed = cloud if T is None else cloud.transformed(T)
        if output is not None:
            fa.write_cloud(output, found.colored(placed))
        if csv is not None:
            fa.write_cloud(csv, fa.PointCloud(placed.points, attributes={"deviation": found.values}))
        if picture is not None:
            from ..reports.histogram import deviation_histogram

            deviation_histogram(found, picture, f"{Path(aligned).name} on {Path(part).name}")
        write_json(found, json_path)
    click.echo(as_json(found) if json_path == "-" else str(found))
    return 3 if found.statistics.within not in (None, 1.0) else 0


def _check_outputs(output: str | None, csv: str | None, picture: str | None, json_path: str | None) -> None:
    """What cannot be written is said before the work, not after it."""
    from ..clouds.files import writer_of

    for path in (output, csv):
        if path is not None:
            writer_of(path)
    if csv is not None and Path(csv).suffix.lower() != ".csv":
        raise ArgumentError(f"--csv must end in .csv, but is {csv!r}")
    check_folder(json_path)
    check_picture(picture)
