"""The house itself: what is public, what is quiet, what imports what."""

import ast
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import fieldalign as fa

ROOT = Path(__file__).parents[1]
SOURCE = Path(fa.__file__).parent
MODULES = sorted(SOURCE.rglob("*.py"))
PEERS = {"open3d", "small_gicp", "kiss_matcher", "kiss_icp", "teaserpp_python", "evo"}


def imported(module: Path) -> set[str]:
    nodes = list(ast.walk(ast.parse(module.read_text())))
    plain = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    named = [node for node in nodes if isinstance(node, ast.ImportFrom) and not node.level]
    return plain | {node.module for node in named if node.module}


def test_public_names_exist():
    assert all(hasattr(fa, name) for name in fa.__all__)
    assert (SOURCE / "py.typed").is_file()


def test_no_peer_is_imported():
    for module in MODULES:
        assert not {name.split(".")[0] for name in imported(module)} & PEERS, module


def test_the_library_never_prints():
    for module in MODULES:
        if "cli" in module.parts:
            continue
        calls = [n.func for n in ast.walk(ast.parse(module.read_text())) if isinstance(n, ast.Call)]
        assert not [c for c in calls if isinstance(c, ast.Name) and c.id in {"print", "eval", "exec"}], module


def test_importing_is_quiet_and_light():
    heavy = ("matplotlib", "trimesh", "pypcd4", "laspy", "scipy")
    code = f"import fieldalign, sys; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
    assert done.stderr == ""


def test_every_exception_is_ours():
    for error in (fa.ArgumentError, fa.CloudFileError, fa.FieldError, fa.MissingExtraError):
        assert issubclass(error, fa.FieldalignError)
    assert issubclass(fa.ArgumentError, ValueError)
    assert issubclass(fa.CloudFileError, ValueError)


def test_the_lock_holds_what_the_package_asks_for():
    """Every dependency, and those of the extras that are locked, by hash, at a version that is allowed."""
    Requirement = pytest.importorskip("packaging.requirements").Requirement
    canonicalize_name = pytest.importorskip("packaging.utils").canonicalize_name
    blocks = (ROOT / "requirements.lock").read_text().replace("\\\n", " ").splitlines()
    pins: dict[str, list[str]] = {}
    for block in blocks:
        pin, *hashes = block.split(" --hash=sha256:")
        name, _, version = pin.partition(";")[0].strip().partition("==")
        assert hashes, f"{name} is locked without a hash"
        pins.setdefault(canonicalize_name(name), []).append(version)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    locked = [extras[name] for name in ("viz", "las", "e57", "mesh", "volume", "dask", "bag", "hdf5")]
    for requirement in map(Requirement, sum(locked, project["dependencies"])):
        versions = pins[canonicalize_name(requirement.name)]
        assert all(version in requirement.specifier for version in versions), f"{requirement}: run `make lock`"
