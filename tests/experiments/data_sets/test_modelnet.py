"""ModelNet40 in each of its layouts, written and read back; and the part of it that comes with the project."""

import pickle

import numpy as np
import pytest

from fieldalign.errors import ArgumentError, CloudFileError, DataSetError, MissingExtraError
from fieldalign.experiments.data_sets import modelnet

TRAIN, TEST = ["airplane_0002", "vase_0001"], ["vase_0100", "vase_0020", "xbox_0104", "airplane_0627"]


def in_off(root, write_off):
    """Some in ModelNet's broken way: no line end after OFF."""
    for k, name in enumerate(TRAIN + TEST):
        split = "train" if name in TRAIN else "test"
        write_off(root / name.rpartition("_")[0] / split / f"{name}.off", k + 1, "OFF" if k % 2 else "OFF\n")


def in_text(root, rng):
    root.mkdir()
    for names, split in ((TRAIN, "train"), (TEST, "test")):
        (root / f"modelnet40_{split}.txt").write_text("\n".join(names) + "\n\n")
        for name in names:
            folder = root / name.rpartition("_")[0]
            folder.mkdir(exist_ok=True)
            np.savetxt(folder / f"{name}.txt", rng.uniform(-1, 1, (50, 6)), fmt="%.6f", delimiter=",")
    (root / "modelnet40_shape_names.txt").write_text("airplane\nvase\nxbox\n")


def in_hdf5(root, rng):
    h5py = pytest.importorskip("h5py")
    root.mkdir()
    (root / "shape_names.txt").write_text("airplane\nvase\nxbox\n")
    for split, labels in (("train", [[0, 1]]), ("test", [[1, 2, 0], [1]])):
        names = [f"ply_data_{split}{k}.h5" for k in range(len(labels))]
        (root / f"{split}_files.txt").write_text("".join(f"data/modelnet40_ply_hdf5_2048/{name}\n" for name in names))
        for name, row in zip(names, labels, strict=True):
            with h5py.File(root / name, "w") as file:
                file["data"] = rng.uniform(-1, 1, (len(row), 30, 3)).astype(np.float32)
                file["label"] = np.array(row, np.uint8)[:, None]


LAYOUTS = {"ModelNet40": in_off, "modelnet40_normal_resampled": in_text, "modelnet40_ply_hdf5_2048": in_hdf5}


@pytest.fixture(params=LAYOUTS)
def placed(request, tmp_path, write_off, rng):
    """The set in one of its layouts: the folder that holds it, and its own."""
    root = tmp_path / request.param
    LAYOUTS[request.param](root, write_off if request.param == "ModelNet40" else rng)
    return tmp_path, root


def names_of(shapes):
    return [shape.name for shape in shapes]


def test_the_unseen_shapes_of_each_layout(placed):
    for folder in placed:
        shapes = modelnet.shapes(folder)
        assert [shape.category for shape in shapes] == ["vase", "vase", "xbox"]
        assert len(set(names_of(shapes))) == 3
        assert all(np.isclose(np.ptp(shape.vertices(), axis=0).max(), 1) for shape in shapes)


def test_splits_and_categories_of_each_layout(placed):
    _, root = placed
    every = modelnet.shapes(root, ["airplane", "vase", "xbox"], split="all")
    assert [shape.category for shape in every] == ["airplane"] * 2 + ["vase"] * 3 + ["xbox"]
    train = modelnet.shapes(root, ["vase"], split="train")
    assert len(train) == 1
    assert train[0].name in names_of(every)
    assert names_of(modelnet.shapes(root, ["airplane"], split="test")) != names_of(
        modelnet.shapes(root, ["airplane"], split="train")
    )
    with pytest.raises(DataSetError, match="holds no shapes of the categories door, but of airplane, vase"):
        modelnet.shapes(root, ["door"])


def test_what_each_layout_holds_is_what_is_read(placed):
    """By the distances between points, which are those of the file but for one factor."""
    _, root = placed
    for shape in modelnet.shapes(root, split="all"):
        again = pickle.loads(pickle.dumps(shape))
        assert np.array_equal(again.vertices(), shape.vertices())
        assert np.array_equal(again.sample(20, seed=4), shape.sample(20, seed=4))


def test_meshes_come_by_category_and_number(tmp_path, write_off, tetrahedron):
    in_off(tmp_path, write_off)
    assert names_of(modelnet.shapes(tmp_path)) == ["vase_0020", "vase_0100", "xbox_0104"]
    for shape in modelnet.shapes(tmp_path, split="all"):
        assert np.array_equal(shape.read().triangles, tetrahedron[1])
    assert np.array_equal(modelnet.shapes(tmp_path)[0].read().points, 4 * tetrahedron[0])


def test_without_unseen_categories_all_come(tmp_path, write_off):
    write_off(tmp_path / "bathtub" / "test" / "bathtub_0107.off")
    write_off(tmp_path / "airplane" / "test" / "airplane_0627.off")
    assert names_of(modelnet.shapes(tmp_path)) == ["airplane_0627", "bathtub_0107"]


def test_points_of_the_text_layout(tmp_path, rng):
    in_text(tmp_path / "set", rng)
    shape = modelnet.shapes(tmp_path / "set")[0]
    table = np.loadtxt(tmp_path / "set" / "vase" / "vase_0020.txt", delimiter=",")
    assert shape.name == "vase_0020"
    assert np.array_equal(shape.read().points, table[:, :3])
    (tmp_path / "set" / "vase" / "vase_0020.txt").unlink()
    with pytest.raises(CloudFileError, match=r"vase_0020\.txt does not exist"):
        shape.vertices()


def test_points_of_the_hdf5_layout(tmp_path, rng):
    in_hdf5(tmp_path / "set", rng)
    import h5py

    shapes = modelnet.shapes(tmp_path / "set")
    assert names_of(shapes) == ["vase_ply_data_test0_0", "vase_ply_data_test1_0", "xbox_ply_data_test0_1"]
    with h5py.File(tmp_path / "set" / "ply_data_test0.h5") as file:
        assert np.array_equal(shapes[2].read().points, file["data"][1].astype(float))
    (tmp_path / "set" / "shape_names.txt").write_text("airplane\n")
    with pytest.raises(DataSetError, match=r"has labels from 0 to 2, but shape_names\.txt has 1 names"):
        modelnet.shapes(tmp_path / "set")
    (tmp_path / "set" / "ply_data_test0.h5").write_bytes(b"no HDF5")
    with pytest.raises(DataSetError, match=r"ply_data_test0\.h5 cannot be read as an \.h5"):
        modelnet.shapes(tmp_path / "set")


def test_an_hdf5_that_would_fill_the_memory(tmp_path, rng):
    h5py = pytest.importorskip("h5py")
    in_hdf5(tmp_path / "set", rng)
    with h5py.File(tmp_path / "set" / "ply_data_test0.h5", "w") as file:
        file.create_dataset("label", (10**12, 1), "u1", chunks=(10**6, 1), compression="gzip")
    with pytest.raises(DataSetError, match="an array 'label', 1000000000000 bytes of"):
        modelnet.shapes(tmp_path / "set")


def test_without_h5py_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "h5py", None)
    (tmp_path / "test_files.txt").write_text("a.h5\n")
    (tmp_path / "shape_names.txt").write_text("vase\n")
    with pytest.raises(MissingExtraError, match=r"reading a\.h5 needs the extra 'hdf5'"):
        modelnet.shapes(tmp_path)


def test_a_folder_without_it(tmp_path):
    with pytest.raises(DataSetError) as caught:
        modelnet.shapes(tmp_path)
    message = str(caught.value)
    assert message.startswith(f"{tmp_path} holds nothing of ModelNet40; looked for ")
    assert all(layout in message for layout in ("ModelNet40 (", "normal_resampled", "hdf5_2048", "CATEGORY.npz"))
    with pytest.raises(DataSetError, match="nowhere is no folder"):
        modelnet.shapes(tmp_path / "nowhere")
    with pytest.raises(ArgumentError, match="split must be one of test, train, all, but is 'val'"):
        modelnet.shapes(tmp_path, split="val")


def test_the_unseen_half():
    assert len(set(modelnet.UNSEEN)) == 20
    assert sorted(modelnet.UNSEEN) == list(modelnet.UNSEEN)


def test_the_part(data):
    shapes = modelnet.shapes(data)
    assert [shape.category for shape in shapes] == ["airplane"] * 50 + ["bathtub"] * 25
    assert shapes[0].name == "airplane_0627"
    assert len({shape.name for shape in shapes}) == 75
    assert shapes[-1].vertices().shape == (10000, 3)
    assert shapes[60].sample(1000, seed=0).shape == (1000, 3)
    assert len(modelnet.shapes(data, ["bathtub"])) == 25
