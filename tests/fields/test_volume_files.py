"""Volumes from files: what was written is read, and what is wrong is said with the file's name."""

import sys
import zipfile

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.fields.volume import VolumeField
from fieldalign.fields.volume_files import read_volume

nrrd = pytest.importorskip("nrrd")

ORIGIN, SPACING = np.array([10.0, -20, 5e6]), np.array([0.5, 0.25, 1.0])


@pytest.fixture
def values(rng):
    """A slanting plane, (7, 8, 9)."""
    i, j, k = np.indices((7, 8, 9))
    return (0.6 * SPACING[0] * i + 0.8 * SPACING[1] * j - 2.3 + 0.01 * k).astype(np.float32)


@pytest.fixture
def places(rng):
    return ORIGIN + SPACING * rng.uniform(-2, 10, (200, 3))


def same(one, other, places):
    return all(np.array_equal(a, b) for a, b in zip(one.sample(places), other.sample(places), strict=True))


def test_npz_with_all_that_a_volume_has(tmp_path, values, places):
    given = {"origin": ORIGIN, "spacing": SPACING, "truncation": 1.5, "signed": True, "seen": values < 3}
    np.savez(tmp_path / "a.npz", values=values, **given)
    field = read_volume(tmp_path / "a.npz")
    assert same(field, VolumeField(values, **given), places)
    assert field.signed is True


def test_npz_with_the_values_alone(tmp_path, values, places):
    np.savez_compressed(tmp_path / "a.NPZ", values=values)
    (tmp_path / "a.NPZ.npz").rename(tmp_path / "a.NPZ")
    assert same(read_volume(str(tmp_path / "a.NPZ")), VolumeField(values), places)


@pytest.mark.parametrize("suffix", ["nrrd", "nhdr"])
@pytest.mark.parametrize("encoding", ["raw", "gzip", "ascii"])
def test_nrrd(tmp_path, values, places, suffix, encoding):
    header = {"space origin": ORIGIN, "space directions": np.diag(SPACING), "encoding": encoding, "space dimension": 3}
    nrrd.write(str(tmp_path / f"a.{suffix}"), values, header)
    assert same(read_volume(tmp_path / f"a.{suffix}"), VolumeField(values, ORIGIN, SPACING), places)


def test_nrrd_with_spacings_only(tmp_path, values, places):
    nrrd.write(str(tmp_path / "a.nrrd"), values, {"spacings": SPACING})
    assert same(read_volume(tmp_path / "a.nrrd"), VolumeField(values, spacing=SPACING), places)


def test_nrrd_with_axes_in_another_order_and_back_to_front(tmp_path, values, places):
    """As medical scanners write them: the second axis runs along x, the third against y, and the first against z."""
    stored = np.transpose(values, (2, 0, 1))[::-1, :, ::-1]
    directions = np.zeros((3, 3))
    directions[1, 0], directions[2, 1], directions[0, 2] = SPACING * [1, -1, -1]
    first = ORIGIN + SPACING * [0, values.shape[1] - 1, values.shape[2] - 1]
    nrrd.write(str(tmp_path / "a.nrrd"), stored, {"space origin": first, "space directions": directions})
    assert same(read_volume(tmp_path / "a.nrrd"), VolumeField(values, ORIGIN, SPACING), places)


# --------------------------------------------------------------------------------------------------------------- errors


def refused(path, words):
    with pytest.raises(fa.CloudFileError, match=words) as raised:
        read_volume(path)
    assert str(path) in str(raised.value)


@pytest.mark.parametrize(
    ("arrays", "words"),
    [
        ({"sdf": np.zeros((3, 3, 3))}, "must hold the array 'values', .* but holds sdf"),
        ({"values": np.zeros((3, 3, 3)), "weight": 1}, "may hold origin, spacing, .* but holds values, weight"),
        ({}, "but holds none"),
        ({"values": np.zeros((3, 3))}, r"but have shape \(3, 3\)"),
        ({"values": np.zeros((3, 3, 3))}, "differ from place to place"),
        ({"values": np.array([None])}, "never loaded"),
        ({"values": np.eye(3), "truncation": [1, 2]}, "cannot be read as .npz"),
    ],
)
def test_an_npz_that_holds_no_volume(tmp_path, arrays, words):
    np.savez(tmp_path / "a.npz", **arrays)
    refused(tmp_path / "a.npz", words)


def test_files_that_are_no_volume(tmp_path):
    for name in ("a.npz", "a.nrrd", "b.vdb", "a.tif"):
        (tmp_path / name).write_bytes(b"nothing like it\n")
    refused(tmp_path / "a.npz", "cannot be read as .npz: File is not a zip file")
    refused(tmp_path / "a.nrrd", "cannot be read as .nrrd")
    refused(tmp_path / "b.vdb", "is an OpenVDB file, which is not read here.*numpy.savez")
    refused(tmp_path / "a.tif", "has the suffix '.tif', but .* read from .npz, .nrrd, .nhdr, .vdb")
    refused(tmp_path / "none.npz", "does not exist")


def test_promises_are_not_believed(tmp_path, values):
    np.savez(tmp_path / "a.npz", values=values)
    with zipfile.ZipFile(tmp_path / "a.npz") as archive:
        content = archive.read("values.npy")
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("values.npy", content.replace(b"(7, 8, 9), }      ", b"(70000, 80000, 9),}"[:18]))
    refused(tmp_path / "a.npz", "promises|cannot be read")
    nrrd.write(str(tmp_path / "a.nrrd"), values, {"spacings": SPACING, "encoding": "raw"})
    written = (tmp_path / "a.nrrd").read_bytes()
    (tmp_path / "a.nrrd").write_bytes(written.replace(b"sizes: 7 8 9", b"sizes: 70000 80000 90000"))
    refused(tmp_path / "a.nrrd", "Size of the data does not equal")


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ({"space directions": [[0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1]]}, "must have axes along those of space"),
        ({"space directions": [[1, 0, 0], [1, 0, 0], [0, 0, 1]]}, "must have axes along those of space"),
        ({"space directions": [[1.0, 0], [0, 1], [0, 0]]}, "must have axes along those of space"),
        ({}, "must have 'space directions' or 'spacings', but has neither"),
    ],
)
def test_nrrd_in_a_space_that_no_volume_has(tmp_path, values, header, words):
    nrrd.write(str(tmp_path / "a.nrrd"), values, {key: np.array(value) for key, value in header.items()})
    refused(tmp_path / "a.nrrd", words)


def test_nrrd_of_vectors(tmp_path, values):
    nrrd.write(str(tmp_path / "a.nrrd"), np.stack([values, values]))
    refused(tmp_path / "a.nrrd", "must hold a volume of three axes")


def test_without_pynrrd_the_extra_is_named(tmp_path, values, monkeypatch):
    nrrd.write(str(tmp_path / "a.nrrd"), values)
    monkeypatch.setitem(sys.modules, "nrrd", None)
    with pytest.raises(fa.MissingExtraError, match=r"fieldalign\[volume\]"):
        read_volume(tmp_path / "a.nrrd")
