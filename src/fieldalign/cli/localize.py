"""fieldalign localize MAP SCAN...: where a sensor is on a map that is known."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import fieldalign as fa

from .files import check_folder, write_text
from .progress import bar

if TYPE_CHECKING:
    from ..odometry.sequences.sequence import Frame


@click.command("localize")
@click.argument("map_path", metavar="MAP", type=click.Path())
@click.argument("scans", metavar="SCAN...", type=click.Path(), nargs=-1, required=True)
@click.option("--topic", help="Of a bag, which; needed where it holds several with PointCloud2.")
@click.option("--trajectory", type=click.Path(), help="Write the poses that were found, in TUM's format, to this file.")
@click.option("--json", "json_path", type=click.Path(allow_dash=True), help="Write all of it as JSON; - for stdout.")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of every random draw.")
def command(
    map_path: str, scans: tuple[str, ...], topic: str | None, trajectory: str | None, json_path: str | None, seed: int
) -> int:
    """Find each SCAN on MAP, from no guess; a scan that follows another is tracked from there.

    MAP is a cloud, as `fieldalign odometry` writes it (map.ply), or any other one. SCANs are clouds, or one folder or
    bag that holds a drive. Scans that do not lie where they are expected are searched for in all of the map.

    Exit status 0: every scan has its place; 3: some have none, and why.
    """
    check_folder(trajectory, json_path)
    import numpy as np

    names, stamps = [], []
    with bar() as tell:
        tell("reading map", 0, None)
        localizer = fa.Localizer(map_path, seed=seed)
        count, frames = _frames(scans, topic)
        tell("scans", 0, count)
        for number, (name, frame) in enumerate(frames):
            cloud = frame.cloud
            localizer.step(cloud, None if cloud is None else cloud.times, frame.stamp)
            names.append(name)
            stamps.append(float(number) if frame.stamp is None else frame.stamp)
            tell("scans", number + 1, count)
    rows = [{"scan": name} | result.to_dict() for name, result in zip(names, localizer.results, strict=True)]
    placed = [k for k, result in enumerate(localizer.results) if result.tracked]
    if trajectory is not None:
        poses = np.reshape([localizer.results[k].pose for k in placed], (-1, 4, 4))
        fa.write_trajectory(trajectory, fa.Trajectory(np.array([stamps[k] for k in placed]), poses))
    everything = json.dumps(rows, indent=1)
    write_text(json_path, everything)
    click.echo(everything if json_path == "-" else "\n".join(map(_told, rows)))
    return 0 if len(placed) == len(rows) else 3


def _frames(scans: tuple[str, ...], topic: str | None) -> tuple[int | None, Iterator[tuple[str, Frame]]]:
    """How many there are, and each with its name: a scan's path, or its number in the drive."""
    from ..odometry.sequences.bags import is_bag
    from ..odometry.sequences.sequence import Frame

    first = Path(scans[0])
    if len(scans) == 1 and first.exists() and (first.is_dir() or is_bag(first)):
        sequence = fa.read_sequence(first, topic=topic)
        return sequence.length, ((f"frame {frame.index}", frame) for frame in sequence)
    return len(scans), ((scan, Frame(k, None, fa.read_cloud(scan))) for k, scan in enumerate(scans))


def _told(row: dict[str, Any]) -> str:
    where = "" if row["pose"] is None else " at " + " ".join(f"{line[3]:.3f}" for line in row["pose"][:3])
    return f"{row['scan']}: {row['reason']}{where}, agreement {row['agreement']:.0%}"
