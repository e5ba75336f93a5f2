"""Commands that are killed at random moments, called again, and killed again, until they are done.

Whenever a command has died, its outputs are whole or absent, what grows line by line is a beginning of the whole, and
no process is left. When it is done at last, its outputs are those of a run that nobody disturbed, but for seconds.

    python tests/faults/campaign.py --kills 200 --output docs/benchmarks/faults.json
"""

from __future__ import annotations

import argparse
import csv
import io
import json
import os
import re
import secrets
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import fieldalign as fa
from fieldalign.assembly.record import _decoded
from fieldalign.clouds.simulated import simulate_room
from fieldalign.motions import exp_twist

SIGNALS = signal.SIGINT, signal.SIGTERM, signal.SIGKILL
PATIENCE = 60.0  # seconds in which a command that is told to end does so, and all its workers
WIDE = 200, 110  # degrees
TIMED = {"seconds", "cpu_seconds", "seconds_total", "seconds_a_frame", "seconds_a_frame_by_stage", "read", "step",
         "cpu", "date", "measures"}


@dataclass(frozen=True)
class Victim:
    """A command, run in a folder with `data` beside it. grows: outputs that are valid line by line. ends_in_order: on
    SIGINT and SIGTERM it writes all that there is up to then, and may be called whole again."""

    arguments: str
    grows: tuple[str, ...] = ()
    ends_in_order: bool = False


VICTIMS = {
    "assemble": Victim("assemble {data}/0.ply {data}/1.ply {data}/2.ply {data}/3.ply --run run --workers 2 "
                       "--output model.ply --poses-to poses.json --json all.json --moved moved"),
    "batch": Victim("batch {data}/pairs.csv --run run --workers 2 --output batch.csv --json batch.json"),
    "assemble, alone": Victim("assemble {data}/0.ply {data}/1.ply {data}/2.ply --run run --output model.ply "
                              "--poses-to poses.json"),
    "batch, dask": Victim("batch {data}/pairs.csv --run run --dask local --workers 1 --output batch.csv"),
    "odometry": Victim("odometry {data}/drive --output out",
                       ("trajectory_tum.txt", "trajectory_kitti.txt", "frames.csv"), ends_in_order=True),
    "experiment": Victim("experiment modelnet40 --data {data}/shapes --output out --workers 2 --columns paper,default "
                         "--limit 4"),
}


def make_data(folder: Path) -> None:
    """Scans of a sensor that comes through a room, pairs of them, and two hills as a small ModelNet40."""
    room = simulate_room(0)
    (folder / "drive").mkdir(parents=True)
    for k in range(20):
        pose = exp_twist(np.array([0, 0, 0.02 * k, 0, 0, 0]))
        pose[:3, 3] = room.size[0] / 2 + 0.04 * k - 0.4, room.size[1] / 2, 1.5
        points = room.scan(pose, 4000, 0.004, WIDE, seed=k).points
        fa.write_cloud(folder / "drive" / f"{k:02}.ply", points)
        if k % 4 == 0:
            fa.write_cloud(folder / f"{k // 4}.ply", points)
    pairs = "".join(f"{k}.ply,{k - 1}.ply\n" for k in range(1, 5))
    (folder / "pairs.csv").write_text(f"source,target\n{pairs}")
    u, v = (a.ravel() for a in np.meshgrid(np.linspace(0, 1, 20), np.linspace(0, 0.8, 16), indexing="ij"))
    a = (16 * np.arange(19)[:, None] + np.arange(15)).ravel()
    faces = np.r_[np.c_[a, a + 16, a + 1], np.c_[a + 1, a + 16, a + 17]]
    for category, split, size in (("piano", "train", 0.4), ("sofa", "test", 0.7)):
        height = size * (np.exp(-20 * ((u - 0.3) ** 2 + (v - 0.2) ** 2)) + 0.6 * np.sin(3 * u) * v**2)
        rows = ["{:.6f} {:.6f} {:.6f}".format(*row) for row in np.c_[u, v, height]]
        rows += ["3 {} {} {}".format(*row) for row in faces]
        file = folder / "shapes" / "ModelNet40" / category / split / f"{category}_0001.off"
        file.parent.mkdir(parents=True)
        file.write_text(f"OFF\n{len(u)} {len(faces)} 0\n" + "\n".join(rows) + "\n")
    (folder / "shapes" / "gt_poses.csv").write_text("0.5,0.2,-0.3,0.1,0.4,-0.2\n-0.1,0.6,0.2,0.3,0,0.1\n")


# -------------------------------------------------------------------------------------------------- what is written


def plain(path: Path) -> Any:
    """What a file holds, but for seconds; raises where it is not whole."""
    if path.suffix == ".json":
        return without(json.loads(path.read_text()))
    if path.suffix == ".csv":
        rows = list(csv.DictReader(io.StringIO(path.read_text())))
        return [{key: value for key, value in row.items() if key not in TIMED} for row in rows]
    if path.suffix == ".png":
        assert path.read_bytes()[-8:-4] == b"IEND"
        return "a picture"
    if path.suffix == ".md":
        return re.sub(r"\| [\d. -]+\|$|, \d{4}-.*$", "", path.read_text(), flags=re.MULTILINE)
    return path.read_bytes()


def without(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: without(entry) for key, entry in value.items() if key not in TIMED}
    return [without(entry) for entry in value] if isinstance(value, list) else value


def outputs(folder: Path) -> dict[str, Path]:
    """The files of a run's results, by name; what it goes on from is its own business."""
    files = (path for path in folder.rglob("*") if path.is_file())
    names = {str(path.relative_to(folder)): path for path in files}
    return {name: path for name, path in names.items() if not re.match(r"run/|out/\w+\.run/|tmp/", name)}


def check_record(path: Path) -> int:
    """How many results a record holds; all its lines are whole, but for the last."""
    lines = path.read_bytes().splitlines(keepends=True)
    assert all(_decoded(line) is not None for line in lines[:-1]), path
    return max(0, len(lines) - 1)


# ----------------------------------------------------------------------------------------------------------- killing


@dataclass
class Tally:
    """What came of a campaign."""

    kills: Counter[str] = field(default_factory=Counter)
    runs: int = 0
    statuses: Counter[str] = field(default_factory=Counter)
    slowest_end: float = 0.0
    slowest_orphan: float = 0.0
    left: Counter[str] = field(default_factory=Counter)

    def to_dict(self) -> dict[str, Any]:
        return {
            "kills": dict(self.kills), "runs": self.runs, "statuses": dict(sorted(self.statuses.items())),
            "seconds until the command had ended, at most": round(self.slowest_end, 2),
            "seconds until its workers had, at most": round(self.slowest_orphan, 2),
            "temporary files left": dict(self.left),
        }


class Chain:
    """One command, from nothing to its end, however often it is killed."""

    def __init__(self, name: str, data: Path, folder: Path) -> None:
        self.name, self.victim, self.folder = name, VICTIMS[name], folder
        self.mark = secrets.token_hex(8)
        (folder / "tmp").mkdir(parents=True)
        arguments = self.victim.arguments.format(data=data).split()
        self.command = [sys.executable, "-W", "ignore", "-m", "fieldalign", *arguments]
        paths = os.pathsep.join([str(Path(fa.__file__).parents[1]), *filter(None, [os.environ.get("PYTHONPATH")])])
        self.environment = os.environ | {"PYTHONPATH": paths, "TMPDIR": str(folder / "tmp"), "CAMPAIGN": self.mark}

    def start(self) -> subprocess.Popen[str]:
        return subprocess.Popen(self.command, cwd=self.folder, env=self.environment, text=True, start_new_session=True,
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    def whole(self) -> tuple[dict[str, Any], float]:
        """What it writes if nobody disturbs it, and how long that takes."""
        began = time.monotonic()
        text, _ = (process := self.start()).communicate(timeout=300)
        assert process.returncode in (0, 3), text
        return self.written(), time.monotonic() - began

    def killed(self, after: float, number: signal.Signals, tally: Tally) -> bool:
        """Whether it was killed before its end."""
        process = self.start()
        time.sleep(after)
        began = time.monotonic()
        if process.poll() is None:
            # Ctrl-C reaches the whole group of the terminal, other signals the command alone.
            (os.killpg if number == signal.SIGINT else os.kill)(process.pid, number)
            tally.kills[number.name] += 1
        try:
            text, _ = process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            text, _ = process.communicate()
            raise AssertionError(f"it hangs after {number.name}:\n{text}") from None
        tally.slowest_end = max(tally.slowest_end, time.monotonic() - began)
        tally.runs += 1
        tally.statuses[f"{number.name} {process.returncode}"] += 1
        tally.slowest_orphan = max(tally.slowest_orphan, self.wait_for_workers())
        return process.returncode not in ((0,) if self.victim.ends_in_order else (0, 3))

    def wait_for_workers(self) -> float:
        """Seconds until no process of this chain is left."""
        began = time.monotonic()
        while alive := processes_of(self.mark):
            assert time.monotonic() - began < PATIENCE, f"processes are left: {alive}"
            time.sleep(0.02)
        return time.monotonic() - began

    def written(self) -> dict[str, Any]:
        return {name: plain(path) for name, path in outputs(self.folder).items() if not path.name.startswith(".")}

    def check(self, whole: dict[str, Any], number: signal.Signals, tally: Tally) -> None:
        """After a death: outputs are whole or absent, and of what grows the beginning is there."""
        left = [path for path in self.folder.rglob("*") if path.name.startswith(".") or path.parent.name == "tmp"
                if path.name != "dask-scratch-space"]  # where Dask always leaves it
        tally.left[number.name] += len(left)
        assert number == signal.SIGKILL or not left, f"left after {number.name}: {left}"
        for path in left:
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        for name, path in outputs(self.folder).items():
            if path.name in self.victim.grows:
                found = plain(path)
                assert found == whole[name][: len(found)], f"{name} is no beginning of the whole"
            elif not (self.victim.ends_in_order and number != signal.SIGKILL):
                assert plain(path) == whole[name], f"{name} is neither whole nor absent"
            else:
                plain(path)
        for record in self.folder.rglob("record.jsonl"):
            check_record(record)


def processes_of(mark: str) -> list[str]:
    """The command lines of living processes that carry a mark in their environment."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit() and int(entry.name) != os.getpid():
            try:
                if f"CAMPAIGN={mark}".encode() in (entry / "environ").read_bytes():
                    found.append((entry / "cmdline").read_bytes().replace(b"\0", b" ").decode()[:200])
            except OSError:  # gone, or nobody's
                continue
    return found


def disturb(
    name: str, data: Path, folder: Path, kills: int, rng: np.random.Generator,
    tell: Callable[[str], None] = lambda text: None,
) -> Tally:
    """Kills a command so often, in as many chains as it takes, and lets each chain come to its end."""
    whole, seconds = Chain(name, data, folder / "whole").whole()
    tally, chains = Tally(), 0
    while (done := sum(tally.kills.values())) < kills:
        chain = Chain(name, data, folder / f"chain_{chains}")
        chains += 1
        number = SIGNALS[int(rng.integers(len(SIGNALS)))]
        while chain.killed(seconds * rng.uniform(0.1, 1), number, tally):
            chain.check(whole, number, tally)
            if sum(tally.kills.values()) >= kills:
                chain.whole()
                break
            number = SIGNALS[int(rng.integers(len(SIGNALS)))]
        written = chain.written()
        other = {name: (written.get(name), whole.get(name)) for name in written.keys() | whole
                 if written.get(name) != whole.get(name)}
        assert not other, f"not what an undisturbed run writes: {str(other)[:3000]}"
        shutil.rmtree(chain.folder)
        tell(f"{name}: {sum(tally.kills.values()) - done} kills, {chains} runs to the end")
    return tally


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--output", type=Path)
    parser.add_argument("--only", choices=VICTIMS)
    asked = parser.parse_args()
    names = [asked.only] if asked.only else list(VICTIMS)
    told, began = {}, time.monotonic()
    with TemporaryDirectory(prefix="faults-") as folder:
        make_data(data := Path(folder, "data"))
        for k, name in enumerate(names):
            kills = asked.kills // len(names) + (k < asked.kills % len(names))
            tally = disturb(name, data, Path(folder, str(k)), kills, np.random.default_rng([asked.seed, k]), tell)
            told[name] = tally.to_dict()
            tell(json.dumps(told[name]))
    report = {"seed": asked.seed, "kills": asked.kills, "seconds": round(time.monotonic() - began), "commands": told}
    if asked.output:
        asked.output.write_text(json.dumps(report, indent=1) + "\n")


def tell(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
