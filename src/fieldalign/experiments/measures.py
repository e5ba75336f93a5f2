"""What is read out of the errors of many registrations, with their 95 % intervals."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..motions import Matrix

QUANTILES = 0.25, 0.5, 0.75, 0.95
_DRAWS = 1000  # of the bootstrap
_INTERVAL = 0.025, 0.975
_NORMAL = 1.959964  # of which 95 % lie within


def rmse(errors: Matrix) -> Matrix:
    """The root of the mean square along the last axis."""
    return np.asarray(np.sqrt(np.mean(np.square(errors), axis=-1)))


def summary(errors: Matrix, seed: int) -> dict[str, Any]:
    """Errors (n,) in a few numbers: RMSE and median with their intervals, and quantiles; None where n = 0."""
    if not len(errors):
        return {"rmse": None, "rmse_interval": None, "median": None, "median_interval": None, "quantiles": None}
    return {
        "rmse": float(rmse(errors)), "rmse_interval": interval(errors, rmse, seed),
        "median": float(np.median(errors)), "median_interval": interval(errors, _median, seed),
        "quantiles": dict(zip(map(str, QUANTILES), np.quantile(errors, QUANTILES).tolist(), strict=True)),
    }


def share(hits: NDArray[np.bool_]) -> dict[str, Any]:
    """The share of hits (n,) of True, and its interval."""
    if not len(hits):
        return {"share": None, "interval": None}
    part = float(np.mean(hits))
    low, high = share_interval(np.array(part), len(hits))
    return {"share": part, "interval": [float(low), float(high)]}


def share_interval(part: Matrix, count: int | Matrix) -> tuple[Matrix, Matrix]:
    """The 95 % interval of shares of `count` trials (Wilson 1927): a bootstrap has none where all or none are hits."""
    z2 = _NORMAL**2 / count
    half = _NORMAL * np.sqrt(part * (1 - part) / count + z2 / (4 * count))
    middle = part + z2 / 2
    return np.maximum(middle - half, 0) / (1 + z2), np.minimum((middle + half) / (1 + z2), 1)


def interval(values: Matrix, statistic: Callable[[Matrix], Matrix], seed: int) -> list[float]:
    """The 95 % interval of a statistic by the percentile bootstrap (Efron & Tibshirani 1993, ch. 13): the values (n,)
    are drawn anew 1000 times."""
    rng = np.random.default_rng([seed, len(values)])
    draws = values[rng.integers(len(values), size=(_DRAWS, len(values)))]
    return [float(bound) for bound in np.quantile(statistic(draws), _INTERVAL)]


def euler_errors(T: Matrix, T_true: Matrix) -> tuple[Matrix, Matrix]:
    """The pooled measure of PointNetLK-Revisited and of the authors' program, for motions (n, 4, 4): differences of the
    Euler angles (x, y, z; degrees, 3 n) and of the components of the translation (3 n), all in one list.

    Its RMSE is that of RRE and RTE over about sqrt(3); published figures of Tables I and II are of this kind.
    """
    angles = [Rotation.from_matrix(motion[:, :3, :3]).as_euler("xyz", degrees=True) for motion in (T, T_true)]
    return np.abs(angles[0] - angles[1]).ravel(), np.abs(T[:, :3, 3] - T_true[:, :3, 3]).ravel()


def _median(draws: Matrix) -> Matrix:
    return np.asarray(np.median(draws, axis=-1))
