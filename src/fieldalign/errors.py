"""Every exception that fieldalign raises on purpose.

    FieldalignError
    ├── ArgumentError (ValueError)       an argument has the wrong shape, value or combination
    │   ├── CloudFileError               a file is missing, truncated, foreign or promises what it does not hold
    │   ├── DataSetError                 a folder holds nothing of a data set, or something that cannot be of it
    │   └── FieldError                   a distance field answered with the wrong shape or with NaN or infinity
    ├── RunError                         work on many scans cannot begin or go on: its folder, the disk, the workers
    └── MissingExtraError (ImportError)  an optional dependency is not installed; the message names the extra

Each message is one sentence that names the argument, says what came and what is allowed.
"""


class FieldalignError(Exception):
    """Root of all exceptions of fieldalign."""


class ArgumentError(FieldalignError, ValueError):
    """An argument has the wrong shape, value or combination."""


class CloudFileError(ArgumentError):
    """A file is missing, truncated, foreign or promises what it does not hold."""


class DataSetError(ArgumentError):
    """A folder holds nothing of a data set of the experiments, or something that cannot be of it."""


class FieldError(ArgumentError):
    """A distance field answered with the wrong shape or with values that are not finite."""


class RunError(FieldalignError):
    """Work on many scans cannot begin or go on: something is wrong with its run folder, the disk or the workers."""


class MissingExtraError(FieldalignError, ImportError):
    """An optional dependency is not installed; the message names the extra that brings it."""


def missing_extra(extra: str, purpose: str) -> MissingExtraError:
    """The error for an absent optional dependency: what it is needed for, and the command that brings it."""
    return MissingExtraError(f"{purpose} needs the extra '{extra}': pip install 'fieldalign[{extra}]'")


def printable(text: str) -> str:
    """The text with a sign in the place of each that a terminal would obey: files may say anything."""
    return "".join(sign if sign.isprintable() else "\N{REPLACEMENT CHARACTER}" for sign in text)
