"""A list of pairs as work: each distinct cloud is an item, each distinct pair a task."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import as_numbers
from ..errors import ArgumentError
from ..fields.protocol import Floats
from ..flat import FlatCloud
from ..prepare import CloudLike, prepare_named
from ..prepared import PreparedCloud
from ..register import register
from .identity import identity_of
from .pair_result import PairResult
from .work import Done, Items, Load, Task

Pair: TypeAlias = tuple[CloudLike, CloudLike] | tuple[CloudLike, CloudLike, ArrayLike | None]


class Pairs:
    """Pairs (source, target) or (source, target, init).

    keys: of each pair its task's key; equal pairs have one. tasks: by key. clouds: by name, which is a path as it was
    given, or "cloud 3" for the fourth distinct object.

    Raises ArgumentError for what is no pair, and for an init that is no matrix of numbers.
    """

    def __init__(self, pairs: Iterable[Pair]) -> None:
        self.clouds: dict[str, CloudLike] = {}
        self.tasks: dict[str, Task] = {}
        self.keys: list[str] = []
        self._names: dict[int, str] = {}
        for number, pair in enumerate(pairs):
            self._add(pair, f"pairs[{number}]")

    def items(self, threads: int, drop_nonfinite: bool) -> Items:
        """How each cloud is made ready."""
        return {
            name: partial(ready, _anywhere(cloud), name, threads, drop_nonfinite)
            for name, cloud in self.clouds.items()
        }

    def identities(self) -> dict[str, Any]:
        """What tells of each cloud that it is still the same."""
        return {name: identity_of(cloud, name) for name, cloud in self.clouds.items()}

    def result(self, done: Done) -> PairResult:
        """What came of a task."""
        if done.error is None:
            return done.value  # type: ignore[no-any-return]
        source, target = self.tasks[done.key].data[0]
        return PairResult.failed(source, target, done.error)

    def _add(self, pair: Pair, name: str) -> None:
        if not isinstance(pair, tuple | list) or len(pair) not in (2, 3):
            raise ArgumentError(f"{name} must be (source, target) or (source, target, init), but is {_short(pair)}")
        names = self._named(pair[0]), self._named(pair[1])
        init = _as_matrix(pair[2], f"init of {name}") if len(pair) == 3 and pair[2] is not None else None
        key = json.dumps([*names, None if init is None else init.tolist()])
        self.tasks[key] = Task(key, names, (names, init))
        self.keys.append(key)

    def _named(self, cloud: CloudLike) -> str:
        if isinstance(cloud, str | os.PathLike):
            name = os.fspath(cloud)
        else:
            name = self._names.setdefault(id(cloud), f"cloud {len(self._names)}")
        self.clouds.setdefault(name, cloud)
        return name


@dataclass(frozen=True)
class RegisterPair:
    """The work on one pair, for an executor. options, threads: of fa.register."""

    options: Mapping[str, Any]
    threads: int

    def __call__(self, data: tuple[tuple[str, str], Floats | None], load: Load) -> PairResult:
        """Registers the clouds of two names, from a guess (4, 4) or None."""
        (source, target), init = data
        result = register(load(source), load(target), init=init, threads=self.threads, **self.options)
        return PairResult.of(source, target, result)


def told(options: Mapping[str, Any]) -> dict[str, str]:
    """What decides about results, exactly, as text."""
    return {name: json.dumps(value, default=_parts) for name, value in options.items()}


def _parts(value: Any) -> Any:
    """An array's numbers, or a settings object's parts."""
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else vars(value)


def ready(cloud: CloudLike, name: str, threads: int, drop_nonfinite: bool) -> PreparedCloud | FlatCloud:
    """A cloud made ready for registration, where the work is."""
    return prepare_named(cloud, name, threads, drop_nonfinite)


def _anywhere(cloud: CloudLike) -> CloudLike:
    """A path that another process finds, too."""
    return os.fspath(Path(cloud).absolute()) if isinstance(cloud, str | os.PathLike) else cloud


def _as_matrix(init: ArrayLike, name: str) -> Floats:
    matrix = as_numbers(init, name, "a (4, 4) matrix of numbers")
    if matrix.shape not in ((4, 4), (3, 3)):
        raise ArgumentError(f"{name} must be a (4, 4) matrix, but has shape {matrix.shape}")
    return matrix


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."
