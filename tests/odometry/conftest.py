"""A street without end, a tunnel, and a sensor that spins while it drives through them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

from fieldalign.clouds.simulated import Box, cast
from fieldalign.motions import exp_twist, translation

PERIOD = 0.1   # seconds a turn
REACH = 30.0   # metres
LENGTH = 20.0  # metres, after which the street is the same again
SPEED = 8.0    # metres a second
CYCLE = 25     # scans in which the sensor comes so far


def block(x, y, z, size, yaw=0.0):
    return Box((x, y, z + size[2] / 2), size, yaw)


def street():
    """Houses on both sides, parked cars, posts; the same again every 20 metres."""
    solids = [Box((0, 0, -0.5), (400, 60, 1))]
    for k in range(-4, 6):
        x = LENGTH * k
        solids += [block(x + 4, 9, 0, (9, 5, 6)), block(x + 14, 10.5, 0, (7, 5, 8), 0.1)]
        solids += [block(x + 7, -10, 0, (12, 6, 7))]
        solids += [block(x + 3, 4.5, 0, (4, 1.8, 1.4), 0.05), block(x + 15, -4.8, 0, (4.2, 1.8, 1.5))]
        solids += [block(x + 11, 6, 0, (0.3, 0.3, 5)), block(x + 18, -6, 0, (0.4, 0.4, 4))]
    return tuple(solids)


def tunnel():
    """Bare walls, but for a gate behind the beginning and some pillars."""
    walls = [block(60, 5.5, 0, (240, 1, 7)), block(60, -5.5, 0, (240, 1, 7))]
    walls += [Box((60, 0, -0.5), (240, 12, 1)), Box((60, 0, 6.5), (240, 12, 1))]
    walls += [block(-9, 3, 0, (0.5, 4, 7)), block(-9, -3, 0, (0.5, 4, 7))]
    return (*walls, *(block(-8.0 + 6 * k, 4.6 * (-1) ** k, 0, (1.5, 1, 2 + k)) for k in range(3)))


@dataclass(frozen=True)
class Spinning:
    """A sensor of 32 beams; noise in metres."""

    columns: int = 480
    noise: float = 0.01

    def sweep(self, solids, pose_at, start, seed):
        """Points (n, 3), each in the sensor's frame of its own time, and the times (n,)."""
        azimuth = np.pi - 2 * np.pi * np.arange(self.columns) / self.columns
        elevation = np.radians(np.linspace(-24, 8, 32))[:, None]
        times = start + PERIOD * np.arange(self.columns) / self.columns
        poses = np.stack([pose_at(t) for t in times])
        across = np.cos(elevation)
        beams = np.stack([across * np.cos(azimuth), across * np.sin(azimuth), np.sin(elevation) + 0 * azimuth], -1)
        ahead = np.einsum("aij,baj->bai", poses[:, :3, :3], beams).reshape(-1, 3)
        origins = np.broadcast_to(poses[:, :3, 3], beams.shape).reshape(-1, 3)
        ranges = cast(solids, origins, ahead)
        ranges += self.noise * np.random.default_rng(seed).normal(size=len(ranges))
        seen = ranges < REACH
        points = beams.reshape(-1, 3)[seen] * ranges[seen, None]
        return points.astype(np.float32), np.broadcast_to(times, beams.shape[:2]).reshape(-1)[seen]


def along_street(t):
    """world_from_sensor at a time: straight on, the sensor turned and tilted a little."""
    return translation([SPEED * t, 0.4, 1.8]) @ exp_twist(np.r_[0.02, -0.03, 0.1, 0, 0, 0])


def through_tunnel(t):
    """From rest to ten metres a second, and on."""
    return translation([2.5 * t**2 if t < 2 else 10 * (t - 1), 0.5, 1.8])


@cache
def cycle():
    return [Spinning().sweep(street(), along_street, PERIOD * k, k) for k in range(CYCLE)]


@dataclass(frozen=True)
class Drive:
    """Scans with their times, and the truth: the sensor's pose in the middle of a sweep, seen from the first one's."""

    solids: tuple
    pose_at: object
    scan: object

    def distance(self, points):
        """Metres (n,) from places in the frame of the first pose to the nearest surface, along six directions."""
        T = self.pose_at(PERIOD / 2)
        places = points @ T[:3, :3].T + T[:3, 3]
        rays = [cast(self.solids, places, np.tile(s * a, (len(places), 1))) for a in np.eye(3) for s in (-1.0, 1.0)]
        return np.min(rays, axis=0)

    def pose(self, k):
        first, now = (self.pose_at(PERIOD * (i + 0.5)) for i in (0, k))
        return np.linalg.inv(first) @ now


@pytest.fixture(scope="session")
def drive():
    """Down the street for ever."""

    def scan(k):
        points, times = cycle()[k % CYCLE]
        return points, times + PERIOD * CYCLE * (k // CYCLE)

    return Drive(street(), along_street, scan)


@pytest.fixture(scope="session")
def dark():
    """60 metres through the tunnel."""
    scan = cache(lambda k: Spinning(columns=360).sweep(tunnel(), through_tunnel, PERIOD * k, k))
    return Drive(tunnel(), through_tunnel, scan)


@pytest.fixture(scope="session")
def off():
    """How far a pose is from the truth: metres, radians."""

    def measure(pose, truth):
        E = np.linalg.inv(truth) @ pose
        return np.linalg.norm(E[:3, 3]), 2 * np.arcsin(min(1.0, np.linalg.norm(E[:3, :3] - np.eye(3)) / np.sqrt(8)))

    return measure
