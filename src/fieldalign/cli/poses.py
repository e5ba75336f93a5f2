"""Poses as people write them on a command line."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import ArgumentError

if TYPE_CHECKING:
    from ..dof import Dof
    from ..motions import Matrix


def read_pose(text: str, name: str = "init", scaled: bool = False) -> Matrix:
    """A rigid motion (4, 4) from a file (.npy, .json, or text of 4 rows) or from 16 numbers, row by row; or a
    similarity.

    A .json file holds 4 rows, or an object with the key T_target_source, as `--json` writes it.
    name: of the argument, in errors. Raises ArgumentError where it is none.
    """
    import numpy as np

    from ..arguments import as_numbers
    from ..motions import as_rigid, as_similar

    try:
        given = _from_file(Path(text)) if Path(text).is_file() else text.replace(",", " ").split()
        values = as_numbers(given, name)
    except (OSError, ValueError, EOFError, RecursionError) as error:
        wanted = "a file with a 4 x 4 pose or 16 numbers"
        raise ArgumentError(f"{name} must be {wanted}, but is {text!r}: {error}") from error
    if values.size != 16:
        raise ArgumentError(f"{name} must hold 16 numbers (4 x 4, row by row), but {text!r} holds {values.size}")
    return (as_similar if scaled else as_rigid)(np.reshape(values, (4, 4)), name)


def read_poses(path: str, scans: Sequence[str]) -> list[Any]:
    """The pose (4, 4) of each scan, as assemble writes them with --poses-to; None of those that the file does not name
    or has none of. Raises ArgumentError where it is no such file, or names scans that are not there."""
    from ..motions import as_rigid

    try:
        given = json.loads(Path(path).read_text())
    except (OSError, ValueError, RecursionError) as error:
        raise ArgumentError(f"poses must be JSON, {{scan: 4 x 4}}, but {path} is not: {error}") from error
    if not isinstance(given, dict):
        raise ArgumentError(f"poses must be JSON, {{scan: 4 x 4}}, but {path} holds no such object")
    if unknown := sorted(set(given) - set(scans)):
        raise ArgumentError(f"poses name scans that are not there, the first is {unknown[0]!r}")
    return [None if given.get(scan) is None else as_rigid(given[scan], f"the pose of {scan}") for scan in scans]


def _from_file(path: Path) -> Any:
    if path.suffix == ".npy":
        from ..clouds.formats.numpy import load_npy

        return load_npy(path)
    if path.suffix == ".json":
        content = json.loads(path.read_text())
        return content.get("T_target_source", content) if isinstance(content, dict) else content
    lines = path.read_text(encoding="utf-8-sig").splitlines()
    return " ".join(line.partition("#")[0].replace(",", " ") for line in lines).split()


def read_dof(free: str | None, axis: str | None, centre: str | None) -> Dof | None:
    """What is free, of what stands on the command line; None: all."""
    if free is None:
        if axis is not None or centre is not None:
            raise ArgumentError("--dof-axis and --dof-centre say about what --dof is free, but there is no --dof")
        return None
    from ..dof import Dof

    return Dof(free, *(None if part is None else part.replace(",", " ").split() for part in (axis, centre)))
