"""Odd arguments for every entry point of the native core, built with sanitizers: no crash, whatever comes.

    python fuzz/core.py --core FOLDER [--seconds 20] [--seed 0] [--first 0] [--only NAME]

Input k is made from (seed, k) alone. A sanitizer ends the process; the file named by --mark then holds k, and
`--first k --inputs 1` is that input again.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
from arrays import broken, cloud, directions, length, motion, number, values

core: Any = None  # the module under test
Rng = np.random.Generator
REFUSALS = (TypeError, ValueError)  # of the core itself: shapes are its own matter, meaning is Python's
SLOWEST = 10.0  # seconds that an input may take under sanitizers
SEARCH = {
    "seed": 1,
    "rounds": 2,
    "draws": 64,
    "matches": 4,
    "tolerance": 0.1,
    "min_cosine": 0.8,
    "penalty": 0.1,
    "doubt": 2.0,
    "keep": 8,
    "apart_cosine": 0.99,
    "apart_distance": 0.1,
    "drift_cosine": 0.9,
    "drift_distance": 0.3,
    "enough_hits": 5,
    "distinct": 0.5,
    "alike": 0.9,
    "facing": False,
}
TRACK = {
    "deviations": 3.0,
    "least_scale": 0.01,
    "gate": 1.0,
    "thickness": 0.02,
    "flatness": 0.2,
    "width": 0.05,
    "steps": 12,
    "free_steps": 6,
    "fewest": 3.0,
    "first_scale": 0.5,
    "still_shift": 1e-4,
    "still_turn": 1e-5,
    "largest_turn": 0.2,
    "trust": 0.0,
    "arm": 1.0,
    "certain_gate": 0.5,
    "certain_flatness": 0.1,
}


def call(rng: Rng, function: Callable[..., Any], *arguments: Any) -> Any:
    """The answer, or None where the core refuses; now and then one of the arguments is made another thing."""
    given = list(arguments)
    if rng.random() < 0.05:
        k = int(rng.integers(len(given)))
        given[k] = broken(rng, given[k]) if isinstance(given[k], np.ndarray) and given[k].ndim else number(rng)
    try:
        return function(*given)
    except REFUSALS:
        return None


def threads(rng: Rng) -> int:
    return int(rng.choice([1, 1, 2, 3, 8, 0, -1]))


def points(rng: Rng) -> np.ndarray:
    given = cloud(rng)
    with np.errstate(over="ignore"):
        return given.astype(np.float32) if rng.random() < 0.3 else given


def tree(rng: Rng) -> None:
    made = call(rng, core.PointTree, points(rng), threads(rng))
    if made is None:
        return
    places, k = cloud(rng, int(rng.integers(0, 200))), int(rng.choice([1, 2, 10, 64, 65, 0]))
    call(rng, made.nearest, places, k, threads(rng))
    guess = rng.integers(0, len(made) + (rng.random() < 0.1), len(places)).astype(np.uint32)
    call(rng, made.sample, places, k, guess if rng.random() < 0.5 else None, threads(rng))
    call(rng, made.surfels, places, k, threads(rng))
    call(rng, made.rows, guess)
    if len(made) <= 1000:
        call(rng, made.keypoints, length(rng), length(rng), 0.5, 0.5, int(rng.integers(0, 12)), threads(rng))


def thinning(rng: Rng) -> None:
    given = points(rng)
    call(rng, core.occupancy, given, int(rng.choice([0, 1, 100, 100_000])), threads(rng))
    surveyed = call(rng, core.survey, given, threads(rng))
    bounds = cloud(rng, int(rng.choice([0, 1, 2]))) if surveyed is None or rng.random() < 0.1 else surveyed[0]
    call(rng, core.thin, given, bounds, length(rng), threads(rng))


def algebra(rng: Rng) -> None:
    n = int(rng.integers(0, 50))
    J, r, w, T = values(rng, n, 6), values(rng, n), values(rng, n), motion(rng)
    call(rng, core.transform, T[:3, :3].copy(), T[:3, 3].copy(), cloud(rng))
    call(rng, core.exp_twist, values(rng, 6))
    call(rng, core.log_motion, T)
    call(rng, core.relative_twist, T, motion(rng))
    call(rng, core.directions, r, values(rng, n, 3))
    call(rng, core.moment_rows, values(rng, n, 3), values(rng, n, 3))
    call(rng, core.direct, J, r)
    call(rng, core.reweighted, J, r, w, length(rng), length(rng), length(rng), int(rng.integers(-1, 30)))
    call(rng, core.information, J, w)
    call(rng, core.count_equal, cloud(rng))


def steps(rng: Rng) -> None:
    n, b = int(rng.integers(0, 100)), int(rng.integers(0, 5))
    means, x, along = cloud(rng, n), cloud(rng, n), directions(rng, n)
    call(
        rng,
        core.robust_sums,
        x,
        directions(rng, n),
        means,
        along,
        np.abs(values(rng, n)),
        0.5,
        length(rng),
        3.0,
        length(rng),
    )
    call(rng, core.coplanar, x, along, means, directions(rng, n), length(rng), 0.9, threads(rng))
    call(rng, core.stretch, values(rng, b, 4))
    call(
        rng, core.take_steps, values(rng, b, 4, 4), values(rng, b, 6, 6), values(rng, b, 6), values(rng, b), length(rng)
    )


def grid_of(rng: Rng) -> Any:
    n = int(rng.integers(0, 300))
    cell = length(rng)
    return call(rng, core.ClosestGrid, cloud(rng, n), directions(rng, n), cell, cell * rng.uniform(0, 5))


def grid(rng: Rng) -> None:
    made = grid_of(rng)
    if made is None:
        return
    n, poses = (
        int(rng.integers(0, 100)),
        np.array([motion(rng) for _ in range(int(rng.integers(0, 4)))]).reshape(-1, 4, 4),
    )
    arguments = (
        cloud(rng, n),
        directions(rng, n),
        values(rng, n),
        poses,
        length(rng),
        0.5,
        length(rng),
        False,
        threads(rng),
    )
    call(rng, made.robust_sums, *arguments)
    call(rng, made.agreement, *arguments)


def search(rng: Rng) -> None:
    n = int(rng.integers(0, 200))
    table = call(rng, core.PairTable, cloud(rng, n), directions(rng, n), length(rng), length(rng), threads(rng))
    made = grid_of(rng)
    if table is None or made is None:
        return
    table.counts()
    m = int(rng.integers(0, 100))
    confinement = (motion(rng)[None], values(rng, 3), abs(length(rng)), 0.5) if rng.random() < 0.3 else None
    freedoms = (np.stack([motion(rng), motion(rng)]), bool(rng.random() < 0.5), rng.integers(0, 2, 6) * 1.0)
    call(
        rng,
        core.search,
        made,
        table,
        cloud(rng, m),
        directions(rng, m),
        cloud(rng, m),
        directions(rng, m),
        confinement,
        freedoms if rng.random() < 0.3 else None,
        SEARCH | {"seed": int(rng.integers(2**62))},
        threads(rng),
    )


def sight(rng: Rng) -> None:
    made = call(rng, core.Sight, cloud(rng), values(rng, 3), int(rng.choice([0, 1, 2, 30, 100])))
    if made is not None:
        call(rng, made.ranges, cloud(rng))


def scan(rng: Rng, n: int) -> np.ndarray:
    with np.errstate(over="ignore"):
        return np.c_[cloud(rng, n), rng.uniform(-0.1, 0.1, n)].astype(np.float32)


def odometry(rng: Rng) -> None:
    given = points(rng)
    times = values(rng, len(given)) if rng.random() < 0.5 else None
    call(rng, core.thin_scan, given, times, number(rng), int(rng.integers(0, 4)), length(rng), length(rng), length(rng))
    few = scan(rng, int(rng.integers(0, 400)))
    call(rng, core.thin_twice, few, length(rng), int(rng.choice([0, 1, 50, 1000])))
    call(rng, core.deskew, few, values(rng, 6))
    made = call(rng, core.VoxelMap, length(rng))
    if made is None:
        return
    for _ in range(int(rng.integers(1, 4))):
        call(rng, made.add, few, motion(rng), number(rng) if rng.random() < 0.3 else 100.0)
        last = motion(rng) if rng.random() < 0.5 else None
        held = values(rng, 6, 6) if rng.random() < 0.2 else None
        call(
            rng,
            made.track,
            scan(rng, int(rng.integers(0, 200))),
            motion(rng),
            values(rng, 3),
            last,
            length(rng),
            held,
            bool(rng.random() < 0.5),
            TRACK,
        )
        call(rng, made.planes, number(rng))
        call(rng, made.keep_within, values(rng, 3), number(rng))


TARGETS = {f.__name__: f for f in (tree, thinning, algebra, steps, grid, search, sight, odometry)}


def main() -> int:
    options = _options()
    sys.path.insert(0, options.core)
    global core
    import _core as core  # of the folder, not the package's own

    names = [options.only] if options.only else list(TARGETS)
    done, slowest, begun = Counter[str](), dict.fromkeys(names, (0.0, -1)), time.monotonic()
    mark = os.open(options.mark, os.O_WRONLY | os.O_CREAT, 0o666)
    for number_ in range(options.first, options.first + options.inputs):
        if time.monotonic() - begun > options.seconds:
            break
        name = names[number_ % len(names)]
        os.pwrite(mark, f"{number_:<20} {name:<20}\n".encode(), 0)
        start = time.process_time()  # of all threads: another program's load does not count
        with np.errstate(all="ignore"):
            TARGETS[name](np.random.default_rng([options.seed, number_]))
        done[name] += 1
        slowest[name] = max(slowest[name], (time.process_time() - start, number_))
    for name, (seconds, which) in slowest.items():
        print(json.dumps({"target": name, "inputs": done[name], "slowest": round(seconds, 3), "input": which}))
    return int(max(slowest.values())[0] > SLOWEST)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--core", required=True, help="folder of a core that was built with sanitizers")
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--inputs", type=int, default=2**62)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--only", choices=list(TARGETS))
    parser.add_argument("--mark", default="core.mark", help="file that holds the number of the input")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
