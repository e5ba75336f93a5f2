"""The command line: one file per verb; each parses, calls one public function and prints.

A verb's file imports what it works with where it works: its --help waits for no library.
"""

from __future__ import annotations

import logging
import signal
import sys
import threading
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import NoReturn

import click

from ..errors import FieldalignError, printable
from . import loudness

VERBS = (
    "register", "verify", "batch", "assemble", "odometry", "localize", "evaluate", "deviation", "plot", "experiment",
    "demo", "completion",
)


class LazyVerbs(click.Group):
    """Loads a verb, and what it needs, only when it is called: --help stays quick."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The verbs in the order of the way of the data."""
        return list(VERBS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of a verb, from the file of its name, with the options that every verb has."""
        if cmd_name not in VERBS:
            return None
        command: click.Command = import_module(f".{cmd_name}", __name__).command
        if not any(parameter.name == "quiet" for parameter in command.params):
            command.params += loudness.options()
        return command


@click.group(cls=LazyVerbs, context_settings={"help_option_names": ["-h", "--help"]}, params=loudness.options())
@click.version_option(package_name="fieldalign")
def cli() -> None:
    """Find the rigid motion between scans, and say whether it can be trusted.

    Exit status: 0 accepted, 1 an error of the user, 3 finished but not accepted, 130 and 143 ended by Ctrl-C (SIGINT)
    and SIGTERM.
    """


def main(args: list[str] | None = None) -> None:
    """Runs a command; an error of the user is one line on stderr and exit status 1, a warning one line.

    A SIGINT (Ctrl-C) or SIGTERM ends it with exit status 130 or 143; a file that it was writing is not there, or is the
    older one.
    """
    loudness.reset()
    try:
        with _ended_by_signals(), _one_line_warnings():
            status = cli.main(args=args, prog_name="fieldalign", standalone_mode=False)
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message())
        sys.exit(1)
    except click.ClickException as error:
        _fail(error.format_message())
    except FieldalignError as error:
        if loudness.is_verbose():
            traceback.print_exc()
        _fail(str(error))
    except OSError as error:  # of stdout, with a full disk behind it, or of a file of which nothing else is known
        _fail(f"{error.filename or 'the output cannot be written'}: {error.strerror or error}")
    except (click.Abort, KeyboardInterrupt):
        sys.exit(128 + signal.SIGINT)
    sys.exit(status or 0)


@contextmanager
def _ended_by_signals() -> Iterator[None]:
    """A SIGTERM ends the command as Ctrl-C does: what it had begun to write is removed. Whatever becomes of the
    exception on its way (Python itself wraps some), the exit status names the signal."""
    came = 0

    def end(number: int, frame: object) -> NoReturn:
        nonlocal came
        came = number
        raise KeyboardInterrupt

    in_main = threading.current_thread() is threading.main_thread()
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM) if in_main}
    before = {number: handler for number, handler in before.items() if handler != signal.SIG_IGN}
    try:
        for number in before:
            signal.signal(number, end)
        yield
    except BaseException:
        if came:
            sys.exit(128 + came)
        raise
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def _one_line_warnings() -> Iterator[None]:
    """What the library warns of or logs, as single lines on stderr while a command runs."""
    handler = _Warnings()
    logger = logging.getLogger("fieldalign")
    logger.addHandler(handler)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("default", UserWarning)
            warnings.showwarning = lambda message, *_, **__: _warn(str(message))
            yield
    finally:
        logger.removeHandler(handler)


class _Warnings(logging.Handler):
    def emit(self, record: logging.LogRecord) -> None:
        _warn(record.getMessage())


def _warn(message: str) -> None:
    """A line, in place of a bar that stands there."""
    if not loudness.is_quiet():
        click.echo(("\r\x1b[K" if sys.stderr.isatty() else "") + printable(f"Warning: {message}"), err=True)


def _fail(message: str) -> NoReturn:
    click.echo("Error: " + printable(" ".join(message.split())), err=True)
    sys.exit(1)
