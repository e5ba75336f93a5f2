"""Which way is up: z of what is levelled, and of what a camera has seen the vertical of its floors and walls."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fieldalign.reports import views

Z = np.array([0.0, 0.0, 1.0])
CAMERA = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # of right, ahead, up: x right, y down, z ahead


def degrees_between(a, b):
    return np.degrees(np.arccos(np.clip(a @ b, -1, 1)))


def room(rng):
    """Floor, three walls and a table of a room, levelled; nothing behind the place (0, 0, 0), which is 1.5 m high."""
    u, v = rng.uniform(size=(2, 5000))
    floor = np.c_[4 * u - 2, 1.5 + 3 * v, np.full(5000, -1.5)]
    back = np.c_[4 * u - 2, np.full(5000, 4.5), 2.5 * v - 1.5]
    left, right = (np.c_[np.full(5000, x), 1.5 + 3 * u, 2.5 * v - 1.5] for x in (-2.0, 2.0))
    table = np.c_[u - 0.5, 2.5 + v, np.full(5000, -0.8)]
    return np.concatenate([floor, back, left, right, table])


@pytest.mark.parametrize("azimuth", [0, 20, 45])
@pytest.mark.parametrize("nod", [0, 10, 30])
def test_what_a_camera_has_seen_stands_upright(rng, azimuth, nod):
    levelled = room(rng) @ Rotation.from_euler("z", azimuth, degrees=True).as_matrix().T
    ahead = levelled[levelled[:, 1] > 0.6 * np.linalg.norm(levelled, axis=1)]
    axes = CAMERA @ Rotation.from_euler("x", nod, degrees=True).as_matrix()
    up = views.upright(ahead @ axes.T)
    assert degrees_between(up, axes @ Z) < 2


def test_what_is_levelled_keeps_z(rng):
    for points in (room(rng), room(rng) + [3, 5, 1.5], room(rng) * [1, 1, 0.3]):
        assert degrees_between(views.upright(points), Z) < 1


def test_a_tilted_sensor_is_levelled(rng):
    tilt = Rotation.from_euler("xy", [12, -7], degrees=True).as_matrix()
    assert degrees_between(views.upright(room(rng) @ tilt.T), tilt @ Z) < 1


def test_an_object_that_stands_off_keeps_z(rng):
    """All of it lies in a cone about z, as of a camera; but its sides are along z, and nothing is along y."""
    around, up = rng.uniform(0, 2 * np.pi, 20_000), rng.uniform(2, 4, 20_000)
    column = np.c_[0.3 * np.cos(around), 0.3 * np.sin(around), up]
    assert degrees_between(views.upright(column), Z) < 3


def test_noise_keeps_z(rng):
    assert degrees_between(views.upright(rng.normal(size=(3000, 3))), Z) < 10


def test_the_frames_own_points_tell(rng):
    levelled = room(rng)
    axes = CAMERA @ Rotation.from_euler("x", 20, degrees=True).as_matrix()
    seen = levelled[levelled[:, 1] > 0.6 * np.linalg.norm(levelled, axis=1)]
    whole = np.concatenate([levelled, levelled * [1, -1, 1]]) @ axes.T
    assert degrees_between(views.upright(whole, seen @ axes.T), axes @ Z) < 2
    assert degrees_between(views.upright(whole), Z) < 25


def test_directions_all_over_the_sphere():
    tries = views.sphere(500)
    assert np.allclose(np.linalg.norm(tries, axis=1), 1)
    nearest = np.sort(np.arccos(np.clip(tries @ tries.T, -1, 1)), axis=1)[:, 1]
    assert nearest.max() < 2 * nearest.min()
