"""KISS-Matcher, refined by small_gicp.

Its settings are its defaults. It refuses voxels below 5 mm and clamps its noise bounds at 1, both made for metres and
large scenes: clouds are handed to it scaled, so that the voxel is its default of 0.3, and neither rule bites.
"""

from __future__ import annotations

import kiss_matcher
import numpy as np

from . import gicp

VOXEL = 0.3


def align(source, target, voxel, threads, init=None, fine=False) -> np.ndarray:
    scale = VOXEL / voxel
    matcher = kiss_matcher.KISSMatcher(kiss_matcher.KISSMatcherConfig(VOXEL))
    found = matcher.estimate(*((scale * cloud).astype(np.float32) for cloud in (source, target)))
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = found.rotation, found.translation / scale
    return gicp.refine(source, target, voxel, threads, T, fine)
