"""Simulated scans: the rays hit what they should, nothing is seen through anything, and the truth is true."""

from __future__ import annotations

import numpy as np
import pytest

from fieldalign.clouds.simulated import (
    Box,
    Cylinder,
    Scene,
    Sphere,
    cast,
    ray_pattern,
    simulate_pair,
    simulate_room,
)
from fieldalign.errors import ArgumentError

SOLIDS = [
    Box((1.0, -0.5, 0.3), (0.6, 1.0, 0.4), yaw=0.7),
    Cylinder((0.5, 0.2, -0.3), (1.1, -0.4, 0.8), 0.35),
    Cylinder((0.0, 0.0, 0.0), (0.0, 0.0, 2.0), 0.5),
    Sphere((-0.4, 0.9, 0.1), 0.6),
]


def signed_distance(solid, points):
    """Written apart from the library: negative inside, zero on the surface."""
    if isinstance(solid, Sphere):
        return np.linalg.norm(points - solid.center, axis=-1) - solid.radius
    if isinstance(solid, Cylinder):
        start, end = np.array(solid.start), np.array(solid.end)
        length = np.linalg.norm(end - start)
        axis = (end - start) / length
        height = (points - start) @ axis
        across = np.linalg.norm(np.cross(points - start, axis), axis=-1) - solid.radius
        outside = np.stack([across, np.maximum(-height, height - length)])
    else:
        c, s = np.cos(solid.yaw), np.sin(solid.yaw)
        local = (points - solid.center) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        outside = np.moveaxis(np.abs(local) - np.array(solid.size) / 2, -1, 0)
    return np.linalg.norm(np.maximum(outside, 0), axis=0) + np.minimum(outside.max(axis=0), 0)


def distance_to_scene(scene, points):
    return np.min([np.abs(signed_distance(solid, points)) for solid in scene.primitives], axis=0)


def directions(n, seed=0):
    d = np.random.default_rng(seed).standard_normal((n, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def pose(x, y, z, yaw=0.0):
    T = np.eye(4)
    T[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    T[:3, 3] = x, y, z
    return T


@pytest.mark.parametrize("solid", SOLIDS)
def test_ranges_agree_with_marching_along_the_ray(solid):
    rng = np.random.default_rng(1)
    origins, d = rng.uniform(-2, 2, (400, 3)), directions(400)
    d[::2] = np.array(solid.center) + rng.uniform(-0.5, 0.5, (200, 3)) - origins[::2]
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    steps = np.linspace(0, 8, 1001)
    inside = signed_distance(solid, origins[:, None] + steps[:, None] * d[:, None]) < 0
    crossed = inside[:, 1:] != inside[:, :-1]
    marched = np.where(crossed.any(axis=1), steps[crossed.argmax(axis=1)], np.inf)
    found = solid.intersect(origins, d)
    both = np.isfinite(found) & np.isfinite(marched)
    assert both.sum() > 80
    assert np.isinf(found).sum() > 80
    assert np.all(np.abs(found[both] - marched[both]) < 0.0081)
    assert np.mean(np.isfinite(found) != np.isfinite(marched)) < 0.02  # marching steps over a grazed edge


@pytest.mark.parametrize("solid", SOLIDS)
def test_hits_lie_on_the_surface_from_outside_and_from_inside(solid):
    near, d = np.array(solid.center) + 0.05, directions(500)
    leaving = solid.intersect(near, d)
    assert np.isfinite(leaving).all()
    assert np.abs(signed_distance(solid, near + leaving[:, None] * d)).max() < 1e-12
    coming = solid.intersect(near + 50 * d, -d)
    assert np.isfinite(coming).all()
    assert np.allclose(coming, 50 - leaving, atol=1e-9)  # the solids are convex


def test_closed_forms():
    ahead = np.array([[1.0, 0.0, 0.0]])
    assert Sphere((5, 0, 0), 2).intersect(np.zeros(3), ahead) == 3
    assert Box((5, 0, 0), (2, 2, 2)).intersect(np.zeros(3), ahead) == 4
    assert np.isclose(Box((5, 0, 0), (2, 2, 2), np.pi / 4).intersect(np.zeros(3), ahead), 5 - np.sqrt(2))
    assert Cylinder((5, 0, -1), (5, 0, 1), 2).intersect(np.zeros(3), ahead) == 3
    assert Cylinder((5, 0.1, 0), (7, 0.1, 0), 1).intersect(np.zeros(3), ahead) == 5  # along the axis
    assert Cylinder((5, 2, 0), (7, 2, 0), 1).intersect(np.zeros(3), ahead) == np.inf
    assert np.all(np.isinf([s.intersect(np.zeros(3), -ahead) for s in (Sphere((5, 0, 0), 2), SOLIDS[0])]))


@pytest.mark.parametrize("solid", SOLIDS)
def test_a_moved_solid_moves_its_surface(solid):
    yaw, shift = 0.9, (0.3, -2.0, 0.5)
    T = pose(*shift, yaw)
    origins, d = np.random.default_rng(2).uniform(-2, 2, (300, 3)), directions(300)
    moved = solid.moved(shift, yaw).intersect(origins @ T[:3, :3].T + T[:3, 3], d @ T[:3, :3].T)
    assert np.allclose(moved, solid.intersect(origins, d), atol=1e-9)


def test_cast_is_the_minimum_over_all_solids_whatever_the_culling():
    room = simulate_room(1)
    origins, d = np.random.default_rng(3).uniform((0.5, 0.5, 0.2), (5, 4, 2.4), (9000, 3)), directions(9000)
    brute = np.min([solid.intersect(origins, d) for solid in room.primitives], axis=0)
    assert np.allclose(room.ranges(origins, d), brute, rtol=0, atol=1e-12)
    one_place = origins[:1].repeat(9000, axis=0)
    assert np.allclose(room.ranges(origins[0], d), room.ranges(one_place, d), rtol=0, atol=1e-12)
    assert np.isinf(cast([], origins, d)).all()


@pytest.mark.parametrize("seed", range(2))
def test_noise_free_points_lie_on_the_room_and_nothing_is_before_them(seed):
    room = simulate_room(seed)
    world_from_sensor = pose(0.8 * room.size[0], 0.55 * room.size[1], 1.5, yaw=2.5)
    cloud = room.scan(world_from_sensor, 5000, noise=0, field_of_view=(360, 150))
    assert len(cloud) == 5000  # the room is closed
    assert cloud.points.dtype == np.float64
    assert np.array_equal(cloud.viewpoint, np.eye(4))
    surface = cloud.transformed(world_from_sensor).points
    assert distance_to_scene(room, surface).max() < 1e-9
    along = np.linspace(0.02, 0.99, 40)[:, None, None]
    between = world_from_sensor[:3, 3] + along * (surface[::40] - world_from_sensor[:3, 3])
    assert min(signed_distance(solid, between).min() for solid in room.primitives) > -1e-9
    assert room.sees(world_from_sensor, surface, (360, 150)).all()
    assert room.sees(world_from_sensor, surface, (360, 60)).mean() < 0.6


def test_a_point_behind_a_solid_or_out_of_the_field_of_view_is_not_seen():
    scene = Scene((Sphere((2, 0, 0), 0.5), Box((5, 0, 0), (1, 4, 4))))
    points = np.array([[1.5, 0, 0], [4.5, 0, 0], [4.5, 1.9, 0], [5.5, 1.9, 0], [2.5, 0, 0]])
    assert scene.sees(np.eye(4), points).tolist() == [True, False, True, False, False]
    assert scene.sees(np.eye(4), points, (20, 20)).tolist() == [True, False, False, False, False]
    assert not scene.sees(pose(0, 0, 0, np.pi), points).any()
    board = Scene((Box((2, 0, 0), (0.002, 1, 1)),))
    assert board.sees(np.eye(4), np.array([[1.999, 0.2, 0], [2.001, 0.2, 0]])).tolist() == [True, False]


def test_rays_that_meet_nothing_give_no_point():
    scene = Scene((Sphere((3, 0, 0), 1),))
    cloud = scene.scan(np.eye(4), 20_000, noise=0)
    directions_of_hits = cloud.points / np.linalg.norm(cloud.points, axis=1, keepdims=True)
    assert 0 < len(cloud) < 20_000
    assert np.all(directions_of_hits[:, 0] > np.cos(np.arcsin(1 / 3)) - 1e-12)


def test_rays_fill_the_field_of_view():
    d = ray_pattern(20_000, (90, 60))
    azimuth, elevation = np.degrees(np.arctan2(d[:, 1], d[:, 0])), np.degrees(np.arcsin(d[:, 2]))
    assert np.allclose(np.linalg.norm(d, axis=1), 1)
    for angle, opening in ((azimuth, 90), (elevation, 60)):
        assert np.allclose([angle.min(), angle.max()], [-opening / 2, opening / 2], atol=0.6)
        counts, _ = np.histogram(angle, bins=12, range=(-opening / 2, opening / 2))
        assert np.ptp(counts) < 0.05 * counts.mean()


def test_noise_is_along_the_ray_and_as_large_as_asked():
    room = simulate_room(0)
    here = pose(2.0, 2.4, 1.6)
    exact, noisy = (room.scan(here, 20_000, noise=n).points for n in (0, 0.01))
    assert np.abs(np.cross(exact, noisy)).max() < 1e-12
    assert np.std(np.linalg.norm(noisy, axis=1) - np.linalg.norm(exact, axis=1)) == pytest.approx(0.01, rel=0.03)


def test_same_seed_same_bits_and_other_seed_another_room():
    one, same = (simulate_pair(4, points=3000, overlap=0.5) for _ in range(2))
    assert np.array_equal(one.source.points, same.source.points)
    assert np.array_equal(one.target.points, same.target.points)
    assert np.array_equal(one.T_target_source, same.T_target_source)
    assert one.overlap == same.overlap
    assert simulate_room(4) == simulate_room(4)
    assert simulate_room(4) != simulate_room(5)
    scans = [simulate_room(4).scan(pose(2, 2.4, 1.5), 500, seed=seed).points for seed in (0, 1)]
    assert not np.array_equal(*scans)


@pytest.mark.parametrize(("seed", "overlap"), [(0, 0.4), (1, 0.6), (4, 0.95)])
def test_pair_is_as_asked_and_its_truth_is_exact(seed, overlap):
    pair = simulate_pair(seed, points=4000, overlap=overlap, noise=0)
    assert len(pair.source) == len(pair.target) == 4000
    assert pair.overlap == pytest.approx(overlap, abs=0.05)
    room, T = simulate_room(seed), pair.T_target_source
    for cloud, world_from_cloud in (
        (pair.source, pair.world_from_target @ T),
        (pair.target, pair.world_from_target),
    ):
        assert distance_to_scene(room, cloud.transformed(world_from_cloud).points).max() < 1e-9
    axis = np.array([T[2, 1] - T[1, 2], T[0, 2] - T[2, 0], T[1, 0] - T[0, 1]])
    angle = np.degrees(np.arctan2(np.linalg.norm(axis), np.trace(T[:3, :3]) - 1))
    assert 0 < angle <= 45
    assert np.abs(axis / np.linalg.norm(axis)).max() < 0.999  # not about one axis only
    assert 0 < np.linalg.norm(T[:3, 3]) <= 0.8


def test_overlap_is_what_the_other_scan_covers():
    pair = simulate_pair(2, points=20_000, noise=0)
    moved = pair.source.transformed(pair.T_target_source).points[::40]
    nearest = [np.min(np.linalg.norm(pair.target.points - point, axis=1)) for point in moved]
    assert np.mean(np.array(nearest) < 0.05) == pytest.approx(pair.overlap, abs=0.05)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"rays": 0}, "rays"),
        ({"rays": 2.5}, "rays"),
        ({"noise": -1}, "noise"),
        ({"noise": np.nan}, "noise"),
        ({"field_of_view": (400, 50)}, "field_of_view"),
        ({"field_of_view": (90, 0)}, "field_of_view"),
        ({"world_from_sensor": np.eye(3)}, "world_from_sensor"),
        ({"world_from_sensor": 2 * np.eye(4)}, "world_from_sensor"),
        ({"world_from_sensor": np.diag([1.0, 1, -1, 1])}, "world_from_sensor"),
        ({"world_from_sensor": np.full((4, 4), np.nan)}, "world_from_sensor"),
        ({"seed": -1}, "seed"),
    ],
)
def test_bad_arguments_of_a_scan(arguments, named):
    with pytest.raises(ArgumentError, match=named):
        Scene((SOLIDS[0],)).scan(**{"world_from_sensor": np.eye(4), "rays": 10} | arguments)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"overlap": 0.0}, "overlap"),
        ({"overlap": 1.5}, "overlap"),
        ({"overlap": np.nan}, "overlap"),
        ({"points": -5}, "points"),
        ({"noise": -0.1}, "noise"),
        ({"seed": -1}, "seed"),
    ],
)
def test_bad_arguments_of_a_pair(arguments, named):
    with pytest.raises(ArgumentError, match=named):
        simulate_pair(**{"points": 100} | arguments)
