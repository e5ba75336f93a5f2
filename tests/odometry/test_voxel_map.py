"""The map of voxels and what is laid on it: planes as they are, steps as they should be."""

import ctypes

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fieldalign import _core
from fieldalign.motions import exp_twist, inverse, log_motion, translation
from fieldalign.odometry.track import _settings


def scan_of(points, times=None):
    seconds = np.zeros(len(points)) if times is None else times
    return np.c_[points, seconds].astype(np.float32)


@pytest.fixture
def points(rng):
    """In one voxel of an edge of 2: a tilted plane with some noise."""
    u, v = rng.uniform(-0.6, 0.6, (2, 60))
    R = Rotation.from_rotvec([0.3, -0.2, 0.1]).as_matrix()
    return np.c_[u, v, rng.normal(0, 0.02, 60)] @ R.T + [1, 1, 1]


def test_the_plane_of_a_voxel(points):
    voxels = _core.VoxelMap(2.0)
    voxels.add(scan_of(points), np.eye(4), 1000)
    means, normals, counts, variances = voxels.planes(5)
    values, vectors = np.linalg.eigh(np.cov(points.T, bias=True))
    assert counts == [60]
    assert np.allclose(means, points.mean(axis=0), atol=1e-6)
    assert abs(normals[0] @ vectors[:, 0]) > 1 - 1e-6
    assert np.allclose(variances, values[:2], rtol=1e-4)


def test_far_from_the_origin_nothing_is_lost(points):
    near, far = _core.VoxelMap(2.0), _core.VoxelMap(2.0)
    near.add(scan_of(points), np.eye(4), 1000)
    far.add(scan_of(points), translation([2e5, -4e5, 6e4]), 1000)
    assert np.allclose(near.planes(5)[3], far.planes(5)[3], rtol=1e-6)
    assert np.allclose(near.planes(5)[1], far.planes(5)[1], atol=1e-7)


def test_points_come_one_by_one_or_together(points):
    one, many = _core.VoxelMap(2.0), _core.VoxelMap(2.0)
    one.add(scan_of(points), np.eye(4), 1000)
    for row in scan_of(points):
        many.add(row[None], np.eye(4), 1000)
        many.planes(5)  # what is asked between changes nothing
    assert all(np.array_equal(a, b) for a, b in zip(one.planes(5), many.planes(5), strict=True))


def test_a_full_voxel_stays_as_it_is(points):
    voxels = _core.VoxelMap(2.0)
    voxels.add(scan_of(points), np.eye(4), 50)
    before = voxels.planes(5)
    voxels.add(scan_of(points + 0.1), np.eye(4), 50)
    assert before[2] == [50]
    assert all(np.array_equal(a, b) for a, b in zip(before, voxels.planes(5), strict=True))


def test_what_is_far_is_swept_out(rng):
    voxels = _core.VoxelMap(0.5)
    points = rng.uniform(-20, 20, (50_000, 3))
    voxels.add(scan_of(points), np.eye(4), 100)
    centres = np.unique(np.floor(points.astype(np.float32) / 0.5), axis=0) * 0.5 + 0.25
    assert len(voxels) == len(centres)
    eye = np.array([3.0, -2.0, 1.0])
    left = voxels.keep_within(eye, 9.0)
    assert left == len(voxels) == (np.linalg.norm(centres - eye, axis=1) <= 9).sum()
    voxels.add(scan_of(points), np.eye(4), 100)
    assert len(voxels) == len(centres)


def room(rng, n=6000):
    """Three walls of a corner, a box: metres."""
    u, v = rng.uniform(0, 6, (2, n))
    walls = [np.c_[u, v, 0 * u], np.c_[u, 0 * u, v], np.c_[0 * u, u, v]]
    return np.vstack(walls) + rng.normal(0, 0.01, (3 * n, 3))


SETTINGS = {
    "steps": 15, "free_steps": 5, "fewest": 5, "deviations": 2.0, "thickness": 0.02, "least_scale": 0.02,
    "first_scale": 0.3, "flatness": 0.2, "width": 0.1, "gate": 1.0, "certain_gate": 0.3, "certain_flatness": 0.05,
    "still_shift": 1e-6, "still_turn": 1e-6, "largest_turn": 0.3, "trust": 0.0, "arm": 1.0,
}


def test_a_scan_is_laid_on_the_map(rng):
    voxels = _core.VoxelMap(0.7)
    voxels.add(scan_of(room(rng)), np.eye(4), 1000)
    truth = exp_twist(np.array([0.02, -0.01, 0.03, 0.1, -0.15, 0.05]))
    seen = room(rng, 300) @ truth[:3, :3] - truth[:3, 3] @ truth[:3, :3]
    found = voxels.track(scan_of(seen), np.eye(4), np.zeros(3), None, 1.0, None, False, SETTINGS)
    error = log_motion(inverse(truth) @ found["motion"])
    assert np.abs(error).max() < 8e-3
    assert found["on"] > 0.9 * found["met"] > 0
    assert found["least_hold"] > 0.01


def test_twists_that_are_not_held_are_left(rng):
    voxels = _core.VoxelMap(0.7)
    voxels.add(scan_of(room(rng)), np.eye(4), 1000)
    seen = room(rng, 300) - [0.1, -0.15, 0.05]
    held = np.diag([0.0, 0, 0, 0, 1, 1])
    found = voxels.track(scan_of(seen), np.eye(4), np.zeros(3), None, 1.0, held, False, SETTINGS)
    assert np.array_equal(found["motion"][:3, :3], np.eye(3))
    assert found["motion"][0, 3] == 0
    assert np.allclose(found["motion"][1:3, 3], [-0.15, 0.05], atol=0.01)


def test_one_plane_holds_three_of_six(rng):
    u, v = rng.uniform(-5, 5, (2, 20_000))
    floor = np.c_[u, v, rng.normal(0, 0.01, 20_000)]
    voxels = _core.VoxelMap(0.7)
    voxels.add(scan_of(floor), np.eye(4), 1000)
    found = voxels.track(scan_of(floor[:800]), np.eye(4), np.zeros(3), None, 1.0, None, False, SETTINGS)
    lever = np.r_[1, 1, 1, [found["lever"]] * 3]
    shares = np.linalg.eigvalsh(found["hold"] * np.outer(lever, lever))
    assert (np.abs(shares[:3]) < 1e-3 * shares[-1]).all()
    assert shares[3] > 0.1 * shares[-1]
    assert found["least_hold"] < 1e-3


def test_a_prediction_that_is_trusted_weighs_where_little_holds(rng):
    u, v = rng.uniform(-5, 5, (2, 20_000))
    floor = np.c_[u, v, rng.normal(0, 0.01, 20_000)]
    voxels = _core.VoxelMap(0.7)
    voxels.add(scan_of(floor), np.eye(4), 1000)
    seen = scan_of(floor[:800] + [0.05, 0, 0.1])

    def found(trust):
        settings = SETTINGS | {"trust": trust}
        return voxels.track(seen, np.eye(4), np.zeros(3), None, 1.0, None, False, settings)

    plain, mild, firm = (found(trust) for trust in (0.0, 1e3, 1e9))
    assert abs(mild["motion"][2, 3] + 0.1) < 0.01  # the floor holds the height
    assert np.linalg.norm(mild["motion"][:2, 3]) < 0.3 * np.linalg.norm(plain["motion"][:2, 3])
    assert np.abs(firm["motion"] - np.eye(4)).max() < 0.01
    assert firm["H"].max() < 1e5  # what the scan says does not count the prediction


def test_an_unknown_place_has_no_steps():
    voxels = _core.VoxelMap(0.7)
    found = voxels.track(scan_of(np.ones((80, 3))), np.eye(4), np.zeros(3), None, 1.0, None, False, SETTINGS)
    assert np.array_equal(found["motion"], np.eye(4))
    assert found["met"] == found["on"] == 0


# --------------------------------------------------------------------------------------------------------- scans


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_thinning_keeps_the_first_in_each_voxel(rng, dtype):
    points = rng.uniform(-10, 10, (5000, 3)).astype(dtype)
    times = rng.uniform(0, 1, 5000)
    kept = _core.thin_scan(points, times, 0.5, 3, 0.8, 2.0, 9.0)
    taken, seconds = points[::3].astype(np.float32), times[::3]
    ranges = np.linalg.norm(taken, axis=1)
    inside = (ranges >= 2) & (ranges <= 9)
    cells = np.floor(taken[inside] * (np.float32(1) / np.float32(0.8)))
    first = np.sort(np.unique(cells, axis=0, return_index=True)[1])
    assert np.array_equal(kept[:, :3], taken[inside][first])
    assert np.allclose(kept[:, 3], (seconds[inside] - 0.5)[first], atol=1e-7)


def test_rows_that_are_not_finite_are_missing_returns(rng):
    points = rng.uniform(-5, 5, (100, 3)).astype(np.float32)
    points[::2] = np.nan
    points[1] = np.inf
    kept = _core.thin_scan(points, None, 0.0, 1, 1e-3, 0.0, 1e9)
    assert np.array_equal(kept[:, :3], points[3::2])


def test_pseudo_points_are_evenly_taken_of_one_in_a_voxel(rng):
    scan = scan_of(rng.uniform(-10, 10, (20_000, 3)))
    sparse, few = _core.thin_twice(scan, 2.0, 300)
    assert len(sparse) == 1000
    assert np.array_equal(few, sparse[np.arange(300) * 1000 // 300])
    sparse, few = _core.thin_twice(scan, 20.0, 300)
    assert len(sparse) == 8
    assert np.array_equal(few, scan[np.arange(300) * 20_000 // 300])


@pytest.mark.parametrize("turn", [0.0, 0.3, 5.0])
def test_deskewing_is_exact(rng, turn):
    """A place stands still while the sensor moves at a steady twist: whenever it was seen, it comes to where it is."""
    twist = np.r_[turn * np.array([0.2, -0.4, 0.9]), 9.0, -2.0, 0.5]
    places, seconds = rng.uniform(-20, 20, (300, 3)), rng.uniform(-0.1, 0.1, 300)
    T = np.stack([inverse(exp_twist(s * twist)) for s in seconds])
    seen = np.einsum("nij,nj->ni", T[:, :3, :3], places) + T[:, :3, 3]
    assert np.abs(_core.deskew(scan_of(seen, seconds), twist)[:, :3] - places).max() < 1e-5


def test_deskewing_goes_on_with_the_steps(rng):
    """Where the sensor was before tells how fast it moved; the scan is deskewed by that, and found exactly."""
    voxels = _core.VoxelMap(0.7)
    voxels.add(scan_of(room(rng)), np.eye(4), 1000)
    before, truth = translation([0.5, 0.2, 0.1]), exp_twist(np.array([0.05, 0, 0.1, 0.9, 0.5, 0.3]))
    twist = log_motion(inverse(before) @ truth) / 0.1
    seconds = rng.uniform(-0.05, 0.05, 900)
    T = np.stack([inverse(truth @ exp_twist(s * twist)) for s in seconds])
    seen = np.einsum("nij,nj->ni", T[:, :3, :3], room(rng, 300)) + T[:, :3, 3]
    start = translation([0.7, 0.4, 0.2])
    found = voxels.track(scan_of(seen, seconds), start, np.zeros(3), before, 0.1, None, False, SETTINGS)
    assert np.abs(log_motion(inverse(truth) @ found["motion"])).max() < 4e-3
    plain = voxels.track(scan_of(seen), start, np.zeros(3), None, 0.1, None, False, SETTINGS)
    assert np.abs(log_motion(inverse(truth) @ plain["motion"])).max() > 8e-3


class Watched:
    """A number that tells when a thread reads it; one that does not hold the interpreter's lock dies of that."""

    def __init__(self, value, told):
        self.value, self.told = value, told

    def __float__(self):
        self.told.append(ctypes.pythonapi.PyGILState_Check())
        return float(self.value)


def test_settings_are_read_while_the_lock_is_held():
    voxels, scan, told = _core.VoxelMap(1.0), np.zeros((100, 4), np.float32), []
    settings = _settings(1.0, 0.1, 5)
    watched = {name: Watched(value, told) for name, value in settings.items() if name not in ("steps", "free_steps")}
    voxels.track(scan, np.eye(4), np.zeros(3), None, 1.0, None, False, settings | watched)
    assert told == [1] * len(watched)
