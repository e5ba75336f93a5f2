"""fieldalign assemble SCANS...: a folder of scans becomes one model."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click
import numpy as np

import fieldalign as fa

from ..clouds.files import writer_of
from ..errors import ArgumentError
from ..motions import as_rigid
from ..whole_file import replacing
from .executors import bar, chosen_executor, executor_options


@click.command("assemble")
@click.argument("scans", type=click.Path(), nargs=-1, required=True)
@click.option("--output", type=click.Path(), help="Write the fused cloud; of other components to NAME_2.ply, ...")
@click.option("--poses-to", type=click.Path(), help="Write {scan: world_from_scan} as JSON.")
@click.option("--json", "json_path", type=click.Path(), help="Write everything that was found as JSON.")
@click.option("--moved", type=click.Path(), help="Write every placed scan, whole and moved, into this folder.")
@click.option("--poses", type=click.Path(), help="Poses that are known: JSON {scan: 4 x 4}, as --poses-to writes them.")
@click.option("--sigma", type=(float, float), metavar="DEGREES LENGTH", help="How well --poses are known.")
@click.option("--fixed", multiple=True, metavar="SCAN", help="A scan of --poses that is not to move.")
@click.option("--ordered", is_flag=True, help="Successive scans are neighbours.")
@click.option("--dof", type=click.Choice(["levelled", "planar", "translation"]), help="What the poses may differ by.")
@executor_options
def command(
    scans: tuple[str, ...],
    output: str | None,
    poses_to: str | None,
    json_path: str | None,
    moved: str | None,
    poses: str | None,
    sigma: tuple[float, float] | None,
    fixed: tuple[str, ...],
    ordered: bool,
    dof: str | None,
    run_folder: str | None,
    workers: int | None,
    dask: str | None,
    seed: int,
) -> int:
    """Find the poses of SCANS, in any order and pose, and fuse them.

    Exit status 0: all scans are placed in one frame; 3: some are left out, or there are several components.
    """
    if output is not None:
        writer_of(output)
    known = None if poses is None else _read_poses(poses, scans)
    with bar() as progress:
        found = fa.assemble(
            list(scans), poses=known, pose_sigma=sigma, fixed=[_index(name, scans) for name in fixed], ordered=ordered,
            dof=dof, executor=chosen_executor(workers, dask), run_folder=run_folder, progress=progress, seed=seed,
        )
    if poses_to is not None:
        placed = {scan: None if T is None else T.tolist() for scan, T in zip(scans, found.poses, strict=True)}
        _write(poses_to, json.dumps(placed, indent=1))
    if json_path is not None:
        _write(json_path, json.dumps({"scans": list(scans)} | found.to_dict(), indent=1))
    if output is not None:
        for number, model in enumerate(found.models, 1):
            fa.write_cloud(_numbered(output, number), model)
    if moved is not None:
        _write_moved(Path(moved), scans, found)
    _tell(scans, found)
    return 0 if len(found.components) == 1 and not found.left_out else 3


def _read_poses(path: str, scans: Sequence[str]) -> list[Any]:
    """The pose of each scan, None of those that the file does not name."""
    try:
        given = json.loads(Path(path).read_text())
    except (OSError, ValueError) as error:
        raise ArgumentError(f"poses must be JSON, {{scan: 4 x 4}}, but {path} is not: {error}") from error
    unknown = sorted(set(given) - set(scans))
    if unknown:
        raise ArgumentError(f"poses name scans that are not there, the first is {unknown[0]!r}")
    return [None if given.get(scan) is None else as_rigid(given[scan], f"the pose of {scan}") for scan in scans]


def _index(name: str, scans: Sequence[str]) -> int:
    if name not in scans:
        raise ArgumentError(f"fixed must name one of the scans, but is {name!r}")
    return scans.index(name)


def _numbered(path: str, number: int) -> str:
    file = Path(path)
    return path if number == 1 else str(file.with_name(f"{file.stem}_{number}{file.suffix}"))


def _write(path: str, text: str) -> None:
    try:
        with replacing(path) as unfinished:
            unfinished.write_text(text)
    except OSError as error:
        raise ArgumentError(f"{path} cannot be written: {error.strerror or error}") from error


def _write_moved(folder: Path, scans: Sequence[str], found: fa.Assembly) -> None:
    """Each placed scan with all that its file says of it, one at a time; a folder per component if there are more."""
    for number, members in enumerate(found.components, 1):
        place = folder if len(found.components) == 1 else folder / f"component_{number}"
        place.mkdir(parents=True, exist_ok=True)
        for k in members:
            fa.write_cloud(place / Path(scans[k]).name, fa.read_cloud(scans[k]).transformed(np.asarray(found.poses[k])))


def _tell(scans: Sequence[str], found: fa.Assembly) -> None:
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
