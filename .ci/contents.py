"""Compares what the built archives hold with what they must, and nothing else; run by `make dist`.

    python .ci/contents.py dist
"""

from __future__ import annotations

import re
import sys
import tarfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "src" / "fieldalign"
LICENCES = ("LICENSE", "src/fieldalign/reports/page/three.LICENSE")
LEFTOVERS = re.compile(r"(^|/)(__pycache__|build|dist|\.[^/]*cache|\.venv[^/]*|\.git)/|\.(pyc|o|so|orig|swp)$")
SDIST_FOLDERS = {"cpp", "examples", "src", "tests"}  # what builds it, shows it and tests it
SDIST_FILES = {"CHANGELOG.md", "CITATION.cff", "CMakeLists.txt", "CONTRIBUTING.md", "LICENSE", "Makefile", "PKG-INFO",
               "README.md", "SECURITY.md", "pyproject.toml", "requirements.lock", ".gitignore"}


def main() -> None:
    folder = Path(sys.argv[1])
    (wheel,), (sdist,) = folder.glob("*.whl"), folder.glob("*.tar.gz")
    faults = [*of_wheel(names_in_wheel(wheel)), *of_sdist(names_in_sdist(sdist))]
    for fault in faults:
        print(f"{wheel.name}, {sdist.name}: {fault}", file=sys.stderr)
    sys.exit(1 if faults else 0)


def names_in_wheel(wheel: Path) -> set[str]:
    with zipfile.ZipFile(wheel) as archive:
        return set(archive.namelist())


def names_in_sdist(sdist: Path) -> set[str]:
    """Without the folder that all of it lies in."""
    with tarfile.open(sdist) as archive:
        return {name.partition("/")[2] for name in archive.getnames()} - {""}


def of_wheel(names: set[str]) -> list[str]:
    """What is wrong: the package's own files, one compiled core, the licences and what every wheel says of itself."""
    cores = {name for name in names if re.fullmatch(r"fieldalign/_core\.[\w.-]+\.(so|pyd)", name)}
    info = {name.partition("/")[2] for name in names if ".dist-info/" in name}
    own = {f"fieldalign/{file.relative_to(PACKAGE).as_posix()}" for file in PACKAGE.rglob("*") if file.is_file()}
    own = {name for name in own if not LEFTOVERS.search(name)}
    held = {name for name in names - cores if ".dist-info/" not in name}
    expected = {"METADATA", "WHEEL", "RECORD", "entry_points.txt", *(f"licenses/{name}" for name in LICENCES)}
    return [
        *differences(held, own, "the wheel"), *differences(info, expected, "the wheel's .dist-info"),
        *([] if len(cores) == 1 else [f"the wheel must hold one compiled core, but holds {sorted(cores)}"]),
    ]


def of_sdist(names: set[str]) -> list[str]:
    tops, left = {name.partition("/")[0] for name in names}, sorted(name for name in names if LEFTOVERS.search(name))
    return [
        *differences(tops, SDIST_FOLDERS | SDIST_FILES, "the sdist"),
        *([f"the sdist holds leftovers, {left[0]} the first"] if left else []),
    ]


def differences(held: set[str], expected: set[str], where: str) -> list[str]:
    return [f"{where} lacks {name}" for name in sorted(expected - held)] + [
        f"{where} holds {name}, which nothing asks for" for name in sorted(held - expected)
    ]


if __name__ == "__main__":
    main()
