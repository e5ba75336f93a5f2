"""Many threads at once through a core that was built with the thread sanitizer: no race, and all is right.

    python fuzz/races.py --core FOLDER [--seconds 20] [--callers 8]

Every caller registers pairs, thins, samples one field that all share, and drives an odometry of its own; each answer is
compared to the bit with what one thread alone gave before.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

TURN = np.array([[0.8, -0.6, 0, 0.3], [0.6, 0.8, 0, -0.2], [0, 0, 1, 0.1], [0, 0, 0, 1]])


def room(n: int, seed: int) -> np.ndarray:
    """Points (n, 3) on five faces of a box, and on a smaller one in it."""
    rng = np.random.default_rng(seed)
    points = rng.random((n, 3)) * [4, 3, 2]
    face = rng.integers(0, 3, n)
    points[np.arange(n), face] = 0
    small = np.arange(n) % 4 == 0
    points[small] = points[small] * [0.2, 0.3, 0.4] + [1.5, 1, 0.3]
    return points


def works(fa: Any) -> dict[str, Callable[[], Any]]:
    """What the callers do, by name: each gives arrays that no other thread may change."""
    source, target = room(4000, 1), room(4000, 2) @ TURN[:3, :3].T + TURN[:3, 3]
    shared, prepared = fa.fields.PointField(room(20_000, 3), threads=2), fa.prepare(target, threads=2)
    places = room(3000, 4) + 0.05

    def drive() -> np.ndarray:
        odometry = fa.Odometry()
        for k in range(4):
            odometry.step(room(3000, 5) + [0.05 * k, 0, 0])
        return odometry.trajectory.poses

    return {
        "register": lambda: fa.register(source, target, threads=3).T_target_source,
        "register on a shared cloud": lambda: fa.register(source, prepared, threads=2).T_target_source,
        "thin": lambda: fa.thin(room(40_000, 6), 0.1, threads=4).points,
        "sample": lambda: shared.sample(places).value,
        "normals": lambda: shared.sample(places[:500]).normal,
        "drive": drive,
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--core", required=True, help="folder of a core that was built with the thread sanitizer")
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--callers", type=int, default=8)
    options = parser.parse_args()
    sys.path.insert(0, options.core)
    import _core

    sys.modules["fieldalign._core"] = _core
    import fieldalign as fa

    alone = {name: work() for name, work in works(fa).items()}
    together = works(fa)  # shared clouds of which nothing is worked out yet
    end, names = time.monotonic() + options.seconds, list(alone)

    def caller(number: int) -> tuple[int, list[str]]:
        done, wrong = 0, []
        while done < len(names) or time.monotonic() < end:
            name = names[(number + done) % len(names)]
            if not np.array_equal(together[name](), alone[name]):
                wrong.append(name)
            done += 1
        return done, wrong

    with ThreadPoolExecutor(options.callers) as pool:
        answers = list(pool.map(caller, range(options.callers)))
    wrong = sorted({name for _, names_ in answers for name in names_})
    print(f"{sum(done for done, _ in answers)} calls by {options.callers} threads; other than alone: {wrong or 'none'}")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
