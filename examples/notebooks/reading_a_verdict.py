# %% [markdown]
# # Reading a verdict
#
# May a pose be used? Five pairs, and what is said of each. What to do in each case: `docs/reading-the-verdict.md`.

# %%
import matplotlib.pyplot as plt
import numpy as np

import fieldalign as fa
from fieldalign.clouds.simulated import simulate_pair

scans = simulate_pair(seed=4, points=20_000)
right = fa.register(scans.source, scans.target)
print(right.verdict)

# %% [markdown]
# **The numbers.** Each is divided by what is asked of it, so that 1 is just enough. The smallest of them is `strength`.

# %%
def draw(verdicts):
    """The factors by which each piece of evidence exceeds what is asked of it, on a logarithmic scale."""
    figure, axes = plt.subplots(1, len(verdicts), figsize=(3.2 * len(verdicts), 2.6), sharey=True)
    for axis, (name, verdict) in zip(np.atleast_1d(axes), verdicts.items(), strict=True):
        factors = verdict.evidence.factors
        values = np.clip(list(factors.values()), 0.04, 300)
        colors = np.where(values < 1, "#c0392b", "#27ae60")
        axis.barh(list(factors), values - 0.03, left=0.03, color=colors)
        axis.axvline(1, color="black")
        axis.set(xscale="log", xlim=(0.03, 300), title=f"{name}\n{verdict.reason.name}")
    figure.tight_layout()
    plt.show()


draw({"a right pose": right})

# %% [markdown]
# **A wrong pose**, as another tool may hand it over: half a metre off. `fa.verify` judges it and leaves it as it is.

# %%
pushed = scans.T_target_source.copy()
pushed[:3, 3] += 0.5, 0, 0
wrong = fa.verify(scans.source, scans.target, pushed)
print(wrong.verdict)
assert not wrong.accepted

# %% [markdown]
# **Another place.** A scan of one thing and a scan of another have no right pose; the best one is not accepted.

# %%
rng = np.random.default_rng(0)
ball = rng.normal(size=(4000, 3))
ball /= np.linalg.norm(ball, axis=1)[:, None]
other = fa.register(ball * [3, 2, 1], scans.target)
print(other.verdict)
assert not other.accepted

# %% [markdown]
# **A wall on a wall** slides. What is known is kept, what is not is named.

# %%
wall = np.c_[rng.uniform(0, 4, (6000, 2)), rng.normal(0, 0.005, 6000)]
slides = fa.register(wall[:3000], wall[3000:])
print(slides.reason)
print(*slides.freedoms, sep="\n")
assert slides.reason is fa.Reason.DEGENERATE

# %% [markdown]
# **A box** lies on itself in several ways. All of them are right, as far as the surface tells; those that were
# found to agree as well are `alternatives`.

# %%
def box(rng):
    """Points on a box of 3 x 2 x 1, with a little noise."""
    half = np.array([1.5, 1.0, 0.5])
    points = rng.uniform(-half, half, (6000, 3))
    side = rng.integers(0, 3, 6000)
    points[np.arange(6000), side] = half[side] * rng.choice([-1, 1], 6000)
    return points + rng.normal(0, 0.002, points.shape)


symmetric = fa.register(box(rng), box(rng))
print(symmetric.reason)
print(*(other.T_target_source.round(2) for other in symmetric.alternatives), sep="\n")
assert symmetric.reason is fa.Reason.AMBIGUOUS

# %%
draw({"pushed": wrong, "another place": other, "a wall": slides, "a box": symmetric})
