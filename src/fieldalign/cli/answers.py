"""How the answer for a pair is told: on the terminal, as JSON, and by the exit status."""

from __future__ import annotations

import json
import sys
from typing import Any, Protocol

import click

import fieldalign as fa

from .files import write_text


class Told(Protocol):
    """What can be told as JSON: a RegistrationResult, a Deviation, an Evaluation."""

    def to_dict(self) -> dict[str, Any]: ...  # noqa: D102


def write_json(result: Told, path: str | None) -> None:
    """Writes the result to a file, whole or not at all; nothing for None and for "-", which is stdout."""
    write_text(path, as_json(result))


def tell(result: fa.RegistrationResult, json_path: str | None) -> int:
    """Prints the answer, as JSON where that is asked for on stdout; the exit status."""
    if json_path == "-":
        click.echo(as_json(result))
    else:
        _print(result)
    return 0 if result.accepted else 3


def as_json(result: Told) -> str:
    """The result as JSON."""
    return json.dumps(result.to_dict(), indent=1)


def _print(result: fa.RegistrationResult) -> None:
    """The pose, so that it can be copied, and what is known of it."""
    import numpy as np

    click.echo("T_target_source =")
    np.savetxt(sys.stdout, result.T_target_source, fmt="% .9f")
    click.echo(result.verdict)
    click.echo(
        f"overlap {result.overlap:.0%} of the source, {result.overlap_target:.0%} of the target; "
        f"rmse {result.rmse:.3g}; {result.iterations} iterations; {sum(result.seconds.values()) * 1e3:.0f} ms"
    )
    for name, rows in zip(("source", "target"), result.dropped, strict=True):
        if rows:
            click.echo(f"{rows} missing returns (NaN) of the {name} left out")
