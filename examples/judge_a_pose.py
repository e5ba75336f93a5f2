"""A pose that any tool has found: may it be used, how well is it known, and what is open?"""

import numpy as np

import fieldalign as fa
from fieldalign.clouds.simulated import simulate_pair

scans = simulate_pair(seed=4, points=30_000)
T = scans.T_target_source
pushed = T.copy()
pushed[:3, 3] += 0.3, 0, 0

for name, pose in (("the truth", T), ("half an arm's length off", pushed)):
    verdict = fa.verify(scans.source, scans.target, pose)
    print(f"{name}: {verdict.reason.value}; {verdict.evidence}")
    if verdict.accepted:
        turn, shift = np.sqrt(np.diag(verdict.covariance)).reshape(2, 3)
        print("known to", np.degrees(turn).round(4), "degrees,", (1e3 * shift).round(2), "mm")

rng = np.random.default_rng(0)
wall = np.c_[rng.uniform(0, 4, (6000, 2)), rng.normal(0, 0.005, 6000)]
slides = fa.register(wall[:3000], wall[3000:])
print("a wall on a wall may", *(str(freedom) for freedom in slides.freedoms), sep="\n  ")
