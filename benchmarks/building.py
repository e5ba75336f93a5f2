"""A building of offices on three storeys, scanned from hundreds of places by a panoramic scanner; the truth is exact.

    python benchmarks/building.py /tmp/building                       200 scans of 10^6 points, levelled; two minutes
    python benchmarks/building.py /tmp/building --free --scans 40     turned at random in SO(3)
    python benchmarks/building.py /tmp/building --small               12 scans of 50,000 points

Writes scan_000.npy, ... (N, 3) float32, metres, each in the frame of its scanner, in random order, and truth.npz:
world_from_scan (n, 4, 4), and shared (n, n), the share of the surface that scan i sees (cells of 0.25 m, up to 12 m
away) which scan j sees too. The scanner stands 1.5 m above the floor, in rooms, in doorways, along corridors and on
stairs; it does not see the floor right below, and its ranges have noise of 2 mm. Levelled: turned about z alone; the
tilt is exactly none. Free: the frame is turned at random, the scans are the same. Same seed, same files.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from building_plan import Plan
from panorama import Panorama, World
from scipy.spatial.transform import Rotation

NOISE = 0.002  # of the range, metres
CELL, REACH = 0.25, 12.0  # of the count of what is shared: its cells, and up to which range it is counted
SPARE = 1.15  # scans that are made for each that is kept: those that share least with all others are left out
FOLDER = Path("/tmp/building")

_world: list[World] = []  # of this process


def make(folder: Path, scans: int, points: int, free: bool, seed: int, jobs: int = 2) -> dict:
    """Writes the files; returns what it took and what came out."""
    folder.mkdir(parents=True, exist_ok=True)
    for earlier in files(folder):
        earlier.unlink()
    start = time.perf_counter()
    plan = Plan(round(SPARE * scans), seed)
    work = partial(_scanned, folder=folder, places=plan.places, points=points, free=free, seed=seed)
    with ProcessPoolExecutor(jobs, get_context("spawn"), _prepare, (round(SPARE * scans), seed)) as pool:
        made = list(pool.map(work, range(len(plan.places))))
    cells = [seen for _, seen, _ in made]
    shared = np.array([[len(np.intersect1d(a, b, True)) / len(a) for b in cells] for a in cells], np.float32)
    kept = np.random.default_rng([seed, 4]).permutation(_grown(shared, scans)[1])
    _keep(folder, kept)
    poses, shared = np.stack([made[k][0] for k in kept]), shared[np.ix_(kept, kept)]
    np.savez(folder / "truth.npz", world_from_scan=poses, shared=shared)
    counts = [made[k][2] for k in kept]
    return {"seconds": time.perf_counter() - start, "least": min(counts), "most": max(counts)} | described(shared)


def _keep(folder: Path, kept: np.ndarray) -> None:
    """Names the scans that are kept by their order, and removes the others."""
    for name, k in enumerate(kept):
        (folder / f"spare_{k:03d}.npy").rename(folder / f"scan_{name:03d}.npy")
    for spare in folder.glob("spare_*.npy"):
        spare.unlink()


def described(shared: np.ndarray) -> dict:
    """How much of what a scan sees its nearest neighbours see, and how much one needs to ask for to lose a scan."""
    others = np.sort(np.minimum(shared, shared.T) * (1 - np.eye(len(shared))), axis=1)[:, ::-1]
    weakest, _ = _grown(shared, len(shared))
    return {
        "first_neighbour": np.quantile(others[:, 0], (0, 0.1, 0.5, 0.9)).tolist(),
        "third_neighbour": np.quantile(others[:, min(2, len(others) - 1)], (0, 0.1, 0.5, 0.9)).tolist(),
        "weakest_link": weakest,  # of the tree of strongest links that joins all scans
    }


def files(folder: Path) -> list[Path]:
    return sorted(folder.glob("scan_*.npy"))


def truth(folder: Path) -> np.ndarray:
    """world_from_scan (n, 4, 4)."""
    return np.load(folder / "truth.npz")["world_from_scan"]


def part(folder: Path, count: int) -> list[int]:
    """So many scans that hang together, in random order."""
    _, chosen = _grown(np.load(folder / "truth.npz")["shared"], count)
    return [chosen[k] for k in np.random.default_rng(0).permutation(len(chosen))]


def _grown(shared: np.ndarray, count: int) -> tuple[float, list[int]]:
    """The scans that are reached first over the strongest links, and the weakest of these links."""
    both = np.minimum(shared, shared.T)
    chosen, weakest = [int(both.sum(axis=1).argmax())], 1.0
    reach = both[chosen[0]].copy()
    while len(chosen) < count:
        reach[chosen] = -1
        chosen.append(int(reach.argmax()))
        weakest = min(weakest, float(reach[chosen[-1]]))
        reach = np.maximum(reach, both[chosen[-1]])
    return weakest, chosen


# ------------------------------------------------------------------------------------------------ one scan


def _prepare(scans: int, seed: int) -> None:
    """Each process of the pool makes the world for itself."""
    _world.append(World(Plan(scans, seed).solids))


def _scanned(k: int, folder: Path, places: np.ndarray, points: int, free: bool, seed: int) -> tuple:
    """Writes a scan; its pose (4, 4), the cells of the world that it sees, and its number of points."""
    rng = np.random.default_rng([seed, 2, k])
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("z", rng.uniform(0, 2 * np.pi)).as_matrix()
    pose[:3, 3] = places[k]
    cloud = Panorama(points).scan(_world[0], pose, NOISE, rng)
    near = cloud[np.linalg.norm(cloud, axis=1) < REACH]
    cells = _cells(near @ pose[:3, :3].T.astype(np.float32) + pose[:3, 3].astype(np.float32))
    if free:
        turn = Rotation.random(random_state=np.random.default_rng([seed, 3, k])).as_matrix()
        cloud = (cloud.astype(float) @ turn).astype(np.float32)
        pose[:3, :3] = pose[:3, :3] @ turn
    np.save(folder / f"spare_{k:03d}.npy", cloud)
    return pose, cells, len(cloud)


def _cells(points: np.ndarray) -> np.ndarray:
    """The numbers of the cells of a grid that hold points: its planes lie beside those of the walls."""
    i, j, k = (np.floor((points + np.float32(100.11)) / np.float32(CELL)).astype(np.int64)).T
    return np.unique((i * 4096 + j) * 4096 + k)


# ------------------------------------------------------------------------------------------------ command line


def lines(described: dict) -> Iterator[str]:
    for key, value in described.items():
        said = [f"{v:.4g}" for v in (value if isinstance(value, list) else [value])]
        yield f"{key}: {', '.join(said)}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, nargs="?", default=FOLDER)
    parser.add_argument("--scans", type=int, default=200)
    parser.add_argument("--points", type=int, default=1_000_000, help="at least so many in each scan, about")
    group = parser.add_mutually_exclusive_group()
    group.add_argument("--free", action="store_true", help="turned at random in SO(3)")
    group.add_argument("--levelled", action="store_true", help="turned about z alone (the default)")
    parser.add_argument("--small", action="store_true", help="12 scans of 50,000 points")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    arguments = parser.parse_args()
    scans, points = (12, 50_000) if arguments.small else (arguments.scans, arguments.points)
    made = make(arguments.folder, scans, points, arguments.free, arguments.seed, arguments.jobs)
    print("\n".join(lines(made)))


if __name__ == "__main__":
    main()
