# %% [markdown]
# # A folder of scans
#
# Scans of one place, in any order and each turned in its own way, become one model.

# %%
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.spatial.transform import Rotation

import fieldalign as fa
from fieldalign.clouds.simulated import simulate_room

room = simulate_room(seed=2)
Path("scans").mkdir(exist_ok=True)
truth = []
for k, place in enumerate([(1.2, 2.6), (3.0, 1.0), (4.6, 3.3)]):
    pose = np.eye(4)
    pose[:3, :3] = Rotation.random(random_state=k).as_matrix()
    pose[:3, 3] = *place, 1.5
    fa.write_cloud(f"scans/{k}.ply", room.scan(pose, 20_000, noise=0.004, field_of_view=(360, 150), seed=k))
    truth.append(pose)

# %% [markdown]
# Each scanner stood at the origin of its scan. Saying so is the best help against places that look alike.

# %%
assembly = fa.assemble(sorted(Path("scans").glob("*.ply")), sensor_at_origin=True)
print("belong together:", assembly.components, "left out:", assembly.left_out)
for i, j, edge in assembly.edges:
    print(f"scan {j} into scan {i}: {edge.reason.value}, overlap {edge.overlap:.0%}")

# %% [markdown]
# In the room's frame, from above, without the ceiling: the model, coloured by scan, and where the scanners stood.

# %%
T_room_world = truth[0] @ np.linalg.inv(assembly.poses[0])
model = assembly.models[0].transformed(T_room_world)
below = model.points[:, 2] < 2.2
places = np.array([(T_room_world @ pose)[:3, 3] for pose in assembly.poses])
plt.figure(figsize=(7, 6))
plt.scatter(*model.points[below, :2].T, c=model.attributes["scan"][below], s=1, cmap="Set2")
plt.plot(*places[:, :2].T, "k^", markersize=10)
plt.gca().set(aspect="equal", title="one model of three scans")
plt.show()

# %%
error = np.linalg.norm(places - np.array(truth)[:, :3, 3], axis=1)
print("off the truth, mm:", (1000 * error).round(2))
assert error.max() < 0.003
fa.write_cloud("model.ply", assembly.models[0])
