"""fieldalign register SOURCE TARGET: the motion between two scans."""

from __future__ import annotations

from pathlib import Path

import click

import fieldalign as fa

from ..errors import ArgumentError
from .answers import tell, write_json
from .files import check_output, check_picture, check_report, drawn, write_moved
from .poses import read_dof, read_pose
from .progress import file_size, stages

_PRESETS = ("object", "indoor", "outdoor", "object-near", "indoor-dense")  # fa.PRESETS

_ANOTHER_UNIT = 30  # times as large: rather another unit than a part of the whole


@click.command("register")
@click.argument("source", type=click.Path())
@click.argument("target", type=click.Path())
@click.option("--init", metavar="POSE", help="Guess of T_target_source: .txt, .npy, .json, or 16 numbers.")
@click.option("--search-radius", type=float, help="With --init: search so far from it (the clouds' unit).")
@click.option("--search-angle", type=float, help="With --init: search so far from it (degrees).")
@click.option("--dof", metavar="NAMES", help="What is free: levelled, planar, yaw, or any of 'rx ry rz x y z'.")
@click.option("--dof-axis", metavar="X,Y,Z", help="With --dof: the axis that z stands for, in TARGET's frame.")
@click.option("--dof-centre", metavar="X,Y,Z", help="With --dof: about which place it turns, in TARGET's frame.")
@click.option("--scale", is_flag=True, help="SOURCE is in another unit: its scale is sought, too.")
@click.option("--output", type=click.Path(), help="Write the source, moved into the target's frame, to this file.")
@click.option("--json", "json_path", type=click.Path(allow_dash=True), help="Write the result as JSON; - for stdout.")
@click.option("--picture", type=click.Path(), help="Draw both clouds before and after (.png, .svg, .pdf).")
@click.option("--report", type=click.Path(), help="Write a page with all of it, in 3D, to keep (.html).")
@click.option("--method", type=click.Choice(["robust", "paper"]), default="robust", show_default=True,
              help="robust: from any pose; paper: as published, from --init or the centroids.")
@click.option("--settings", type=click.Choice(_PRESETS),
              help="Of the paper's method.  [default: indoor]")
@click.option("--length-scale", type=click.FloatRange(min=0, min_open=True),
              help="Of the paper's method: multiply its lengths, which are metres: 1000 for millimetres.")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of every random draw.")
@click.option("--threads", type=int, default=None, help="How many threads; all cores by default.")
def command(
    source: str,
    target: str,
    init: str | None,
    search_radius: float | None,
    search_angle: float | None,
    dof: str | None,
    dof_axis: str | None,
    dof_centre: str | None,
    scale: bool,
    output: str | None,
    json_path: str | None,
    picture: str | None,
    report: str | None,
    method: str,
    settings: str | None,
    length_scale: float | None,
    seed: int,
    threads: int | None,
) -> int:
    """Find the motion that brings SOURCE onto TARGET, from any pose.

    SOURCE and TARGET are in one unit: scans (.ply, .pcd, .xyz, .txt, .csv, .npy, .npz, .bin, .las, .laz, .e57, .obj),
    meshes, taken by their triangles (.stl, .ply, .obj, .off), or volumes (.nrrd, .nhdr, .npz with `values`).
    """
    from ..fields.files import read_shape
    from ..prepare import prepare_pair
    from ..threads import resolve_threads

    chosen = _settings(method, settings, length_scale)
    guess = None if init is None else read_pose(init, scaled=scale)
    free = read_dof(dof, dof_axis, dof_centre)
    check_output(output)
    check_picture(picture)
    check_report(report)
    sizes = file_size(source), file_size(target)
    with stages(
        {"reading source": sizes[0], "reading target": sizes[1], "aligning": 4 * sum(sizes), "writing": sum(sizes)}
    ) as stage:
        stage()
        source_shape = read_shape(source)
        check_output(output, source_shape)
        stage()
        target_shape = read_shape(target)
        stage()
        pair = prepare_pair(source_shape, target_shape, resolve_threads(threads), True)
        result = fa.register(
            *pair, init=guess, search_radius=search_radius, search_angle=search_angle,
            method=method, settings=chosen, seed=seed, threads=threads, dof=free, scale=scale,
        )
        stage()
        if output is not None:
            write_moved(output, source_shape, result.T_target_source)
        if picture is not None:
            from ..reports.picture import before_and_after

            title = f"{Path(source).name} onto {Path(target).name}: {result.reason.value}, overlap {result.overlap:.0%}"
            before_and_after(drawn(source_shape), drawn(target_shape), result.T_target_source, picture, title)
        if report is not None:
            from ..reports import write_report

            write_report(result, *pair, report, f"{Path(source).name} onto {Path(target).name}")
        write_json(result, json_path)
    status = tell(result, json_path)
    if not (result.accepted or scale or json_path == "-"):
        _ask_about_units(pair[0].extent / pair[1].extent)
    return status


def _ask_about_units(ratio: float) -> None:
    """A hint where the one cloud is so much larger than the other that its unit may be another one."""
    factor = max(ratio, 1 / ratio)
    if factor > _ANOTHER_UNIT:
        click.echo(f"One is {factor:.0f} times as large as the other: are both in one unit? --scale seeks the factor.")


def _settings(method: str, preset: str | None, length_scale: float | None) -> fa.Settings | None:
    """The paper's settings; None for the robust method, which takes none."""
    if method == "robust":
        if preset is not None or length_scale is not None:
            raise ArgumentError("--settings and --length-scale belong to --method paper; the robust method takes none")
        return None
    return fa.PRESETS[preset or "indoor"].scaled(length_scale or 1.0)
