"""Looks at what the package depends on, as locked in requirements.lock; run by `make audit`.

The lock is what pyproject.toml asks for, with the hash of every file; its hashes are those of the files that the index
gives, nothing in it was taken back, every licence lets the package be used and passed on freely, and no version has a
known weakness. Exits with 1 where one of these does not hold, or cannot be told.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
LOCK = ROOT / "requirements.lock"
EXTRAS = ("viz", "las", "e57", "mesh", "volume", "dask", "bag", "hdf5")  # not neural: a network brings its own torch
TOOLS = Path(sys.executable).parent
FREE = re.compile(r"MIT|BSD|Apache|PSF|Python Software Foundation|HPND|ISC|Zlib|Unlicense|CC0", re.IGNORECASE)
KNOWN = {  # looked at by a person
    "apsw": "any licence that the OSI approves, as its user chooses (it comes with rosbags)",
    "libigl": "MPL-2.0, under which its own files stay, and nothing that uses them (only with the extra 'mesh')",
}


def main() -> None:
    if sys.argv[1:] == ["--lock"]:
        lock(LOCK)
        return
    with tempfile.TemporaryDirectory(prefix="audit-") as folder:
        faults = [*stale(Path(folder)), *of_files(Path(folder)), *weaknesses(Path(folder))]
    for fault in faults:
        print(f"audit: {fault}", file=sys.stderr)
    sys.exit(1 if faults else 0)


def lock(path: Path) -> None:
    """Pins what pyproject.toml asks for, for all Pythons and systems; what `path` pins already stays while it can."""
    extras = [word for extra in EXTRAS for word in ("--extra", extra)]
    subprocess.run(
        [TOOLS / "uv", "pip", "compile", "--quiet", "--universal", "--python-version", "3.11", "--generate-hashes",
         "--no-header", "--no-annotate", *extras, "--output-file", path, "pyproject.toml"],
        cwd=ROOT, check=True, stdout=subprocess.DEVNULL,
    )


def stale(folder: Path) -> list[str]:
    """Whether pyproject.toml asks for something else than the lock has."""
    again = Path(shutil.copy(LOCK, folder))
    lock(again)
    fits = again.read_text() == LOCK.read_text()
    return [] if fits else ["requirements.lock is not what this pyproject.toml asks for: `make lock`"]


def of_files(folder: Path) -> list[str]:
    """What is wrong with the files that the index gives: all are fetched, and pip refuses those of another hash."""
    report = folder / "report.json"
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--dry-run", "--ignore-installed", "--no-deps",
               "--only-binary", ":all:", "--require-hashes", "--report", report, "-r", LOCK]
    if subprocess.run(command).returncode:
        return ["the locked files cannot be installed"]
    items = json.loads(report.read_text())["install"]
    names = [item["metadata"]["name"] for item in items]
    back = [f"{name} {item['metadata']['version']} was taken back by its authors"
            for name, item in zip(names, items, strict=True) if item.get("is_yanked")]
    unfree = [f"the licence of {name} is {licence_of(item['metadata'])!r}"
              for name, item in zip(names, items, strict=True)
              if name not in KNOWN and not is_free(licence_of(item["metadata"]))]
    print(f"{len(items)} packages: hashes right, {len(back)} taken back, {len(unfree)} under licences to look at, and "
          + "; ".join(f"{name} under {why}" for name, why in KNOWN.items()))
    return back + unfree


def licence_of(metadata: dict[str, Any]) -> str:
    """As the package says it: the expression, the classifiers, or the first line of what it has instead."""
    classifiers = [c.rpartition(" :: ")[2] for c in metadata.get("classifier", ()) if c.startswith("License ::")]
    text = metadata.get("license_expression") or ", ".join(classifiers) or metadata.get("license") or "not told"
    return str(text).strip().splitlines()[0]


def is_free(licence: str) -> bool:
    """Of several that hold together, each must be."""
    return all(FREE.search(part) for part in re.split(r"\bAND\b|,", licence))


def weaknesses(folder: Path) -> list[str]:
    """The known ones. pip-audit calls it a success where nobody can tell; this is none."""
    names = [line.partition("==") for line in LOCK.read_text().splitlines() if "==" in line]
    first = folder / "first.lock"
    first.write_text(next(f"{name}=={rest.split()[0]}\n" for name, _, rest in names if ";" not in rest))
    if any("skip_reason" in found for found in audited(first)):
        return ["the service of known weaknesses (the index's JSON API) cannot be reached from here, so none can be "
                "ruled out: run `make audit` where it can"]
    found = audited(LOCK)
    untold = [f"nothing is known about {one['name']}: {one['skip_reason']}" for one in found if "skip_reason" in one]
    return untold + [f"{one['name']} {one['version']} has {weakness['id']}, mended in {weakness['fix_versions']}"
                     for one in found for weakness in one.get("vulns", ())]


def audited(requirements: Path) -> list[dict[str, Any]]:
    command = [TOOLS / "pip-audit", "--format", "json", "--progress-spinner", "off", "--disable-pip", "--no-deps",
               "--requirement", requirements]
    done = subprocess.run(command, capture_output=True, text=True)
    try:
        return list(json.loads(done.stdout)["dependencies"])
    except (ValueError, KeyError):
        return [{"name": "all", "skip_reason": done.stderr.strip()[-200:]}]


if __name__ == "__main__":
    main()
