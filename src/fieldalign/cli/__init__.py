"""The command line: one file per verb; each parses, calls one public function and prints."""

from __future__ import annotations

import logging
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module

import click

from ..errors import FieldalignError

VERBS = (
    "register", "verify", "batch", "assemble", "odometry", "localize", "evaluate", "deviation", "experiment", "demo",
)


class LazyVerbs(click.Group):
    """Loads a verb, and what it needs, only when it is called: --help stays quick."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The verbs in the order of the way of the data."""
        return list(VERBS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of a verb, from the file of its name."""
        if cmd_name not in VERBS:
            return None
        command: click.Command = import_module(f".{cmd_name}", __name__).command
        return command


@click.group(cls=LazyVerbs, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="fieldalign")
def cli() -> None:
    """Find the rigid motion between scans, and say whether it can be trusted.

    Exit status: 0 accepted, 1 an error of the user, 3 finished but not accepted.
    """


def main(args: list[str] | None = None) -> None:
    """Runs a command; an error of the user is one line on stderr and exit status 1, a warning one line."""
    try:
        with _one_line_warnings():
            status = cli.main(args=args, prog_name="fieldalign", standalone_mode=False)
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message())
        sys.exit(1)
    except click.ClickException as error:
        _fail(error.format_message())
    except FieldalignError as error:
        _fail(str(error))
    except click.Abort:
        sys.exit(130)
    sys.exit(status or 0)


@contextmanager
def _one_line_warnings() -> Iterator[None]:
    """What the library warns of or logs, as single lines on stderr while a command runs."""
    handler = logging.StreamHandler()
    handler.setFormatter(logging.Formatter("Warning: %(message)s"))
    logger = logging.getLogger("fieldalign")
    logger.addHandler(handler)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("default", UserWarning)
            warnings.showwarning = lambda message, *_, **__: click.echo(f"Warning: {message}", err=True)
            yield
    finally:
        logger.removeHandler(handler)


def _fail(message: str) -> None:
    click.echo("Error: " + " ".join(message.split()), err=True)
    sys.exit(1)
