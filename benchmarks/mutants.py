"""Mutation testing: faults are put into the solver, the verdict and the readers, and the tests must see them.

A seeded sample of all mutants of an area, each run against the tests of the area, the module's own first, until one
fails. A mutant that runs out of time is killed, too: it hangs where the code does not.

    python benchmarks/mutants.py --output docs/benchmarks
"""

from __future__ import annotations

import argparse
import json
import os
import random
import resource
import shutil
import sys
import tempfile
from contextlib import suppress
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from mutations import Mutant, mutants_of

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "src" / "fieldalign"


class Area(NamedTuple):
    """What is mutated, and the tests that must see it."""

    modules: tuple[str, ...]
    tests: tuple[str, ...]


AREAS = {
    "solver": Area(
        ("alignment/*.py", "methods/by_points.py", "methods/pair.py", "methods/paper.py", "methods/refined.py",
         "methods/robust.py", "methods/similar.py", "motions.py"),
        ("alignment", "test_motions.py", "methods/test_exact.py", "methods/test_similar.py", "methods/test_dof.py"),
    ),
    "verdict": Area(
        ("verdict/*.py", "methods/judged.py", "methods/paper_verdict.py"),
        ("verdict", "methods/test_judged.py", "methods/test_paper_verdict.py", "test_verify.py"),
    ),
    "readers": Area(
        ("clouds/files.py", "clouds/checks.py", "clouds/formats/*.py", "fields/files.py", "fields/volume_files.py"),
        ("clouds/test_files.py", "clouds/test_foreign_writers.py", "clouds/test_bad_files.py", "fields/test_files.py",
         "fields/test_volume_files.py", "clouds/test_checks.py", "clouds/test_bombs.py", "clouds/test_byte_order.py"),
    ),
}
LOADED = ("scipy.optimize", "scipy.spatial.transform", "trimesh", "laspy", "lazrs", "pypcd4", "pye57", "nrrd", "igl")
MOST = 150  # seconds of a processor, for all tests of an area: what needs more hangs


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, required=True)
    parser.add_argument("--area", choices=AREAS, action="append")
    parser.add_argument("--count", type=int, default=80, help="mutants of each area")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    given.output.mkdir(parents=True, exist_ok=True)
    path = given.output / "mutants.json"
    report = json.loads(path.read_text()) if path.is_file() else {}
    for library in LOADED:  # before the forks
        with suppress(ImportError):
            import_module(library)
    os.chdir(ROOT)
    sys.dont_write_bytecode = True
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        package = copied(Path(folder))
        for name in given.area or AREAS:
            if run([str(ROOT / "tests" / test) for test in AREAS[name].tests], package.parent) != "survived":
                sys.exit(f"the tests of the {name} fail before anything is mutated")
            report[name] = tried(AREAS[name], package, given.count, given.seed)
            path.write_text(json.dumps(report, indent=1) + "\n")
            print(f"{name}: {report[name]['killed']} of {report[name]['mutants']} killed", flush=True)


def copied(folder: Path) -> Path:
    """The package of this checkout with the core of the installed one, which is not imported here."""
    package = folder / "fieldalign"
    shutil.copytree(SOURCE, package, ignore=shutil.ignore_patterns("__pycache__"))
    installed = find_spec("fieldalign")
    assert installed is not None
    for core in Path(installed.origin).parent.glob("_core*.so"):
        shutil.copy(core, package)
    return package


def tried(area: Area, package: Path, count: int, seed: int) -> dict[str, Any]:
    """What became of a sample of the area's mutants."""
    every = [(file, mutant) for file in modules(area) for mutant in mutants_of((SOURCE / file).read_text())]
    sample = random.Random(seed).sample(every, min(count, len(every)))
    survivors = []
    for file, mutant in sample:
        fate = fate_of(file, mutant, tests_of(file, area), package)
        print(f"{fate:8} {file}:{mutant.line}  {mutant.what}", flush=True)
        if fate == "survived":
            survivors.append({"module": file, "line": mutant.line, "what": mutant.what})
    return {"of": len(every), "mutants": len(sample), "killed": len(sample) - len(survivors), "survivors": survivors}


def modules(area: Area) -> list[str]:
    found = (file for pattern in area.modules for file in SOURCE.glob(pattern))
    return sorted(file.relative_to(SOURCE).as_posix() for file in found)


def tests_of(file: str, area: Area) -> list[str]:
    """The tests of the area, the module's own first."""
    own = ROOT / "tests" / Path(file).parent / f"test_{Path(file).name}"
    return [*([str(own)] if own.is_file() else []), *(str(ROOT / "tests" / name) for name in area.tests)]


def fate_of(file: str, mutant: Mutant, tests: list[str], package: Path) -> str:
    """"killed", "hung", which counts as killed, or "survived"."""
    (package / file).write_text(mutant.text)
    try:
        return next((fate for test in tests if (fate := run([test], package.parent)) != "survived"), "survived")
    finally:
        shutil.copy(SOURCE / file, package / file)


def run(tests: list[str], folder: Path) -> str:
    """In a fork of this process, which has the slow imports behind it."""
    if not (child := os.fork()):
        resource.setrlimit(resource.RLIMIT_CPU, (MOST, MOST))
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        os.environ["PYTHONPATH"] = str(folder)
        sys.path.insert(0, str(folder))
        os._exit(pytest.main(["-xq", "-p", "no:cacheprovider", "-m", "not slow", "--rootdir", str(ROOT), *tests]))
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    return "hung" if status < 0 else "survived" if status in (0, 5) else "killed"  # 5: all of them are slow


if __name__ == "__main__":
    main()
