"""Shapes: what PointNetLK makes of their points, and what is drawn from their surfaces."""

import pickle
from functools import partial

import numpy as np
import pytest
from scipy.stats import chisquare

from fieldalign.errors import ArgumentError, CloudFileError, DataSetError
from fieldalign.experiments.data_sets.shapes import Shape, Stored, mesh_in


def shape_of(points, triangles=None):
    return Shape("cat", "cat_1", partial(Stored, np.array(points, float), triangles))


def test_vertices_come_on_the_unit_cube(tetrahedron):
    """The longest edge of the bounding box, 4, becomes 1, and the mean of the vertices, not the box's middle, 0."""
    corners, faces = tetrahedron
    expected = corners / 4 - [0.25, 0.125, 0.0625]
    assert np.allclose(shape_of(corners, faces).vertices(), expected, atol=1e-15)
    assert np.allclose(shape_of(1000 * corners + [5, -3, 9], faces).vertices(), expected, atol=1e-12)


def test_the_stored_points_are_not_changed(tetrahedron):
    shape = shape_of(*tetrahedron)
    shape.vertices()
    assert np.array_equal(shape.read().points, tetrahedron[0])


def test_drawn_points_lie_on_the_faces_by_their_areas(tetrahedron):
    corners, faces = tetrahedron
    shape = shape_of(corners, faces)
    x = 4 * (shape.sample(20000, seed=3) + [0.25, 0.125, 0.0625])
    offsets = np.abs(np.c_[x[:, 2], x[:, 1], x[:, 0], x @ [0.25, 0.5, 1] - 1])  # from each face's plane, by a factor
    assert offsets.min(axis=1).max() < 1e-12
    assert (x > -1e-12).all()
    assert (x @ [0.25, 0.5, 1] < 1 + 1e-12).all()
    areas = np.linalg.norm(np.cross(*(corners[faces[:, k]] - corners[faces[:, 0]] for k in (1, 2))), axis=1)
    counts = np.bincount(offsets.argmin(axis=1), minlength=4)
    assert chisquare(counts, 20000 * areas / areas.sum()).pvalue > 1e-3
    thirds = x[offsets.argmin(axis=1) == 0] / [4, 2, 1]  # within a face evenly: a third of its corners' sum
    assert np.allclose(thirds.mean(axis=0)[:2], 1 / 3, atol=0.01)


def test_a_seed_draws_the_same_points_always(tetrahedron, rng):
    for shape in (shape_of(*tetrahedron), shape_of(rng.normal(size=(500, 3)))):
        assert np.array_equal(shape.sample(100, seed=5), shape.sample(100, seed=5))
        assert not np.array_equal(shape.sample(100, seed=5), shape.sample(100, seed=6))


def test_of_a_cloud_points_are_drawn_once_each(rng):
    shape = shape_of(rng.normal(size=(500, 3)))
    drawn = shape.sample(400, seed=0)
    rows = {tuple(row) for row in shape.vertices()}
    assert len({tuple(row) for row in drawn}) == 400
    assert all(tuple(row) in rows for row in drawn)
    assert len(np.unique(shape.sample(500, seed=1), axis=0)) == 500
    with pytest.raises(DataSetError, match="cat_1 has 500 points, from which 501 cannot be drawn"):
        shape.sample(501, seed=0)


@pytest.mark.parametrize("count", [0, -1, 2.5, True])
def test_counts_that_are_none(count, tetrahedron):
    with pytest.raises(ArgumentError, match="count must be an integer of at least 1"):
        shape_of(*tetrahedron).sample(count, seed=0)


@pytest.mark.parametrize(
    "points", [[], [[1, 2, 3]], [[1, 2, 3]] * 5, [[0, 0, 0], [1, 1, np.nan]], [[0, 0, 0], [1, 1, np.inf]]]
)
def test_points_that_make_no_shape(points):
    with pytest.raises(DataSetError, match="cat_1 must have points that are finite and differ"):
        shape_of(np.reshape(points, (-1, 3))).vertices()


def test_faces_that_make_no_surface(tetrahedron):
    corners, _ = tetrahedron
    for faces in ([[0, 1, 4]], [[0, 1, -1]]):
        with pytest.raises(DataSetError, match="cat_1 has 4 vertices, but faces of others"):
            shape_of(corners, np.array(faces)).sample(1, seed=0)
    flat = shape_of(corners, np.array([[0, 0, 1]]))
    assert len(flat.vertices()) == 4
    with pytest.raises(DataSetError, match="cat_1 has no triangle with an area"):
        flat.sample(1, seed=0)


def test_a_face_without_an_area_draws_nothing(tetrahedron):
    corners, _ = tetrahedron
    flat_first = shape_of(corners, np.array([[0, 0, 1], [0, 1, 2], [3, 3, 3]]))
    x = 4 * (flat_first.sample(1000, seed=0) + [0.25, 0.125, 0.0625])
    assert np.abs(x[:, 2]).max() < 1e-12


def test_a_mesh_of_points_alone_is_a_cloud(rng):
    shape = shape_of(rng.normal(size=(50, 3)), np.empty((0, 3), int))
    assert shape.sample(10, seed=0).shape == (10, 3)


def test_meshes_travel_to_other_processes_unread(tmp_path, write_off):
    file = tmp_path / "a.off"
    shape = pickle.loads(pickle.dumps(Shape("cat", "a", partial(mesh_in, file))))
    with pytest.raises(CloudFileError, match=r"a\.off does not exist"):
        shape.vertices()
    write_off(file)
    assert len(shape.vertices()) == 4


def test_a_truncated_mesh_is_told(tmp_path, write_off):
    file = tmp_path / "a.off"
    write_off(file)
    text = file.read_text()
    for kept in range(len(text) - 2):
        file.write_text(text[:kept])
        with pytest.raises(CloudFileError, match=r"a\.off "):
            Shape("cat", "a", partial(mesh_in, file)).vertices()
