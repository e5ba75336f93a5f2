"""The methods that an experiment measures side by side: this project's, and other people's by a folder of adapters."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Mapping
from contextlib import closing
from dataclasses import dataclass
from functools import cache
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..assembly.executor import Processes, Task
from ..errors import ArgumentError
from ..fields.protocol import Floats
from ..motions import Matrix
from ..register import register
from ..settings import Settings

_faults: dict[ByPeer, str | None] = {}  # of peers that were tried


class Answer(NamedTuple):
    """A pose (4, 4), and whether the method itself trusts it; None where it does not say."""

    T_target_source: Matrix
    accepted: bool | None


class Align(Protocol):
    """A way to register; pickles, and its repr says all that decides about its answers."""

    def __call__(self, source: Floats, target: Floats, T_guess: Matrix, threads: int, seed: int) -> Answer:
        """The pose that it finds."""
        ...


@dataclass(frozen=True)
class Column:
    """A method in a table. name: on the command line and in files; title: in tables."""

    name: str
    title: str
    align: Align


@dataclass(frozen=True)
class ByPaper:
    """The paper's method. from_guess: whether it starts from the guess, or from the centroids laid on each other."""

    settings: Settings
    from_guess: bool = False

    def __call__(self, source: Floats, target: Floats, T_guess: Matrix, threads: int, seed: int) -> Answer:
        """See Align."""
        init = T_guess if self.from_guess else None
        result = register(source, target, init=init, method="paper", settings=self.settings, seed=seed, threads=threads)
        return Answer(result.T_target_source, result.accepted)


@dataclass(frozen=True)
class ByDefault:
    """This project's default. angle: degrees around the guess in which the setting lets it search; None: from any pose,
    without the guess."""

    angle: float | None = None

    def __call__(self, source: Floats, target: Floats, T_guess: Matrix, threads: int, seed: int) -> Answer:
        """See Align."""
        prior: dict[str, Any] = {} if self.angle is None else {"init": T_guess, "search_angle": self.angle}
        result = register(source, target, seed=seed, threads=threads, **prior)
        return Answer(result.T_target_source, result.accepted)


PRIOR = Column("default", "fieldalign, from the guess, within 50 deg", ByDefault(50.0))
ANY_POSE = Column("default-any-pose", "fieldalign, without a guess", ByDefault())


@dataclass(frozen=True)
class ByPeer:
    """A method of a folder of adapters, which is told a length that suits the data; it starts where ByPaper does."""

    folder: str
    name: str
    voxel: float
    from_guess: bool = False
    checkout: str | None = None

    def __call__(self, source: Floats, target: Floats, T_guess: Matrix, threads: int, seed: int) -> Answer:
        """See Align. What the peer answers is checked: a pose with NaN is none."""
        align = _peer(self.folder, self.name, self.checkout, threads)
        T = np.asarray(align(source, target, self.voxel, threads, T_guess if self.from_guess else None), float)
        if T.shape != (4, 4) or not np.isfinite(T).all():
            raise ArgumentError(f"the answer of {self.name} must be a finite (4, 4) matrix, but is {T.tolist()}")
        return Answer(T, None)


def peers_in(folder: Path, names: Iterable[str], checkouts: Mapping[str, Path]) -> dict[str, str]:
    """The titles of the methods of a folder of adapters, as far as they are among the names and can be had: a method
    that needs a checkout only with one.

    Raises ArgumentError for a folder without adapters.
    """
    methods = adapters(str(folder.absolute())).METHODS
    needs = {name for name, (_, _, options) in methods.items() if options.get("checkout", "") is None}
    return {name: methods[name][1] for name in names if name in methods and (name not in needs or name in checkouts)}


def unloadable(peers: Iterable[ByPeer]) -> dict[str, str]:
    """Why peers cannot be loaded here, by name: a package is missing. Asked once, in a process of its own, since what
    they load is heavy, and may take a number of threads only once."""
    named = {peer.name: peer for peer in peers}
    tasks = [Task(name, (), peer) for name, peer in named.items() if peer not in _faults]
    if tasks:
        with closing(Processes(1).run(_fault_of, tasks, {})) as answers:
            _faults.update({named[done.key]: done.error or done.value for done in answers})
    return {name: fault for name, peer in named.items() if (fault := _faults[peer]) is not None}


def _fault_of(peer: ByPeer, load: object) -> str | None:
    try:
        _peer(peer.folder, peer.name, peer.checkout, 1)
    except ImportError as error:
        return str(error)
    return None


@cache
def adapters(folder: str) -> ModuleType:
    """The package of adapters in a folder: METHODS, name -> (module, title, options), and load(name, **options)."""
    init = Path(folder, "__init__.py")
    if not init.is_file():
        raise ArgumentError(f"peers must be a folder with adapters, as benchmarks/peers of a checkout, but {init} "
                            "is no file")
    spec = spec_from_file_location("fieldalign_peers", init, submodule_search_locations=[folder])
    if spec is None or spec.loader is None:
        raise ArgumentError(f"peers must be a folder with adapters, but {init} cannot be loaded")
    module = module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@cache
def _peer(folder: str, name: str, checkout: str | None, threads: int) -> Any:
    """The align function of a peer; not all of them can be told a number of threads otherwise, and only before."""
    os.environ["OMP_NUM_THREADS"] = str(threads)
    return adapters(folder).load(name, **({} if checkout is None else {"checkout": checkout}))
