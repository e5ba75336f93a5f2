"""Scans and a measure of distance that the laws share."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fieldalign.clouds.simulated import simulate_pair
from fieldalign.motions import growth, inverse, size_of, translation

THREE_SIGMA = {6: 20.1, 7: 21.8}  # 0.9973 quantiles of chi^2 with so many degrees of freedom


@pytest.fixture(scope="session", params=[3, 6, 11])
def scans(request):
    """Two simulated scans of a room, 20,000 points each, with noise: source, target."""
    pair = simulate_pair(request.param, 20_000)
    return pair.source.points, pair.target.points


@pytest.fixture(scope="session")
def smaller_scans():
    """One such pair with fewer points, for the laws that are tried with many options; and T_target_source."""
    pair = simulate_pair(3, 8000)
    return pair.source.points, pair.target.points, pair.T_target_source


@pytest.fixture
def within_three_sigma():
    """Whether two independent answers (result a; pose b) differ by no more than their stated covariances allow."""

    def check(a, T_b: np.ndarray) -> bool:
        centre, n = translation(a.reference_point), len(a.covariance)
        difference = inverse(centre) @ T_b @ np.linalg.inv(a.T_target_source) @ centre
        size = size_of(difference)
        turn = Rotation.from_matrix((difference @ growth(1 / size))[:3, :3]).as_rotvec()
        x = np.r_[turn, difference[:3, 3], np.log(size)][:n]
        return float(x @ np.linalg.pinv(2 * a.covariance) @ x) < THREE_SIGMA[n]

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
