"""fieldalign verify SOURCE TARGET POSE: whether a pose that any tool has found may be used."""

from __future__ import annotations

from pathlib import Path

import click

import fieldalign as fa

from .answers import tell, write_json
from .files import check_report
from .poses import read_pose
from .progress import file_size, stages


@click.command("verify")
@click.argument("source", type=click.Path())
@click.argument("target", type=click.Path())
@click.argument("pose")
@click.option("--search/--no-search", default=True, show_default=True,
              help="Search all poses for one that agrees as well, or try only some around the given one.")
@click.option("--json", "json_path", type=click.Path(allow_dash=True), help="Write the result as JSON; - for stdout.")
@click.option("--report", type=click.Path(), help="Write a page with all of it, in 3D, to keep (.html).")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of every random draw.")
@click.option("--threads", type=int, default=None, help="How many threads; all cores by default.")
def command(
    source: str, target: str, pose: str, search: bool, json_path: str | None, report: str | None, seed: int,
    threads: int | None,
) -> int:
    """Judge the POSE that brings SOURCE onto TARGET: T_target_source in a .txt, .npy or .json, or 16 numbers.

    Exit status 0: it may be used; 3: it may not, and why.
    """
    from ..fields.files import read_shape
    from ..prepare import prepare_pair
    from ..threads import resolve_threads

    T_target_source = read_pose(pose, "pose")
    check_report(report)
    sizes = file_size(source), file_size(target)
    with stages(
        {"reading source": sizes[0], "reading target": sizes[1], "judging": 4 * sum(sizes), "writing": sum(sizes)}
    ) as stage:
        stage()
        source_shape = read_shape(source)
        stage()
        target_shape = read_shape(target)
        stage()
        pair = prepare_pair(source_shape, target_shape, resolve_threads(threads), True)
        result = fa.verify(*pair, T_target_source, search=search, seed=seed, threads=threads)
        stage()
        write_json(result, json_path)
        if report is not None:
            from ..reports import write_report

            title = f"{Path(source).name} onto {Path(target).name}, a given pose"
            write_report(result, *pair, report, title)
    return tell(result, json_path)
