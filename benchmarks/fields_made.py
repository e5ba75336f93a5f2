"""What the benchmark of fields is run on: shapes as points, mesh, volume and function, fused scans, wrong pairs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
import scenes
from scenes import DATA, apply, shift
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from verdict_trials.clouds import clouds, direction, on_triangles
from verdict_trials.trial import FIT, REPORT
from verdict_trials.wrong import _may_meet as may_meet

from fieldalign.fields import CallableField, MeshField, PointField, VolumeField, read_field

KINDS = "points", "mesh", "volume", "callable"
POINTS, SEEN, NOISE = 20_000, 2 / 3, 5e-4  # of a cloud; the share that a plane leaves; of the extent
CELLS, MARGIN = 64, 4  # of a volume, along its longest edge and beyond
ALIKE = 4 * NOISE      # of the extent: a surface that lies on itself so closely, turned, is symmetric
LEAST_TURN, TURNS, REFINED = 15.0, 400, 12  # degrees; turns that are tried, and those that are refined
FUSED, BAND, BLOCK = 200, 4, 8  # cells along the longest edge of a fused volume, truncation in cells, cells in a block
THIN, ASIDE = 0.3, 1.5  # of a plane's width: its thickness; cells to the scan's nearest point, along the surface


# ------------------------------------------------------------------------------------------------ shapes


@dataclass(frozen=True, eq=False)
class Shape:
    """A closed mesh; extent: the diagonal of its bounding box."""

    name: str
    mesh: MeshField

    @property
    def extent(self) -> float:
        return float(np.linalg.norm(np.ptp(self.mesh.bounds, axis=0)))

    def moved(self, T: np.ndarray) -> MeshField:
        return MeshField(apply(T, self.mesh.vertices), self.mesh.faces)

    def surface(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Points (count, 3), uniform by area."""
        return on_triangles(self.mesh.vertices[self.mesh.faces], count, rng)

    def seen(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """About two thirds of such points: those on one side of a plane in a random direction."""
        points = self.surface(count, rng)
        along = points @ direction(rng)
        return points[along <= np.quantile(along, SEEN)]

    def off(self, points: np.ndarray) -> float:
        """The mean distance of points from the surface, as a share of the extent."""
        return float(np.abs(self.mesh.sample(points).value).mean() / self.extent)


def asymmetric(count: int) -> tuple[list[Shape], dict[str, float]]:
    """The first meshes that are closed and not symmetric; the symmetry of all closed ones that were looked at."""
    chosen, measured = [], {}
    for file in sorted((DATA / "meshes").glob("*.obj")):
        shape = Shape(file.stem, read_field(file))
        if shape.mesh.signed and len(chosen) < count:
            measured[shape.name] = symmetry(shape)
            chosen += [shape] if measured[shape.name] >= ALIKE else []
    return chosen, measured


def symmetry(shape: Shape) -> float:
    """How closely the surface lies on itself, turned by at least 15 degrees and shifted: the least mean distance, as a
    share of the extent. Turns about the main axes and random ones are tried, and the best refined; no registration."""
    rng = np.random.default_rng(0)
    places = shape.surface(300, rng)
    middle = places.mean(axis=0)
    away = places - middle
    axes = np.linalg.svd(away, full_matrices=False)[2]
    regular = [Rotation.from_rotvec(np.radians(angle) * axis) for axis in axes for angle in (90, 120, 180, 240, 270)]
    random = [turn for turn in Rotation.random(TURNS, random_state=rng) if is_turned(turn)]

    def distances(motion: np.ndarray, start: Rotation) -> np.ndarray:
        turned = (Rotation.from_rotvec(motion[:3]) * start).apply(away)
        return shape.mesh.sample(turned + middle + shape.extent * motion[3:]).value / shape.extent

    still = np.zeros(6)
    tried = sorted(regular + random, key=lambda start: np.abs(distances(still, start)).mean())
    least = np.inf
    for start in tried[:REFINED]:
        found = least_squares(distances, still, args=(start,), loss="soft_l1", f_scale=ALIKE, max_nfev=30).x
        if is_turned(Rotation.from_rotvec(found[:3]) * start):
            least = min(least, float(np.abs(distances(found, start)).mean()))
    return least


def is_turned(turn: Rotation) -> bool:
    return bool(np.degrees(turn.magnitude()) >= LEAST_TURN)


def anywhere(size: float, rng: np.random.Generator) -> np.ndarray:
    """A motion (4, 4), uniform in its rotation, with a shift of about so far along each axis."""
    T = shift(size * rng.normal(size=3))
    T[:3, :3] = Rotation.random(random_state=rng).as_matrix()
    return T


def levelled(size: float, rng: np.random.Generator) -> np.ndarray:
    """As anywhere(), turned about z alone."""
    T = shift(size * rng.normal(size=3))
    T[:3, :3] = Rotation.from_euler("z", rng.uniform(-np.pi, np.pi)).as_matrix()
    return T


def pushed(T: np.ndarray, centre: np.ndarray, angle: float, length: float, rng: np.random.Generator) -> np.ndarray:
    """A motion, off by an angle (rad) and a length about where it takes the centre (3,)."""
    turn, middle = np.eye(4), apply(T, centre[None])[0]
    turn[:3, :3] = Rotation.from_rotvec(angle * direction(rng)).as_matrix()
    return shift(middle + length * direction(rng)) @ turn @ shift(-middle) @ T


def made(kind: str, shape: Shape, T: np.ndarray, points: np.ndarray, rng: np.random.Generator):
    """A kind of surface, moved by T (4, 4); a cloud is made of the given points (N, 3) of the shape, with noise."""
    if kind == "points":
        return apply(T, points) + NOISE * shape.extent * rng.normal(size=points.shape)
    mesh = shape.moved(T)
    if kind == "callable":
        around = 0.05 * shape.extent * np.array([[-1], [1]])
        return CallableField(lambda x: mesh.sample(x).value, mesh.bounds + around)
    return volume_of(mesh) if kind == "volume" else mesh


def volume_of(mesh: MeshField) -> VolumeField:
    """The mesh's signed distances on a grid along the axes of its frame."""
    size = np.ptp(mesh.bounds, axis=0)
    spacing = size.max() / CELLS
    origin = mesh.bounds[0] - MARGIN * spacing
    counts = np.ceil(size / spacing).astype(int) + 2 * MARGIN + 1
    nodes = origin + spacing * np.indices(counts).reshape(3, -1).T
    return VolumeField(mesh.sample(nodes).value.reshape(counts), origin, spacing)


# ------------------------------------------------------------------------------------------------ fused scans


def fused(scans: list[np.ndarray], world_from_scan: np.ndarray) -> VolumeField:
    """The truncated signed distance of scans in blocks, as fusion gives it: at each node the mean over the scans, by
    weight, of the distance to the plane at the scan's nearest point. Scanners look along -z of their scan's frame."""
    world = [apply(W, scan) for W, scan in zip(world_from_scan, scans, strict=True)]
    whole = np.concatenate(world)
    voxel = float(np.ptp(whole, axis=0).max() / FUSED)
    origin, side = whole.min(axis=0) - BLOCK * voxel, BLOCK * voxel
    blocks = blocks_near((whole - origin) / side)
    row_of = {tuple(block): row for row, block in enumerate(blocks.tolist())}
    inside = np.indices((BLOCK,) * 3).reshape(3, -1).T
    total, weight = np.zeros((2, len(blocks), BLOCK**3))
    for points, W in zip(world, world_from_scan, strict=True):
        rows = [row_of[tuple(block)] for block in blocks_near((points - origin) / side).tolist()]
        nodes = origin + voxel * (BLOCK * blocks[rows, None] + inside)
        value, counts = seen_by(PointField(points), W[:3, 2], nodes.reshape(-1, 3), voxel)
        total[rows] += (counts * value).reshape(len(rows), -1)
        weight[rows] += counts.reshape(len(rows), -1)
    shape = (len(blocks), BLOCK, BLOCK, BLOCK)
    values, seen = (total / np.maximum(weight, 1e-12)).reshape(shape), (weight > 0).reshape(shape)
    return VolumeField.from_blocks(values.astype(np.float32), blocks, origin, voxel, seen=seen, truncation=BAND * voxel)


def blocks_near(u: np.ndarray) -> np.ndarray:
    """The blocks (B, 3) within half a block, which is the truncation, of places u (N, 3), in blocks."""
    touched = np.concatenate([np.floor(u + corner).astype(np.int64) for corner in product((-0.5, 0.5), repeat=3)])
    counts = touched.max(axis=0) + 1
    return np.stack(np.unravel_index(np.unique(np.ravel_multi_index(touched.T, counts)), counts), axis=1)


def seen_by(scan: PointField, towards: np.ndarray, nodes: np.ndarray, voxel: float) -> tuple[np.ndarray, np.ndarray]:
    """For nodes (n, 3) the height (n,) over the plane of a scan's nearest points, positive towards the scanner (3,),
    and what it counts for: as the surface faces the scanner, less behind it; nothing beyond the truncation, off the
    scan's edge, and where the points lie in no plane."""
    near = scan.nearest(nodes)[1][:, 0]
    mean, normal, (across, along) = (part.T for part in scan.surfels(scan.points, scan.normal_neighbours))
    facing = towards @ normal
    facing, normal = np.where(across < THIN * along, np.abs(facing), 0), (normal * np.sign(facing)).T[near]
    height = np.einsum("ni,ni->n", nodes - mean.T[near], normal)
    aside = np.linalg.norm(np.cross(nodes - scan.points[near], normal), axis=1)
    behind = np.clip((height / voxel + BAND) / (BAND - 1), 0, 1)
    return height, np.where((np.abs(height) < BAND * voxel) & (aside < ASIDE * voxel), facing[near] * behind, 0)


# ------------------------------------------------------------------------------------------------ wrong pairs


def wrong_pairs(count: int, seed: int, motion) -> Iterator[tuple]:
    """kind, name, source and target (N, 3) of pairs that no motion of their kind, and no scale, can be right for.

    "crossed": clouds of different scenes, scaled to one extent. "mirrored": two halves of one cloud's points, drawn by
    chance, one as an upright mirror shows it; shapes, many of them symmetric, are left out. motion: levelled or
    anywhere.
    """
    for k in range(count):
        rng, pool = np.random.default_rng([seed, k]), clouds((FIT, REPORT)[k // 2 % 2])  # one half: no scene is in both
        if k % 2:
            a = b = rng.choice([cloud for cloud in pool if cloud.set != "shapes"])
            whole = a.load(False)
            half = rng.uniform(size=len(whole.points)) < 0.5
            across = scenes._unit(np.r_[rng.normal(size=2), 0])
            source, target = whole.taken(half).reflected(across), whole.taken(~half)
        else:
            a, b = next((a, b) for a, b in rng.choice(pool, (1000, 2)) if not may_meet(a, b))
            source, target = (cloud.load(False) for cloud in (a, b))
            source = source.scaled(target.extent() / source.extent())
        name, kind = f"{a.name} x {b.name}" if a is not b else a.name, "mirrored" if k % 2 else "crossed"
        moved = source.moved(motion(target.extent() / 3, rng) @ shift(-source.points.mean(axis=0)))
        yield kind, name, moved.points, np.ascontiguousarray(target.points, float)
