"""Fuzzes everything for a while, side by side: the readers, the core under sanitizers, and the public functions.

    python fuzz/run.py --core FOLDER --work FOLDER [--seconds 60] [--seed 1]

Prints how many inputs each had; exit status 1 where one broke a promise, whose input then lies in the work folder.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
SANITIZERS = {
    "ASAN_OPTIONS": "detect_leaks=0:max_allocation_size_mb=2048:allocator_may_return_null=0",
    "UBSAN_OPTIONS": "print_stacktrace=1:halt_on_error=1",
    "OPENBLAS_NUM_THREADS": "1",
}


def library(name: str) -> str:
    """A library of the compiler's."""
    return subprocess.run(
        ["g++", f"-print-file-name={name}"], check=True, capture_output=True, text=True
    ).stdout.strip()


def start(log: Path, *command: object, **environment: str) -> subprocess.Popen[bytes]:
    """A process of ours, which writes to a file."""
    return subprocess.Popen(
        [sys.executable, *map(str, command)],
        stdout=log.open("wb"),
        stderr=subprocess.STDOUT,
        env=os.environ | environment,
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--core", required=True, help="folder of a core that was built with address,undefined")
    parser.add_argument("--work", type=Path, required=True, help="folder for corpora, logs and failures")
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1, help="another one, other inputs")
    options = parser.parse_args()
    shutil.rmtree(options.work, ignore_errors=True)
    options.work.mkdir(parents=True)
    seed, logs = options.seed, {name: options.work / f"{name}.log" for name in WATCHED}
    preload = f"{library('libasan.so')} {library('libstdc++.so')}"
    jobs = {
        "readers": start(
            logs["readers"],
            HERE / "readers.py",
            "all",
            "--work",
            options.work / "readers",
            f"-max_total_time={options.seconds}",
            f"-seed={seed}",
            OPENBLAS_NUM_THREADS="1",
        ),
        "core": start(
            logs["core"],
            HERE / "core.py",
            "--core",
            options.core,
            "--seconds",
            options.seconds / 2,
            "--seed",
            seed,
            "--mark",
            options.work / "core.mark",
            LD_PRELOAD=preload,
            **SANITIZERS,
        ),
    }
    broken = [name for name in ("core",) if jobs[name].wait()]
    jobs["functions"] = start(
        logs["functions"],
        *("-m", "pytest", "-vv", "-x", "-p", "no:cacheprovider", "-m", "not slow", f"--hypothesis-seed={seed}"),
        HERE.parent / "tests" / "properties",
        FIELDALIGN_EXAMPLES="2",
        OPENBLAS_NUM_THREADS="1",
    )
    try:
        jobs["functions"].wait(options.seconds / 2)
    except subprocess.TimeoutExpired:
        jobs["functions"].terminate()  # what it has tried by now has held
        jobs["functions"].wait()
    broken += [name for name in ("readers", "functions") if jobs[name].wait() > 0]
    broken += ["readers"] * any((options.work / "readers" / "failures").glob("*"))
    for name, log in logs.items():
        print(f"{name}: {WATCHED[name](log.read_text(errors='replace'))}")
    for name in sorted(set(broken)):
        print(f"\n{name} broke a promise (seed {seed}):\n{logs[name].read_text(errors='replace')[-6000:]}")
    return int(bool(broken))


def of_readers(log: str) -> str:
    found = re.findall(r"number_of_executed_units: (\d+)", log)
    return f"{found[-1] if found else 'unknown how many'} inputs"


def of_core(log: str) -> str:
    return f"{sum(json.loads(line)['inputs'] for line in log.splitlines() if line.startswith('{'))} inputs"


def of_functions(log: str) -> str:
    return f"{log.count(' PASSED')} properties, twice as many examples as in the tests"


WATCHED = {"readers": of_readers, "core": of_core, "functions": of_functions}

if __name__ == "__main__":
    sys.exit(main())
