"""Where the sensor of a simulated drive is at any time: a smooth curve, a speed along it, and what shakes the sensor.

    curve = Curve([(0, 0), (200, 0), (200, 150)], rounding=8, closed=True)
    motion = driven(curve, ground, speed=10.0, seed=0)
    motion.poses(times)          # (n, 4, 4) world_from_sensor; x forward, y left, z up
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.interpolate import CubicHermiteSpline, CubicSpline
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

STEP = 0.1  # metres, between the points of a curve
TICK = 0.02  # seconds, between the knots of a motion
ACCELERATION, SIDEWAYS = 1.5, 2.0  # m/s^2, along the curve and across it
WHEELBASE, TRACK = 1.4, 0.8  # metres, halves


class Curve:
    """A way through the plane, its corners rounded: metres along it (arc) to places."""

    def __init__(self, corners: Sequence, rounding: float, closed: bool = False, meander: float = 0.0) -> None:
        """corners: (n, 2). rounding: metres along the curve over which a corner is spread; the least radius of a
        right angle is 1.6 times that. meander: metres by which straight stretches swing."""
        corners = np.array([*corners, corners[0]] if closed else corners, float)
        dense = _resampled(corners)
        arc = np.arange(len(dense)) * STEP
        swing = meander * np.sin(2 * np.pi * arc / arc[-1] * round(arc[-1] / 140))[:, None] * _left(dense)
        self._take(_rounded((dense + swing)[: -1 if closed else None], rounding, closed), closed)

    def _take(self, xy: np.ndarray, closed: bool) -> None:
        self.xy, self.closed, self.length = xy, closed, STEP * (len(xy) - 1)
        self._heading = np.unwrap(np.arctan2(*np.gradient(xy, axis=0).T[::-1]))

    def offset(self, left: float) -> Curve:
        """The curve beside it."""
        path = (self.xy + left * _left(self.xy, self.closed))[: -1 if self.closed else None]
        beside = object.__new__(Curve)
        beside._take(_rounded(path, 1.0, self.closed), self.closed)
        return beside

    def laps(self, count: float) -> Curve:
        """A closed curve gone round so many times; an open one up to that share."""
        along = object.__new__(Curve)
        whole = np.concatenate([self.xy[:-1]] * int(np.ceil(count)))
        along._take(whole[: round(count * (len(self.xy) - 1))], closed=False)
        return along

    def at(self, arc: np.ndarray, left: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Places (n, 2), so far to the left of the curve, and headings (n,), rad, without jumps."""
        knots = np.arange(len(self.xy)) * STEP
        yaw = np.interp(arc, knots, self._heading)
        xy = np.stack([np.interp(arc, knots, c) for c in self.xy.T], -1)
        return xy + left * np.stack([-np.sin(yaw), np.cos(yaw)], -1), yaw

    def bending(self) -> np.ndarray:
        """Curvature (1/m) at each of its points."""
        return gaussian_filter1d(np.abs(np.gradient(self._heading)) / STEP, 4)


def _resampled(xy: np.ndarray) -> np.ndarray:
    arc = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(xy, axis=0), axis=1))])
    every = np.linspace(0, arc[-1], round(arc[-1] / STEP) + 1)
    return np.stack([np.interp(every, arc, c) for c in xy.T], 1)


def _rounded(xy: np.ndarray, length: float, closed: bool) -> np.ndarray:
    smooth = gaussian_filter1d(xy, length / STEP, axis=0, mode="wrap" if closed else "nearest")
    return _resampled(np.vstack([smooth, smooth[:1]]) if closed else smooth)


def _left(xy: np.ndarray, closed: bool = False) -> np.ndarray:
    """Unit normals (n, 2); the first point of a closed curve is its last one too."""
    dx, dy = (np.gradient(np.vstack([xy[-2], xy, xy[1]]), axis=0)[1:-1] if closed else np.gradient(xy, axis=0)).T
    return np.stack([-dy, dx], 1) / np.hypot(dx, dy)[:, None]


class Motion:
    """A pose for every time of [0, duration], twice differentiable; and the metres gone by then."""

    def __init__(self, arc: np.ndarray, xyz: np.ndarray, yaw_pitch_roll: np.ndarray) -> None:
        """Knots every TICK: arc (n,), xyz (n, 3), angles (n, 3), rad."""
        times = TICK * np.arange(len(arc))
        self.duration = float(times[-1])
        self.arc = CubicSpline(times, arc)
        self._place, self._angles = CubicSpline(times, xyz), CubicSpline(times, yaw_pitch_roll)

    def poses(self, times: np.ndarray) -> np.ndarray:
        poses = np.tile(np.eye(4), (len(times), 1, 1))
        poses[:, :3, :3] = Rotation.from_euler("ZYX", self._angles(times)).as_matrix()
        poses[:, :3, 3] = self._place(times)
        return poses


def driven(curve: Curve, ground: Callable, speed: float, seed: int, stops: int = 0, height: float = 1.73) -> Motion:
    """A car that keeps to the speed, slows down in bends, halts sometimes, and rocks on its springs.

    ground: heights (n,) of places x (n,), y (n,).
    """
    rng = np.random.default_rng([seed, 10])
    halts = np.sort(rng.uniform(0.1, 0.9, stops)) * curve.length
    arc = timetable(curve, speed, halts, rng.uniform(2, 5, stops))
    xy, yaw = curve.at(arc)
    ahead, behind = (_heights(ground, xy, yaw, along, 0) for along in (WHEELBASE, -WHEELBASE))
    left, right = (_heights(ground, xy, yaw, 0, side) for side in (TRACK, -TRACK))
    pace, pushed = np.gradient(arc, TICK), np.gradient(np.gradient(arc, TICK), TICK)
    moving = pace / (pace + 2)
    pitch = np.arctan((behind - ahead) / (2 * WHEELBASE)) - 0.004 * pushed
    pitch += 0.0035 * moving * shaken(rng, len(arc), 0.12)
    roll = np.arctan((left - right) / (2 * TRACK)) + 0.0035 * moving * shaken(rng, len(arc), 0.12)
    z = (ahead + behind + left + right) / 4 + height + 0.012 * moving * shaken(rng, len(arc), 0.1)
    angles = gaussian_filter1d(np.stack([yaw, pitch, roll], 1), 0.08 / TICK, axis=0)
    return Motion(arc, np.column_stack([xy, gaussian_filter1d(z, 0.08 / TICK)]), angles)


def walked(curve: Curve, speed: float, seed: int, height: float = 1.5) -> Motion:
    """Someone who carries the sensor over level ground: it bobs with each step, sways, and looks about."""
    rng = np.random.default_rng([seed, 11])
    arc = timetable(curve, speed, np.empty(0), np.empty(0), sideways=0.5)
    xy, yaw = curve.at(arc)
    count, stride = len(arc), arc / 0.7
    yaw = gaussian_filter1d(yaw, 0.7 / TICK) + 0.06 * np.sin(np.pi * stride) + 0.05 * shaken(rng, count, 0.5)
    pitch = 0.02 * np.sin(2 * np.pi * stride + 1) + 0.03 * shaken(rng, count, 0.4)
    roll = 0.025 * np.sin(np.pi * stride + 2) + 0.02 * shaken(rng, count, 0.4)
    z = height + 0.025 * np.sin(2 * np.pi * stride) + 0.02 * shaken(rng, count, 1.0)
    angles = gaussian_filter1d(np.stack([yaw, pitch, roll], 1), 0.08 / TICK, axis=0)
    return Motion(arc, np.column_stack([xy, z]), angles)


def timetable(
    curve: Curve, speed: float, halts: np.ndarray, waits: np.ndarray, sideways: float = SIDEWAYS
) -> np.ndarray:
    """Metres gone at each tick: as fast as bends, halts and the acceleration allow; from rest, after a second."""
    pace = np.minimum(speed, np.sqrt(sideways / np.maximum(curve.bending(), 1e-6)))
    stands = np.round(halts / STEP).astype(int)
    pace[[0, *stands]] = 0
    gain = 2 * ACCELERATION * STEP
    for k in range(1, len(pace)):
        pace[k] = min(pace[k], np.sqrt(pace[k - 1] ** 2 + gain))
    for k in range(len(pace) - 2, -1, -1):
        pace[k] = min(pace[k], np.sqrt(pace[k + 1] ** 2 + gain))
    arc = np.arange(len(pace)) * STEP
    times = np.concatenate([[0], np.cumsum(2 * STEP / (pace[1:] + pace[:-1]))])
    for stand, wait in zip(stands, waits, strict=True):
        times[stand + 1 :] += wait
    after = np.unique(stands) + 1
    leaving = times[after] - 2 * STEP / pace[after]
    times, arc = np.insert(times, after, leaving), np.insert(arc, after, arc[after - 1])
    gone = CubicHermiteSpline(times, arc, np.insert(pace, after, 0))(np.arange(0, times[-1], TICK))
    gone = np.pad(gone, (round(1 / TICK), 0))
    return gaussian_filter1d(gone, 0.25 / TICK, mode="nearest")[: -round(0.5 / TICK)]


def shaken(rng: np.random.Generator, count: int, seconds: float) -> np.ndarray:
    """Noise of unit deviation, smooth over so many seconds."""
    noise = gaussian_filter1d(rng.standard_normal(count), seconds / TICK)
    return noise / noise.std()


def _heights(ground: Callable, xy: np.ndarray, yaw: np.ndarray, ahead: float, left: float) -> np.ndarray:
    c, s = np.cos(yaw), np.sin(yaw)
    return ground(xy[:, 0] + ahead * c - left * s, xy[:, 1] + ahead * s + left * c)
