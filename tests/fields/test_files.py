"""Fields from files: triangles, volumes and points, each as exact as the file; and files that are broken or lie."""

import struct
import sys

import numpy as np
import pytest
import trimesh

import fieldalign as fa
from fieldalign.fields import MeshField, PointField
from fieldalign.fields.files import MESHES, read_field, read_shape, write_mesh

igl = pytest.importorskip("igl")

TRIANGLES = [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]]
CORNERS = np.array([[0, 0, 0], [0, 2, 0.5], [1, 0.25, 0], [0.5, 0.5, 3]])
SQUARES = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}

encodings = pytest.mark.parametrize("encoding", ORDERS)


def tetrahedron():
    return MeshField(CORNERS, TRIANGLES)


def ply(path, encoding, vertices, polygons, before="", rows_before=b"", extra=False):
    """Writes polygons; `extra`: with a number before and a list after the corners."""
    lines = ["ply", f"format {encoding} 1.0", f"element vertex {len(vertices)}"]
    lines += [f"property double {axis}" for axis in "xyz"]
    lines += [before] if before else []
    lines += [f"element face {len(polygons)}"]
    lines += ["property float quality"] if extra else []
    lines += ["property list uchar int vertex_indices"]
    lines += ["property list uchar float texcoord"] if extra else []
    data = "\n".join([*lines, "end_header", ""]).encode()
    order = ORDERS[encoding]
    if not order:
        data += b"".join(b"%r %r %r\n" % tuple(v) for v in np.asarray(vertices).tolist()) + rows_before
        for p in polygons:
            words = ["0.5"] * extra + [str(len(p)), *map(str, p)] + ["2", "0.1", "0.2"] * extra
            data += (" ".join(words) + "\n").encode()
    else:
        data += np.asarray(vertices).astype(order + "f8").tobytes() + rows_before
        for p in polygons:
            data += struct.pack(order + "f", 0.5) * extra + struct.pack(f"{order}B{len(p)}i", len(p), *p)
            data += struct.pack(order + "Bff", 2, 0.1, 0.2) * extra
    path.write_bytes(data)
    return path


def obj(path, vertices, faces, between=""):
    text = "".join("v {} {} {}\n".format(*v) for v in np.asarray(vertices).tolist())
    path.write_text(text + between + "".join("f " + " ".join(map(str, f)) + "\n" for f in faces))
    return path


def off(path, vertices, polygons, head="OFF\n"):
    text = f"{head}{len(vertices)} {len(polygons)} 0\n" + "".join("{} {} {}\n".format(*v) for v in vertices.tolist())
    path.write_text(text + "".join(" ".join(map(str, [len(p), *p])) + "\n" for p in polygons))
    return path


def written(path):
    """The tetrahedron in a format."""
    write_mesh(path, CORNERS, np.array(TRIANGLES))
    return path


def is_the_tetrahedron(field, atol=0.0):
    x = np.random.default_rng(0).uniform(-1, 3, (50, 3))
    assert isinstance(field, MeshField)
    assert field.signed
    return np.allclose(field.sample(x).value, tetrahedron().sample(x).value, rtol=0, atol=max(atol, 1e-12))


# ------------------------------------------------------------------------------------------------------------ triangles


@pytest.mark.parametrize("suffix", [*MESHES, ".STL", ".Ply"])
def test_what_is_written_is_read(suffix, tmp_path):
    assert is_the_tetrahedron(read_field(written(tmp_path / f"part{suffix}")))


@pytest.mark.parametrize("suffix", [".ply", ".stl", ".obj", ".off"])
def test_what_trimesh_writes_is_read(suffix, tmp_path):
    trimesh.Trimesh(CORNERS, TRIANGLES, process=False).export(tmp_path / f"part{suffix}")
    assert is_the_tetrahedron(read_field(tmp_path / f"part{suffix}"))


@pytest.mark.parametrize("suffix", MESHES)
def test_trimesh_reads_what_is_written(suffix, tmp_path):
    mesh = trimesh.load_mesh(written(tmp_path / f"part{suffix}"))
    assert mesh.is_watertight
    assert np.isclose(mesh.volume, trimesh.Trimesh(CORNERS, TRIANGLES).volume)


@pytest.mark.parametrize("suffix", [".ply", ".off", ".obj"])
def test_coordinates_of_utm_size_are_kept(suffix, tmp_path):
    far = CORNERS + [5e6, 4e5, 0.123]
    write_mesh(tmp_path / f"far{suffix}", far, np.array(TRIANGLES))
    field = read_field(tmp_path / f"far{suffix}")
    assert np.abs(np.sort(field.vertices, axis=0) - np.sort(far, axis=0)).max() < 2e-8


def test_an_stl_that_rounds_says_so(tmp_path, caplog):
    write_mesh(tmp_path / "here.stl", CORNERS + 0.1, np.array(TRIANGLES))
    assert not caplog.messages
    write_mesh(tmp_path / "far.stl", CORNERS + [5e6 + 0.1, 0, 0], np.array(TRIANGLES))
    assert "far.stl: .stl files hold float32, which rounds these coordinates by up to 0" in caplog.messages[0]


def test_an_ascii_stl(tmp_path):
    mesh = trimesh.Trimesh(CORNERS, TRIANGLES, process=False)
    (tmp_path / "part.stl").write_text(mesh.export(file_type="stl_ascii"))
    assert is_the_tetrahedron(read_field(tmp_path / "part.stl"), 1e-6)
    two = "".join(trimesh.Trimesh(CORNERS + k, TRIANGLES).export(file_type="stl_ascii") + "\n" for k in (0, 9))
    (tmp_path / "two.stl").write_text(two)
    assert len(read_field(tmp_path / "two.stl")) == 8


@encodings
@pytest.mark.parametrize("extra", [False, True], ids=["plain", "with more in a row"])
def test_plys_of_all_encodings(encoding, extra, tmp_path):
    assert is_the_tetrahedron(read_field(ply(tmp_path / "part.ply", encoding, CORNERS, TRIANGLES, extra=extra)))


@encodings
@pytest.mark.parametrize("extra", [False, True], ids=["plain", "with more in a row"])
def test_polygons_are_split(encoding, extra, tmp_path):
    mixed = [*SQUARES[:4], SQUARES[4][:3], [SQUARES[4][k] for k in (0, 2, 3)], SQUARES[5]]
    for polygons in (SQUARES, mixed):
        field = read_field(ply(tmp_path / "cube.ply", encoding, CUBE, polygons, extra=extra))
        assert field.signed
        assert len(field) == 12
        assert np.allclose(field.sample([[0.5, 0.5, 0.4], [0.5, 0.5, 2]]).value, [-0.4, 1])


def test_a_face_of_five_corners_is_a_fan_of_three_triangles(tmp_path):
    outline = np.array([[0, 0, 0], [2, 0, 0], [3, 1, 0], [1, 2, 0], [-1, 1, 0]], float)
    for field in (
        read_field(ply(tmp_path / "a.ply", "ascii", outline, [[0, 1, 2, 3, 4]])),
        read_field(obj(tmp_path / "a.obj", outline, [[1, 2, 3, 4, 5]])),
        read_field(off(tmp_path / "a.off", outline, [[0, 1, 2, 3, 4]])),
    ):
        assert field.faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 3, 4]]


def test_the_vertices_of_a_ply_are_those_of_its_cloud(tmp_path):
    """Also where an element stands in between, and vertices hold more than places."""
    between = "element edge 2\nproperty int vertex1\nproperty int vertex2"
    for encoding, rows in (("ascii", b"0 1\n1 2\n"), ("binary_big_endian", struct.pack(">4i", 0, 1, 1, 2))):
        path = ply(tmp_path / "a.ply", encoding, CORNERS, TRIANGLES, between, rows)
        assert is_the_tetrahedron(read_field(path))
        assert np.array_equal(fa.read_cloud(path).points, CORNERS)
    head = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty uchar red\nproperty float x\nproperty float z\n"
    head += b"property float y\nelement face 1\nproperty list uint8 uint vertex_index\nend_header\n"
    (tmp_path / "b.ply").write_bytes(head + b"9 0 0 0\n9 1 0 0\n9 0 1 0\n3 0 1 2\n")
    assert np.array_equal(read_field(tmp_path / "b.ply").vertices, [[0, 0, 0], [1, 0, 0], [0, 0, 1]])


@pytest.mark.parametrize(
    ("faces", "between"),
    [
        ([[1, 2, 3], [1, 4, 2], [2, 4, 3], [3, 4, 1]], ""),
        ([[-4, -3, -2], [-4, -1, -3], [-3, -1, -2], [-2, -1, -4]], "# back from the last one\n"),
        (
            [["1/1", "2/2", "3/1"], ["1//7", "4//8", "2//9"], ["2/1/1", "4/2/2", "3/3/3"], [3, 4, "1 # the last"]],
            "vt 0 0\n",
        ),
        ([["1/1/1", "2/2/2", "3/1/3"], ["1//7", "4//8", "2//9"], ["2/1", "4/2", "3/3"], ["3/5", "4", "1/7"]], ""),
        ([[1, 2, 3], [1, 4, 2], [2, 4, 3], [3, 4, 1]], "mtllib nowhere.mtl\no part\ng side\nusemtl steel\ns off\n"),
    ],
    ids=["plain", "from behind", "with textures", "mixed", "with materials"],
)
def test_objs_as_programs_write_them(faces, between, tmp_path):
    assert is_the_tetrahedron(read_field(obj(tmp_path / "part.obj", CORNERS, faces, between)))


@pytest.mark.parametrize("head", ["OFF\n", "OFF ", "OFF", "OFF # a comment\n\n# another\n", "COFF\n", "STCNOFF\n"])
def test_offs_as_programs_write_them(head, tmp_path):
    assert is_the_tetrahedron(read_field(off(tmp_path / "part.off", CORNERS, TRIANGLES, head)))


def test_an_off_of_polygons(tmp_path):
    for polygons, triangles in ((SQUARES, 12), ([*SQUARES[:5], SQUARES[5][:3]], 11), ([SQUARES[0][:3], SQUARES[1]], 3)):
        assert len(read_field(off(tmp_path / "cube.off", CUBE, polygons))) == triangles


@pytest.mark.parametrize("corner", ["1.5", "x", "nan", "1e300", "9007199254740993"])
def test_an_off_whose_corners_are_no_whole_numbers(corner, tmp_path):
    (tmp_path / "part.off").write_text("OFF\n4 1 0\n" + ROWS + f"0 0 1\n3 0 {corner} 2\n")
    assert refused(tmp_path / "part.off")


def test_colours_in_an_off_are_left_out(tmp_path):
    rows = "".join("{} {} {} 255 0 0 255\n".format(*v) for v in CORNERS.tolist())
    rows += "".join("3 {} {} {} 0.5 0.5 0.5\n".format(*f) for f in TRIANGLES)
    (tmp_path / "part.off").write_text("COFF\n4 4 6\n" + rows)
    assert is_the_tetrahedron(read_field(tmp_path / "part.off"))


# --------------------------------------------------------------------------------------------------- volumes and points


def a_volume():
    grid = np.stack(np.meshgrid(*[np.linspace(-1.5, 1.5, 13)] * 3, indexing="ij"), axis=-1)
    return {"values": np.linalg.norm(grid, axis=-1) - 1, "origin": [-1.5] * 3, "spacing": 0.25}


def test_an_npz_with_values_is_a_volume(tmp_path):
    np.savez(tmp_path / "volume.npz", **a_volume())
    field = read_field(tmp_path / "volume.npz")
    assert type(field).__name__ == "VolumeField"
    assert abs(field.sample([[0.5, 0, 0.0]]).value[0] + 0.5) < 0.02


def test_a_nrrd_is_a_volume(tmp_path):
    nrrd = pytest.importorskip("nrrd")
    volume = a_volume()
    header = {"space": "left-posterior-superior", "space directions": 0.25 * np.eye(3), "space origin": [-1.5] * 3}
    nrrd.write(str(tmp_path / "volume.nrrd"), volume["values"], header)
    assert type(read_field(tmp_path / "volume.nrrd")).__name__ == "VolumeField"


def test_a_vdb_is_refused_with_a_way_out(tmp_path):
    (tmp_path / "volume.vdb").write_bytes(b" BDV")
    with pytest.raises(fa.CloudFileError, match=r"volume\.vdb is an OpenVDB file"):
        read_field(tmp_path / "volume.vdb")


@pytest.mark.parametrize("suffix", [".ply", ".pcd", ".xyz", ".npy", ".npz", ".csv"])
def test_clouds_are_points(suffix, tmp_path, rng):
    points = rng.normal(size=(50, 3))
    fa.write_cloud(tmp_path / f"scan{suffix}", points)
    field = read_field(tmp_path / f"scan{suffix}")
    assert isinstance(field, PointField)
    assert np.allclose(field.points, points)


def test_one_array_of_several(tmp_path, rng):
    first, second = rng.normal(size=(2, 40, 3))
    np.savez(tmp_path / "two.npz", first=first, values=second)
    assert np.array_equal(read_field(f"{tmp_path}/two.npz#first").points, first)
    assert np.array_equal(read_field(f"{tmp_path}/two.npz#values").points, second)


@pytest.mark.parametrize("suffix", [".obj", ".off", ".ply"])
def test_meshes_without_faces_are_points(suffix, tmp_path):
    path = tmp_path / f"points{suffix}"
    {".obj": obj, ".off": off, ".ply": lambda *a: ply(a[0], "ascii", *a[1:])}[suffix](path, CORNERS, [])
    assert np.array_equal(read_field(path).points, CORNERS)
    assert isinstance(read_shape(path), fa.PointCloud)


def test_missing_returns_are_left_out_and_infinity_is_refused(tmp_path, rng):
    points = rng.normal(size=(50, 3))
    points[7] = np.nan
    fa.write_cloud(tmp_path / "gaps.ply", points)
    assert len(read_field(tmp_path / "gaps.ply")) == 49
    points[9] = np.inf
    fa.write_cloud(tmp_path / "infinite.ply", points)
    with pytest.raises(fa.CloudFileError, match=r"infinite\.ply .* points must be finite"):
        read_field(tmp_path / "infinite.ply")


def test_a_cloud_keeps_what_it_knows(tmp_path, rng):
    eye = np.eye(4)
    eye[:3, 3] = 5
    cloud = fa.PointCloud(rng.normal(size=(50, 3)), intensity=np.arange(50), viewpoint=eye)
    fa.write_cloud(tmp_path / "scan.ply", cloud)
    shape = read_shape(tmp_path / "scan.ply")
    assert np.array_equal(shape.viewpoint, eye)
    assert np.array_equal(shape.intensity, np.arange(50))
    assert np.array_equal(fa.prepare(tmp_path / "scan.ply").eye, [5, 5, 5])
    assert fa.prepare(written(tmp_path / "part.stl")).eye is None


def test_a_file_of_triangles_is_registered_by_its_triangles(tmp_path, any_motion, rng):
    from fieldalign.motions import apply, inverse

    ball = trimesh.creation.icosphere(2)
    d = np.asarray(ball.vertices)
    radius = 1 + 0.3 * d[:, 0] + 0.25 * np.sin(3 * d[:, 1] + d[:, 0]) + 0.3 * np.cos(4 * d[:, 2] * d[:, 0])
    vertices, T = (d * radius[:, None] * [1.3, 1, 0.8]).astype(np.float32), any_motion(rng, 2.0)
    write_mesh(tmp_path / "part.stl", vertices, np.asarray(ball.faces))
    scan = MeshField(vertices, ball.faces).spread(5000)
    fa.write_cloud(tmp_path / "scan.ply", apply(inverse(T), scan))
    result = fa.register(tmp_path / "scan.ply", str(tmp_path / "part.stl"))
    assert result.accepted
    assert np.abs(apply(result.T_target_source, apply(inverse(T), scan)) - scan).max() < 1e-9
    assert isinstance(fa.prepare(tmp_path / "part.stl").field, MeshField)


# --------------------------------------------------------------------------------------------------------------- errors


def refused(path):
    with pytest.raises(fa.CloudFileError) as caught:
        read_field(path)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert message.count(str(path)) == 1
    assert "\n" not in message
    assert len(message) < 400
    return message


@pytest.mark.parametrize("suffix", [*MESHES, ".nrrd", ".nhdr", ".vdb", ".npz", ".pcd"])
def test_a_missing_file_a_folder_and_an_empty_file(suffix, tmp_path):
    path = tmp_path / f"part{suffix}"
    assert "does not exist" in refused(path)
    path.mkdir()
    assert "is a folder, not a file" in refused(path)
    path.rmdir()
    path.touch()
    assert "is empty (0 bytes)" in refused(path)


def test_an_unknown_suffix_names_the_known_ones(tmp_path):
    (tmp_path / "part.step").write_text("ISO-10303-21;")
    message = refused(tmp_path / "part.step")
    assert all(suffix in message for suffix in (".ply", ".stl", ".off", ".nrrd", ".e57"))


@pytest.mark.parametrize("suffix", MESHES)
@pytest.mark.parametrize("content", [b"\x89PNG\r\n\x1a\n" + bytes(range(256)), b"%PDF-1.4\n" * 30, bytes(1000)])
def test_foreign_content(suffix, content, tmp_path):
    (tmp_path / f"foreign{suffix}").write_bytes(content)
    refused(tmp_path / f"foreign{suffix}")


@pytest.mark.parametrize("suffix", [".ply", ".stl", ".off"])
def test_a_truncated_mesh(suffix, tmp_path):
    data, cut = written(tmp_path / f"whole{suffix}").read_bytes().rstrip(b"\n"), tmp_path / f"cut{suffix}"
    for length in {1, 3, 20, 90, *range(len(data) - 30, len(data), 3), len(data) - 1}:
        cut.write_bytes(data[:length])
        refused(cut)


@encodings
@pytest.mark.parametrize("extra", [False, True], ids=["plain", "with more in a row"])
def test_a_ply_that_ends_within_its_faces(encoding, extra, tmp_path):
    for polygons in (TRIANGLES, [*TRIANGLES[:3], [2, 3, 0, 1]]):
        data = ply(tmp_path / "whole.ply", encoding, CORNERS, polygons, extra=extra).read_bytes()
        for lost in (7, 14, 20):  # less may leave a shorter number
            (tmp_path / "cut.ply").write_bytes(data[:-lost])
            refused(tmp_path / "cut.ply")


@encodings
@pytest.mark.parametrize("row", [[0, 1, 4], [-1, 1, 2], [0, 1, 2**31 - 1]])
def test_a_ply_whose_faces_name_no_vertices(encoding, row, tmp_path):
    path = ply(tmp_path / "a.ply", encoding, CORNERS, [*TRIANGLES, row])
    assert "must be rows of its 4 vertices" in refused(path)


@pytest.mark.parametrize("count", [5, 10**9, 10**12, 2**63, -1])
@encodings
def test_a_ply_that_promises_more_faces(encoding, count, tmp_path):
    data = ply(tmp_path / "a.ply", encoding, CORNERS, TRIANGLES).read_bytes()
    (tmp_path / "a.ply").write_bytes(data.replace(b"element face 4", b"element face %d" % count))
    refused(tmp_path / "a.ply")


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("lie", [255, 2**31, 2**32 - 1])
def test_a_ply_whose_list_claims_a_huge_length(order, lie, tmp_path):
    data = ply(tmp_path / "a.ply", dict(zip("<>", list(ORDERS)[1:], strict=True))[order], CORNERS, []).read_bytes()
    data = data.replace(b"face 0", b"face 2").replace(b"list uchar int", b"list uint int")
    for lies in ((lie, 3), (3, lie)):
        rows = b"".join(struct.pack(order + "I3i", k, 0, 1, 2) for k in lies)
        (tmp_path / "a.ply").write_bytes(data + rows)
        assert "is truncated within its 2 faces" in refused(tmp_path / "a.ply")


def test_lists_before_the_faces_are_told(tmp_path):
    between = "element strips 1\nproperty list uchar int vertex_indices"
    path = ply(tmp_path / "a.ply", "binary_little_endian", CORNERS, TRIANGLES, between, struct.pack("<B3i", 3, 0, 1, 2))
    assert "has lists before its faces (element 'strips')" in refused(path)
    assert len(fa.read_cloud(path)) == 4


@pytest.mark.parametrize(
    ("faces", "words"),
    [
        ([[1, 2]], "has a face that is none: 'f 1 2'"),
        ([[0, 1, 2]], "has a face that is none: 'f 0 1 2'"),
        ([[]], "has a face that is none: 'f'"),
        ([[1, 2, 3], []], "has a face that is none: 'f'"),
        ([[1, 2, 3], [1, 2, 3, "/4"]], "cannot be read as .obj"),
        ([[1, 2, 3], [1, 2, "3f"]], "cannot be read as .obj"),
        ([[1, 2, "x"]], "cannot be read as .obj"),
        ([[1, 2, "/3"]], "cannot be read as .obj"),
        ([[1, 2, 3.5]], "cannot be read as .obj"),
        ([[1, 2, 5]], "must be rows of its 4 vertices"),
        ([[-5, 1, 2]], "must be rows of its 4 vertices"),
        ([[1, 2, 10**30]], "cannot be read as .obj"),
        ([[1, 1, 2]], "needs triangles with an area"),
    ],
)
def test_an_obj_whose_faces_are_none(faces, words, tmp_path):
    assert words in refused(obj(tmp_path / "part.obj", CORNERS, faces))


ROWS = "0 0 0\n1 0 0\n0 1 0\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("3 1 0\n" + ROWS + "3 0 1 2\n", "is not an OFF file"),
        ("4OFF\n3 1 0\n" + ROWS + "3 0 1 2\n", "is not an OFF file"),
        ("OFF BINARY\n3 1 0\n", "must say how many vertices and faces it has, as text"),
        ("OFF\n", "must say how many"),
        ("OFF\n3\n", "must say how many"),
        ("OFF\n0 0 0\n", "must have vertices"),
        ("OFF\n3 -1 0\n" + ROWS, "must have vertices"),
        ("OFF\n3 2 0\n" + ROWS + "3 0 1 2\n", "promises 3 vertices and 2 faces, but holds 3 and 1"),
        (f"OFF\n{10**12} 1 0\n" + ROWS + "3 0 1 2\n", f"promises {10**12} vertices"),
        (f"OFF\n{10**30} 1 0\n" + ROWS + "3 0 1 2\n", "cannot be read as .off"),
        ("OFF\n3 1 0\n" + ROWS + "3 0 1\n", "has a face of 3 corners with 2 of them"),
        ("OFF\n3 1 0\n" + ROWS + "-3 0 1 2\n", "has a face of -3 corners"),
        ("OFF\n3 1 0\n" + ROWS + "3 0 1 3\n", "must be rows of its 3 vertices"),
        ("OFF\n3 1 0\n0 0 0\n1 0\n0 1 0\n3 0 1 2\n", "cannot be read as .off"),
        ("OFF\n3 1 0\n0 0 0\n1 0 a\n0 1 0\n3 0 1 2\n", "cannot be read as .off"),
        ("OFF\n3 1 0\n0 0 0\n1 0 nan\n0 1 0\n3 0 1 2\n", "must be finite, but 1 faces"),
    ],
)
def test_an_off_that_makes_no_sense(text, words, tmp_path):
    (tmp_path / "part.off").write_text(text)
    assert words in refused(tmp_path / "part.off")


def test_a_mesh_without_an_area_is_refused(tmp_path):
    flat = np.outer(np.arange(4), [1, 1, 1])
    assert "needs triangles with an area" in refused(ply(tmp_path / "a.ply", "ascii", flat, TRIANGLES))


def test_a_broken_npz_is_refused(tmp_path):
    (tmp_path / "a.npz").write_bytes(b"PK\x03\x04" + bytes(100))
    refused(tmp_path / "a.npz")
    np.savez(tmp_path / "a.npz", values=np.zeros((4, 4, 4)))
    refused(tmp_path / "a.npz")


def test_without_libigl_the_extra_is_named(tmp_path, monkeypatch):
    written(tmp_path / "part.stl")
    monkeypatch.setitem(sys.modules, "igl", None)
    with pytest.raises(fa.MissingExtraError, match=r"fieldalign\[mesh\]"):
        read_field(tmp_path / "part.stl")
    with pytest.raises(fa.MissingExtraError, match=r"fieldalign\[mesh\]"):
        fa.prepare(tmp_path / "part.stl")
    assert len(fa.read_cloud(tmp_path / "part.stl")) == 4


# -------------------------------------------------------------------------------------------------------------- writing


@pytest.mark.parametrize(
    ("name", "words"), [("part.step", "suffix of a mesh must be one of .ply, .stl"), ("nowhere/part.stl", "no folder")]
)
def test_what_cannot_be_written_is_named(name, words, tmp_path):
    with pytest.raises(fa.CloudFileError, match=words):
        write_mesh(tmp_path / name, CORNERS, np.array(TRIANGLES))
    assert not list(tmp_path.iterdir())
