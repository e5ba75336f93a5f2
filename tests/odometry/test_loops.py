"""Loops: round a block, and a third of the way again, with an odometry that drifts by a known amount."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

import fieldalign as fa
from fieldalign import _core
from fieldalign.clouds.simulated import Box, cast
from fieldalign.evaluation import absolute_errors
from fieldalign.motions import exp_twist, inverse, translation
from fieldalign.odometry.keyframes import Keyframe, fused
from fieldalign.odometry.loop_graph import between_keyframes
from fieldalign.odometry.loop_search import LoopSearch

RADIUS, EVERY, FRAMES = 20.0, 3.0, 56  # metres, metres, of them 42 once round
SIGHT, VOXEL = 12.0, 0.5


@cache
def block():
    """Houses of all sizes inside and outside of a ring road."""
    rng = np.random.default_rng(3)
    solids = [Box((0, 0, -0.5), (120, 120, 1))]
    for radius, count in ((12.0, 9), (28.0, 22)):
        for angle in np.linspace(0, 2 * np.pi, count, endpoint=False) + rng.uniform(0, 0.2, count):
            size = rng.uniform(2, 5, 3)
            away = radius + rng.uniform(-1.5, 1.5)
            place = away * np.cos(angle), away * np.sin(angle), size[2] / 2
            solids.append(Box(place, tuple(size), float(rng.uniform(0, np.pi))))
    return tuple(solids)


def true_pose(k):
    angle = k * EVERY / RADIUS
    turn = exp_twist(np.array([0, 0, angle + np.pi / 2, 0, 0, 0]))
    return translation([RADIUS * np.cos(angle), RADIUS * np.sin(angle), 1.8]) @ turn


@cache
def scan(k):
    """Points (m, 4) within sight, thinned, in the sensor's frame."""
    azimuth, elevation = np.meshgrid(np.linspace(-np.pi, np.pi, 360, endpoint=False), np.linspace(-0.5, 0.3, 32))
    across = np.cos(elevation)
    beams = np.stack([across * np.cos(azimuth), across * np.sin(azimuth), np.sin(elevation)], -1).reshape(-1, 3)
    pose = true_pose(k)
    ranges = cast(block(), np.tile(pose[:3, 3], (len(beams), 1)), beams @ pose[:3, :3].T)
    ranges += 0.01 * np.random.default_rng(k + 1).normal(size=len(ranges))
    seen = ranges < 25
    return _core.thin_scan(beams[seen] * ranges[seen, None], None, 0.0, 1, 0.4 * VOXEL, 0.0, 25.0)


@cache
def keyframe(k):
    voxels = _core.VoxelMap(VOXEL)
    back = inverse(true_pose(k))
    for other in (k - 1, k, k + 1):
        voxels.add(scan(other), back @ true_pose(other), 100)
    means, normals, counts, _ = voxels.planes(5)
    near = np.linalg.norm(means, axis=1) < SIGHT
    surface = (array[near].astype(np.float32) for array in (means, normals, counts))
    return Keyframe(10 * k, true_pose(k), k * EVERY, *surface, scan(k), VOXEL, SIGHT)


@dataclass
class Driven(fa.Odometry):
    """An odometry whose steps are off by a twist each, ten to a keyframe."""

    drift: np.ndarray
    count: int = FRAMES
    keeps_all = True

    def __post_init__(self):
        poses = [np.eye(4)]
        for k in range(10 * (self.count - 1)):
            poses.append(poses[-1] @ inverse(true_pose(k / 10)) @ true_pose((k + 1) / 10) @ exp_twist(self.drift / 10))
        self.poses = np.stack(poses)
        self.truth = np.stack([inverse(true_pose(0)) @ true_pose(k / 10) for k in range(len(poses))])

    @property
    def trajectory(self):
        covariances = np.tile(np.diag([1e-8] * 3 + [1e-6] * 3), (len(self.poses), 1, 1))
        return fa.Trajectory(np.arange(len(self.poses)) / 10, self.poses, covariances)

    @property
    def keyframes(self):
        return [replace(keyframe(k), pose=self.poses[10 * k]) for k in range(self.count)]

    @property
    def map(self):
        return fused(self.keyframes)

    def ate(self, poses):
        return np.sqrt(np.mean(absolute_errors(self.truth, poses, "positions")[0].translation ** 2))


DRIFT = np.array([2e-4, 1e-4, 1e-3, 0.005, 0.003, 0.002])


@pytest.fixture(scope="module")
def driven():
    return Driven(DRIFT)


@pytest.fixture(scope="module")
def closed(driven):
    return fa.close_loops(driven, threads=1)


def test_loops_mend_the_drift(driven, closed):
    assert closed.mended
    assert len(closed.loops) >= 3
    assert driven.ate(driven.poses) > 0.2
    assert driven.ate(closed.trajectory.poses) < 0.25 * driven.ate(driven.poses)
    again = inverse(closed.trajectory.poses[100]) @ closed.trajectory.poses[520]
    truth = inverse(driven.truth[100]) @ driven.truth[520]
    assert np.linalg.norm((inverse(truth) @ again)[:3, 3]) < 0.03


def test_a_loop_is_as_exact_as_it_says(driven, closed):
    chi_squared = []
    for loop in closed.loops:
        truth = inverse(driven.truth[10 * loop.i]) @ driven.truth[10 * loop.j]
        error = loop.edge.error_of(truth)
        assert np.linalg.norm(error[3:]) < 0.03
        chi_squared.append(error @ np.linalg.solve(loop.covariance, error))
    assert 0.5 < np.median(chi_squared) < 100  # the map of then is bent by its drift, which is not in it


def test_the_map_is_that_of_the_mended_drive(driven, closed):
    def doubled(cloud):
        """The spread of heights of the ground, which a second round that is off makes two of."""
        ground = cloud.points[np.abs(cloud.normals[:, 2]) > 0.95]
        return np.std(ground[ground[:, 2] < -1.2, 2])

    assert doubled(closed.map) < 0.5 * doubled(driven.map)


def test_the_covariance_says_how_well_a_place_is_known(driven, closed):
    off, _ = absolute_errors(driven.truth, closed.trajectory.poses, "none")
    sigma = np.sqrt(np.trace(closed.trajectory.covariances[:, 3:, 3:], axis1=1, axis2=2))
    assert sigma[0] < sigma[200]
    assert 0.1 < np.median(off.translation[50:] / sigma[50:]) < 5


def test_the_same_bits_at_any_number_of_threads(driven, closed):
    again = fa.close_loops(driven, threads=2)
    assert np.array_equal(again.trajectory.poses, closed.trajectory.poses)
    assert again.to_dict() == closed.to_dict()


def test_what_was_seen_from_a_whole_stretch_has_no_viewpoint(driven):
    around = LoopSearch(driven.keyframes, 0, 1).around(1)
    assert len(around) > 100
    assert around.viewpoint is None


def test_progress_is_told(driven):
    heard = []
    fa.close_loops(Driven(DRIFT, 48), threads=1, progress=lambda *told: heard.append(told))
    assert heard[0][1] == 0
    assert heard[-1][1] == heard[-1][2] > 0


def test_what_does_not_drift_is_left_as_it_is():
    exact = Driven(np.zeros(6), 50)
    found = fa.close_loops(exact, threads=1)
    assert exact.ate(found.trajectory.poses) <= 0.005
    if not found.mended:
        assert np.array_equal(found.trajectory.poses, exact.poses)


def test_a_drive_that_does_not_return_is_left_as_it_is():
    short = Driven(DRIFT, 14)
    found = fa.close_loops(short, threads=1)
    assert (found.mended, found.tried, found.loops) == (False, 0, ())
    assert np.array_equal(found.trajectory.poses, short.poses)


def test_the_way_between_keyframes_is_bent_evenly():
    poses = np.stack([translation([k, 0, 0]) for k in range(10)])
    corrections = np.stack([np.eye(4), translation([0, 4, 0])])
    mended = between_keyframes(poses, [2, 6], corrections)
    assert np.allclose(mended[:, 1, 3], [0, 0, 0, 1, 2, 3, 4, 4, 4, 4])
    assert np.allclose(mended[:, 0, 3], np.arange(10))


def test_the_whole_map_is_needed():
    for odometry in (fa.Odometry(), "odometry"):
        with pytest.raises(fa.ArgumentError, match=r"make it with fa.Odometry\(whole=True\)"):
            fa.close_loops(odometry)
    nothing = fa.close_loops(fa.Odometry(whole=True))
    assert len(nothing.trajectory) == 0
