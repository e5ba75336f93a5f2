# %% [markdown]
# # First pair
#
# Two scans of one room, each in the frame of its own scanner, and nothing known of how they lie to each other.

# %%
import numpy as np
from IPython.display import Image

import fieldalign as fa
from fieldalign.clouds.simulated import simulate_pair
from fieldalign.evaluation import rotation_error, translation_error
from fieldalign.reports.picture import before_and_after

scans = simulate_pair(seed=0, points=30_000)
source, target = scans.source, scans.target
print(len(source), "and", len(target), "points")

# %% [markdown]
# With scans of your own: `source, target = fa.read_cloud("scan_2.ply"), fa.read_cloud("scan_1.ply")`.
#
# One call finds the motion. No guess, no voxel, no distance.

# %%
result = fa.register(source, target)
print(result.verdict)

# %%
before_and_after(source, target, result.T_target_source, "picture.png")
Image("picture.png", width=800)

# %% [markdown]
# `accepted` says whether the pose may be used; the covariance says how well it is known.

# %%
assert result.accepted
turn, shift = np.sqrt(np.diag(result.covariance)).reshape(2, 3)
print(result.T_target_source.round(4))
print("known to", np.degrees(turn).round(4), "degrees and", (1000 * shift).round(2), "mm")

# %% [markdown]
# The scans are simulated, so the truth is known.

# %%
print(f"wrong by {rotation_error(result.T_target_source, scans.T_target_source):.3f} degrees and "
      f"{1000 * translation_error(result.T_target_source, scans.T_target_source):.1f} mm")
assert rotation_error(result.T_target_source, scans.T_target_source) < 0.1

# %% [markdown]
# Use it: the source in the target's frame.

# %%
moved = source.transformed(result.T_target_source)
fa.write_cloud("moved.ply", moved)
