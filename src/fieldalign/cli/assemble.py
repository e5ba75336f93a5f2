"""fieldalign assemble SCANS...: a folder of scans becomes one model."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path

import click

import fieldalign as fa

from ..errors import ArgumentError
from .executors import chosen_executor, executor_options
from .files import check_folder, check_output, check_report, write_text
from .poses import read_poses
from .progress import Tell, bar


@click.command("assemble")
@click.argument("scans", type=click.Path(), nargs=-1, required=True)
@click.option("--output", type=click.Path(), help="Write the fused cloud; of other components to NAME_2.ply, ...")
@click.option("--poses-to", type=click.Path(), help="Write {scan: world_from_scan} as JSON.")
@click.option("--json", "json_path", type=click.Path(allow_dash=True),
              help="Write everything that was found as JSON; - for stdout.")
@click.option("--report", type=click.Path(dir_okay=False),
              help="Write a page: the graph of scans, the pairs that fit worst in 3D, what was left out (.html).")
@click.option("--moved", type=click.Path(), help="Write every placed scan, whole and moved, into this folder.")
@click.option("--poses", type=click.Path(), help="Poses that are known: JSON {scan: 4 x 4}, as --poses-to writes them.")
@click.option("--sigma", type=(float, float), metavar="DEGREES LENGTH", help="How well --poses are known.")
@click.option("--fixed", multiple=True, metavar="SCAN", help="A scan of --poses that is not to move.")
@click.option("--ordered", is_flag=True, help="Successive scans are neighbours.")
@click.option("--sensor-at-origin", is_flag=True, help="Each scan is in the frame of its own sensor.")
@click.option("--dof", type=click.Choice(["levelled", "planar", "translation"]), help="What the poses may differ by.")
@executor_options
def command(
    scans: tuple[str, ...],
    output: str | None,
    poses_to: str | None,
    json_path: str | None,
    report: str | None,
    moved: str | None,
    poses: str | None,
    sigma: tuple[float, float] | None,
    fixed: tuple[str, ...],
    ordered: bool,
    sensor_at_origin: bool,
    dof: str | None,
    run_folder: str | None,
    workers: int | None,
    dask: str | None,
    seed: int,
) -> int:
    """Find the poses of SCANS, in any order and pose, and fuse them.

    Exit status 0: all scans are placed in one frame; 3: some are left out, or there are several components.
    """
    check_output(output)
    check_folder(output, poses_to, json_path)
    check_report(report)
    places = None if moved is None else _places(Path(moved), scans)
    known = None if poses is None else read_poses(poses, scans)
    with bar() as progress:
        found = fa.assemble(
            list(scans), poses=known, pose_sigma=sigma, fixed=[_index(name, scans) for name in fixed], ordered=ordered,
            sensor_at_origin=sensor_at_origin, dof=dof, executor=chosen_executor(workers, dask), run_folder=run_folder,
            progress=progress, seed=seed,
        )
        if report is not None:
            from ..reports import write_assembly_report

            write_assembly_report(
                found, scans, report, progress=lambda finished, of: progress("drawing", finished, of)
            )
        if output is not None:
            _write_models(output, found, progress)
        if places is not None:
            _write_moved(places, scans, found, progress)
    placed = {scan: None if T is None else T.tolist() for scan, T in zip(scans, found.poses, strict=True)}
    write_text(poses_to, json.dumps(placed, indent=1))
    everything = json.dumps({"scans": list(scans)} | found.to_dict(), indent=1)
    write_text(json_path, everything)
    if json_path == "-":
        click.echo(everything)
    else:
        _tell(scans, found)
    return 0 if len(found.components) == 1 and not found.left_out else 3


def _index(name: str, scans: Sequence[str]) -> int:
    if name not in scans:
        raise ArgumentError(f"fixed must name one of the scans, but is {name!r}")
    return scans.index(name)


def _write_models(output: str, found: fa.Assembly, progress: Tell) -> None:
    count = len(found.components)
    for number in range(count):
        progress("writing", number, count)
        fa.write_cloud(_numbered(output, number + 1), found.models[number])


def _numbered(path: str, number: int) -> str:
    file = Path(path)
    return path if number == 1 else str(file.with_name(f"{file.stem}_{number}{file.suffix}"))


def _places(folder: Path, scans: Sequence[str]) -> dict[str, tuple[Path, Path]]:
    """The folder, and within it where each scan goes: as it lies below the folder that holds them all."""
    from ..clouds.files import writer_of

    files = [Path(scan).absolute() for scan in scans]
    common = Path(os.path.commonpath([file.parent for file in files]))
    for scan in scans:
        writer_of(scan)
    return {scan: (folder, file.relative_to(common)) for scan, file in zip(scans, files, strict=True)}


def _write_moved(
    places: dict[str, tuple[Path, Path]], scans: Sequence[str], found: fa.Assembly, progress: Tell
) -> None:
    """Each placed scan with all that its file says of it, one at a time; a folder per component if there are more."""
    import numpy as np

    moved, count = 0, sum(map(len, found.components))
    for number, members in enumerate(found.components, 1):
        for k in members:
            progress("moving", moved, count)
            moved += 1
            folder, below = places[scans[k]]
            place = (folder if len(found.components) == 1 else folder / f"component_{number}") / below
            place.parent.mkdir(parents=True, exist_ok=True)
            fa.write_cloud(place, fa.read_cloud(scans[k]).transformed(np.asarray(found.poses[k])))


def _tell(scans: Sequence[str], found: fa.Assembly) -> None:
    import numpy as np

    placed = sum(map(len, found.components))
    click.echo(f"{placed} of {len(scans)} scans placed, by {len(found.edges)} of {found.tried} pairs, in "
               f"{sum(found.seconds.values()):.1f} s")
    for number, members in enumerate(found.components, 1):
        sigma = [np.sqrt(np.trace(np.asarray(found.covariances[k])[3:, 3:])) for k in members]
        click.echo(f"component {number}: {len(members)} scans, placed to {np.median(sigma):.2g} (median)")
    for i, j, result in found.doubted:
        click.echo(f"not believed: {scans[j]} on {scans[i]}, which the others contradict: {result.reason.value}")
    for k, reason in found.left_out.items():
        click.echo(f"left out: {scans[k]}: {reason}")
