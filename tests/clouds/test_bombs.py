"""Small files that would take a large memory, or no end: refused at once, whatever their format unpacks with."""

import bz2
import gzip
import io
import struct
import time
import tracemalloc
import zipfile

import numpy as np
import pytest

from fieldalign import CloudFileError, read_cloud
from fieldalign.clouds import formats
from fieldalign.clouds.cloud import PointCloud
from fieldalign.clouds.files import write_cloud
from fieldalign.fields.volume_files import read_volume

NRRD = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nspacings: 1 1 1\n"


@pytest.fixture
def small(monkeypatch):
    """The bound on what any file may unpack to, a hundred times smaller than it is: the bombs may be, too."""
    monkeypatch.setattr(formats, "UNPACKED", formats.UNPACKED // 100)


def refused(path, read=read_cloud, megabytes=8.0):
    begun = time.process_time()
    tracemalloc.start()
    with pytest.raises(CloudFileError) as caught:
        read(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert time.process_time() - begun < 1
    assert peak < megabytes * 1e6
    assert str(path) in str(caught.value)
    return str(caught.value)


def npy(shape, descr="<f8"):
    file = io.BytesIO()
    np.lib.format.write_array_header_1_0(file, {"descr": descr, "fortran_order": False, "shape": shape})
    return file.getvalue()


def test_an_npz_that_unpacks_to_a_thousand_times_its_size(small, tmp_path):
    np.savez_compressed(tmp_path / "a.npz", points=np.zeros((200_000, 3)))
    assert "more than 100 times" in refused(tmp_path / "a.npz")


def test_the_members_of_an_npz_that_share_their_bytes_count_each(small, tmp_path):
    """A zip's directory may name one piece of compressed data any number of times."""
    with zipfile.ZipFile(tmp_path / "a.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("points.npy", npy((100_000, 1)) + bytes(800_000))
        one = archive.infolist()[0]
        for k in range(5):
            again = zipfile.ZipInfo(f"part{k}.npy")
            for name in ("compress_type", "CRC", "compress_size", "file_size", "header_offset"):
                setattr(again, name, getattr(one, name))
            archive.filelist.append(again)
    assert "6 members" in refused(tmp_path / "a.npz")


def test_an_npz_of_constant_numbers_is_no_bomb(tmp_path):
    np.savez_compressed(tmp_path / "a.npz", points=np.zeros((200_000, 3)))
    assert len(read_cloud(tmp_path / "a.npz")) == 200_000


@pytest.mark.parametrize(
    ("shape", "descr"),
    [((0, 10**12), "<f8"), ((10**9, 3), "|S0"), ((10**9, 3), "|V0"), ((10**18,), "<U0"), ((1, 10**9), "|S0"),
     ((10**9,), [("x", "|S0"), ("y", "|S0"), ("z", "|S0")])],
)
def test_an_npy_without_bytes_holds_no_rows(shape, descr, tmp_path):
    (tmp_path / "a.npy").write_bytes(npy(shape, descr) + bytes(8))
    refused(tmp_path / "a.npy")


def test_a_table_of_more_columns_than_any_scan_has(tmp_path):
    np.save(tmp_path / "a.npy", np.zeros((1, 10_001), np.float32))
    assert "at most 10000" in refused(tmp_path / "a.npy")
    np.save(tmp_path / "b.npy", np.zeros((3, 10_000), np.float32))
    assert len(read_cloud(tmp_path / "b.npy").attributes) == 9996


def test_a_laz_of_one_point_again_and_again(small, tmp_path):
    pytest.importorskip("laspy")
    write_cloud(tmp_path / "a.laz", PointCloud(np.tile([1.0, 2, 3], (200_000, 1))))
    assert "200000 points" in refused(tmp_path / "a.laz")


@pytest.mark.parametrize("encoding", ["gzip", "bzip2"])
def test_a_volume_that_unpacks_without_end(encoding, small, tmp_path):
    pytest.importorskip("nrrd")
    packed = (gzip if encoding == "gzip" else bz2).compress(bytes(20_000_000))
    (tmp_path / "a.nrrd").write_bytes(f"{NRRD}encoding: {encoding}\n\n".encode() + packed)
    assert "a volume" in refused(tmp_path / "a.nrrd", read_volume)


@pytest.mark.parametrize("name", ["/dev/zero", "../other.raw", "sub/other.raw", ".", "gone.raw", "LIST"])
def test_a_volume_has_its_data_beside_its_header(name, tmp_path):
    pytest.importorskip("nrrd")
    (tmp_path / "in").mkdir()
    (tmp_path / "other.raw").write_bytes(bytes(8))
    (tmp_path / "in" / "a.nhdr").write_text(f"{NRRD}encoding: raw\ndata file: {name}\n")
    assert "in a file of its own folder" in refused(tmp_path / "in" / "a.nhdr", read_volume)


def test_lines_that_a_volume_skips_end_with_its_file(tmp_path):
    nrrd = pytest.importorskip("nrrd")
    values = np.arange(27.0).reshape(3, 3, 3) - 9
    nrrd.write(str(tmp_path / "a.nrrd"), values, {"spacings": [1, 1, 1], "encoding": "gzip"})
    head, _, data = (tmp_path / "a.nrrd").read_bytes().partition(b"\n\n")
    (tmp_path / "a.nrrd").write_bytes(head + b"\nline skip: 2\n\nskipped\nskipped\n" + data)
    assert read_volume(tmp_path / "a.nrrd").sample(np.ones((1, 3))).value == abs(values[1, 1, 1])
    (tmp_path / "a.nrrd").write_bytes(head + b"\nline skip: 1000000000000\n\n" + data)
    refused(tmp_path / "a.nrrd", read_volume)


# ------------------------------------------------------------------------------------------------------- the XML of E57

DECLARED = "".join(
    f"<!ELEMENT {name} ANY><!ATTLIST {name} type CDATA #IMPLIED xmlns CDATA #IMPLIED allowHeterogeneousChildren CDATA "
    "#IMPLIED>"
    for name in ("e57Root", "formatName", "guid", "versionMajor", "versionMinor", "data3D")
)
LAUGHS = "".join(f'<!ENTITY e{k} "{f"&e{k - 1};" * 10 if k else "ha"}">' for k in range(12))


@pytest.fixture
def e57(crc32c):
    """Makes a file that holds nothing but a text (bytes)."""
    pytest.importorskip("pye57")
    return lambda xml: _e57(xml, crc32c)


def _e57(xml, crc32c):
    pages = -(-(48 + len(xml)) // 1020)
    head = struct.pack("<8sIIQQQQ", b"ASTM-E57", 1, 0, 1024 * pages, 48, len(xml), 1024)
    text = (head + xml).ljust(1020 * pages, b"\0")
    parts = [text[at : at + 1020] for at in range(0, len(text), 1020)]
    return b"".join(part + struct.pack(">I", crc32c(part)) for part in parts)


def e57_text(guid, doctype="", mark=""):
    return (
        f'{mark}<?xml version="1.0" encoding="UTF-8"?>{doctype}'
        '<e57Root type="Structure" xmlns="http://www.astm.org/COMMIT/E57/2010-e57-v1.0">'
        '<formatName type="String"><![CDATA[ASTM E57 3D Imaging Data File]]></formatName>'
        f'<guid type="String">{guid}</guid><versionMajor type="Integer">1</versionMajor>'
        '<versionMinor type="Integer">0</versionMinor>'
        '<data3D type="Vector" allowHeterogeneousChildren="1"></data3D></e57Root>'
    )


@pytest.mark.parametrize(
    "entities", [LAUGHS, '<!ENTITY e11 SYSTEM "file:///etc/passwd">'], ids=["a billion laughs", "another file"]
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_an_e57_whose_text_declares_entities(entities, encoding, e57, tmp_path):
    text = e57_text("&e11;", f"<!DOCTYPE e57Root [{DECLARED}{entities}]>")
    (tmp_path / "a.e57").write_bytes(e57(text.encode(encoding)))
    assert "its XML has a document type" in refused(tmp_path / "a.e57")


@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_an_e57_with_plain_text_is_read(mark, e57, tmp_path):
    (tmp_path / "a.e57").write_bytes(e57(e57_text("any", mark=mark).encode()))
    assert "holds 0" in refused(tmp_path / "a.e57")


def test_an_e57_whose_text_has_no_end(e57, tmp_path):
    data = bytearray(e57(e57_text("any").encode()))
    data[32:40] = struct.pack("<Q", 2**62)
    (tmp_path / "a.e57").write_bytes(data)
    assert "its XML" in refused(tmp_path / "a.e57")
