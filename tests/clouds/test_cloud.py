"""A cloud keeps what it is given, refuses what does not fit, and carries everything along."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform

from fieldalign.clouds.cloud import PointCloud, as_points
from fieldalign.errors import ArgumentError

N = 9


@pytest.fixture
def full(rng):
    normals = rng.normal(size=(N, 3))
    viewpoint = np.eye(4)
    viewpoint[:3, 3] = [1, 2, 3]
    return PointCloud(
        rng.normal(size=(N, 3)),
        normals=normals / np.linalg.norm(normals, axis=1)[:, None],
        times=np.arange(N) / 10,
        intensity=np.arange(N, dtype=np.uint16),
        colors=rng.integers(0, 256, (N, 4)).astype(np.uint8),
        attributes={"ring": np.arange(N) % 3, "pair": rng.normal(size=(N, 2))},
        viewpoint=viewpoint,
    )


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("normals", np.zeros((N - 1, 3))),
        ("normals", np.zeros((N, 2))),
        ("normals", np.zeros(N)),
        ("times", np.zeros(N + 1)),
        ("times", np.zeros((N, 1))),
        ("times", 0.0),
        ("intensity", np.zeros((N, 3))),
        ("colors", np.zeros((N, 2), np.uint8)),
        ("colors", np.zeros(N, np.uint8)),
        ("colors", np.zeros((3, 4), np.uint8)),
        ("viewpoint", np.eye(3)),
        ("viewpoint", np.zeros(3)),
    ],
)
def test_a_shape_that_does_not_fit_is_named(name, value):
    with pytest.raises(ArgumentError, match=rf"^{name} must .*but has shape"):
        PointCloud(np.zeros((N, 3)), **{name: value})


@pytest.mark.parametrize("value", [np.zeros(N - 1), 1.0, np.zeros((3, N))])
def test_an_attribute_of_another_length_is_named(value):
    with pytest.raises(ArgumentError, match=r"^attributes\['ring'\] must"):
        PointCloud(np.zeros((N, 3)), attributes={"fine": np.zeros(N), "ring": value})


@pytest.mark.parametrize(
    ("points", "word"),
    [
        (np.zeros((N, 2)), r"shape \(9, 2\)"),
        (np.zeros(3), r"shape \(3,\)"),
        (np.zeros((2, N, 3)), "shape"),
        ([], "shape"),
        (5.0, "shape"),
        ([[1, 2, 3], [4, 5]], "rows differ"),
        ([["a", "b", "c"]], "numbers"),
        (np.ones((N, 3), bool), "numbers"),
        (np.ones((N, 3), complex), "real"),
        (None, "numbers"),
    ],
)
def test_what_is_no_array_of_points_is_refused(points, word):
    with pytest.raises(ArgumentError, match=f"^points must .*{word}"):
        PointCloud(points)
    with pytest.raises(ArgumentError, match=f"^scan must .*{word}"):
        as_points(points, "scan")


@pytest.mark.parametrize(
    ("given", "kept"),
    [("f4", "f4"), ("f8", "f8"), ("f2", "f8"), ("i4", "f8"), ("u1", "f8"), ("i8", "f8"), (">f8", "f8"),
     (">f4", "f4")],
)
def test_float32_stays_and_all_else_becomes_float64(given, kept):
    values = np.arange(27).reshape(9, 3)
    points = as_points(values.astype(given), "points")
    assert points.dtype == np.dtype(kept)
    assert points.dtype.isnative
    assert np.array_equal(points, values)


def test_any_order_in_memory_is_taken(rng):
    values = rng.normal(size=(20, 3))
    for given in (np.asfortranarray(values), np.repeat(values, 2, axis=0)[::2], np.hstack([values, values])[:, 3:]):
        points = as_points(given, "points")
        assert points.flags.c_contiguous
        assert np.array_equal(points, values)


def test_float64_in_order_is_not_copied(rng):
    values = rng.normal(size=(20, 3))
    assert np.shares_memory(as_points(values, "points"), values)
    assert np.shares_memory(PointCloud(values).points, values)


def test_missing_returns_are_kept():
    points = np.array([[1, 2, 3], [np.nan, np.nan, np.nan], [np.inf, 0, 0]])
    assert np.array_equal(PointCloud(points).points, points, equal_nan=True)


def test_an_empty_cloud_is_a_cloud():
    empty = PointCloud(np.zeros((0, 3)), normals=np.zeros((0, 3)), attributes={"ring": []})
    assert len(empty) == 0
    assert len(empty.transformed(np.eye(4))) == 0


def test_lists_become_arrays():
    cloud = PointCloud([[0, 0, 0], [1, 2, 3]], times=[0.5, 1.5], attributes={7: [1, 2]})
    assert cloud.points.dtype == np.float64
    assert np.array_equal(cloud.times, [0.5, 1.5])
    assert np.array_equal(cloud.attributes["7"], [1, 2])


def test_a_cloud_is_immutable(full):
    with pytest.raises(dataclasses.FrozenInstanceError):
        full.points = np.zeros((N, 3))


def same(cloud, other, rows):
    for f in dataclasses.fields(PointCloud):
        one, whole = getattr(cloud, f.name), getattr(other, f.name)
        if f.name == "attributes":
            assert list(one) == list(whole)
            assert all(np.array_equal(one[key], whole[key][rows]) for key in whole)
        elif f.name == "viewpoint":
            assert np.array_equal(one, whole)
        else:
            assert np.array_equal(one, whole[rows])
            assert one.dtype == whole.dtype


@pytest.mark.parametrize(
    "rows",
    [slice(2, 7), slice(None, None, -1), np.array([3, 3, 0]), np.arange(N) % 2 == 0, slice(0, 0), [4, -1]],
    ids=["slice", "reversed", "rows", "mask", "nothing", "list"],
)
def test_a_part_carries_everything(full, rows):
    part = full[rows]
    same(part, full, rows)
    assert len(part) == len(full.points[rows])


def test_a_part_of_a_bare_cloud_is_bare(rng):
    part = PointCloud(rng.normal(size=(N, 3)))[:4]
    assert len(part) == 4
    assert part.normals is part.times is part.intensity is part.colors is part.viewpoint is None
    assert part.attributes == {}


def test_a_motion_moves_points_normals_and_viewpoint(full, motion, rng):
    T = motion(rng, 70, 5.0)
    oracle = RigidTransform.from_matrix(T)
    moved = full.transformed(T)
    assert np.allclose(moved.points, oracle.apply(full.points), atol=1e-14)
    assert np.allclose(moved.normals, oracle.rotation.apply(full.normals), atol=1e-14)
    assert np.allclose(moved.viewpoint, (oracle * RigidTransform.from_matrix(full.viewpoint)).as_matrix(), atol=1e-14)
    same(dataclasses.replace(moved, points=full.points, normals=full.normals, viewpoint=full.viewpoint), full, slice(N))


def test_a_sensor_sees_its_points_where_it_saw_them(full, motion, rng):
    """Points in the sensor's own frame do not depend on where the cloud is moved."""
    def in_sensor(cloud):
        return RigidTransform.from_matrix(cloud.viewpoint).inv().apply(cloud.points)

    assert np.allclose(in_sensor(full.transformed(motion(rng, 40, 3.0))), in_sensor(full), atol=1e-13)


def test_moved_points_are_float64_and_the_given_ones_untouched(rng, motion):
    points = rng.normal(size=(N, 3)).astype(np.float32)
    cloud, before = PointCloud(points), points.copy()
    moved = cloud.transformed(motion(rng, 10, 1e6))
    assert moved.points.dtype == np.float64
    assert np.array_equal(cloud.points, before)
    assert moved.normals is None
    assert moved.viewpoint is None
