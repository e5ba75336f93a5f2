# %% [markdown]
# # A drive
#
# A stream of scans becomes a trajectory and a map. Here a scanner is carried once around a simulated room.

# %%
import matplotlib.pyplot as plt
import numpy as np
from IPython.display import Image

import fieldalign as fa
from fieldalign.clouds.simulated import simulate_room
from fieldalign.reports.trajectory_picture import trajectory_picture

room = simulate_room(seed=3)
middle = np.array(room.size) / 2
sweeps, truth = [], []
for k, a in enumerate(np.linspace(0, 2 * np.pi, 50)):
    pose = np.eye(4)  # world_from_sensor: it looks where it goes
    pose[:2, :2] = [[-np.sin(a), -np.cos(a)], [np.cos(a), -np.sin(a)]]
    pose[:3, 3] = middle[0] + 0.9 * np.cos(a), middle[1] + 0.7 * np.sin(a), 1.5
    sweeps.append(room.scan(pose, 10_000, noise=0.005, field_of_view=(360, 70), seed=k))
    truth.append(pose)
truth = fa.Trajectory(np.arange(50.0), np.linalg.inv(truth[0]) @ truth)  # the world is the first scan's frame

# %% [markdown]
# With a drive of your own: `for frame in fa.read_sequence("drive.bag"): odometry.step(frame.cloud)`.

# %%
odometry = fa.Odometry()
for sweep in sweeps:
    odometry.step(sweep)
    if not odometry.last.tracked:
        print(odometry.last.reason)
print(sum(step.tracked for step in odometry.results), "of", len(sweeps), "scans are tracked")

# %%
found = fa.evaluate(odometry.trajectory, truth)
print(found)
assert found.absolute.translation.max() < 0.01

# %%
trajectory_picture(found.trajectory, "trajectory.png", truth=found.truth)
Image("trajectory.png", width=600)

# %% [markdown]
# The map: a point with its normal for each plane.

# %%
points = odometry.map.points
below = points[:, 2] < 0.7
plt.figure(figsize=(7, 6))
plt.scatter(*points[below, :2].T, c=points[below, 2], s=4)
plt.plot(*odometry.trajectory.poses[:, :2, 3].T, "r")
plt.gca().set(aspect="equal", title="the map from above, and the way")
plt.show()
