"""The trials that the verdict is judged by: right pairs, and everything that must never be accepted.

    from verdict_trials import trials
    for trial in trials(seed=0):
        source, target, T_true, tolerance, init, ask = trial.make()

T_true is None where no pose is right: the clouds do not meet, a reflection lies between them, or the data cannot tell
their poses apart. Clouds are made when they are asked for, from the seed and the trial's name alone. Where the sensor's
place is known, a part of the trials tells it (PointClouds with a viewpoint); the rest are plain arrays.

Scenes are cut into two halves for good: thresholds may be chosen on "fit", figures count on "report". No trial mixes
the two.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import pairwise

import numpy as np
import scenes
import simulations
from scenes import DATA, SETS, apply, shift
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

import fieldalign as fa
from fieldalign.clouds.simulated import Room, Scene
from fieldalign.clouds.simulated.furniture import block

FIT, REPORT = "fit", "report"
REGISTER, VERIFY = "register", "verify"
HIGH, LOW = "> 0.3", "0.1-0.3"
HALVES = {
    FIT: ("kitchen", "kitti00", "raw154", "bunny"),
    REPORT: ("office", "demo", "kitti far", "raw22", "kitti07", "dragon_stand"),
}
RIGHT = ("indoor", "low", "lidar", "objects", "paper", "simulated")
VOXELS = {name: SETS[name].voxel for name in RIGHT} | {"shapes": 0.02}


@dataclass(frozen=True)
class Trial:
    """One question to fieldalign.

    kind: why the answer is known; set, scene, name: where it comes from; half: which half the scene belongs to.
    voxel: what the peers are told. overlap: of right pairs, HIGH or LOW; else empty.
    make: () -> source, target, T_true or None, tolerance (degrees, metres) or None, init or None, REGISTER or VERIFY.
    """

    kind: str
    set: str
    scene: str
    name: str
    voxel: float
    make: Callable[[], tuple]
    overlap: str = ""

    @property
    def half(self) -> str:
        return half_of(self.scene)


def half_of(scene: str) -> str:
    """FIT or REPORT, for good: real scenes by the table, made ones by their name."""
    listed = [half for half, members in HALVES.items() if scene in members]
    return listed[0] if listed else (FIT, REPORT)[zlib.crc32(scene.encode()) % 2]


def trials(seed: int = 0, scale: float = 1.0) -> list[Trial]:
    """All trials of a seed, scale: the share of each kind that is kept."""
    right = _right()
    kinds = (
        right,
        _changed(),
        _crossed(1250, seed),
        _similar_rooms(80, seed),
        _of_one("ends", _opposite_ends, 350, seed),
        _of_one("mirrored", _mirrored, 420, seed),
        _pushed("pushed", REGISTER, right, 600, seed),
        _pushed("pushed, verify", VERIFY, right, 300, seed),
        _periodic(20),
        _symmetric(6),
        _degenerate(2),
    )
    return [trial for kind in kinds for trial in evenly(kind, round(scale * len(kind)))]


def evenly(rows: list, count: int) -> list:
    """At most `count` of the rows, but one at least, evenly chosen."""
    places = np.linspace(0, len(rows) - 1, min(max(count, 1), len(rows))).round().astype(int)
    return [rows[place] for place in places]


def points_of(cloud) -> np.ndarray:
    return cloud.points if isinstance(cloud, fa.PointCloud) else cloud


# ------------------------------------------------------------------------------------------------ clouds


@dataclass(frozen=True, eq=False)
class Scan:
    """Points (N, 3), and where the sensor stood (3,), if that is known."""

    points: np.ndarray
    eye: np.ndarray | None = None

    def moved(self, T: np.ndarray) -> Scan:
        return self._each(lambda x: apply(T, x))

    def scaled(self, factor: float) -> Scan:
        return self._each(lambda x: factor * x)

    def reflected(self, normal: np.ndarray) -> Scan:
        """Seen in the mirror through the origin."""
        return self._each(lambda x: x - 2 * np.outer(x @ normal, normal))

    def taken(self, rows: np.ndarray) -> Scan:
        return replace(self, points=self.points[rows])

    def extent(self) -> float:
        """The diagonal, but for stray points."""
        return float(np.linalg.norm(np.ptp(np.percentile(self.points, (3, 97), axis=0), axis=0)))

    def given(self):
        """What fieldalign is handed: a PointCloud where the sensor's place is known, else an array."""
        points = np.ascontiguousarray(self.points, float)
        return points if self.eye is None else fa.PointCloud(points, viewpoint=shift(self.eye))

    def _each(self, change: Callable) -> Scan:
        return Scan(change(self.points), None if self.eye is None else change(self.eye[None])[0])


@dataclass(frozen=True)
class Cloud:
    """One cloud to make wrong trials of; load: (sighted) -> Scan."""

    set: str
    scene: str
    name: str
    load: Callable[[bool], Scan]


@cache
def clouds(half: str) -> tuple[Cloud, ...]:
    """The clouds of a half of the scenes."""
    found = [_stored("indoor", "office", f"indoor_fragments/frag_{i:02d}.npz", "xyz") for i in range(10)]
    for file in ("redkitchen_0_1", "redkitchen_1_4", "geotransformer_demo", "7-scenes-redkitchen_0_5"):
        found += [_stored("indoor", "kitchen", f"3dmatch/{file}.npz", key) for key in ("source", "target")]
    found += [_stored("indoor", "demo", "pointnetlk/demo_pair.npz", key) for key in ("p0", "p1")]
    frames = (("kitti00", "kitti00", 5), ("raw22", "kittiraw_22f", 7), ("raw154", "kittiraw_154f", 7))
    for scene, folder, step in frames:
        found += [_stored("lidar", scene, f"{folder}/{k:06d}.npz", "xyz", sensed=True) for k in range(0, 16, step)]
    found += [_stored("lidar", "kitti07", f"kitti07_submaps/{k:06d}.npz", "xyz") for k in range(5)]
    found += [_stored("lidar", "kitti far", f"kitti_10m_pairs/{k:03d}.npz", "target") for k in range(10, 60, 10)]
    for shape in ("bunny", "dragon_stand"):
        names = scenes._stanford(shape)[0][::2]
        found += [_stored("objects", shape, f"stanford/{shape}.npz", name) for name in names]
    found += [Cloud("simulated", f"room {r}", f"room {r}", partial(_room, r)) for r in range(3000, 3024)]
    found += [Cloud("shapes", f"mesh {k}", f"mesh {k}", partial(_mesh, k)) for k in range(0, 100, 4)]
    for shape in ("airplane", "bathtub"):
        found += [Cloud("shapes", f"{shape} {k}", f"{shape} {k}", partial(_model, shape, k)) for k in range(0, 25, 6)]
    return tuple(cloud for cloud in found if half_of(cloud.scene) == half)


def _stored(set: str, scene: str, file: str, key: str, sensed: bool = False) -> Cloud:
    """A cloud of a file; sensed: one scan in its sensor's frame."""

    def load(sighted: bool) -> Scan:
        return Scan(np.load(DATA / file)[key].astype(float), np.zeros(3) if sensed and sighted else None)

    return Cloud(set, scene, f"{file} {key}", load)


def _room(number: int, sighted: bool) -> Scan:
    return Scan(simulations.simulate(number)[0], np.zeros(3) if sighted else None)


def _model(shape: str, place: int, sighted: bool) -> Scan:
    return Scan(np.load(DATA / "modelnet40" / f"{shape}.npz")["xyz"][place].astype(float))


def _mesh(number: int, sighted: bool) -> Scan:
    lines = (DATA / "meshes" / f"{number:03d}.obj").read_text().splitlines()
    words = [line.split() for line in lines if line.strip()]
    vertices = np.array([[float(x) for x in w[1:4]] for w in words if w[0] == "v"])
    faces = [[int(corner.split("/")[0]) - 1 for corner in w[1:]] for w in words if w[0] == "f"]
    triangles = [(face[0], *pair) for face in faces for pair in pairwise(face[1:])]
    return Scan(_on_triangles(vertices[np.array(triangles)], 20_000, _rng("mesh", number)))


def _on_triangles(triangles: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Points (count, 3), uniform on triangles (T, 3, 3)."""
    corner = triangles[:, 0]
    one, other = triangles[:, 1] - corner, triangles[:, 2] - corner
    area = np.linalg.norm(np.cross(one, other), axis=1)
    rows = rng.choice(len(triangles), count, p=area / area.sum())
    a, b = np.sort(rng.uniform(size=(2, count)), axis=0)[..., None]
    return corner[rows] + a * one[rows] + (b - a) * other[rows]


def _rng(*key) -> np.random.Generator:
    return np.random.default_rng(zlib.crc32(repr(key).encode()))


def _direction(rng: np.random.Generator) -> np.ndarray:
    return scenes._unit(rng.normal(size=3))


def _any_pose(scan: Scan, rng: np.random.Generator) -> Scan:
    """The scan turned by up to 180 degrees about its middle, and shifted by about its size."""
    turn = np.eye(4)
    turn[:3, :3] = Rotation.from_rotvec(rng.uniform(0, np.pi) * _direction(rng)).as_matrix()
    middle = scan.points.mean(axis=0)
    return scan.moved(shift(rng.normal(size=3) * scan.extent() / 3) @ turn @ shift(-middle))


def _nothing_right(source: Scan, target: Scan, rng: np.random.Generator) -> tuple:
    """A trial of which every answer is wrong, with the source moved anywhere."""
    return _any_pose(source, rng).given(), target.given(), None, None, None, REGISTER


# ------------------------------------------------------------------------------------------------ right pairs


def _right() -> list[Trial]:
    """The pairs of the any-pose benchmark, each from two poses; the second tells where the sensors stood."""
    found = []
    for name in RIGHT:
        for seed in (0, 1):
            for recipe in SETS[name].recipes(seed):
                overlap = LOW if name == "low" or recipe.group in ("overlap 0.3", "overlap 0.1") else HIGH
                make = partial(_moved_pair, name, recipe, seed)
                label = f"{recipe.name} s{seed}"
                found.append(Trial("right", name, _scene_of(name, recipe), label, VOXELS[name], make, overlap))
    return found


def _moved_pair(name: str, recipe: scenes.Recipe, seed: int) -> tuple:
    target, source, T, _ = recipe.make()
    eye = np.zeros(3) if seed == 1 and name in ("lidar", "simulated") else None
    P = scenes._motion(SETS[name], source.mean(axis=0), np.random.default_rng([seed, zlib.crc32(recipe.name.encode())]))
    moved = Scan(source, eye).moved(P).given()
    return moved, Scan(target, eye).given(), T @ np.linalg.inv(P), SETS[name].tolerance, None, REGISTER


def _scene_of(name: str, recipe: scenes.Recipe) -> str:
    """The place that a pair was taken at; pairs of one place never lie in both halves."""
    if name in ("indoor", "low"):
        return "office" if recipe.group == "fragments" else "kitchen"
    if name == "lidar":
        return "kitti00" if recipe.name.startswith("kitti00") or recipe.name.endswith(" 000") else "kitti far"
    if name == "objects":
        return recipe.group
    first, second, *_ = recipe.name.split()
    return f"room {second}" if name == "simulated" else first


def _changed(rooms: int = 14) -> list[Trial]:
    """Rooms of which the target's sensor sees two or three pieces of furniture taken away or moved: right pairs."""
    return [
        Trial(
            kind="right",
            set="changed",
            scene=f"room {number}",
            name=f"changed room {number} overlap {overlap}",
            voxel=VOXELS["simulated"],
            make=partial(_changed_pair, number, overlap),
            overlap=HIGH,
        )
        for overlap in (0.9, 0.7, 0.5)
        for number in range(1500, 1500 + rooms)
    ]


def _changed_pair(number: int, overlap: float, rays: int = 30_000) -> tuple:
    rng = _rng("changed", number, overlap)
    _, source, T, made = simulations.simulate(number, overlap=overlap, rays=(rays, rays))
    pose = made.world_from_target
    while True:
        target = _rearranged(made.room, rng).scan(pose, rays, made.noise, seed=2 * number + 1).points
        if np.linalg.norm(target, axis=1).min() > 0.3:  # nothing was put right before the sensor
            break
    eye = np.zeros(3) if number % 2 else None
    middle = source.mean(axis=0)
    P = scenes._motion(SETS["simulated"], middle, rng)
    moved = Scan(source, eye).moved(P).given()
    return moved, Scan(target, eye).given(), T @ np.linalg.inv(P), scenes.INDOOR, None, REGISTER


def _rearranged(room: Room, rng: np.random.Generator) -> Scene:
    """The room with two or three pieces taken away, or moved by about half a metre."""
    solids = list(room.primitives)
    size = np.array(room.size)
    for _ in range(rng.integers(2, 4)):
        centres = np.array([solid.center for solid in solids])
        small = np.array([solid.reach < 1.3 for solid in solids])  # no wall, floor, beam or chimney
        loose = small & ((centres > 0.02) & (centres < size - 0.02)).all(axis=1)
        heart = centres[rng.choice(np.flatnonzero(loose))]
        piece = loose & (np.linalg.norm((centres - heart)[:, :2], axis=1) < 0.6)
        x, y = rng.uniform(0.3, 0.7, 2) * rng.choice((-1, 1), 2)
        away = rng.uniform() < 0.5
        moved = [] if away else [s.moved((x, y, 0.0)) for s, belongs in zip(solids, piece, strict=True) if belongs]
        solids = [solid for solid, belongs in zip(solids, piece, strict=True) if not belongs] + moved
    return Scene(tuple(solids))


# ------------------------------------------------------------------------------------------------ wrong pairs


def _crossed(count: int, seed: int) -> list[Trial]:
    """Clouds of different scenes, of one half; across sets always scaled to one extent, within a set sometimes."""
    rng, found = np.random.default_rng([seed, 1]), []
    while len(found) < count:
        pool = clouds((FIT, REPORT)[len(found) % 2])
        a, b = (pool[k] for k in rng.integers(len(pool), size=2))
        if not _may_meet(a, b):
            name = f"{len(found)} {a.name} x {b.name}"
            make = partial(_crossed_pair, a, b, (seed, name))
            found.append(Trial("crossed", f"{a.set} x {b.set}", b.scene, name, VOXELS[b.set], make))
    return found


def _may_meet(a: Cloud, b: Cloud) -> bool:
    """Whether two clouds may show the same place, or shapes or rooms that are alike."""
    if a.scene == b.scene or (a.set == b.set and a.set in ("shapes", "simulated")):
        return True
    streets = a.set == b.set == "lidar"
    return streets and not (a.scene.startswith("raw") or b.scene.startswith("raw"))


def _crossed_pair(a: Cloud, b: Cloud, key: tuple) -> tuple:
    rng = _rng("crossed", *key)
    sighted = bool(rng.integers(2))
    source, target = a.load(sighted), b.load(sighted)
    if a.set != b.set or rng.uniform() < 0.3:
        source = source.scaled(target.extent() / source.extent())
    return _nothing_right(source, target, rng)


def _similar_rooms(count: int, seed: int) -> list[Trial]:
    """Two simulated rooms, alike in layout, one of them a fifth smaller or a quarter larger."""
    rng, found = np.random.default_rng([seed, 2]), []
    for k in range(count):
        rooms = [cloud for cloud in clouds((FIT, REPORT)[k % 2]) if cloud.set == "simulated"]
        a, b = (rooms[place] for place in rng.choice(len(rooms), 2, replace=False))
        make = partial(_similar_pair, a, b, float(rng.choice((0.8, 1.25))), (seed, k))
        name = f"{k} {a.name} x {b.name}"
        found.append(Trial("similar rooms", "simulated", b.scene, name, VOXELS[b.set], make))
    return found


def _similar_pair(a: Cloud, b: Cloud, factor: float, key: tuple) -> tuple:
    rng = _rng("similar", *key)
    sighted = bool(rng.integers(2))
    return _nothing_right(a.load(sighted).scaled(factor), b.load(sighted), rng)


def _of_one(kind: str, cut: Callable, count: int, seed: int) -> list[Trial]:
    """Trials of one cloud that is cut in two; shapes, many of them symmetric, are left out."""
    rng, found = np.random.default_rng([seed, zlib.crc32(kind.encode())]), []
    for k in range(count):
        pool = [cloud for cloud in clouds((FIT, REPORT)[k % 2]) if cloud.set != "shapes"]
        cloud = pool[rng.integers(len(pool))]
        make = partial(cut, cloud, (kind, seed, k))
        found.append(Trial(kind, cloud.set, cloud.scene, f"{k} {cloud.name}", VOXELS[cloud.set], make))
    return found


def _opposite_ends(cloud: Cloud, key: tuple) -> tuple:
    """What lies below the 45 % and above the 55 % quantile in a direction within the cloud's two longer axes."""
    rng = _rng(*key)
    whole = cloud.load(bool(rng.integers(2)))
    _, _, axes = np.linalg.svd(whole.points[::10] - whole.points.mean(axis=0), full_matrices=False)
    along = whole.points @ (scenes._unit(rng.normal(size=2)) @ axes[:2])
    low, high = np.quantile(along, (0.45, 0.55))
    return _nothing_right(whole.taken(along < low), whole.taken(along > high), rng)


def _mirrored(cloud: Cloud, key: tuple) -> tuple:
    """One half of the points, drawn by chance, as a mirror shows them, and the other half."""
    rng = _rng(*key)
    whole = cloud.load(bool(rng.integers(2)))
    half = rng.uniform(size=len(whole.points)) < 0.5
    return _nothing_right(whole.taken(half).reflected(_direction(rng)), whole.taken(~half), rng)


def _pushed(kind: str, ask: str, right: list[Trial], count: int, seed: int) -> list[Trial]:
    """Right pairs with the truth pushed by 10 to 180 degrees and a shift: as a guess without search, or to verify."""
    rng, base = np.random.default_rng([seed, zlib.crc32(kind.encode())]), [t for t in right if t.set != "low"]
    found = []
    for k in range(count):
        pair = base[rng.integers(len(base))]
        make = partial(_pushed_pair, pair, ask, (kind, seed, k))
        found.append(replace(pair, kind=kind, name=f"{k} {pair.name}", make=make, overlap=""))
    return found


def _pushed_pair(pair: Trial, ask: str, key: tuple) -> tuple:
    source, target, T, tolerance, *_ = pair.make()
    rng, points = _rng(*key), points_of(target)
    turn, middle = np.eye(4), points.mean(axis=0)
    turn[:3, :3] = Rotation.from_rotvec(np.radians(rng.uniform(10, 180)) * _direction(rng)).as_matrix()
    step = _direction(rng) * rng.uniform(0, 0.075) * np.linalg.norm(np.ptp(points, axis=0))
    return source, target, T, tolerance, shift(middle + step) @ turn @ shift(-middle) @ T, ask


# ------------------------------------------------------------------------------------------------ what has no answer


def _periodic(count: int) -> list[Trial]:
    """Both scans see an interior stretch of a repeated structure: from any pose; and shifted by one period, verified.

    What the data cannot tell apart may not be accepted, not even the pose that happens to be true.
    """
    return [
        Trial(f"period, {ask}", what, f"{what} {k}", f"{what} {k}", 0.05, partial(_periodic_pair, what, k, ask))
        for what in STRUCTURES
        for ask in (REGISTER, VERIFY)
        for k in range(count)
    ]


def _periodic_pair(what: str, number: int, ask: str) -> tuple:
    rng = _rng(what, number)
    scene, period, eye, pitch = STRUCTURES[what](rng)
    poses = [_looking(eye + along * period, pitch, rng) for along in (0.0, rng.uniform(-0.6, 0.6))]
    source, target = (
        Scan(scene.scan(pose, 30_000, seed=2 * number + k).points, np.zeros(3) if number % 2 else None)
        for k, pose in enumerate(poses)
    )
    if ask == REGISTER:
        return _nothing_right(source, target, rng)
    T = np.linalg.inv(poses[1]) @ shift(rng.choice((-1, 1)) * period) @ poses[0]
    return source.given(), target.given(), None, None, T, VERIFY


def _looking(eye: np.ndarray, pitch: float, rng: np.random.Generator) -> np.ndarray:
    """world_from_sensor (4, 4), near the eye, ahead (+y) and down by the pitch, each off by some degrees."""
    yaw, down, roll = np.array([90, pitch, 0]) + rng.uniform(-6, 6, 3)
    pose = shift(eye + rng.uniform(-0.15, 0.15, 3))
    pose[:3, :3] = Rotation.from_euler("ZYX", [yaw, down, roll], degrees=True).as_matrix()
    return pose


def _facade(rng: np.random.Generator) -> tuple:
    """A wall along x behind y = 0 over a pavement, with equal windows; longer and higher than can be seen."""
    step, width, depth = rng.uniform((1.8, 0.8, 0.15), (2.6, 1.3, 0.3))
    bands = [block((-30, 0, z), (30, 1, z + 1.6)) for z in np.arange(0, 18, 3)]
    piers = [block((x, 0, 0), (x + step - width, 1, 18)) for x in step * np.arange(-12, 12)]
    ground, glass = block((-30, -20, -1), (30, 1, 0)), block((-30, depth, 0), (30, 1, 18))
    return Scene((ground, glass, *bands, *piers)), np.array([step, 0, 0]), np.array([0, -5.0, 1.7]), -8.0


def _row(rng: np.random.Generator) -> tuple:
    """Equal boxes in a row along x, on a floor, before a wall."""
    step, width, height = rng.uniform((1.2, 0.4, 0.5), (1.8, 0.8, 1.2))
    boxes = [block((x, 0, 0), (x + width, 0.7, height)) for x in step * np.arange(-25, 25)]
    floor, wall = block((-40, -20, -1), (40, 2, 0)), block((-40, 1.5, 0), (40, 2.5, 20))
    return Scene((floor, wall, *boxes)), np.array([step, 0, 0]), np.array([0, -3.0, 1.6]), 15.0


def _stairs(rng: np.random.Generator) -> tuple:
    """Equal steps that rise along y, between two walls."""
    tread, rise = rng.uniform((0.26, 0.15), (0.34, 0.19))
    steps = [block((-1.2, k * tread, -20), (1.2, (k + 1) * tread, k * rise)) for k in range(-60, 61)]
    walls = [block((x, -40, -40), (x + 1, 40, 40)) for x in (-2.2, 1.2)]
    return Scene((*walls, *steps)), np.array([0, tread, rise]), np.array([0, 0, 1.6]), 35.0


STRUCTURES = {"facade": _facade, "row": _row, "stairs": _stairs}


def _symmetric(count: int) -> list[Trial]:
    """Whole objects that turn into themselves; noise of 0 and 0.3 % of the extent in turn."""
    names = ("box", "cube", *(f"prism {n}" for n in (3, 4, 5, 6, 8)))
    return [
        Trial("symmetric", name, f"{name} {k}", f"{name} {k}", 0.03, partial(_symmetric_pair, name, k))
        for name in names
        for k in range(count)
    ]


def _symmetric_pair(name: str, number: int) -> tuple:
    rng = _rng(name, number)
    sides = int(name.split()[1]) if name.startswith("prism") else 4
    turns = 2 * np.pi * (np.arange(sides) + 0.5) / sides
    size = {"box": np.array([1.4, 1.0, 0.6]), "cube": np.full(3, 1.0)}.get(name, rng.uniform((1, 1, 0.5), (1, 1, 2)))
    ring = np.sqrt(0.5) * np.column_stack([np.cos(turns), np.sin(turns)])
    corners = np.vstack([np.column_stack([ring, np.full(sides, z)]) for z in (-0.5, 0.5)]) * size
    triangles = corners[ConvexHull(corners).simplices]
    return _noisy_pair(lambda: _on_triangles(triangles, 20_000, rng), 0.003 * (number % 2), rng)


def _noisy_pair(draw: Callable[[], np.ndarray], noise: float, rng: np.random.Generator) -> tuple:
    """Two samples of one surface, with noise in shares of the extent along each axis."""
    samples = [draw() for _ in range(2)]
    spread = noise * np.linalg.norm(np.ptp(samples[0], axis=0))
    return _nothing_right(*(Scan(s + spread * rng.normal(size=s.shape)) for s in samples), rng)


def _degenerate(count: int) -> list[Trial]:
    """Surfaces that slide or turn on themselves, by noise and density."""
    return [
        Trial(
            kind="degenerate",
            set=what,
            scene=what,
            name=f"{what} {points} points noise {noise} {k}",
            voxel=0.05,
            make=partial(_degenerate_pair, what, points, noise, k),
        )
        for what in SURFACES
        for points in (5000, 40_000)
        for noise in (0.0, 0.001, 0.003, 0.01)
        for k in range(count)
    ]


def _degenerate_pair(what: str, points: int, noise: float, number: int) -> tuple:
    rng = _rng(what, points, noise, number)
    return _noisy_pair(lambda: SURFACES[what](rng, *rng.uniform(size=(2, points))), noise, rng)


def _ball(rng, u, v):
    g = rng.normal(size=(len(u), 3))
    return g / np.linalg.norm(g, axis=1, keepdims=True)


def _cap(rng, u, v):
    height = 1 - 0.6 * v  # of a sphere, areas go with heights
    return _around(np.sqrt(1 - height**2), 2 * np.pi * u, height)


def _around(radius, turn, z):
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), z])


def _tunnel(rng, u, v):
    vault = np.column_stack([2 * np.cos(np.pi * u), 20 * v, 2 * np.sin(np.pi * u)])
    return np.where(rng.uniform(size=(len(u), 1)) < 0.4, np.column_stack([4 * u - 2, 20 * v, 0 * u]), vault)


def _corridor(rng, u, v):
    walls = [np.column_stack([np.full(len(u), x), 15 * v, 2.5 * u]) for x in (-1, 1)]
    return np.choose(rng.integers(3, size=(len(u), 1)), [*walls, np.column_stack([2 * u - 1, 15 * v, 0 * u])])


def _two_planes(rng, u, v):
    flat, upright = np.column_stack([3 * u, 4 * v, 0 * u]), np.column_stack([0 * u, 4 * v, 3 * u])
    return np.where(rng.uniform(size=(len(u), 1)) < 0.5, flat, upright)


def _torus(rng, u, v):
    keep = rng.uniform(0, 2.6, len(u)) < 2 + 0.6 * np.cos(2 * np.pi * v)
    u, v = 2 * np.pi * u[keep], 2 * np.pi * v[keep]
    return _around(2 + 0.6 * np.cos(v), u, 0.6 * np.sin(v))


SURFACES = {
    "plane": lambda rng, u, v: np.column_stack([4 * u, 3 * v, 0 * u]),
    "sphere": _ball,
    "cap": _cap,
    "cylinder": lambda rng, u, v: _around(1.0, 2 * np.pi * u, 6 * v),
    "half tunnel": _tunnel,
    "corridor": _corridor,
    "cone": lambda rng, u, v: _around(np.sqrt(v), 2 * np.pi * u, 2 * np.sqrt(v)),
    "two planes": _two_planes,
    "torus": _torus,
}
