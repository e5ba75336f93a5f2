"""What the pages take for granted: the scans, and the names, that their code speaks of."""

import pytest

SCANS = """
import numpy as np
import fieldalign as fa
from fieldalign.clouds.simulated import simulate_pair
scans = simulate_pair(0, 10_000)
T = scans.T_target_source
"""
PAIR = SCANS + """
for name in "scan_2.ply", "source.ply":
    fa.write_cloud(name, scans.source)
for name in "scan_1.ply", "target.ply":
    fa.write_cloud(name, scans.target)
np.savetxt("pose.txt", T)
"""
THREE = """
import numpy as np
import fieldalign as fa
from fieldalign.clouds.simulated import simulate_room
for k, name in enumerate("abc"):
    pose = np.eye(4)
    pose[:3, 3] = 2.0 + k, 2.5, 1.5
    fa.write_cloud(name + ".ply", simulate_room(2).scan(pose, 8000, field_of_view=(360, 120), seed=k))
"""
PART = """
import trimesh
block = trimesh.creation.box((80.0, 50.0, 20.0))
block.vertices[:, 2] *= 1 + 0.005 * block.vertices[:, 0] + 0.004 * block.vertices[:, 1]
block.export("part.stl")
fa.write_cloud("scan.ply", fa.PointCloud(fa.fields.read_field("part.stl").spread(6000)).transformed(T))
"""
PLANE = """
corners = np.array([[0, 0], [9, 0], [9, 4], [6, 4], [6, 7], [0, 7], [0, 0]], float)
def outline(n):
    along = np.linspace(0, 5.999, n)
    k = along.astype(int)
    return corners[k] + (along - k)[:, None] * (corners[k + 1] - corners[k])
floor_plan, sweep = outline(1500), outline(1400) @ np.array([[0.8, -0.6], [0.6, 0.8]])
"""
SWEEPS = """
import numpy as np
from pathlib import Path
import fieldalign as fa
from fieldalign.clouds.simulated import simulate_room
sweeps, drive = [], Path("2011_09_26_drive_0001_sync")
drive.mkdir()
for k in range(6):
    pose = np.eye(4)
    pose[:3, 3] = 2.0 + 0.05 * k, 2.5, 1.5
    scan = simulate_room(3).scan(pose, 6000, field_of_view=(360, 70), seed=k)
    sweeps.append((scan.points, np.linspace(k, k + 0.9, len(scan))))
    fa.write_cloud(drive / f"{k}.ply", scan)
track = fa.Trajectory(np.arange(6.0), np.tile(np.eye(4), (6, 1, 1)))
fa.write_trajectory("trajectory_tum.txt", track)
points, times = sweeps[0]
"""
MAP = """
fa.write_cloud("map.ply", simulate_room(3).scan(pose, 20_000, field_of_view=(360, 120)))
times = None
"""
GROUNDWORK = {
    "README": PAIR + """
from pathlib import Path
Path("demo").mkdir()
fa.write_cloud("demo/source.ply", scans.source)
fa.write_cloud("demo/target.ply", scans.target)
""",
    "overview": PAIR + PART + THREE + PLANE + SWEEPS + """
source, target, photogrammetry = scans.source, scans.target, scans.source.points * 1.5
""",
    "reading-the-verdict": PAIR + """
rng = np.random.default_rng(0)
wall = np.c_[rng.uniform(0, 4, (6000, 2)), rng.normal(0, 0.005, 6000)]
fa.write_cloud("wall.ply", fa.PointCloud(wall[:3000]))
fa.write_cloud("other_half.ply", fa.PointCloud(wall[3000:]))
""",
    "coming-from": SCANS + "source, target, guess = scans.source.points, scans.target.points, T\n",
    "verdict": PAIR,
    "reports": PAIR,
    "fields": SCANS + PART + """
from types import SimpleNamespace
scan, map = scans.source, scans.target
a, b, part, fixture = scan, map, "scan.ply", "part.stl"
""",
    "assemble": THREE,
    "odometry": SWEEPS + MAP,
    "sequences": SWEEPS,
}


@pytest.fixture(scope="session")
def groundwork():
    """Of each page: code that makes the files and the names that its blocks speak of."""
    return GROUNDWORK
