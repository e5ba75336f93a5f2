"""Files that other tools write, and the names that they give to what they know of a point."""

import logging
import struct

import numpy as np
import pypcd4
import pytest
import trimesh

from fieldalign.clouds.files import read_cloud

RNG = np.random.default_rng(11)
N = 20
XYZ = RNG.random((N, 3)).astype(np.float32)


def ply_bytes(encoding, columns, before="", after=""):
    """A PLY of any encoding, written without fieldalign."""
    names = {"f4": "float", "f8": "double", "u1": "uchar", "i4": "int", "u4": "uint", "u2": "ushort"}
    count = len(next(iter(columns.values())))
    properties = "".join(f"property {names[v.dtype.str[1:]]} {name}\n" for name, v in columns.items())
    head = f"ply\nformat {encoding} 1.0\ncomment made by hand\nobj_info a b\n{before}"
    head += f"element vertex {count}\n{properties}{after}"
    rows = zip(*(v.tolist() for v in columns.values()), strict=True)
    if encoding == "ascii":
        return head.encode() + b"end_header\n" + "".join(" ".join(map(repr, row)) + "\n" for row in rows).encode()
    order = {"binary_little_endian": "<", "binary_big_endian": ">"}[encoding]
    table = np.array(list(rows), [(name, order + v.dtype.str[1:]) for name, v in columns.items()])
    return head.encode() + b"end_header\n" + table.tobytes()


def axes(points=XYZ, names="xyz"):
    return dict(zip(names, points.T, strict=True))


ENCODINGS = ["ascii", "binary_little_endian", "binary_big_endian"]


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_ply_in_all_encodings(encoding, tmp_path):
    utm = np.array([5.4e6, 4.8e5, 300.0]) + RNG.random((N, 3))
    columns = axes(utm) | {
        "intensity": XYZ[:, 0],
        "label": np.arange(N, dtype=np.uint16),
        "red": np.arange(N).astype("u1"),
    }
    columns |= {"green": columns["red"], "blue": columns["red"]}
    (tmp_path / "a.ply").write_bytes(ply_bytes(encoding, columns))
    cloud = read_cloud(tmp_path / "a.ply")
    assert np.array_equal(cloud.points, utm)
    assert np.array_equal(cloud.intensity, XYZ[:, 0])
    assert cloud.intensity.dtype == np.float32
    assert np.array_equal(cloud.attributes["label"], np.arange(N))
    assert np.array_equal(cloud.colors[:, 2], np.arange(N))


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_ply_float32_stays_float32(encoding, tmp_path):
    (tmp_path / "a.ply").write_bytes(ply_bytes(encoding, axes()))
    points = read_cloud(tmp_path / "a.ply").points
    assert points.dtype == np.float32
    assert np.array_equal(points, XYZ)


@pytest.mark.parametrize("encoding", ["binary", "ascii"])
def test_ply_of_trimesh(encoding, tmp_path):
    mesh = trimesh.creation.icosphere(subdivisions=1)
    mesh.export(tmp_path / "ball.ply", encoding=encoding, vertex_normal=True)
    cloud = read_cloud(tmp_path / "ball.ply")
    assert np.allclose(cloud.points, mesh.vertices, atol=1e-7)
    assert np.allclose(cloud.normals, mesh.vertex_normals, atol=1e-7)


def test_ply_whose_faces_differ_in_their_corners(tmp_path):
    faces = "element face 2\nproperty list uchar int vertex_indices\n"
    data = ply_bytes("binary_little_endian", axes(), after=faces)
    (tmp_path / "a.ply").write_bytes(data + struct.pack("<B4iB3i", 4, 0, 1, 2, 3, 3, 0, 1, 2))
    assert np.array_equal(read_cloud(tmp_path / "a.ply").points, XYZ)


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_ply_with_an_element_before_its_vertices(encoding, tmp_path):
    before = "element camera 1\nproperty float focal\nproperty int id\n"
    head, sign, data = ply_bytes(encoding, axes(), before=before).partition(b"end_header\n")
    (tmp_path / "a.ply").write_bytes(head + sign + (b"0.5 7\n" if encoding == "ascii" else bytes(8)) + data)
    assert np.array_equal(read_cloud(tmp_path / "a.ply").points, XYZ)


def test_ply_with_the_line_ends_of_windows(tmp_path):
    (tmp_path / "a.ply").write_bytes(ply_bytes("ascii", axes()).replace(b"\n", b"\r\n"))
    assert np.array_equal(read_cloud(tmp_path / "a.ply").points, XYZ)


@pytest.mark.parametrize(
    ("name", "dtype", "part"),
    [
        ("intensity", "f4", "intensity"),
        ("scalar_Intensity", "f4", "intensity"),
        ("reflectance", "f4", "intensity"),
        ("reflectivity", "u2", "intensity"),
        ("time", "f4", "times"),
        ("timestamp", "f8", "times"),
        ("GpsTime", "f8", "times"),
        ("scalar_GpsTime", "f8", "times"),
        ("gps_time", "f8", "times"),
        ("t", "f8", "times"),
    ],
)
def test_names_of_intensity_and_times(name, dtype, part, tmp_path):
    values = (np.arange(N) + (0.25 if dtype[0] == "f" else 0)).astype(dtype)
    (tmp_path / "a.ply").write_bytes(ply_bytes("binary_little_endian", axes() | {name: values}))
    cloud = read_cloud(tmp_path / "a.ply")
    assert np.array_equal(getattr(cloud, part), values)
    assert not cloud.attributes


@pytest.mark.parametrize(
    "names",
    ["nx ny nz", "normal_x normal_y normal_z", "NormalX NormalY NormalZ", "scalar_Nx scalar_Ny scalar_Nz"],
)
def test_names_of_normals(names, tmp_path):
    (tmp_path / "a.ply").write_bytes(ply_bytes("ascii", axes(names="XYZ") | axes(XYZ[:, ::-1], names.split())))
    assert np.array_equal(read_cloud(tmp_path / "a.ply").normals, XYZ[:, ::-1])


@pytest.mark.parametrize("names", ["red green blue", "r g b", "diffuse_red diffuse_green diffuse_blue"])
@pytest.mark.parametrize(("dtype", "scale"), [("u1", 1), ("u2", 257), ("f4", 1 / 255)])
def test_names_and_scales_of_colors(names, dtype, scale, tmp_path):
    colors = RNG.integers(0, 256, (N, 3))
    colors[0] = 255
    columns = axes() | axes((colors * scale).astype(dtype), names.split())
    (tmp_path / "a.ply").write_bytes(ply_bytes("binary_big_endian", columns))
    assert np.array_equal(read_cloud(tmp_path / "a.ply").colors, colors)


@pytest.mark.parametrize("name", ["t", "offset_time"])
def test_nanoseconds_of_ouster_and_livox_are_seconds(name, tmp_path):
    (tmp_path / "a.ply").write_bytes(
        ply_bytes("binary_little_endian", axes() | {name: np.arange(N, dtype="u4") * 5_000_000})
    )
    assert np.allclose(read_cloud(tmp_path / "a.ply").times, np.arange(N) * 0.005, rtol=1e-15)


@pytest.mark.parametrize(("name", "dtype"), [("timestamp", "i4"), ("t", "i4"), ("timestamp", "f8")])
def test_times_of_unknown_unit_are_not_guessed(name, dtype, tmp_path):
    values = (np.arange(N) * 1000).astype(dtype)
    (tmp_path / "a.ply").write_bytes(ply_bytes("binary_little_endian", axes() | {name: values}))
    cloud = read_cloud(tmp_path / "a.ply")
    assert cloud.times is None
    assert np.array_equal(cloud.attributes[name], values)


def test_the_first_of_two_intensities_is_taken(tmp_path):
    columns = axes() | {
        "reflectivity": np.arange(N, dtype="u2"),
        "intensity": XYZ[:, 0],
        "ring": np.arange(N, dtype="u1"),
    }
    (tmp_path / "a.ply").write_bytes(ply_bytes("binary_little_endian", columns))
    cloud = read_cloud(tmp_path / "a.ply")
    assert np.array_equal(cloud.intensity, XYZ[:, 0])
    assert cloud.attributes.keys() == {"reflectivity", "ring"}


@pytest.mark.parametrize("encoding", list(pypcd4.Encoding)[:3])
def test_pcd_of_pypcd4_in_all_encodings(encoding, tmp_path):
    times = 1.6e9 + np.arange(N) * 0.1 + 0.05
    points = np.repeat(XYZ[:4], 5, axis=0)  # pypcd4 compresses only what gets smaller
    columns = [*points.T, points[:, 1], np.arange(N, dtype=np.uint16), times]
    types = [np.float32] * 4 + [np.uint16, np.float64]
    pcd = pypcd4.PointCloud.from_points(columns, ("x", "y", "z", "intensity", "ring", "timestamp"), types)
    pcd.metadata.viewpoint = (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0)
    pcd.save(tmp_path / "a.pcd", encoding)
    cloud = read_cloud(tmp_path / "a.pcd")
    assert b"DATA " + encoding.value.encode() in (tmp_path / "a.pcd").read_bytes()
    assert np.allclose(cloud.points, points, atol=0 if encoding != "ascii" else 1e-6)
    assert cloud.points.dtype == np.float32
    assert np.allclose(cloud.times, times, rtol=0, atol=1e-5)
    assert np.array_equal(cloud.attributes["ring"], np.arange(N))
    assert np.allclose(cloud.viewpoint, [[-1, 0, 0, 1], [0, -1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]])


PCD = "# .PCD v0.7\nVERSION 0.7\nFIELDS {fields}\nSIZE {size}\nTYPE {type}\nCOUNT {count}\nWIDTH {n}\n"
PCD += "HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n}\nDATA ascii\n{rows}"


def test_pcd_with_nan_rows_tabs_and_packed_colors(tmp_path):
    rows = "1 2  3\t4278255615\nnan nan nan 0\n"
    text = PCD.format(fields="x y z rgb", size="4 4 4 4", type="F F F U", count="1 1 1 1", n=2, rows=rows)
    (tmp_path / "a.pcd").write_text(text)
    cloud = read_cloud(tmp_path / "a.pcd")
    assert np.isnan(cloud.points[1]).all()
    assert cloud.colors.tolist() == [[0, 255, 255], [0, 0, 0]]
    assert cloud.viewpoint is None


def test_pcd_with_padding_and_descriptors(tmp_path):
    text = PCD.format(
        fields="x y z _ d",
        size="4 4 4 1 4",
        type="F F F U F",
        count="1 1 1 2 3",
        n=1,
        rows="1 2 3 0 0 7 8 9\n",
    )
    (tmp_path / "a.pcd").write_text(text)
    assert [values.tolist() for values in read_cloud(tmp_path / "a.pcd").attributes.values()] == [
        [7],
        [8],
        [9],
    ]


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("1 2 3\n4 5 6\n", {}),
        ("1,2,3\n4,5,6\n", {}),
        ("1; 2; 3\n4; 5; 6\n", {}),
        ("\ufeff1\t2\t3\r\n4\t5\t6\r\n", {}),
        ("# made by hand\n// x y z of höhe\n\n1 2 3\n# between\n// between\n4 5 6\n", {}),
        ("2\n1 2 3\n4 5 6\n", {}),
        ("1 2 3 7\n4 5 6 8\n", {"intensity": [7, 8]}),
        ("1 2 3 255 0 9\n4 5 6 1 2 3\n", {"colors": [[255, 0, 9], [1, 2, 3]]}),
        ("1 2 3 0 0.6 0.8\n4 5 6 0 0 1\n", {"normals": [[0, 0.6, 0.8], [0, 0, 1]]}),
        (
            "2\n1 2 3 -100 255 0 9\n4 5 6 50 1 2 3\n",
            {"intensity": [-100, 50], "colors": [[255, 0, 9], [1, 2, 3]]},
        ),
        ("x,y,z,i\n1,2,3,7\n4,5,6,8\n", {"intensity": [7, 8]}),
        ('"X";"Y";"Z";"GPS Time"\n1;2;3;0.5\n4;5;6;0.6\n', {"attributes": {"GPS Time": [0.5, 0.6]}}),
        (
            "//X Y Z Intensity GpsTime\n2\n1 2 3 7 0.5\n4 5 6 8 0.6\n",
            {"intensity": [7, 8], "times": [0.5, 0.6]},
        ),
        ("z y time x\n3 2 0 1\n6 5 1 4\n", {"times": [0, 1]}),
        ("timestamp x y z\n10 1 2 3\n20 4 5 6\n", {"attributes": {"timestamp": [10, 20]}}),
    ],
)
@pytest.mark.parametrize("suffix", [".xyz", ".txt", ".csv"])
def test_text(text, parts, suffix, tmp_path):
    (tmp_path / f"a{suffix}").write_bytes(text.encode())
    cloud = read_cloud(tmp_path / f"a{suffix}")
    assert cloud.points.tolist() == [[1, 2, 3], [4, 5, 6]]
    for part in ("normals", "times", "intensity", "colors"):
        value = getattr(cloud, part)
        assert (value if value is None else value.tolist()) == parts.get(part)
    assert {name: v.tolist() for name, v in cloud.attributes.items()} == parts.get("attributes", {})


def test_npz_by_any_of_its_usual_names(tmp_path):
    for name in ("points", "xyz", "XYZ", "whatever"):
        np.savez_compressed(tmp_path / "a.npz", **{name: XYZ, "normals": XYZ, "gps_time": XYZ[:, 0], "pose": np.eye(4)})
        cloud = read_cloud(tmp_path / "a.npz")
        assert np.array_equal(cloud.points, XYZ)
        assert np.array_equal(cloud.normals, XYZ)
        assert np.array_equal(cloud.times, XYZ[:, 0])
        assert not cloud.attributes


def test_npy_tables_and_structured_arrays(tmp_path):
    np.save(tmp_path / "a.npy", np.asfortranarray(np.column_stack([XYZ, np.arange(N)]).astype(">f4")))
    cloud = read_cloud(tmp_path / "a.npy")
    assert np.array_equal(cloud.points, XYZ)
    assert np.array_equal(cloud.intensity, np.arange(N))
    rows = np.zeros(N, [("x", "f4"), ("y", "f4"), ("z", "f4"), ("ring", "u1")])
    rows["z"] = XYZ[:, 2]
    np.save(tmp_path / "b.npy", rows)
    assert np.array_equal(read_cloud(tmp_path / "b.npy").points[:, 2], XYZ[:, 2])


def test_kitti(tmp_path):
    np.column_stack([XYZ, XYZ[:, 0]]).tofile(tmp_path / "000000.bin")
    cloud = read_cloud(tmp_path / "000000.bin")
    assert np.array_equal(cloud.points, XYZ)
    assert np.array_equal(cloud.intensity, XYZ[:, 0])


@pytest.mark.parametrize("suffix", [".las", ".laz"])
@pytest.mark.parametrize("point_format", [0, 3, 7])
def test_las_of_laspy(suffix, point_format, tmp_path):
    laspy = pytest.importorskip("laspy")
    header = laspy.LasHeader(version="1.4" if point_format > 5 else "1.2", point_format=point_format)
    header.scales, header.offsets = [1e-3] * 3, [5e6, 4e5, 0]
    las = laspy.LasData(header)
    las.x, las.y, las.z = (XYZ + header.offsets).T
    las.intensity = np.arange(N)
    las.classification = np.arange(N) % 5
    if point_format:
        las.gps_time = np.arange(N)
        las.red = las.green = las.blue = np.arange(N) * 257 * 10
    las.write(tmp_path / f"a{suffix}")
    cloud = read_cloud(tmp_path / f"a{suffix}")
    assert np.abs(cloud.points - XYZ - header.offsets).max() < 0.51e-3
    assert np.array_equal(cloud.intensity, np.arange(N))
    assert cloud.attributes.keys() == {"classification"}
    assert (cloud.times is None) == (cloud.colors is None) == (point_format == 0)
    if point_format:
        assert np.array_equal(cloud.times, np.arange(N))
        assert np.array_equal(cloud.colors[:, 0], np.arange(N) * 10)


@pytest.mark.parametrize("kind", ["stl", "stl_ascii", "obj"])
def test_vertices_of_meshes_of_trimesh(kind, tmp_path):
    mesh = trimesh.creation.icosphere(subdivisions=1)
    path = tmp_path / f"ball.{kind[:3]}"
    mesh.export(path, file_type=kind)
    points = read_cloud(path).points
    assert points.shape == mesh.vertices.shape
    assert np.allclose(np.sort(points, axis=0), np.sort(mesh.vertices, axis=0), atol=1e-7)


def test_an_obj_gives_every_vertex_in_its_order_and_to_the_bit(tmp_path):
    text = "# mesh\nv 5400000.0001 2 3\n v\t4 5 6 1 0 0\nvn 0 0 1\nvt 0 1\nv 7 8 9\nf 1/1/1 2/1/1 1/1/1\n"
    (tmp_path / "a.obj").write_text(text)
    assert read_cloud(tmp_path / "a.obj").points.tolist() == [[5400000.0001, 2, 3], [4, 5, 6], [7, 8, 9]]


def test_reading_says_nothing(tmp_path, caplog, capfd):
    trimesh.creation.box().export(tmp_path / "a.stl")
    with caplog.at_level(logging.DEBUG):
        read_cloud(tmp_path / "a.stl")
    assert not caplog.records
    assert capfd.readouterr() == ("", "")
