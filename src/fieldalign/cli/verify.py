"""fieldalign verify SOURCE TARGET POSE: whether a pose that any tool has found may be used."""

from __future__ import annotations

import click

import fieldalign as fa

from ..fields.files import read_shape
from .answers import tell, write_json
from .poses import read_pose
from .progress import stages


@click.command("verify")
@click.argument("source", type=click.Path())
@click.argument("target", type=click.Path())
@click.argument("pose")
@click.option("--search/--no-search", default=True, show_default=True,
              help="Search all poses for one that agrees as well, or try only some around the given one.")
@click.option("--json", "json_path", type=click.Path(allow_dash=True), help="Write the result as JSON; - for stdout.")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of every random draw.")
@click.option("--threads", type=int, default=None, help="How many threads; all cores by default.")
def command(
    source: str, target: str, pose: str, search: bool, json_path: str | None, seed: int, threads: int | None
) -> int:
    """Judge the POSE that brings SOURCE onto TARGET: T_target_source in a .txt, .npy or .json, or 16 numbers.

    Exit status 0: it may be used; 3: it may not, and why.
    """
    T_target_source = read_pose(pose, "pose")
    with stages("reading source", "reading target", "judging") as stage:
        stage()
        source_shape = read_shape(source)
        stage()
        target_shape = read_shape(target)
        stage()
        result = fa.verify(source_shape, target_shape, T_target_source, search=search, seed=seed, threads=threads)
        write_json(result, json_path)
    return tell(result, json_path)
