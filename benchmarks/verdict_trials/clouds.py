"""The clouds that wrong trials are made of."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import pairwise

import numpy as np
import scenes
import simulations
from scenes import DATA, apply, shift
from scipy.spatial.transform import Rotation

import fieldalign as fa

from .trial import REGISTER, half_of


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
    found += [Cloud("simulated", f"room {r}", f"room {r}", partial(room_scan, r)) for r in range(3000, 3024)]
    found += [Cloud("shapes", f"mesh {k}", f"mesh {k}", partial(_mesh, k)) for k in range(0, 100, 4)]
    for shape in ("airplane", "bathtub"):
        found += [Cloud("shapes", f"{shape} {k}", f"{shape} {k}", partial(_model, shape, k)) for k in range(0, 25, 6)]
    return tuple(cloud for cloud in found if half_of(cloud.scene) == half)


def _stored(set: str, scene: str, file: str, key: str, sensed: bool = False) -> Cloud:
    """A cloud of a file; sensed: one scan in its sensor's frame."""

    def load(sighted: bool) -> Scan:
        return Scan(np.load(DATA / file)[key].astype(float), np.zeros(3) if sensed and sighted else None)

    return Cloud(set, scene, f"{file} {key}", load)


def room_scan(number: int, sighted: bool) -> Scan:
    return Scan(simulations.simulate(number)[0], np.zeros(3) if sighted else None)


def _model(shape: str, place: int, sighted: bool) -> Scan:
    return Scan(np.load(DATA / "modelnet40" / f"{shape}.npz")["xyz"][place].astype(float))


def _mesh(number: int, sighted: bool) -> Scan:
    lines = (DATA / "meshes" / f"{number:03d}.obj").read_text().splitlines()
    words = [line.split() for line in lines if line.strip()]
    vertices = np.array([[float(x) for x in w[1:4]] for w in words if w[0] == "v"])
    faces = [[int(corner.split("/")[0]) - 1 for corner in w[1:]] for w in words if w[0] == "f"]
    triangles = [(face[0], *pair) for face in faces for pair in pairwise(face[1:])]
    return Scan(on_triangles(vertices[np.array(triangles)], 20_000, rng_of("mesh", number)))


def on_triangles(triangles: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Points (count, 3), uniform on triangles (T, 3, 3)."""
    corner = triangles[:, 0]
    one, other = triangles[:, 1] - corner, triangles[:, 2] - corner
    area = np.linalg.norm(np.cross(one, other), axis=1)
    rows = rng.choice(len(triangles), count, p=area / area.sum())
    a, b = np.sort(rng.uniform(size=(2, count)), axis=0)[..., None]
    return corner[rows] + a * one[rows] + (b - a) * other[rows]


def rng_of(*key) -> np.random.Generator:
    return np.random.default_rng(zlib.crc32(repr(key).encode()))


def direction(rng: np.random.Generator) -> np.ndarray:
    return scenes._unit(rng.normal(size=3))


def any_pose(scan: Scan, rng: np.random.Generator) -> Scan:
    """The scan turned by up to 180 degrees about its middle, and shifted by about its size."""
    turn = np.eye(4)
    turn[:3, :3] = Rotation.from_rotvec(rng.uniform(0, np.pi) * direction(rng)).as_matrix()
    middle = scan.points.mean(axis=0)
    return scan.moved(shift(rng.normal(size=3) * scan.extent() / 3) @ turn @ shift(-middle))


def nothing_right(source: Scan, target: Scan, rng: np.random.Generator) -> tuple:
    """A trial of which every answer is wrong, with the source moved anywhere."""
    return any_pose(source, rng).given(), target.given(), None, None, None, REGISTER
