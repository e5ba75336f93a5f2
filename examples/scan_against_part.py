"""A scan against a CAD part: the pose is exact against the triangles, and then each point's deviation is known."""

import numpy as np
import trimesh

import fieldalign as fa

rng = np.random.default_rng(0)
block = trimesh.creation.box((80.0, 50.0, 20.0))  # millimetres
corners = block.vertices * (1 + block.vertices @ np.diag([0.004, 0.006, 0]) @ np.ones((3, 1)) * [0.3, 0.2, 1])
part = fa.fields.MeshField(corners, block.faces)  # lopsided: no turn lays it on itself

points = part.spread(40_000)
points = points[points @ [0.6, 0.3, 0.7] > -5]  # the scanner saw one side
dent = np.linalg.norm(points - [20, 5, 13], axis=1) < 6
points[dent, 2] -= 0.3  # it should not be there
T_scan_part = np.eye(4)
T_scan_part[:3] = [[0, -1, 0, 120], [0, 0, -1, 30], [1, 0, 0, -75]]
scan = fa.PointCloud(points + rng.normal(0, 0.02, points.shape)).transformed(T_scan_part)

result = fa.register(scan, part)
print(result.verdict)
print("largest error of the pose:", np.abs(result.T_target_source @ T_scan_part - np.eye(4)).max().round(4))

found = fa.deviation(scan, part, result.T_target_source, tolerance=0.1)
print(found)
print(f"beyond the tolerance: {(np.abs(found.values) > 0.1).sum()} points, in the dent: {dent.sum()}")
