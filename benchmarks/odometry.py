"""LiDAR odometry beside KISS-ICP: real frames, simulated drives with exact truth, ten thousand frames, and faults.

    make bench-odometry         (or: python benchmarks/odometry.py --output docs/benchmarks)
    python benchmarks/odometry.py --only drives --drives street --modes deskewed --loops --keep
    python benchmarks/odometry.py --quick --output /tmp/odometry

Writes odometry.json (every figure), odometry.md (the tables that the docs quote) and odometry.png into the output
folder, after each part. Real data: ../shared/data or $FIELDALIGN_DATA. The drives (benchmarks/drives.py) are made in
/tmp/drives or --folder, one at a time, 6 GB each, and removed again; --keep leaves them, and those that are there are
used as they are. With --only, --drives, --modes and --methods what is measured replaces the same rows of an earlier
run, and all others stay: the whole may be run drive by drive.
The methods get the same frames, one after the other, in one process on two cores; CPU time is of the process.
fieldalign is told nothing, KISS-ICP the reach of the sensor. An hour and a half on two free cores; --quick takes some
minutes.
"""

from __future__ import annotations

from two_cores import THREADS

# isort: split
import argparse
import json
import shutil
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import odometry_report as report
from any_pose import version_of
from columns import Columns, rows_in
from odometry_faults import FAULTS, suffered
from odometry_run import BOTH, Record, endured, run, taken
from odometry_sets import Sequence, drive, judged, read, real
from paper import _processor as processor
from peers import odometry_prototype as prototype
from scenes import DATA

import fieldalign as fa

REAL = "kitti00", "kittiraw_22f", "kittiraw_154f"
PASSES = 5  # over the short real sequences: medians of time want frames
DRIVES = "street", "loop", "tunnel", "park", "indoor"
# Whether frames have their times, and who is run on them. Without times KISS-ICP does not deskew.
MODES = {"deskewed": (True, BOTH), "no times": (False, ("fieldalign", "rigid", "kiss"))}
REACH = {"indoor": 20.0}  # metres, at which KISS-ICP drifts least there; 100 elsewhere, its default
ON_DRIVES = "fieldalign", "rigid", "kiss"
LONG, LONG_PEER, LAP, EVERY = 10_000, 2000, 2000, 100
QUICK = 300  # frames of a drive

_made: set[Path] = set()  # folders that were made by this run


def reach_of(name: str) -> float:
    return REACH.get(name, 100.0)


# ------------------------------------------------------------------------------------------------ real frames


def real_sets(arguments: argparse.Namespace, earlier: dict) -> dict:
    """A row for each sequence and method."""
    columns = Columns()
    for name in REAL:
        sequence = real(name)
        frames = [read(file) for file in sequence.files]
        methods = (*BOTH, "prototype") if prototype.is_there() else BOTH
        runs = [run(frames, False, 100.0, methods) for _ in range(1 if arguments.quick else PASSES)]
        for method in methods:
            errors = judged(sequence, np.array(runs[0][method].poses))
            times = [taken(record[method]) for record in runs]
            middle = {key: float(np.median([row[key] for row in times])) for key in ("cpu_ms", "wall_ms")}
            row = _size(sequence, len(frames[0].points)) | errors | middle
            columns.add(set=name, method=method, **row)
            print(name, method, in_short(row), flush=True)
    return {"rows": columns.lists()}


def _size(sequence: Sequence, points: int) -> dict:
    return {"frames": len(sequence), "metres": sequence.metres, "points": points}


def in_short(row: dict) -> str:
    drift = "" if row["t_percent"] is None else f"{row['t_percent']:.3f} % {row['r_deg_100m']:.3f} deg/100 m "
    return (
        f"{drift}end {row['end_m']:.3f} m ATE {row['ate_m']:.3f} m RPE {1e3 * row['rpe_m']:.1f} mm "
        f"cpu {row['cpu_ms']:.2f} ms wall {row['wall_ms']:.2f} ms"
    )


# ------------------------------------------------------------------------------------------------ simulated drives


def drives(arguments: argparse.Namespace, earlier: dict) -> dict:
    """A row for each drive, mode and method; those of an earlier run stay where they are not measured again."""
    kept = [row for row in rows_in(earlier.get("rows", {})) if not is_asked_for(row, arguments)]
    columns = Columns()
    for row in kept:
        columns.add(**row)
    for name in arguments.drives:
        sequence = made(name, arguments)
        points = int(np.median([len(frame.points) for frame in map(read, sequence.files[::50])]))
        for mode in arguments.modes:
            has_times, methods = MODES[mode]
            asked = [method for method in methods if method in arguments.methods]
            records = run(sequence.frames(not has_times), True, reach_of(name), asked, arguments.loops)
            for method, record in records.items():
                row = _size(sequence, points) | judged(sequence, np.array(record.poses)) | taken(record)
                row |= after_loops(sequence, record)
                columns.add(drive=name, mode=mode, method=method, **row)
                said = row["moment"], row["said"], loops_in_short(row)
                print(name, mode, method, in_short(row), *said, flush=True)
        remove(name, arguments)
    return {"rows": columns.lists(), "seconds": earlier.get("seconds", 0.0)}


def is_asked_for(row: dict, arguments: argparse.Namespace) -> bool:
    return row["drive"] in arguments.drives and row["mode"] in arguments.modes and row["method"] in arguments.methods


def after_loops(sequence: Sequence, record: Record) -> dict:
    """ATE after the loops were closed, and the seconds that took; None where none were."""
    if record.closed is None:
        return {"loops_ate_m": None, "closing_s": None}
    return {"loops_ate_m": judged(sequence, record.closed)["ate_m"], "closing_s": record.closing_s}


def loops_in_short(row: dict) -> str:
    return "" if row["loops_ate_m"] is None else f"loops: ATE {row['loops_ate_m']:.3f} m, {row['closing_s']:.1f} s"


def made(name: str, arguments: argparse.Namespace, frames: int | None = None) -> Sequence:
    """The drive, made by another process if it is not there yet."""
    folder = arguments.folder / name
    frames = frames or (QUICK if arguments.quick else sys.maxsize)
    if there(folder) < frames:
        options = [] if frames == sys.maxsize else ["--frames", str(frames)]
        command = [sys.executable, str(Path(__file__).with_name("drives.py")), name, str(folder), *options]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        _made.add(folder)
    return drive(folder, name == "indoor").first(None if frames == sys.maxsize else frames)


def there(folder: Path) -> int:
    """How many frames are there; no end of them, if all of the drive are."""
    if not (folder / "poses.npz").exists():
        return 0
    with np.load(folder / "poses.npz") as poses:
        count = len(list(folder.glob("[0-9]*.npz")))
        return sys.maxsize if count == poses["of"] else count


def remove(name: str, arguments: argparse.Namespace) -> None:
    """Unless it was there before, or is to stay."""
    folder = arguments.folder / name
    if folder in _made and not arguments.keep:
        shutil.rmtree(folder)


# ------------------------------------------------------------------------------------------------ endurance, faults


def endurance(arguments: argparse.Namespace, earlier: dict) -> dict:
    """Memory and speed of each method alone, to and fro over a drive; the peer for fewer frames."""
    lap = QUICK if arguments.quick else LAP
    lengths = dict.fromkeys(BOTH, 2 * QUICK) if arguments.quick else dict(zip(BOTH, (LONG, LONG_PEER), strict=True))
    sequence, found = made("loop", arguments, lap), dict(earlier.get("methods", {}))
    for name, frames in lengths.items():
        if name not in arguments.methods:
            continue
        with ProcessPoolExecutor(1, get_context("spawn")) as pool:
            found[name] = pool.submit(endured, name, sequence.files, frames, EVERY, 100.0).result()
        print(name, found[name]["pass_cpu_ms"], found[name]["rss_mib"][:: len(found[name]["rss_mib"]) // 5], flush=True)
    remove("loop", arguments)
    return {"lap": len(sequence), "methods": found}


def faults(arguments: argparse.Namespace, earlier: dict) -> dict:
    """A row for each fault and method; a method that does not survive has its process to itself."""
    sequence, columns = made("street", arguments, 1000), Columns()
    for row in rows_in(earlier.get("rows", {})):
        if row["method"] not in arguments.methods:
            columns.add(**row)
    for key, fault in FAULTS.items():
        for method in (m for m in BOTH if m in arguments.methods):
            with ProcessPoolExecutor(1, get_context("spawn")) as pool:
                row = pool.submit(suffered, sequence, fault, method, 100.0)
                row = row.result() if row.exception() is None else failed(row.exception())
            columns.add(fault=key, method=method, **row)
            print(fault.title, method, row, flush=True)
    remove("street", arguments)
    return {"rows": columns.lists()}


def failed(error: BaseException) -> dict:
    return {"m": None, "deg": None, "said": [], "error": type(error).__name__}


# ------------------------------------------------------------------------------------------------ command line

PARTS = {"real": real_sets, "drives": drives, "endurance": endurance, "faults": faults}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", choices=list(PARTS), help="parts to measure; the others are kept")
    parser.add_argument("--drives", nargs="+", choices=DRIVES, default=DRIVES, help="drives to measure")
    parser.add_argument("--modes", nargs="+", choices=list(MODES), default=list(MODES), help="modes to measure them in")
    parser.add_argument("--methods", nargs="+", choices=ON_DRIVES, default=ON_DRIVES,
                        help="methods to measure; on real frames all are")
    parser.add_argument("--quick", action="store_true", help=f"the first {QUICK} frames of the drives")
    parser.add_argument("--loops", action="store_true", help="close the loops of the drives at their end, too")
    parser.add_argument("--folder", type=Path, default=Path("/tmp/drives"), help="where the drives are made")
    parser.add_argument("--keep", action="store_true", help="leave the drives that are made there")
    parser.add_argument("--output", type=Path, default=Path("docs/benchmarks"))
    arguments = parser.parse_args()
    if not DATA.is_dir():
        raise SystemExit(f"no data: neither $FIELDALIGN_DATA nor {DATA} is a folder")
    arguments.output.mkdir(parents=True, exist_ok=True)
    earlier = arguments.output / "odometry.json"
    results = json.loads(earlier.read_text()) if arguments.only and earlier.exists() else {}
    results |= head(arguments.quick)
    for name in arguments.only or PARTS:
        start = time.perf_counter()
        measured = PARTS[name](arguments, results.get(name, {}))
        seconds = measured.get("seconds", 0.0) + time.perf_counter() - start
        results[name] = measured | {"seconds": seconds}
        report.write(results, arguments.output)
    print(report.as_markdown(results))


def head(quick: bool) -> dict:
    versions = {name: version_of(name) for name in ("numpy", "kiss-icp", "open3d")}
    return {
        "machine": f"{THREADS} cores of {processor()}",
        "date": time.strftime("%Y-%m-%d"),
        "quick": quick,
        "versions": {"fieldalign": fa.__version__} | versions,
    }


if __name__ == "__main__":
    main()
