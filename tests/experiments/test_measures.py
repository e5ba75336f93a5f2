"""The measures, by hand and by SciPy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import binomtest, bootstrap

from fieldalign.experiments import measures


def test_summary_by_hand():
    found = measures.summary(np.array([3.0, 4.0, 0.0, 5.0]), seed=0)
    assert found["rmse"] == pytest.approx(np.sqrt(50 / 4))
    assert found["median"] == 3.5
    assert found["quantiles"] == {"0.25": 2.25, "0.5": 3.5, "0.75": 4.25, "0.95": pytest.approx(4.85)}


def test_summary_of_nothing_is_none():
    assert set(measures.summary(np.empty(0), seed=0).values()) == {None}
    assert measures.share(np.empty(0, bool)) == {"share": None, "interval": None}


def test_interval_is_seeded_and_as_scipys(rng):
    errors = rng.gamma(2.0, size=200)
    found = measures.interval(errors, measures.rmse, seed=3)
    assert found == measures.interval(errors, measures.rmse, seed=3)
    assert found != measures.interval(errors, measures.rmse, seed=4)
    theirs = bootstrap((errors,), lambda x, axis: np.sqrt(np.mean(x**2, axis=axis)), method="percentile", rng=0)
    assert found == pytest.approx(list(theirs.confidence_interval), rel=0.03)


@pytest.mark.parametrize(("hits", "count"), [(0, 5), (3, 10), (60, 60), (1, 1)])
def test_share_interval_is_wilsons(hits, count):
    theirs = binomtest(hits, count).proportion_ci(method="wilson")
    found = measures.share(np.arange(count) < hits)
    assert found["share"] == hits / count
    assert found["interval"] == pytest.approx([theirs.low, theirs.high], abs=1e-7)


def test_euler_errors_pool_components():
    T, T_true = np.tile(np.eye(4), (2, 2, 1, 1))
    T[0, :3, :3] = Rotation.from_euler("z", 10, degrees=True).as_matrix()
    T[1, :3, 3] = 0.1, -0.2, 0
    degrees, shifts = measures.euler_errors(T, T_true)
    assert degrees == pytest.approx([0, 0, 10, 0, 0, 0])
    assert shifts == pytest.approx([0, 0, 0, 0.1, 0.2, 0])
