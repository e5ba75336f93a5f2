# %% [markdown]
# # Scan to CAD
#
# Where does a part lie in a scan, and where does it differ from the drawing? Millimetres throughout.

# %%
import matplotlib.pyplot as plt
import numpy as np
import trimesh
from IPython.display import Image

import fieldalign as fa
from fieldalign.reports.histogram import deviation_histogram

block = trimesh.creation.box((80.0, 50.0, 20.0))
block.vertices[:, 2] *= 1 + 0.005 * block.vertices[:, 0] + 0.004 * block.vertices[:, 1]  # lopsided: one right pose
part = fa.fields.MeshField(block.vertices, block.faces)  # with a file: fa.fields.read_field("part.stl")

rng = np.random.default_rng(0)
points = part.spread(30_000)
points = points[points @ [0.6, 0.3, 0.7] > -5]  # the scanner saw one side
dent = np.linalg.norm(points - [-20, 5, 9], axis=1) < 6
points[dent, 2] -= 0.3  # it should not be there
T_scan_part = np.array([[0, -1, 0, 120], [0, 0, -1, 30], [1, 0, 0, -75], [0, 0, 0, 1.0]])
scan = fa.PointCloud(points + rng.normal(0, 0.02, points.shape)).transformed(T_scan_part)

# %% [markdown]
# The distance to a mesh is exact: to its triangles, not to points on them.

# %%
result = fa.register(scan, part)
print(result.verdict)
assert result.accepted
print("largest error of the pose:", np.abs(result.T_target_source @ T_scan_part - np.eye(4)).max().round(4))

# %%
found = fa.deviation(scan, part, result.T_target_source, tolerance=0.1)
print(found)
assert (found.values[dent] < -0.2).mean() > 0.9

# %%
aligned = scan.transformed(result.T_target_source).points
top = aligned[:, 2] > 5
plt.figure(figsize=(8, 4.5))
plt.scatter(*aligned[top, :2].T, c=found.values[top], s=2, cmap="RdBu_r", vmin=-0.3, vmax=0.3)
plt.colorbar(label="deviation, mm")
plt.gca().set(aspect="equal", title="the part's upper side: the dent")
plt.show()

# %%
deviation_histogram(found, "histogram.png")
Image("histogram.png", width=700)
