"""pycpd: coherent point drift (Myronenko & Song 2010), rigid, without scale.

All points meet all points in each iteration: it gets 1000 points of each cloud, and needs some seconds for them. Half
of the points are taken for outliers (w = 0.5), as suits clouds that overlap in part: with w = 0.1 an indoor pair ends
three times as far off, while copies of one shape are found alike.
"""

from __future__ import annotations

import numpy as np
from pycpd import RigidRegistration

from .thinning import as_came, at_unit_size

POINTS = 1000
OUTLIERS = 0.5
ITERATIONS, TOLERANCE = 100, 1e-6


def align(source, target, voxel, threads, init=None) -> np.ndarray:
    """From init, or with the centroids laid on each other."""
    moving, fixed, to_moving, to_fixed = at_unit_size(source, target, init, POINTS)
    drift = RigidRegistration(
        X=fixed, Y=moving, scale=False, w=OUTLIERS, max_iterations=ITERATIONS, tolerance=TOLERANCE
    )
    _, (_, R, t) = drift.register()
    return as_came(R.T, t, to_moving, to_fixed)  # it turns rows: its rotation stands to their right
