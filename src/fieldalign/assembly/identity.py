"""What tells that a scan is still the one that it was."""

from __future__ import annotations

import hashlib
import os
import pickle
from typing import Any

import numpy as np

from ..clouds.cloud import PointCloud
from ..clouds.files import split_part
from ..errors import ArgumentError


def identity_of(cloud: Any, name: str) -> list[Any]:
    """For a path the file's size and time (ns), None where there is none; otherwise a digest of the content.

    Raises ArgumentError that names it for what has no content of its own, such as a field with a native tree.
    """
    if isinstance(cloud, str | os.PathLike):
        return ["file", *_state_of(cloud)]
    if isinstance(cloud, PointCloud):
        parts = [cloud.points] + ([] if cloud.viewpoint is None else [cloud.viewpoint])
        return ["points", _digest(*parts)]
    try:
        points = np.asarray(cloud)
        if points.dtype.kind in "fiu":
            return ["points", _digest(points)]
        return [type(cloud).__name__, hashlib.blake2b(pickle.dumps(cloud), digest_size=16).hexdigest()]
    except Exception as error:  # pickling raises anything
        raise ArgumentError(
            f"{name} cannot be told from another {type(cloud).__name__} when a run goes on: give a path or points, or "
            "no run_folder"
        ) from error


def _state_of(path: str | os.PathLike[str]) -> tuple[int | None, int | None]:
    try:
        state = os.stat(split_part(path)[0])
    except OSError:
        return None, None
    return state.st_size, state.st_mtime_ns


def _digest(*arrays: Any) -> str:
    content = hashlib.blake2b(digest_size=16)
    for array in arrays:
        content.update(f"{array.dtype} {array.shape} ".encode())
        content.update(np.ascontiguousarray(array).data)
    return content.hexdigest()
