"""fieldalign demo: two simulated scans of a room, registered through the command line."""

from __future__ import annotations

import json
import subprocess
import sys

import click

import fieldalign as fa

from . import loudness
from .files import made_folder, write_text
from .progress import stages


@click.command("demo")
@click.option("--output", type=click.Path(file_okay=False), default="demo", show_default=True, help="Folder to fill.")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of the room and of both scans.")
@click.option("--points", type=int, default=100_000, show_default=True, help="Points of each scan.")
def command(output: str, seed: int, points: int) -> int:
    """Simulate two scans of a furnished room, register them, and compare with the truth.

    Leaves source.ply, target.ply, aligned.ply, result.json, truth.txt and, with the extra viz, picture.png.
    """
    import numpy as np

    from ..clouds.simulated import simulate_pair
    from ..evaluation import rotation_error, translation_error

    folder = made_folder(output)
    with stages({"simulating": 9, "writing": 1}) as stage:
        stage()
        pair = simulate_pair(seed, points)
        stage()
        fa.write_cloud(folder / "source.ply", pair.source)
        fa.write_cloud(folder / "target.ply", pair.target)
        truth = "\n".join(" ".join(map(repr, row)) for row in pair.T_target_source.tolist())
        write_text(str(folder / "truth.txt"), truth + "\n")
    click.echo(f"Two scans of {points} points of a simulated room, overlap {pair.overlap:.0%}, in {folder}")
    arguments = ["source.ply", "target.ply", "--output", "aligned.ply", "--json", "result.json"]
    if _can_draw():
        arguments += ["--picture", "picture.png"]
    click.echo(f"$ cd {folder} && fieldalign register {' '.join(arguments)}")
    (folder / "result.json").unlink(missing_ok=True)
    program = [sys.executable, "-m", "fieldalign", "register"]
    status = subprocess.run([*program, *arguments, *loudness.flags()], cwd=folder).returncode
    if not (folder / "result.json").exists():
        return status
    result = json.loads((folder / "result.json").read_text())
    T = np.array(result["T_target_source"])
    click.echo(
        f"true error: {rotation_error(T, pair.T_target_source):.3f} degrees, "
        f"{translation_error(T, pair.T_target_source) * 1000:.1f} mm; "
        f"the scans were {rotation_error(np.eye(4), pair.T_target_source):.1f} degrees and "
        f"{translation_error(np.eye(4), pair.T_target_source) * 1000:.0f} mm apart"
    )
    click.echo(f"time: {sum(result['seconds'].values()) * 1000:.0f} ms for the registration, files not counted")
    if "--picture" in arguments:
        click.echo(f"picture of before and after: {folder / 'picture.png'}")
    return status


def _can_draw() -> bool:
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        click.echo("no picture: it needs the extra viz (pip install 'fieldalign[viz]')")
        return False
    return True
