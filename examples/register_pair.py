"""Register two scans, and use the answer only where it is accepted."""

import numpy as np

import fieldalign as fa
from fieldalign.clouds.simulated import simulate_pair

scans = simulate_pair(seed=0, points=50_000)  # in your program: fa.read_cloud("scan.ply")
result = fa.register(scans.source, scans.target)

print(result.reason)
if result.accepted:
    print(np.round(result.T_target_source, 4))
    merged = np.vstack([scans.target.points, scans.source.transformed(result.T_target_source).points])
    print(f"{len(merged)} points in one frame; {result.overlap:.0%} of the source lies on the target")
