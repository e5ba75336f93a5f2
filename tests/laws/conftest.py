"""Scans and a measure of distance that the laws share."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fieldalign.clouds.simulated import simulate_pair
from fieldalign.motions import inverse, translation

THREE_SIGMA = 20.1  # 0.9973 quantile of chi^2 with six degrees of freedom


@pytest.fixture(scope="session", params=[3, 6, 11])
def scans(request):
    """Two simulated scans of a room, 20,000 points each, with noise: source, target."""
    pair = simulate_pair(request.param, 20_000)
    return pair.source.points, pair.target.points


@pytest.fixture
def within_three_sigma():
    """Whether two independent answers (result a; pose b) differ by no more than their stated covariances allow."""

    def check(a, T_b: np.ndarray) -> bool:
        centre = translation(a.reference_point)
        difference = inverse(centre) @ T_b @ inverse(a.T_target_source) @ centre
        x = np.r_[Rotation.from_matrix(difference[:3, :3]).as_rotvec(), difference[:3, 3]]
        return float(x @ np.linalg.pinv(2 * a.covariance) @ x) < THREE_SIGMA

    return check


@pytest.fixture(scope="session")
def box():
    """The six sides of a box of 1 x 2 x 3, 6000 points: it fits onto itself in four ways."""
    rng = np.random.default_rng(5)
    edges = np.array([1.0, 2, 3])
    sides = []
    for axis, side in np.ndindex(3, 2):
        face = rng.random((int(3000 * edges.prod() / edges[axis] / 11), 3))
        face[:, axis] = side
        sides.append(edges * face)
    return np.vstack(sides)[rng.permutation(sum(map(len, sides)))]
