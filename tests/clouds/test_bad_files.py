"""Files that are missing, truncated, foreign or that lie: one clear sentence, at once, without memory."""

import io
import re
import struct
import time
import tracemalloc
import zipfile
from contextlib import suppress
from pathlib import Path

import numpy as np
import pypcd4
import pytest

from fieldalign.clouds.cloud import PointCloud
from fieldalign.clouds.files import FORMATS, read_cloud, read_clouds, write_cloud
from fieldalign.errors import CloudFileError
from fieldalign.fields import read_field

RNG = np.random.default_rng(3)
CRASHERS = Path(__file__).with_name("crashers")
LIBRARIES = {".las": "laspy", ".laz": "laspy", ".e57": "pye57"}
TEXTS = [".xyz", ".txt", ".csv", ".obj"]
PNG = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x02\0\0\0\x02\x08\x02\0\0\0\xfd\xd4\x9as" + bytes(range(256)) * 4
TRILLION = 10**12
PLY_HEAD = b"property float x\nproperty float y\nproperty float z\nend_header\n"


def good_file(path):
    """A whole file of 100 points with intensity."""
    if path.suffix in LIBRARIES:
        pytest.importorskip(LIBRARIES[path.suffix])
    points = RNG.normal(size=(100, 3))
    if path.suffix == ".obj":
        path.write_text("".join("v {} {} {}\n".format(*row) for row in points.tolist()))
    elif path.suffix == ".stl":
        path.write_bytes(
            bytes(80) + struct.pack("<I", 33) + b"".join(p.tobytes() + b"\0\0" for p in RNG.random((33, 12), "f4"))
        )
    else:
        write_cloud(path, PointCloud(points, intensity=np.arange(100.0)))
    assert len(read_cloud(path)) > 90
    return path


def refused(path, *, megabytes=2.0, seconds=0.5):
    """The message with which a file is refused, quickly and without memory."""
    with pytest.raises(CloudFileError):  # imports the libraries
        read_cloud(path)
    tracemalloc.start()
    start = time.perf_counter()
    with pytest.raises(CloudFileError) as caught:
        read_cloud(path)
    taken = time.perf_counter() - start
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert taken < seconds
    assert peak < megabytes * 1e6
    message = str(caught.value)
    assert message.startswith(str(path).partition("#")[0])
    assert "\n" not in message
    assert len(message) < 400
    return message


@pytest.mark.parametrize("read", [read_cloud, read_clouds], ids=["read_cloud", "read_clouds"])
@pytest.mark.parametrize("suffix", [*FORMATS, ".docx", ""])
def test_a_missing_file_a_folder_and_an_empty_file(suffix, read, tmp_path):
    path = tmp_path / f"scan{suffix}"
    with pytest.raises(CloudFileError, match=rf"{re.escape(str(path))} does not exist"):
        read(path)
    path.mkdir()
    with pytest.raises(CloudFileError, match="is a folder, not a file"):
        read(path)
    path.rmdir()
    path.touch()
    with pytest.raises(CloudFileError, match=r"is empty \(0 bytes\)" if suffix in FORMATS else "has the suffix"):
        read(path)


def test_an_unknown_suffix_names_the_known_ones(tmp_path):
    (tmp_path / "a.docx").write_bytes(b"PK")
    assert "has the suffix '.docx', but clouds are read from .ply, .pcd" in refused(tmp_path / "a.docx")


@pytest.mark.parametrize("suffix", [suffix for suffix in FORMATS if suffix not in TEXTS])
def test_a_truncated_file(suffix, tmp_path):
    path = good_file(tmp_path / f"whole{suffix}")
    data = path.read_bytes()
    for length in {
        1,
        2,
        3,
        7,
        20,
        60,
        90,
        150,
        230,
        376,
        400,
        len(data) // 2,
        len(data) * 9 // 10,
        len(data) - 1,
    }:
        if suffix != ".bin" or length % 16:
            cut = tmp_path / f"cut{suffix}"
            cut.write_bytes(data[:length])
            refused(cut)


def test_truncated_text_is_told_by_its_last_row(tmp_path):
    for suffix in TEXTS:
        path = good_file(tmp_path / f"whole{suffix}")
        text = path.read_text().rstrip()
        path.write_text(text[: text.rindex("," if suffix == ".csv" else " ")])
        refused(path)


def pcd_of_50_points(path, encoding):
    """Its points can be compressed, else pypcd4 writes them plainly."""
    points = np.zeros((50, 3), np.float32)
    points[:, 1] = np.arange(50)
    pypcd4.PointCloud.from_xyz_points(points).save(path, pypcd4.Encoding(encoding))
    assert np.array_equal(read_cloud(path).points, points)
    assert b"DATA " + encoding.encode() in path.read_bytes()
    return path.read_bytes()


@pytest.mark.parametrize("encoding", ["ascii", "binary", "binary_compressed"])
def test_a_truncated_pcd(encoding, tmp_path):
    data = pcd_of_50_points(tmp_path / "a.pcd", encoding)
    for length in (100, len(data) - 100, len(data) - 25):
        (tmp_path / "cut.pcd").write_bytes(data[:length])
        refused(tmp_path / "cut.pcd")


def test_a_truncated_ascii_ply(tmp_path):
    rows = "".join(f"{i} {i} {i}\n" for i in range(100, 150))
    for kept in (0, 5, 100, 500, len(rows) - 12):
        head = "ply\nformat ascii 1.0\nelement vertex 50\n" + PLY_HEAD.decode()
        (tmp_path / "cut.ply").write_text(head + rows[:kept])
        refused(tmp_path / "cut.ply")


def test_a_truncated_ascii_stl(tmp_path):
    facet = "facet normal 0 0 1\nouter loop\n" + "vertex 0 0 1\nvertex 0 1 0\nvertex 1 0 0\n" + "endloop\nendfacet\n"
    (tmp_path / "cut.stl").write_text("solid a\n" + facet * 5)
    assert "is truncated" in refused(tmp_path / "cut.stl")


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize(
    "content",
    [PNG, b"%PDF-1.4\nfoo bar\n" * 30, bytes(1000), b"\xff" * 1600],
    ids=["png", "pdf", "zeros", "ones"],
)
def test_foreign_content(suffix, content, tmp_path):
    if suffix in LIBRARIES:
        pytest.importorskip(LIBRARIES[suffix])
    path = tmp_path / f"foreign{suffix}"
    path.write_bytes(content)
    refused(path)


@pytest.mark.parametrize("suffix", [suffix for suffix in FORMATS if suffix != ".bin"])
@pytest.mark.parametrize("other", [".ply", ".pcd", ".npy", ".npz", ".e57", ".las"])
def test_a_file_of_another_format(suffix, other, tmp_path):
    if suffix not in (other, ".laz") or (suffix == ".laz" and other != ".las"):
        good = good_file(tmp_path / f"good{other}")
        refused(good.rename(tmp_path / f"renamed{suffix}"))


def lie(data, old, new):
    assert data.count(old) >= 1
    return data.replace(old, new)


@pytest.mark.parametrize("encoding", [b"ascii", b"binary_little_endian", b"binary_big_endian"])
@pytest.mark.parametrize("count", [TRILLION, 10**25, 2**63, 60, -1])
def test_a_ply_that_lies(encoding, count, tmp_path):
    body = b"element vertex %d\n" % count + PLY_HEAD + b"1 2 3\n" * 50
    (tmp_path / "a.ply").write_bytes(b"ply\nformat " + encoding + b" 1.0\n" + body)
    refused(tmp_path / "a.ply")
    before = b"element other %d\nproperty int a\nelement vertex 2\n" % count + PLY_HEAD + b"1 2 3\n" * 3
    (tmp_path / "b.ply").write_bytes(b"ply\nformat " + encoding + b" 1.0\n" + before)
    refused(tmp_path / "b.ply")


@pytest.mark.parametrize(
    "head",
    [
        b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nend_header\n1 2\n",
        b"ply\nformat ascii 1.0\nelement vertex 1\nproperty list uchar float x\nend_header\n1 2\n",
        b"ply\nformat ascii 1.0\nelement vertex 1\nproperty quad x\nend_header\n1 2\n",
        b"ply\nformat morse 1.0\nelement vertex 1\nproperty float x\nend_header\n1 2\n",
        b"ply\nproperty float x\nend_header\n",
        b"ply\nformat ascii 1.0\nelement face 0\nproperty float x\nend_header\n",
        b"ply\nformat ascii 1.0\nelement vertex many\nproperty float x\nend_header\n",
        b"ply\nformat ascii 1.0\nelement vertex 1\n" + PLY_HEAD + b"1 2 three\n",
        b"ply\nformat ascii 1.0\nelement vertex 2\n" + PLY_HEAD + b"1 2 3 \n\n\n      \n     ",
        b"ply" * 100_000,
    ],
)
def test_a_ply_that_makes_no_sense(head, tmp_path):
    (tmp_path / "a.ply").write_bytes(head)
    refused(tmp_path / "a.ply")


@pytest.mark.parametrize("encoding", ["ascii", "binary", "binary_compressed"])
def test_a_pcd_that_lies(encoding, tmp_path):
    data = pcd_of_50_points(tmp_path / "a.pcd", encoding)
    huge = lie(lie(data, b"POINTS 50", b"POINTS %d" % TRILLION), b"WIDTH 50", b"WIDTH %d" % TRILLION)
    lies = [
        huge,
        lie(data, b"WIDTH 50", b"WIDTH %d" % TRILLION),
        lie(data, b"POINTS 50", b"POINTS %d" % TRILLION),
    ]
    lies += [lie(data, b"COUNT 1 1 1", b"COUNT 1 1 %d" % TRILLION), lie(data, b"HEIGHT 1", b"HEIGHT 0")]
    lies += [
        lie(data, b"SIZE 4 4 4", b"SIZE 4 4 3"),
        lie(data, b"FIELDS x y z", b"FIELDS x y"),
        lie(data, b"TYPE F", b"TYPE Q"),
    ]
    if encoding == "binary_compressed":
        start = data.index(b"compressed\n") + len(b"compressed\n")
        lies += [data[:start] + struct.pack("<II", 600, size) + data[start + 8 :] for size in (0xFFFFFFFF, 0, 1)]
        packed = lie(lie(data, b"POINTS 50", b"POINTS 200000000"), b"WIDTH 50", b"WIDTH 200000000")
        lies += [packed[:start] + struct.pack("<II", 600, 2_400_000_000) + packed[start + 8 :]]
    for content in lies:
        (tmp_path / "lie.pcd").write_bytes(content)
        refused(tmp_path / "lie.pcd")


def npy_header(shape, descr="<f8"):
    file = io.BytesIO()
    np.lib.format.write_array_header_1_0(file, {"descr": descr, "fortran_order": False, "shape": shape})
    return file.getvalue()


HUGE_SHAPES = [(TRILLION, 3), (10**25, 3), (40, 3), (-1, 3)]


@pytest.mark.parametrize("shape", HUGE_SHAPES)
def test_an_npy_that_lies(shape, tmp_path):
    (tmp_path / "a.npy").write_bytes(npy_header(shape) + bytes(240))
    refused(tmp_path / "a.npy")


@pytest.mark.parametrize("shape", HUGE_SHAPES)
@pytest.mark.parametrize("compression", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
def test_an_npz_whose_array_lies(shape, compression, tmp_path):
    with zipfile.ZipFile(tmp_path / "a.npz", "w", compression) as archive:
        archive.writestr("points.npy", npy_header(shape) + bytes(240))
    refused(tmp_path / "a.npz")
    refused(f"{tmp_path}/a.npz#points")


@pytest.mark.parametrize("compression", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
def test_an_npz_whose_member_claims_a_huge_size(compression, tmp_path):
    content = npy_header((130_000_000, 3)) + bytes(240)
    with zipfile.ZipFile(tmp_path / "a.npz", "w", compression) as archive:
        archive.writestr("points.npy", content)
    data = (tmp_path / "a.npz").read_bytes()
    claimed = lie(data, struct.pack("<I", len(content)), struct.pack("<I", 3_120_000_000 + len(content) - 240))
    (tmp_path / "a.npz").write_bytes(claimed)
    refused(tmp_path / "a.npz")


def test_pickled_objects_are_never_loaded(tmp_path):
    class Bomb:
        def __reduce__(self):
            return (exec, ("raise SystemExit('loaded')",))

    np.save(tmp_path / "a.npy", np.array([Bomb()]), allow_pickle=True)
    np.savez(tmp_path / "a.npz", points=np.zeros((3, 3)), bomb=np.array([Bomb(), Bomb(), Bomb()]))
    for name in ("a.npy", "a.npz"):
        assert "never loaded" in refused(tmp_path / name)


@pytest.mark.parametrize(
    "array",
    [
        np.zeros(5),
        np.zeros((5, 2)),
        np.zeros((2, 5, 3)),
        np.array(["a", "b"]),
        np.zeros((4, 3), complex),
        np.eye(4),
    ],
)
def test_arrays_that_are_no_clouds(array, tmp_path):
    np.save(tmp_path / "a.npy", array)
    refused(tmp_path / "a.npy")
    np.savez(tmp_path / "a.npz", points=array)
    refused(tmp_path / "a.npz")
    np.savez(tmp_path / "b.npz", whatever=array)
    assert "holds no (N, 3) array of points" in refused(tmp_path / "b.npz")


@pytest.mark.parametrize("suffix", [".las", ".laz"])
@pytest.mark.parametrize(
    ("offset", "lie"),
    [
        (247, struct.pack("<Q", TRILLION)),  # number of points
        (247, struct.pack("<Q", 2**64 - 1)),
        (247, struct.pack("<Q", 50_001)),
        (100, struct.pack("<I", 2**32 - 1)),  # number of variable length records
        (96, struct.pack("<I", 2**32 - 1)),  # where the points begin
        (105, struct.pack("<H", 65535)),  # bytes of a point
        (104, b"\x7f"),  # point format
        (94, struct.pack("<H", 65535)),  # bytes of the header
    ],
)
def test_a_las_that_lies(suffix, offset, lie, tmp_path):
    path = good_file(tmp_path / f"scan{suffix}")
    data = bytearray(path.read_bytes())
    data[offset : offset + len(lie)] = lie
    path.write_bytes(data)
    refused(path)


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_a_las_whose_extended_records_lie_is_read_without_them(suffix, tmp_path):
    path = good_file(tmp_path / f"scan{suffix}")
    data = bytearray(path.read_bytes())
    data[235:247] = struct.pack("<QI", len(data) - 10, 2**32 - 1)
    path.write_bytes(data)
    assert len(read_cloud(path)) == 100


def test_a_laz_whose_chunk_table_lies(tmp_path):
    path = good_file(tmp_path / "scan.laz")
    data = bytearray(path.read_bytes())
    start = struct.unpack_from("<I", data, 96)[0]
    table = struct.unpack_from("<q", data, start)[0]
    for offset, value in [
        (start, struct.pack("<q", 2**62)),
        (start, struct.pack("<q", -1)),
        (table + 4, struct.pack("<I", 2**32 - 1)),
    ]:
        lying = data.copy()
        lying[offset : offset + len(value)] = value
        path.write_bytes(lying)
        refused(path)


def test_a_laz_whose_layers_lie(tmp_path):
    """lazrs would take 4 GB, which tracemalloc does not see."""
    path = good_file(tmp_path / "scan.laz")
    data = bytearray(path.read_bytes())
    start, _, point_bytes = struct.unpack_from("<IIxH", data, 96)
    layer = start + 8 + point_bytes + 4
    data[layer : layer + 4] = b"\xff" * 4
    path.write_bytes(data)
    assert "the layers of a compressed chunk" in refused(path)


def test_a_laz_whose_chunk_size_and_count_lie(tmp_path):
    path = good_file(tmp_path / "scan.laz")
    data = bytearray(path.read_bytes())
    data[247:255] = struct.pack("<Q", 10**9)
    chunk_size = data.index(b"laszip encoded") - 2 + 54 + 12
    assert data[chunk_size : chunk_size + 4] == struct.pack("<I", 50_000)
    data[chunk_size : chunk_size + 4] = struct.pack("<I", 2**32 - 2)
    path.write_bytes(data)
    refused(path, megabytes=100, seconds=2)


def test_an_e57_with_a_wrong_byte(tmp_path):
    path = good_file(tmp_path / "scan.e57")
    data = path.read_bytes()
    for position in range(0, len(data), 97):
        path.write_bytes(data[:position] + bytes([data[position] ^ 0xFF]) + data[position + 1 :])
        try:
            assert len(read_cloud(path)) == 100  # a byte that means nothing
        except CloudFileError:
            refused(path)


def test_an_e57_that_lies(crc32c, tmp_path):
    """The count is 10^12 and the checksum of its page is right."""
    path = good_file(tmp_path / "scan.e57")
    data = bytearray(path.read_bytes())
    position = data.index(b'recordCount="100"')
    data[position : position + 17] = b'recordCount="999"'
    page = position // 1024 * 1024
    data[page + 1020 : page + 1024] = struct.pack(">I", crc32c(data[page : page + 1020]))
    path.write_bytes(data)
    assert "999 points" in refused(path)


@pytest.mark.parametrize(
    "text",
    [
        "1 2\n3 4\n",
        "1 2 3\n4 5\n",
        "x y z\n1 2 3 4\n",
        "x y z z\n1 2 3 4\n",
        "a b c\n1 2 3\n",
        "one two three\nfour five six\n",
        "# nothing but a comment\n",
        "1000000000000\n1 2 3\n",
        "3\n1 2 3\n4 5 6\n",
        "1 2 3\nx y z\n",
        "1,5;2,5;3,5\n",
    ],
)
def test_text_that_makes_no_sense(text, tmp_path):
    (tmp_path / "a.txt").write_text(text)
    refused(tmp_path / "a.txt")


def test_an_stl_that_lies(tmp_path):
    data = good_file(tmp_path / "a.stl").read_bytes()
    (tmp_path / "a.stl").write_bytes(data[:80] + struct.pack("<I", 2**32 - 1) + data[84:])
    refused(tmp_path / "a.stl")


def test_a_kitti_file_of_another_row_length(tmp_path):
    RNG.random((5, 5), "f4").tofile(tmp_path / "a.bin")
    assert "has 100 bytes, but KITTI .bin files hold 16 bytes" in refused(tmp_path / "a.bin")


@pytest.mark.parametrize("path", ["/dev/null", "/dev/zero"])
def test_a_device_is_no_file(path):
    with pytest.raises(CloudFileError, match="is not a regular file"):
        read_cloud(path)


@pytest.mark.parametrize("read", [read_cloud, lambda path: list(read_clouds(path))], ids=["one", "all"])
def test_what_a_file_says_of_itself_does_nothing_to_a_terminal(read, tmp_path):
    """Escape sequences may rewrite what stands there, or set the title of its window."""
    evil = b"\x1b]0;hacked\x07\x1b[2J\x9b"
    head = b"ply\nformat ascii 1.0\nelement vertex 0\nproperty int " + evil + b"\nend_header\n"
    (tmp_path / "a.ply").write_bytes(head)
    np.savez(tmp_path / "b.npz", **{evil.decode("latin1"): np.zeros(3)})
    (tmp_path / "c.txt").write_bytes(evil + b" y z\n1 2 3\n")
    for name in ("a.ply", "b.npz", "c.txt"):
        with pytest.raises(CloudFileError) as caught:
            read(tmp_path / name)
        assert str(caught.value).isprintable()
        assert "hacked" in str(caught.value)


# What fuzz/readers.py found.


def test_an_npy_whose_header_has_two_gigabytes(tmp_path):
    """NumPy would make room for it."""
    content = b"\x93NUMPY\x02\x00" + struct.pack("<I", 2**31 - 1) + b"{'descr': '<f8', 'shape': (4, 3), }" + bytes(99)
    (tmp_path / "a.npy").write_bytes(content)
    assert "a header" in refused(tmp_path / "a.npy")
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("points.npy", content)
    refused(tmp_path / "a.npz")
    (tmp_path / "a.npy").write_bytes(content[:8])  # its own length is missing
    refused(tmp_path / "a.npy")


def test_a_pcd_with_more_lines_than_usual_is_read_where_its_data_are(tmp_path):
    """pypcd4 takes the eleventh line of a header for data, and what stands there for a size."""
    for encoding in ("binary", "binary_compressed"):
        data = lie(pcd_of_50_points(tmp_path / "a.pcd", encoding), b"VERSION", b"AUTHOR a\nPLACE b\nVERSION")
        (tmp_path / "b.pcd").write_bytes(data)
        assert np.array_equal(read_cloud(tmp_path / "b.pcd").points[:, 1], np.arange(50))


def test_a_pcd_whose_compressed_data_are_damaged(tmp_path):
    data = bytearray(pcd_of_50_points(tmp_path / "a.pcd", "binary_compressed"))
    data[data.index(b"compressed\n") + 19 :] = b"\xff" * (len(data) - data.index(b"compressed\n") - 19)
    (tmp_path / "b.pcd").write_bytes(data)
    refused(tmp_path / "b.pcd")


def test_empty_lines_among_rows_are_passed_over_without_a_word(tmp_path):
    head = b"ply\nformat ascii 1.0\nelement vertex 2\n" + PLY_HEAD
    (tmp_path / "a.ply").write_bytes(head + b"\n1 2 3\n \x1e \n4 5 6\n")
    assert np.array_equal(read_cloud(tmp_path / "a.ply").points, [[1, 2, 3], [4, 5, 6]])
    data = pcd_of_50_points(tmp_path / "a.pcd", "ascii")
    start = data.index(b"ascii\n") + 6
    (tmp_path / "a.pcd").write_bytes(data[:start] + b"\n\n" + data[start:])
    assert len(read_cloud(tmp_path / "a.pcd").points) == 50


def test_colours_that_are_no_colours(tmp_path):
    head = "VERSION .7\nFIELDS x y z rgb\nSIZE 4 4 4 8\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\n"
    (tmp_path / "a.pcd").write_text(head + "DATA ascii\n1 2 3 1e300\n4 5 6 nan\n")
    assert len(read_cloud(tmp_path / "a.pcd")) == 2


@pytest.mark.parametrize("path", sorted(CRASHERS.iterdir()), ids=lambda path: path.name)
def test_files_that_the_fuzzer_found(path):
    """Each raised what it must not, or made NumPy warn: a cloud or a field now, or refused."""
    for read in (read_cloud, read_field):
        with suppress(CloudFileError):
            read(path)
