"""ShapeNetCore v2 in its layout, and the meshes that stand in for it."""

import pickle

import numpy as np
import pytest

from fieldalign.errors import DataSetError
from fieldalign.experiments.data_sets import shapenet


@pytest.fixture
def core(tmp_path, write_obj):
    for synset, name in (("02691156", "1a2b"), ("04379243", "ff00"), ("04379243", "0a0b"), ("04256520", "0a0b")):
        write_obj(tmp_path / "ShapeNetCore.v2" / synset / name / "models" / "model_normalized.obj")
    (tmp_path / "ShapeNetCore.v2" / "taxonomy.json").write_text("[]")
    return tmp_path


def test_the_unseen_categories_by_id(core, tetrahedron):
    for folder in (core, core / "ShapeNetCore.v2"):
        shapes = shapenet.shapes(folder)
        assert [s.category for s in shapes] == ["sofa", "table", "table"]
        assert [s.name for s in shapes] == ["04256520/0a0b", "04379243/0a0b", "04379243/ff00"]
    stored = pickle.loads(pickle.dumps(shapes[0])).read()
    assert np.array_equal(stored.points, tetrahedron[0])
    assert np.array_equal(stored.triangles, tetrahedron[1])


def test_categories_by_name_and_id(core):
    assert [s.name for s in shapenet.shapes(core, ["airplane"])] == ["02691156/1a2b"]
    assert len(shapenet.shapes(core, ["02691156", "sofa"])) == 2
    with pytest.raises(DataSetError, match="holds no shapes of the categories mug, but of airplane, sofa, table"):
        shapenet.shapes(core, ["mug"])


def test_the_categories():
    assert len(shapenet.CATEGORIES) == len(set(shapenet.CATEGORIES.values())) == 55
    assert list(shapenet.CATEGORIES) == sorted(shapenet.CATEGORIES)
    assert len(shapenet.UNSEEN) == 12


def test_a_folder_without_it(tmp_path):
    with pytest.raises(DataSetError, match=r"holds nothing of ShapeNetCore v2; looked for ShapeNetCore\.v2 \("):
        shapenet.shapes(tmp_path)


def test_meshes_stand_in_in_natural_order(tmp_path, write_obj):
    for name in ("10", "9", "2"):
        write_obj(tmp_path / "meshes" / f"{name}.obj")
    shapes = shapenet.shapes(tmp_path)
    assert [s.name for s in shapes] == ["2", "9", "10"]
    assert {s.category for s in shapes} == {"procedural"}


def test_the_part(data):
    shapes = shapenet.shapes(data)
    assert len(shapes) == 100
    assert all(shape.sample(100, seed=1).shape == (100, 3) for shape in shapes[::10])
