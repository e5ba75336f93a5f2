"""What a sensor looked through: in front of what it saw, and nowhere else."""

import numpy as np
import pytest

import fieldalign as fa
from fieldalign import _core
from fieldalign.motions import apply, translation
from fieldalign.verdict import Sight

VOXEL = 0.05


@pytest.fixture
def wall(rng):
    """A wall at x = 5, seen from the origin up to 45 degrees aside: 20,000 points."""
    return np.c_[np.full(20_000, 5.0), rng.uniform(-5, 5, (20_000, 2))]


def on_wall(rng, share):
    """Places on the rays to the wall, at a share of the way."""
    return share * np.c_[np.full(500, 5.0), rng.uniform(-4, 4, (500, 2))]


@pytest.mark.parametrize(("share", "through"), [(0.05, True), (0.5, True), (0.85, True), (1.0, False), (1.2, False)])
def test_the_sensor_looked_through_what_is_in_front_of_the_wall(wall, rng, share, through):
    seen = Sight(wall, np.zeros(3)).looked_through(on_wall(rng, share), VOXEL)
    assert seen.shape == (500,)
    assert seen.dtype == bool
    assert (seen == through).all()


def test_where_nothing_came_back_nothing_was_looked_through(wall, rng):
    sight = Sight(wall, np.zeros(3))
    behind, aside = -on_wall(rng, 0.5), on_wall(rng, 0.5)[:, [1, 0, 2]]
    for places in (behind, aside):
        assert not sight.looked_through(places, VOXEL).any()
    assert np.isnan(_core.Sight(wall, np.zeros(3), 16).ranges(behind)).all()


def test_a_place_that_is_short_by_less_than_some_voxels_lies_on_the_wall(wall, rng):
    """A coarse voxel forgives more."""
    sight, places = Sight(wall, np.zeros(3)), on_wall(rng, 0.85)
    assert sight.looked_through(places, VOXEL).all()
    assert not sight.looked_through(places, 1.0).any()


@pytest.fixture
def shell(rng):
    """Directions all around (n, 3): of what is ten units away from a sensor at the origin."""
    directions = rng.normal(size=(20_000, 3))
    return directions / np.linalg.norm(directions, axis=1)[:, None]


@pytest.mark.parametrize("scale", [1.0, 100.0])
def test_a_place_that_is_short_by_less_than_a_twentieth_of_the_range_lies_on_what_is_behind_it(shell, scale):
    """However fine the voxel is: a cell of directions is a degree or two wide."""
    sight = Sight(10 * scale * shell, np.zeros(3))
    for share, through in ((0.96, False), (0.94, True)):
        assert (sight.looked_through(10 * scale * share * shell[:500], 1e-3 * scale) == through).all()


def test_a_sensor_looks_past_what_it_would_see_edge_on(shell):
    sight, rays = Sight(10 * shell, np.zeros(3)), shell[:500]
    across = np.cross(rays, [0.3, 0.5, 0.8])
    across /= np.linalg.norm(across, axis=1)[:, None]
    for cosine, through in ((0.0, False), (0.19, False), (0.21, True), (-0.21, True), (1.0, True)):
        normals = cosine * rays + np.sqrt(1 - cosine**2) * across
        assert (sight.looked_through(5 * rays, VOXEL, normals) == through).all()


def test_only_the_place_of_the_sensor_matters(wall, rng):
    eye = np.array([100.0, -20, 7])
    for share in (0.5, 1.1):
        places = on_wall(rng, share)
        here = Sight(wall, np.zeros(3)).looked_through(places, VOXEL)
        assert np.array_equal(Sight(wall + eye, eye).looked_through(places + eye, VOXEL), here)


def test_ranges_are_those_of_the_nearest_return_around(rng):
    """All around: no further than the return in that direction, and as far as one of those around it."""
    directions = rng.normal(size=(3000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    points = rng.uniform(2, 9, (3000, 1)) * directions
    cells = 8
    ranges = _core.Sight(points, np.zeros(3), cells).ranges(points)
    lengths = np.linalg.norm(points, axis=1)
    assert (ranges <= lengths + 1e-5).all()
    angle = np.arccos(np.clip(directions @ directions.T, -1, 1))
    wide = 2 * np.sqrt(2) * (np.pi / 2 / cells) * 1.01  # from corner to corner of two cells
    for k in range(0, 3000, 50):
        assert np.abs(lengths[angle[k] < wide] - ranges[k]).min() < 1e-5


def test_sight_refuses_what_it_cannot_be():
    with pytest.raises(ValueError, match="length"):
        _core.Sight(np.eye(3), np.zeros(2), 4)
    with pytest.raises(ValueError, match="cells"):
        _core.Sight(np.eye(3), np.zeros(3), 0)


# ---------------------------------------------------------------------------------------------------- prepared clouds


def test_a_prepared_cloud_knows_where_its_sensor_stood(wall):
    viewpoint = translation([1.0, 2, 3])
    assert np.array_equal(fa.prepare(fa.PointCloud(wall, viewpoint=viewpoint)).eye, [1, 2, 3])
    for cloud in (wall, fa.PointCloud(wall)):
        prepared = fa.prepare(cloud)
        assert prepared.eye is None
        assert prepared.sight is None


def test_a_prepared_cloud_sees_as_its_points_do(wall, rng):
    prepared = fa.prepare(fa.PointCloud(wall, viewpoint=np.eye(4)))
    places = np.vstack([on_wall(rng, 0.5), on_wall(rng, 1.3)])
    assert prepared.sight.looked_through(places, VOXEL).tolist() == [True] * 500 + [False] * 500
    assert prepared.sight is prepared.sight


def test_a_file_that_holds_a_viewpoint_tells_it(wall, tmp_path, any_motion, rng):
    W = any_motion(rng, 4.0)
    fa.write_cloud(tmp_path / "scan.pcd", fa.PointCloud(apply(W, wall), viewpoint=W))
    assert np.allclose(fa.prepare(tmp_path / "scan.pcd").eye, W[:3, 3], atol=1e-4)
