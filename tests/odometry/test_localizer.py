"""Localisation: on the map of a street, from no guess, then tracked, and taken elsewhere meanwhile."""

import numpy as np
import pytest

import fieldalign as fa
from fieldalign import Tracking
from fieldalign.clouds.simulated import Box, cast
from fieldalign.motions import exp_twist, inverse, translation

SIGHT, MAPPED = 25.0, 40


def place():
    """A street of 60 metres with houses of all sizes."""
    rng = np.random.default_rng(5)
    solids = [Box((30, 0, -0.5), (200, 80, 1))]
    for side in (-1, 1):
        x = -15.0
        while x < 75:
            size = rng.uniform(3, 9, 3)
            y = side * (7 + size[1] / 2 + rng.uniform(0, 3))
            solids.append(Box((x, y, size[2] / 2), tuple(size), float(rng.uniform(-0.3, 0.3))))
            x += size[0] + rng.uniform(1, 4)
    return tuple(solids)


SOLIDS = place()


def true_pose(x):
    return translation([x, 0.5 * np.sin(x / 7), 1.8]) @ exp_twist(np.array([0, 0, 0.1 * np.cos(x / 5), 0, 0, 0]))


def scan(x, seed=0):
    azimuth, elevation = np.meshgrid(np.linspace(-np.pi, np.pi, 480, endpoint=False), np.linspace(-0.5, 0.3, 32))
    across = np.cos(elevation)
    beams = np.stack([across * np.cos(azimuth), across * np.sin(azimuth), np.sin(elevation)], -1).reshape(-1, 3)
    pose = true_pose(x)
    ranges = cast(SOLIDS, np.tile(pose[:3, 3], (len(beams), 1)), beams @ pose[:3, :3].T)
    ranges += 0.01 * np.random.default_rng([seed, int(10 * x)]).normal(size=len(ranges))
    seen = ranges < SIGHT
    return (beams[seen] * ranges[seen, None]).astype(np.float32)


@pytest.fixture(scope="module")
def whole():
    """The map of a drive of 60 metres, in the frame of the place."""
    odometry = fa.Odometry(whole=True)
    for x in np.linspace(0, 60, MAPPED * 2):
        odometry.step(scan(x))
    return odometry.map.transformed(true_pose(0))


def off(pose, x):
    return np.linalg.norm((inverse(true_pose(x)) @ pose)[:3, 3])


def test_it_is_found_and_then_tracked(whole):
    localizer = fa.Localizer(whole, threads=1)
    for k in range(10):
        x = 22.3 + 0.7 * k
        pose = localizer.step(scan(x, seed=1))
        assert off(pose, x) < 0.1
        assert localizer.last.tracked
    said = [result.reason for result in localizer.results]
    assert said[0] is Tracking.FOUND
    assert localizer.results[0].search.accepted
    assert set(said[1:]) == {Tracking.TRACKED}
    assert localizer.last.covariance.shape == (6, 6)


def test_it_is_searched_again_where_it_is_lost(whole):
    localizer = fa.Localizer(whole, threads=1)
    localizer.step(scan(10.0, seed=1))
    pose = localizer.step(scan(40.0, seed=1))
    assert localizer.last.reason is Tracking.FOUND
    assert off(pose, 40.0) < 0.1


def test_what_is_not_on_the_map_has_no_place(whole, rng):
    localizer = fa.Localizer(whole, threads=1)
    clutter = rng.uniform(-15, 15, (8000, 3))
    assert localizer.step(clutter) is None
    assert localizer.last.reason is Tracking.UNPLACED
    assert not localizer.last.tracked
    assert localizer.last.to_dict()["pose"] is None
    assert localizer.step(np.zeros((0, 3))) is None
    assert localizer.last.reason is Tracking.EMPTY
    assert localizer.step(None) is None
    assert localizer.last.reason is Tracking.MISSING
    assert off(localizer.step(scan(30.0, seed=1)), 30.0) < 0.1
    pose = localizer.step(clutter)
    assert localizer.last.reason is Tracking.LOST
    assert off(pose, 30.0) < 0.5  # the prediction
    for _ in range(6):
        pose = localizer.step(clutter)
    assert pose is None  # too long ago


def test_a_map_of_points_alone_will_do(drive, whole):
    places = np.concatenate([scan(x) @ true_pose(x)[:3, :3].T + true_pose(x)[:3, 3] for x in range(0, 60, 3)])
    localizer = fa.Localizer(places, threads=1)
    for x in (20.0, 20.5):
        assert off(localizer.step(scan(x, seed=1)), x) < 0.1


def test_the_same_bits_at_any_number_of_threads(whole):
    one, other = (fa.Localizer(whole, threads=n).step(scan(33.0, seed=1)) for n in (1, 2))
    assert np.array_equal(one, other)


def test_wrong_arguments_raise(whole, tmp_path):
    with pytest.raises(fa.ArgumentError, match="map must have at least 1000 points, but has 5"):
        fa.Localizer(np.zeros((5, 3)))
    with pytest.raises(fa.ArgumentError, match=r"map must have shape \(N, 3\)"):
        fa.Localizer(np.zeros((5, 2)))
    with pytest.raises(fa.CloudFileError):
        fa.Localizer(tmp_path / "none.ply")
    with pytest.raises(fa.ArgumentError, match=r"cloud must have shape \(N, 3\)"):
        fa.Localizer(whole).step(np.zeros((5, 2)))
