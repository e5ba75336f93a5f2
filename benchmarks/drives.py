"""Drives of a spinning LiDAR through simulated worlds, with exact truth.

    python benchmarks/drives.py street /tmp/drives/street               2.3 km through a hilly town, 64 beams
    python benchmarks/drives.py park /tmp/drives/park --still           each frame from one pose: nothing to deskew
    python benchmarks/drives.py street /tmp/drives/street --frames 300

Writes 000000.npz, ..., one for each turn of the sensor: xyz (N, 3) float32, metres, each point in the frame of the
sensor when it was met; times (N,) float32, seconds since the turn began; stamp, seconds, when it did. And poses.npz:
frames, of (how many the whole drive has), stamps, world_from_lidar (n, 4, 4) at the end of each turn, and
world_from_lidar_start and _middle. The same seed makes the same files.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import drive_shapes as shapes
import numpy as np
from drive_indoor import storey
from drive_route import Curve, Motion, driven, walked
from drive_sensor import Mover, Spinning, World
from drive_streets import Land, Site, side_streets

FOLDER = Path("/tmp/drives")
LANE = 1.75  # metres from the middle of the road


@dataclass(frozen=True, eq=False)
class Drive:
    """A world, a motion through it, and the sensor."""

    world: World
    motion: Motion
    sensor: Spinning

    @property
    def frames(self) -> int:
        return int(self.motion.duration / self.sensor.period) - 1

    def frame(self, k: int, seed: int, still: bool) -> dict:
        """What the file of a frame holds."""
        start = k * self.sensor.period
        points, times = self.sensor.sweep(self.world, self.motion, start, np.random.default_rng([seed, 1, k]), still)
        return {"xyz": points, "times": times, "stamp": start}

    def poses(self, frames: int) -> dict:
        stamps = np.arange(frames) * self.sensor.period
        at = {"": 1.0, "_start": 0.0, "_middle": 0.5}
        poses = {f"world_from_lidar{k}": self.motion.poses(stamps + v * self.sensor.period) for k, v in at.items()}
        return {"frames": np.arange(frames), "of": self.frames, "stamps": stamps} | poses


# ------------------------------------------------------------------------------------------------ drives


def street(seed: int) -> Drive:
    """2.3 km of curved streets over hills, with traffic and three halts; it does not return."""
    corners = [(0, 0), (260, 40), (330, 260), (560, 330), (640, 120), (900, 60), (1010, 300), (880, 480),
               (1010, 640), (870, 760), (640, 690)]
    return _in_town(Curve(corners, 9, meander=4), seed, laps=1, stops=3)


def loop(seed: int) -> Drive:
    """2.3 km: twice round an eight of streets that cross, with traffic; it returns after 1.1 km."""
    corners = [(-20, -10), (110, 90), (195, 60), (180, -60), (85, -85), (-90, 90), (-180, 95), (-200, -20), (-110, -80)]
    return _in_town(Curve(corners, 9, closed=True, meander=3), seed, laps=2.1, stops=3)


def tunnel(seed: int) -> Drive:
    """2.3 km at up to 15 m/s: streets, a tunnel of 800 m that bends a little, streets again."""
    corners = [(0, 0), (300, 60), (520, 20), (900, 60), (1300, 40), (1600, 160), (1750, 60), (2250, 120)]
    road, through = Curve(corners, 25, meander=6), (620.0, 1420.0)
    land = Land([road], seed, slope=0.025)
    site = Site(land, seed)
    site.tunnel(road, *through)
    for begin, end in ((0.0, through[0] - 15), (through[1] + 15, road.length)):
        site.town(road, begin, end)
    site.ground()
    return _on_the_road(site, road.offset(-LANE), seed, speed=15.0, stops=1)


def park(seed: int) -> Drive:
    """2.4 km at 7 m/s: twice round a narrow way among trees and bushes; there are no houses."""
    corners = [(0, 0), (130, -60), (260, 10), (300, 170), (190, 200), (150, 300), (20, 280), (-60, 190), (40, 110)]
    road = Curve(corners, 12, closed=True, meander=6)
    land = Land([road], seed, half=2.2, slope=0.06)
    site = Site(land, seed)
    site.woods(per_hectare=330)
    site.ground(rough=0.05)
    path = road.laps(2.1)
    return Drive(World(site.soup), driven(path, land, 7.0, seed), Spinning())


def indoor(seed: int) -> Drive:
    """A walk of some 200 m through a corridor and the rooms on both sides of it, and back; 16 beams."""
    soup, way = storey(seed)
    sensor = Spinning(16, elevations=(-15.0, 15.0), near=0.4)
    return Drive(World(soup), walked(way, 1.2, seed), sensor)


def _in_town(road: Curve, seed: int, laps: float, stops: int) -> Drive:
    land = Land([road, *side_streets(road, 170, seed)], seed)
    site = Site(land, seed)
    for way in land.roads:
        site.town(way)
    site.ground()
    lane = road.offset(-LANE)
    return _on_the_road(site, lane.laps(laps) if road.closed else lane, seed, 10.0, stops)


def _on_the_road(site: Site, lane: Curve, seed: int, speed: float, stops: int) -> Drive:
    motion = driven(lane, site.land, speed, seed, stops)
    return Drive(World(site.soup, traffic(lane, motion, site.land, seed)), motion, Spinning())


def traffic(lane: Curve, motion: Motion, land: Land, seed: int, every: float = 90.0, pace: float = 9.0) -> list[Mover]:
    """Cars that keep their distance ahead and behind, and oncoming ones, about so many metres apart."""
    rng, movers = np.random.default_rng([seed, 30]), []
    for gap in (17.0, 38.0, -14.0):
        swing = rng.uniform(0, 2 * np.pi)

        def keeping(times: np.ndarray, gap=gap, swing=swing) -> np.ndarray:
            return on_road(lane, land, motion.arc(times) + gap + 3 * np.sin(0.15 * times + swing), 0.0, 0.0)

        movers.append(Mover(shapes.car(rng), keeping))
    first = rng.uniform(30, 60)
    while first < lane.length + pace * motion.duration:

        def oncoming(times: np.ndarray, first=first) -> np.ndarray:
            return on_road(lane, land, first - pace * times, 2 * LANE, np.pi)

        if _apart(oncoming, motion):
            movers.append(Mover(shapes.car(rng), oncoming))
        first += rng.uniform(0.4, 1.6) * every
    return movers


def _apart(poses: Callable[[np.ndarray], np.ndarray], motion: Motion) -> bool:
    """Whether a car never comes so near that it would hit the sensor's, as it might where the road crosses itself."""
    times = np.arange(0, motion.duration, 0.1)
    return bool(np.linalg.norm((poses(times) - motion.poses(times))[:, :2, 3], axis=1).min() > 2.8)


def on_road(lane: Curve, land: Land, arc: np.ndarray, left: float, turn: float) -> np.ndarray:
    """Poses (n, 4, 4) of cars beside a lane; far away from everything where the lane has ended."""
    xy, yaw = lane.at(arc, left)
    poses = np.tile(np.eye(4), (len(arc), 1, 1))
    c, s = np.cos(yaw + turn), np.sin(yaw + turn)
    poses[:, :2, :2] = np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)
    poses[:, :2, 3], poses[:, 2, 3] = xy, land(*xy.T)
    poses[(arc < 0) | (arc > lane.length), :3, 3] = 1e6
    return poses


DRIVES: dict[str, Callable[[int], Drive]] = {
    "street": street, "loop": loop, "tunnel": tunnel, "park": park, "indoor": indoor
}  # fmt: skip


# ------------------------------------------------------------------------------------------------ files


def write(name: str, folder: Path, frames: int | None = None, seed: int = 0, still: bool = False) -> dict:
    """Makes the files; returns what came out."""
    folder.mkdir(parents=True, exist_ok=True)
    for earlier in folder.glob("*.npz"):
        earlier.unlink()
    start = time.perf_counter()
    drive = DRIVES[name](seed)
    built = time.perf_counter()
    frames = min(frames or drive.frames, drive.frames)
    truth = drive.poses(frames)
    np.savez(folder / "poses.npz", **truth)
    counts = []
    for k in range(frames):
        frame = drive.frame(k, seed, still)
        np.savez(folder / f"{k:06d}.npz", **frame)
        counts.append(len(frame["xyz"]))
    gone = np.linalg.norm(np.diff(truth["world_from_lidar"][:, :3, 3], axis=0), axis=1)
    return {
        "frames": frames,
        "metres": float(gone.sum()),
        "climbed": float(np.ptp(truth["world_from_lidar"][:, 2, 3])),
        "points": [int(np.quantile(counts, q)) for q in (0, 0.5, 1)],
        "build_s": built - start,
        "frame_s": (time.perf_counter() - built) / frames,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("drive", choices=list(DRIVES))
    parser.add_argument("folder", type=Path)
    parser.add_argument("--frames", type=int, help="the first so many alone")
    parser.add_argument("--still", action="store_true", help="each frame is seen from where the sensor is at its end")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    made = write(arguments.drive, arguments.folder, arguments.frames, arguments.seed, arguments.still)
    print("\n".join(f"{key}: {value}" for key, value in made.items()))


if __name__ == "__main__":
    main()
