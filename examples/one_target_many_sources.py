"""One map, many scans: what the map is made into is worked out once and kept."""

import numpy as np

import fieldalign as fa
from fieldalign.clouds.simulated import simulate_pair

scans = simulate_pair(seed=0, points=30_000)
target = fa.prepare(scans.target)
rng = np.random.default_rng(0)

for part in range(3):
    source = scans.source[rng.random(len(scans.source)) < 0.5]  # another scan of the same place
    result = fa.register(source, target)
    print(f"scan {part}: {result.reason.value}, {sum(result.seconds.values()) * 1e3:.0f} ms")
