"""How much a command says on stderr: --quiet and --verbose of every verb, before or after its name."""

from __future__ import annotations

import click

_chosen = ""


def is_quiet() -> bool:
    """Nothing but errors."""
    return _chosen == "quiet"


def is_verbose() -> bool:
    """Every step with its time, and where an error came from."""
    return _chosen == "verbose"


def reset() -> None:
    """As without either option."""
    global _chosen
    _chosen = ""


def flags() -> list[str]:
    """The options that hand it on to another command."""
    return [f"--{_chosen}"] if _chosen else []


def options() -> list[click.Option]:
    """Both options, for a command."""
    return [
        click.Option(["-q", "--quiet"], is_flag=True, expose_value=False, callback=_choose,
                     help="No progress and no warnings; errors alone go to stderr."),
        click.Option(["-v", "--verbose"], is_flag=True, expose_value=False, callback=_choose,
                     help="Each step with its time as a line on stderr; a traceback with an error."),
    ]


def _choose(ctx: click.Context, parameter: click.Parameter, is_given: bool) -> None:
    global _chosen
    if not is_given:
        return
    if _chosen not in ("", parameter.name):
        raise click.UsageError("--quiet and --verbose exclude each other")
    _chosen = str(parameter.name)
