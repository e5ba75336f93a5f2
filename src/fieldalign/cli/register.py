"""fieldalign register SOURCE TARGET: the motion between two scans."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import click
import numpy as np

import fieldalign as fa

from ..clouds.files import writer_of
from ..errors import ArgumentError
from ..whole_file import replacing
from .poses import read_pose
from .progress import stages


@click.command("register")
@click.argument("source", type=click.Path())
@click.argument("target", type=click.Path())
@click.option("--init", metavar="POSE", help="First guess of T_target_source: .txt, .npy, .json, or 16 numbers.")
@click.option("--output", type=click.Path(), help="Write the source, moved into the target's frame, to this file.")
@click.option("--json", "json_path", type=click.Path(allow_dash=True), help="Write the result as JSON; - for stdout.")
@click.option("--picture", type=click.Path(), help="Draw both clouds before and after (.png, .svg, .pdf).")
@click.option("--settings", type=click.Choice(list(fa.PRESETS)), default="indoor", show_default=True)
@click.option("--length-scale", type=click.FloatRange(min=0, min_open=True), default=1.0, show_default=True,
              help="Multiply every length of the settings: 1000 for millimetres, 0.1 for a tenth of the size.")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of the pseudo points.")
@click.option("--threads", type=int, default=None, help="How many threads; all cores by default.")
def command(
    source: str,
    target: str,
    init: str | None,
    output: str | None,
    json_path: str | None,
    picture: str | None,
    settings: str,
    length_scale: float,
    seed: int,
    threads: int | None,
) -> int:
    """Find the motion that brings SOURCE onto TARGET.

    SOURCE and TARGET are scans in one unit: .ply, .pcd, .xyz, .txt, .csv, .npy, .npz, .bin, .las, .laz, .e57, .obj,
    .stl. The presets' lengths are metres.
    """
    chosen = fa.PRESETS[settings].scaled(length_scale)
    guess = None if init is None else read_pose(init)
    _check_outputs(output, picture)
    with stages("reading source", "reading target", "aligning", "writing") as stage:
        stage()
        source_cloud = fa.read_cloud(source)
        stage()
        target_cloud = fa.read_cloud(target)
        stage()
        result = fa.register(source_cloud, target_cloud, init=guess, settings=chosen, seed=seed, threads=threads)
        stage()
        if output is not None:
            fa.write_cloud(output, source_cloud.transformed(result.T_target_source))
        if picture is not None:
            from ..reports.picture import before_and_after

            title = f"{Path(source).name} onto {Path(target).name}: {result.reason.value}, overlap {result.overlap:.0%}"
            before_and_after(source_cloud, target_cloud, result.T_target_source, picture, title)
        if json_path is not None and json_path != "-":
            _write_text(json_path, _as_json(result))
    if json_path == "-":
        click.echo(_as_json(result))
    else:
        _print(result)
    return 0 if result.accepted else 3


def _check_outputs(output: str | None, picture: str | None) -> None:
    """What cannot be written is said before the work, not after it."""
    if output is not None:
        writer_of(output)
    if picture is not None:
        from ..reports.picture import checked_path

        checked_path(picture)


def _as_json(result: fa.RegistrationResult) -> str:
    return json.dumps(result.to_dict(), indent=1)


def _write_text(path: str, text: str) -> None:
    try:
        with replacing(path) as unfinished:
            unfinished.write_text(text)
    except OSError as error:
        raise ArgumentError(f"{path} cannot be written: {error.strerror or error}") from error


def _print(result: fa.RegistrationResult) -> None:
    """The pose, so that it can be copied, and what is known of it."""
    click.echo("T_target_source =")
    np.savetxt(sys.stdout, result.T_target_source, fmt="% .9f")
    click.echo(result.reason)
    click.echo(
        f"overlap {result.overlap:.0%} of the source, {result.overlap_target:.0%} of the target; "
        f"rmse {result.rmse:.3g}; {result.iterations} iterations; {sum(result.seconds.values()) * 1e3:.0f} ms"
    )
    for name, rows in zip(("source", "target"), result.dropped, strict=True):
        if rows:
            click.echo(f"{rows} missing returns (NaN) of the {name} left out")
