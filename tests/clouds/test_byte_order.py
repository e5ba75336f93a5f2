"""Files and arrays of machines of the other byte order give the same bits as those of this one."""

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.fields.files import read_field
from fieldalign.motions import apply, exp_twist

TWIST = np.array([0.2, -0.1, 0.3, 0.1, 0.2, -0.1])


@pytest.fixture
def cloud(corner):
    """Of every kind of number that a file may hold per point."""
    n = np.arange(1000)
    return {
        "points": corner[:1000], "normals": np.eye(3)[n % 3].astype(np.float32), "times": n / 1000,
        "intensity": n.astype(np.uint16), "colors": np.tile(n.astype(np.uint8)[:, None], 3),
    }


def swapped(array):
    return array.astype(array.dtype.newbyteorder("S"))


def same(one, other):
    for part in ("points", "normals", "times", "intensity", "colors"):
        assert np.array_equal(getattr(one, part), getattr(other, part)), part


@pytest.mark.parametrize("suffix", [".ply", ".pcd", ".xyz", ".csv", ".npz", ".bin", ".las", ".laz", ".e57"])
def test_a_cloud_of_swapped_arrays_is_written_the_same(cloud, suffix, tmp_path):
    pytest.importorskip({".las": "laspy", ".laz": "lazrs", ".e57": "pye57"}.get(suffix, "numpy"))
    for name, parts in (("a", cloud), ("b", {part: swapped(values) for part, values in cloud.items()})):
        fa.write_cloud(tmp_path / f"{name}{suffix}", fa.PointCloud(**parts))
    here, there = (fa.read_cloud(tmp_path / f"{name}{suffix}") for name in "ab")
    assert np.array_equal(here.points, there.points)
    if suffix != ".bin":
        assert np.array_equal(here.normals, there.normals)
        assert np.array_equal(here.times, there.times)
        assert np.array_equal(here.intensity, there.intensity)


def test_a_structured_npy_and_an_npz(cloud, tmp_path):
    np.savez(tmp_path / "a.npz", **{part: swapped(values) for part, values in cloud.items()})
    same(fa.read_cloud(tmp_path / "a.npz"), fa.PointCloud(**cloud))
    rows = np.zeros(1000, [("x", ">f8"), ("y", ">f8"), ("z", ">f8"), ("intensity", ">u2")])
    rows["x"], rows["y"], rows["z"] = cloud["points"].T
    rows["intensity"] = cloud["intensity"]
    np.save(tmp_path / "a.npy", rows)
    read = fa.read_cloud(tmp_path / "a.npy")
    assert np.array_equal(read.points, cloud["points"])
    assert np.array_equal(read.intensity, cloud["intensity"])


@pytest.mark.parametrize("encoding", ["raw", "gzip"])
def test_a_volume(encoding, tmp_path):
    nrrd = pytest.importorskip("nrrd")
    values = np.add.outer(np.add.outer(np.arange(5.0), np.arange(6)), np.arange(7)) - 7.3
    for kind, name in (("<f8", "a"), (">f8", "b")):
        endian = {"endian": "little" if kind[0] == "<" else "big"}
        header = {"spacings": [1, 1, 1], "encoding": encoding} | endian
        nrrd.write(str(tmp_path / f"{name}.nrrd"), values.astype(kind), header)
        np.savez(tmp_path / f"{name}.npz", values=values.astype(kind), spacing=np.ones(3, kind))
    assert b"endian: big" in (tmp_path / "b.nrrd").read_bytes()[:600]
    places = np.random.default_rng(0).uniform(0, 5, (100, 3))
    expected = fa.fields.VolumeField(values, spacing=np.ones(3)).sample(places)
    for name in ("a.nrrd", "b.nrrd", "a.npz", "b.npz"):
        found = read_field(tmp_path / name).sample(places)
        assert all(np.array_equal(one, other) for one, other in zip(found, expected, strict=True)), name


@pytest.mark.parametrize("kind", ["f8", "f4"])
@pytest.mark.parametrize("method", ["robust", "paper"])
def test_a_registration(corner, method, kind):
    source, target = corner[::2].astype(kind), apply(exp_twist(TWIST), corner[1::2]).astype(kind)
    here = fa.register(source, target, method=method)
    there = fa.register(swapped(source), swapped(target), method=method)
    assert np.array_equal(here.T_target_source, there.T_target_source)
    assert np.array_equal(here.information, there.information)
