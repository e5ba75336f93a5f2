"""A spinning LiDAR in a world of triangles, some of which drive about: each ray is cast from the pose of its own time.

    world = World(site.soup, movers)
    points, times = Spinning().sweep(world, motion, start=12.3, rng=rng)     # (N, 3) and (N,), float32

Rays are cast by Open3D's RaycastingScene (Embree), on one thread.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import open3d as o3d
from drive_route import Motion
from drive_shapes import Soup


@dataclass(frozen=True, eq=False)
class Mover:
    """Something that moves: its shape (m, 4, 3) in its own frame, its poses (n, 4, 4) at times, and its reach."""

    shape: np.ndarray
    poses: Callable[[np.ndarray], np.ndarray]

    @property
    def reach(self) -> float:
        return float(np.linalg.norm(self.shape, axis=-1).max())


class World:
    """What stands still, and what moves."""

    def __init__(self, still: Soup, movers: Sequence[Mover] = ()) -> None:
        self.still, self.movers = _scene(still), list(movers)
        self._shapes = []
        for mover in self.movers:
            soup = Soup()
            soup.quads(mover.shape)
            self._shapes.append(_scene(soup))

    def cast(self, poses: np.ndarray, times: np.ndarray, rays: np.ndarray, far: float) -> tuple[np.ndarray, np.ndarray]:
        """Ranges (columns, beams), inf where nothing is met, and the cosines of incidence.

        poses: (columns, 4, 4) world_from_sensor, at times (columns,); rays: (columns, beams, 3), sensor frame, unit.
        """
        ranges, slant = _cast(self.still, poses, rays)
        middle = poses[len(poses) // 2]
        for mover, scene in zip(self.movers, self._shapes, strict=True):
            there = mover.poses(times[[len(times) // 2]])[0, :3, 3] if len(times) else np.full(3, np.inf)
            offset = (there - middle[:3, 3]) @ middle[:3, :3]
            distance = float(np.linalg.norm(offset))
            if not distance < far + mover.reach:
                continue
            seen = _towards(rays, offset, min(np.pi, 1.3 * mover.reach / max(distance, 1e-3) + 0.25))
            mover_from_sensor = np.linalg.inv(mover.poses(times[seen])) @ poses[seen]
            nearer, other = _cast(scene, mover_from_sensor, rays[seen])
            slant[seen] = np.where(nearer < ranges[seen], other, slant[seen])
            ranges[seen] = np.minimum(ranges[seen], nearer)
        return ranges, slant


def _scene(soup: Soup) -> o3d.t.geometry.RaycastingScene:
    scene = o3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(*(o3d.core.Tensor(array) for array in soup.arrays()))
    return scene


def _cast(scene, poses: np.ndarray, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    turned = rays @ poses[:, :3, :3].astype(np.float32).transpose(0, 2, 1)
    both = np.empty((*rays.shape[:2], 6), np.float32)
    both[..., :3], both[..., 3:] = poses[:, None, :3, 3], turned
    met = scene.cast_rays(o3d.core.Tensor(both), nthreads=1)
    normals = met["primitive_normals"].numpy()
    return met["t_hit"].numpy(), np.abs(np.einsum("cbk,cbk->cb", normals, turned))


def _towards(rays: np.ndarray, offset: np.ndarray, half: float) -> np.ndarray:
    """The columns that look into the direction of the offset, within half that angle."""
    azimuth = np.arctan2(rays[:, 0, 1], rays[:, 0, 0]) - np.arctan2(offset[1], offset[0])
    return np.flatnonzero(np.abs((azimuth + np.pi) % (2 * np.pi) - np.pi) < half)


@dataclass(frozen=True, eq=False)
class Spinning:
    """The sensor. elevations: lowest and highest beam, degrees. noise: deviation of a range, metres. bias: deviation of
    what is wrong with all ranges of one beam, metres. period: of a turn, seconds. near, far: metres."""

    beams: int = 64
    columns: int = 1800
    elevations: tuple[float, float] = (-24.8, 2.0)
    noise: float = 0.02
    bias: float = 0.01
    near: float = 1.0
    far: float = 100.0
    period: float = 0.1

    def sweep(
        self, world: World, motion: Motion, start: float, rng: np.random.Generator, still: bool = False
    ) -> tuple[np.ndarray, np.ndarray]:
        """Points (N, 3), each in the frame of the sensor when it was met, and seconds since the sweep began (N,).

        still: the sensor, and the world, halt at the end of the sweep and all is seen from there.
        """
        since = self.period * (np.arange(self.columns) + 0.5) / self.columns
        times = start + (np.full(self.columns, self.period) if still else since)
        rays = self.rays()
        ranges, slant = world.cast(motion.poses(times), times, rays, self.far)
        chance = rng.random(ranges.shape, np.float32)
        faint = np.minimum(ranges / self.far, 1) ** 2
        met = (ranges > self.near) & (ranges < self.far) & (slant > 0.02 + 0.1 * faint) & (chance > 0.02 + 0.2 * faint)
        column, beam = np.nonzero(met)
        read = ranges[met] + self.beam_bias()[beam] + self.noise * rng.standard_normal(len(beam), np.float32)
        return rays[met] * read[:, None], since[column].astype(np.float32)

    def rays(self) -> np.ndarray:
        """Unit directions (columns, beams, 3), clockwise from behind, float32."""
        azimuth = np.pi - 2 * np.pi * (np.arange(self.columns) + 0.5) / self.columns
        elevation = np.radians(np.linspace(*self.elevations[::-1], self.beams))
        azimuth, elevation = azimuth[:, None], elevation[None]
        level = np.cos(elevation)
        rays = np.broadcast_arrays(level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation))
        return np.stack(rays, -1).astype(np.float32)

    def beam_bias(self) -> np.ndarray:
        """(beams,), metres; the same for every sensor of its kind."""
        return (self.bias * np.random.default_rng(self.beams).standard_normal(self.beams)).astype(np.float32)
