"""fieldalign demo: two simulated scans of a room, registered through the command line."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import click
import numpy as np

import fieldalign as fa
from fieldalign.clouds.simulated import simulate_pair
from fieldalign.evaluation import rotation_error, translation_error


@click.command("demo")
@click.option("--output", type=click.Path(file_okay=False), default="demo", show_default=True, help="Folder to fill.")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of the room and of both scans.")
@click.option("--points", type=int, default=100_000, show_default=True, help="Points of each scan.")
def command(output: str, seed: int, points: int) -> int:
    """Simulate two scans of a furnished room, register them, and compare with the truth.

    Leaves source.ply, target.ply, aligned.ply, result.json, truth.txt and, with the extra viz, picture.png.
    """
    folder = Path(output)
    folder.mkdir(parents=True, exist_ok=True)
    pair = simulate_pair(seed, points)
    fa.write_cloud(folder / "source.ply", pair.source)
    fa.write_cloud(folder / "target.ply", pair.target)
    np.savetxt(folder / "truth.txt", pair.T_target_source)
    click.echo(f"Two scans of {points} points of a simulated room, overlap {pair.overlap:.0%}, in {folder}")
    arguments = ["source.ply", "target.ply", "--output", "aligned.ply", "--json", "result.json"]
    if _can_draw():
        arguments += ["--picture", "picture.png"]
    click.echo(f"$ cd {folder} && fieldalign register {' '.join(arguments)}")
    (folder / "result.json").unlink(missing_ok=True)
    status = subprocess.run([sys.executable, "-m", "fieldalign", "register", *arguments], cwd=folder).returncode
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
