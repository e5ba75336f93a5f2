"""Cloud formats, a module each: `read(path) -> PointCloud` and, where it makes sense, `write(path, cloud)`.

A reader raises CloudFileError with a predicate ("promises 8 points, but ..."), to which files.py adds the
file's name; whatever else a library raises, files.py turns into a CloudFileError. A writer returns what its
format has no place for.
"""

from ...errors import CloudFileError


def require_bytes(needed: int, present: int, promise: str) -> None:
    """Raises CloudFileError where a file cannot hold what its header promises: before any allocation."""
    if not 0 <= needed <= present:
        raise CloudFileError(
            f"promises {promise}, at least {needed} bytes, but holds only {max(present, 0)} bytes of data"
        )
