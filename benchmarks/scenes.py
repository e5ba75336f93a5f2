"""The pairs that the any-pose benchmark is run on: real scans, cuts of real scans, simulated rooms.

    from scenes import pairs
    for case in pairs("indoor", seed=0):
        case.name, case.source, case.target, case.T_target_source, case.tolerance

Every case is moved by one random rigid motion of the source, drawn from the seed and the name of the case alone: the
same for every method, and the same whichever other cases are run. All lengths are metres, also those of the objects.
Data: ../shared/data or $FIELDALIGN_DATA.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import numpy as np
import simulations
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

DATA = Path(os.environ.get("FIELDALIGN_DATA", Path(__file__).parents[2] / "shared" / "data"))


@dataclass(frozen=True, eq=False)
class Case:
    """One pair to register, and the truth about it.

    set, group, name: where it comes from; figures are given by set and by group.
    source, target: (N, 3) float64, metres, each in its own frame.
    T_target_source: (4, 4), the truth.
    tolerance: degrees and metres (of the source's centroid) within which an answer is right.
    voxel: what the peers are told; fieldalign is told no length.
    init: (4, 4), the guess of sets that come with one; None: any pose.
    simulation: how the scans were made, for the Cramer-Rao bound; None for real scans.
    """

    set: str
    group: str
    name: str
    source: np.ndarray
    target: np.ndarray
    T_target_source: np.ndarray
    tolerance: tuple[float, float]
    voxel: float
    init: np.ndarray | None = None
    simulation: simulations.Simulation | None = None


@dataclass(frozen=True)
class Recipe:
    """A case that is not made yet: `make()` gives target, source, T_target_source and the simulation or None."""

    group: str
    name: str
    make: Callable[[], tuple]


@dataclass(frozen=True)
class Set:
    """How to make the cases of one name: recipes by seed, what the peers are told, and how the source is moved."""

    recipes: Callable[[int], list[Recipe]]
    voxel: float
    tolerance: tuple[float, float]
    largest_angle: float = 180.0
    shift: float | None = None  # None: normally distributed, 10 voxels along each axis; else uniform up to this length
    guess: bool = False  # whether the clouds' centroids, laid on each other, are given as a guess
    peers: tuple[str, ...] | None = None  # that run here; None: all


def pairs(name: str, seed: int = 0, count: int | None = None) -> Iterator[Case]:
    """The cases of a set, moved by the motions of this seed; count: at most so many of each group, evenly chosen."""
    kind = SETS[name]
    for recipe in _some(kind.recipes(seed), count):
        target, source, T, simulation = recipe.make()
        target, source = (np.ascontiguousarray(cloud, float) for cloud in (target, source))
        P = _motion(kind, source.mean(axis=0), np.random.default_rng([seed, zlib.crc32(recipe.name.encode())]))
        moved = apply(P, source)
        yield Case(
            set=name,
            group=recipe.group,
            name=recipe.name,
            source=moved,
            target=target,
            T_target_source=T @ np.linalg.inv(P),
            tolerance=kind.tolerance,
            voxel=kind.voxel,
            init=shift(target.mean(axis=0) - moved.mean(axis=0)) if kind.guess else None,
            simulation=simulation,
        )


def apply(T: np.ndarray, points: np.ndarray) -> np.ndarray:
    return points @ T[:3, :3].T + T[:3, 3]


def shift(offset: np.ndarray) -> np.ndarray:
    T = np.eye(4)
    T[:3, 3] = offset
    return T


def _motion(kind: Set, centre: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A rotation by a uniform angle about a random axis through the centre, and a shift."""
    axis, step = rng.normal(size=3), rng.normal(size=3)
    turn = np.eye(4)
    angle = rng.uniform(0, np.radians(kind.largest_angle))
    turn[:3, :3] = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)).as_matrix()
    if kind.shift is None:
        step *= 10 * kind.voxel
    else:
        step *= rng.uniform(0, kind.shift) / np.linalg.norm(step)
    return shift(centre + step) @ turn @ shift(-centre)


def _some(recipes: list[Recipe], count: int | None) -> list[Recipe]:
    """At most `count` of each group, evenly chosen."""
    if count is None:
        return recipes
    chosen = []
    for group in dict.fromkeys(r.group for r in recipes):
        members = [r for r in recipes if r.group == group]
        places = np.linspace(0, len(members) - 1, min(count, len(members))).round().astype(int)
        chosen += [members[place] for place in places]
    return chosen


# ------------------------------------------------------------------------------------------------ real scans


def _indoor(seed: int) -> list[Recipe]:
    """31 pairs of office fragments that overlap by more than 0.3, and 5 of 3DMatch."""
    return _fragments(0.3, 1.0, "fragments") + _ready("3dmatch", "3dmatch")


def _low(seed: int) -> list[Recipe]:
    """9 pairs of office fragments that overlap by 0.1 to 0.3."""
    return _fragments(0.1, 0.3, "fragments")


def _fragments(above: float, up_to: float, group: str) -> list[Recipe]:
    rows = np.loadtxt(DATA / "indoor_fragments" / "pairs.txt")
    chosen = [(int(i), int(j)) for i, j, overlap, *_ in rows if above < overlap <= up_to]
    return [Recipe(group, f"fragments {i}-{j}", partial(_fragment_pair, i, j)) for i, j in chosen]


def _fragment_pair(i: int, j: int) -> tuple:
    (target, world_from_i), (source, world_from_j) = _fragment(i), _fragment(j)
    return target, source, np.linalg.inv(world_from_i) @ world_from_j, None


@cache
def _fragment(i: int) -> tuple:
    archive = np.load(DATA / "indoor_fragments" / f"frag_{i:02d}.npz")
    return archive["xyz"], archive["world_from_fragment"]


def _ready(folder: str, group: str) -> list[Recipe]:
    files = sorted((DATA / folder).glob("*.npz"))
    return [Recipe(group, f"{folder} {file.stem}", partial(_ready_pair, file)) for file in files]


def _ready_pair(file: Path) -> tuple:
    archive = np.load(file)
    return archive["target"], archive["source"], archive["target_from_source"], None


def _lidar(seed: int) -> list[Recipe]:
    """6 pairs 10 m apart, thinned at 0.3 m, and full scans of kitti00 that are 5, 10 and 15 frames apart."""
    far = [(i, i + gap) for gap in (5, 10, 15) for i in range(16 - gap)]
    full = [Recipe("kitti00 full", f"kitti00 {i}-{j}", partial(_kitti_pair, i, j)) for i, j in far]
    return _ready("kitti_10m_pairs", "10 m, thinned") + full


def _kitti_pair(i: int, j: int) -> tuple:
    world = np.load(DATA / "kitti00" / "poses.npz")["world_from_lidar_semantickitti"]
    target, source = (np.load(DATA / "kitti00" / f"{k:06d}.npz")["xyz"] for k in (i, j))
    return target, source, np.linalg.inv(world[i]) @ world[j], None


@cache
def _objects(seed: int) -> list[Recipe]:
    """The 62 pairs of raw range scans of one object that overlap by more than 0.3 at 1.5 mm."""
    recipes = []
    for shape in ("bunny", "dragon_stand"):
        names, scans, world = _stanford(shape)
        trees = [cKDTree(scan) for scan in scans]
        for i, tree in enumerate(trees):
            for j in range(i + 1, len(scans)):
                T = np.linalg.inv(world[i]) @ world[j]
                if (tree.query(apply(T, scans[j][::20]))[0] < 0.0015).mean() > 0.3:
                    make = partial(lambda *pair: (*pair, None), scans[i], scans[j], T)
                    recipes.append(Recipe(shape, f"{names[i]}-{names[j]}", make))
    return recipes


def _stanford(shape: str) -> tuple:
    archive = np.load(DATA / "stanford" / f"{shape}.npz")
    names = [str(name) for name in archive["names"]]
    return names, [archive[name].astype(float) for name in names], archive["world_from_scan"]


# ------------------------------------------------------------------------------------------------ the paper's setting

PAPER_SCENES = {
    "demo": ("pointnetlk/demo_pair.npz", "p0"),
    "kitchen 0": ("3dmatch/redkitchen_0_1.npz", "target"),
    "kitchen 1": ("3dmatch/redkitchen_1_4.npz", "target"),
    "kitchen 4": ("3dmatch/redkitchen_1_4.npz", "source"),
}


def _paper(seed: int) -> list[Recipe]:
    """Two clouds of 100,000 points cut from one real indoor surface, 5 mm noise: the truth is exact."""
    return [
        Recipe(f"overlap {overlap}", name, partial(_cut, scene, overlap, [seed, zlib.crc32(name.encode())]))
        for overlap in (0.9, 0.7, 0.5)
        for scene in PAPER_SCENES
        for cut in range(3)
        for name in [f"{scene} {overlap} cut {cut}"]
    ]


def _cut(scene: str, overlap: float, seed: list[int], points: int = 100_000, noise: float = 0.005) -> tuple:
    """The scene's two ends in a random horizontal direction, so long that they share `overlap` of their surface."""
    rng = np.random.default_rng(seed)
    surface, axes = _scene(scene)
    along = surface[:, 0] @ (axes @ _unit(rng.normal(size=2)))
    share = 1 / (2 - overlap)
    ends = along <= np.quantile(along, share), along >= np.quantile(along, 1 - share)
    target, source = (_sample(surface[end], points, rng) for end in ends)
    target, source = (cloud + noise * rng.normal(size=cloud.shape) for cloud in (target, source))
    return target, source, np.eye(4), None


@cache
def _scene(name: str) -> tuple:
    """(N, 7, 3): each point of the scene with its six nearest neighbours; the two longer axes of the scene (3, 2)."""
    file, key = PAPER_SCENES[name]
    points = np.load(DATA / file)[key].astype(float)
    _, _, axes = np.linalg.svd(points[::10] - points.mean(axis=0), full_matrices=False)
    return points[cKDTree(points).query(points, 7, workers=2)[1]], axes[:2].T


def _sample(surface: np.ndarray, points: int, rng: np.random.Generator) -> np.ndarray:
    """Points on the triangles between a point of the surface and two of its neighbours: no point is drawn twice."""
    rows = rng.integers(len(surface), size=points)
    one, other = 1 + rng.permuted(np.tile(np.arange(6), (points, 1)), axis=1)[:, :2].T
    a, b = np.sort(rng.uniform(size=(2, points)), axis=0)[..., None]
    corner = surface[rows, 0]
    return corner * (1 - b) + surface[rows, one] * a + surface[rows, other] * (b - a)


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


# ------------------------------------------------------------------------------------------------ simulated rooms


def _simulated(seed: int, rooms: int = 6) -> list[Recipe]:
    """Full scans of 100,000 points by overlap: what accuracy is measured on, against the Cramer-Rao bound."""
    return _rooms(seed, rooms, "overlap", (0.9, 0.7, 0.5, 0.3, 0.1), rays=(100_000, 100_000))


def _curve(what: str, values: tuple, seed: int, rooms: int = 6) -> list[Recipe]:
    """One thing at a time made worse, from 0.6 overlap, 0.1 % noise, no outliers and 30,000 points each."""
    return _rooms(seed, rooms, what, values, rays=(30_000, 30_000))


def _rooms(seed: int, rooms: int, what: str, values: tuple, rays: tuple[int, int]) -> list[Recipe]:
    recipes = []
    for value in values:
        options = {"rays": rays} | simulations.changed(what, value)
        for room in range(rooms):
            number = 1000 + 100 * seed + room  # no room that the tests or the demo show
            make = partial(simulations.simulate, number, **options)
            recipes.append(Recipe(f"{what} {value}", f"room {number} {what} {value}", make))
    return recipes


SEARCHING = ("kiss", "kiss-fine", "ransac", "fgr", "gicp")  # a local method without a guess shows nothing new
COARSE = ("kiss", "ransac", "fgr", "gicp")  # a finer last level does not change what is found
INDOOR, LIDAR, OBJECTS = (5.0, 0.2), (5.0, 0.6), (5.0, 0.005)
CURVES = {
    "overlap": (0.9, 0.75, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1),
    "noise": (0.0, 0.1, 0.3, 1.0, 2.0, 3.0),  # per cent of the room's diagonal
    "outliers": (0.0, 0.1, 0.2, 0.3, 0.4, 0.5),  # share of each cloud
    "density": (1, 3, 10, 30, 50),  # source points to a target point
}
SETS = {
    "indoor": Set(_indoor, 0.05, INDOOR),
    "lidar": Set(_lidar, 0.5, LIDAR),
    "objects": Set(_objects, 0.002, OBJECTS),
    "low": Set(_low, 0.05, INDOOR),
    "paper": Set(_paper, 0.05, INDOOR, largest_angle=45.0, shift=0.8, guess=True),
    "simulated": Set(_simulated, 0.05, INDOOR, peers=SEARCHING),
    **{
        f"curve-{what}": Set(partial(_curve, what, values), 0.05, INDOOR, peers=COARSE)
        for what, values in CURVES.items()
    },
}
