"""What is written is read back, in every format, with all that the format can carry."""

import logging
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from fieldalign.clouds.cloud import PointCloud
from fieldalign.clouds.files import FORMATS, read_cloud, read_clouds, write_cloud
from fieldalign.clouds.formats import kitti
from fieldalign.errors import ArgumentError, CloudFileError, MissingExtraError

RNG = np.random.default_rng(7)
N = 57
UTM = np.array([5.4e6, 4.8e5, 300.0])
LIBRARIES = {".las": "laspy", ".laz": "laspy", ".e57": "pye57"}
WRITABLE = [suffix for suffix, form in FORMATS.items() if form.write]
EXACT = [".ply", ".pcd", ".npy", ".npz", ".xyz", ".txt", ".csv"]
COLUMNS = [".ply", ".pcd", ".npz", ".xyz", ".txt", ".csv"]
SURVEY = [".las", ".laz", ".e57"]


def needs_library(suffix):
    if suffix in LIBRARIES:
        pytest.importorskip(LIBRARIES[suffix])


def a_pose():
    angle = 0.7
    pose = np.eye(4)
    pose[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    pose[:3, 3] = UTM + 1.25
    return pose


def full_cloud():
    normals = RNG.normal(size=(N, 3))
    return PointCloud(
        UTM + RNG.normal(size=(N, 3)) * 40,
        normals=normals / np.linalg.norm(normals, axis=1, keepdims=True),
        times=1.6e9 + np.arange(N) * 1e-5 + 0.123456,
        intensity=RNG.integers(0, 256, N).astype(np.float32),
        colors=RNG.integers(0, 256, (N, 3)).astype(np.uint8),
        attributes={
            "ring": np.arange(N, dtype=np.uint16) % 16,
            "range": RNG.random(N),
            "weight": RNG.random(N).astype("f4"),
        },
        viewpoint=a_pose(),
    )


def round_trip(cloud, path):
    write_cloud(path, cloud)
    return read_cloud(path)


def plain_cloud(dtype=np.float32):
    return PointCloud(RNG.normal(size=(N, 3)).astype(dtype))


@pytest.mark.parametrize("suffix", WRITABLE)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_points_come_back(suffix, dtype, tmp_path):
    needs_library(suffix)
    cloud = plain_cloud(dtype)
    back = round_trip(cloud, tmp_path / f"scan{suffix}")
    extent = np.ptp(cloud.points, axis=0).max()
    assert np.abs(back.points - cloud.points).max() <= (0 if suffix in [*EXACT[:4], ".e57"] else 1e-7) * extent
    assert (back.normals, back.times, back.colors, back.viewpoint, back.attributes) == (
        None,
        None,
        None,
        None,
        {},
    )


@pytest.mark.parametrize("suffix", [".ply", ".pcd", ".npy", ".npz", ".bin", ".e57"])
def test_float32_stays_float32(suffix, tmp_path):
    needs_library(suffix)
    assert round_trip(plain_cloud(), tmp_path / f"scan{suffix}").points.dtype == np.float32


@pytest.mark.parametrize("suffix", EXACT)
def test_coordinates_of_utm_size_come_back_to_the_bit(suffix, tmp_path):
    cloud = full_cloud()
    assert np.array_equal(round_trip(cloud, tmp_path / f"scan{suffix}").points, cloud.points)


@pytest.mark.parametrize("suffix", SURVEY)
def test_survey_formats_keep_coordinates_of_utm_size(suffix, tmp_path):
    needs_library(suffix)
    cloud = full_cloud()
    assert np.abs(round_trip(cloud, tmp_path / f"scan{suffix}").points - cloud.points).max() < 1e-6


@pytest.mark.parametrize("suffix", [*COLUMNS, *SURVEY])
def test_what_is_known_of_each_point_comes_back(suffix, tmp_path):
    needs_library(suffix)
    cloud = full_cloud()
    back = round_trip(cloud, tmp_path / f"scan{suffix}")
    assert np.allclose(back.normals, cloud.normals, atol=1e-14)
    assert np.array_equal(back.times, cloud.times)
    assert np.array_equal(back.intensity, cloud.intensity)
    assert np.array_equal(back.colors, cloud.colors)
    assert back.colors.dtype == np.uint8
    if suffix != ".e57":
        assert back.attributes.keys() == cloud.attributes.keys()
        for name, values in cloud.attributes.items():
            assert np.array_equal(back.attributes[name].astype(values.dtype), values)


@pytest.mark.parametrize("suffix", [".ply", ".pcd", ".npz", ".e57"])
def test_the_viewpoint_comes_back(suffix, tmp_path):
    needs_library(suffix)
    cloud = full_cloud()
    assert np.allclose(round_trip(cloud, tmp_path / f"scan{suffix}").viewpoint, cloud.viewpoint, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("suffix", [".ply", ".pcd", ".npz", ".csv"])
def test_colors_with_alpha_come_back(suffix, tmp_path):
    cloud = PointCloud(RNG.random((N, 3)), colors=RNG.integers(0, 256, (N, 4)).astype(np.uint8))
    assert np.array_equal(round_trip(cloud, tmp_path / f"scan{suffix}").colors, cloud.colors)


@pytest.mark.parametrize("suffix", [".ply", ".pcd", ".txt", ".las"])
def test_wide_attributes_are_split_into_columns(suffix, tmp_path):
    needs_library(suffix)
    values = RNG.random((N, 2))
    back = round_trip(PointCloud(RNG.random((N, 3)), attributes={"uv map": values}), tmp_path / f"scan{suffix}")
    assert back.attributes.keys() == {"uv_map_0", "uv_map_1"}
    assert np.array_equal(back.attributes["uv_map_1"], values[:, 1])


def test_npz_keeps_attributes_as_they_are(tmp_path):
    attributes = {"uv map": RNG.random((N, 2)), "time": np.arange(N), "label": np.array(["a"] * N)}
    back = round_trip(PointCloud(RNG.random((N, 3)), attributes=attributes), tmp_path / "scan.npz")
    assert back.attributes.keys() == attributes.keys()
    assert all(np.array_equal(back.attributes[name], values) for name, values in attributes.items())


@pytest.mark.parametrize("dtype", [bool, np.int8, np.int64, np.uint64, np.float16, ">i4", ">f8", np.longdouble])
@pytest.mark.parametrize("suffix", [*COLUMNS, ".las"])
def test_attributes_of_any_number_type_keep_their_values(suffix, dtype, tmp_path):
    needs_library(suffix)
    values = np.arange(N).astype(dtype)
    back = round_trip(PointCloud(RNG.random((N, 3)), attributes={"label": values}), tmp_path / f"scan{suffix}")
    assert np.array_equal(back.attributes["label"], values)


@pytest.mark.parametrize("suffix", [".ply", ".pcd", ".npy", ".npz", ".xyz", ".csv", ".bin", ".e57"])
def test_missing_returns_are_kept(suffix, tmp_path):
    needs_library(suffix)
    points = RNG.random((N, 3)).astype(np.float32)
    points[3] = np.nan
    back = round_trip(PointCloud(points), tmp_path / f"scan{suffix}").points
    assert np.array_equal(np.isnan(back).all(axis=1), np.isnan(points).all(axis=1))


@pytest.mark.parametrize("suffix", [suffix for suffix in WRITABLE if suffix != ".bin"])
def test_a_cloud_without_points_comes_back(suffix, tmp_path):
    needs_library(suffix)
    assert round_trip(PointCloud(np.empty((0, 3)), intensity=np.empty(0)), tmp_path / f"none{suffix}").points.shape == (
        0,
        3,
    )


@pytest.mark.parametrize("suffix", [".las", ".laz"])
@pytest.mark.parametrize("extent", [1e-6, 1.0, 1e7])
@pytest.mark.parametrize("shift", [0.0, 5e6])
def test_las_chooses_its_scale_from_the_data(suffix, extent, shift, tmp_path):
    needs_library(suffix)
    points = shift + RNG.random((N, 3)) * extent
    error = np.abs(round_trip(PointCloud(points), tmp_path / f"scan{suffix}").points - points).max()
    assert error <= max(1e-6 * extent, 4e-9 * (shift > 0))


@pytest.mark.parametrize(
    ("largest", "kind"),
    [(63, b"int"), (2**31 - 1, b"int"), (-(2**31), b"int"), (2**31, b"double"), (-(2**31) - 1, b"double")],
)
def test_a_ply_holds_whole_numbers_of_64_bits_as_32_where_they_fit(largest, kind, tmp_path):
    cloud = PointCloud(np.zeros((2, 3)), attributes={"ring": np.array([0, largest])})
    assert round_trip(cloud, tmp_path / "a.ply").attributes["ring"].tolist() == [0, largest]
    assert b"property " + kind + b" ring\n" in (tmp_path / "a.ply").read_bytes()


def test_a_missing_return_is_no_digit_that_kitti_loses(tmp_path):
    points = np.array([[1.0, 2, 3], [np.nan] * 3, [0.1, 0.2, 0.3]])
    assert kitti.write(tmp_path / "a.bin", PointCloud(points.astype(np.float32))) == []
    assert kitti.write(tmp_path / "a.bin", PointCloud(points)) == ["the digits of the points beyond float32"]


@pytest.mark.parametrize(("largest", "is_own"), [(65535, True), (65536, False), (-1, False)])
def test_las_has_a_place_of_its_own_for_whole_intensities_that_fit(largest, is_own, tmp_path):
    """16 bits; what does not fit goes into a column that CloudCompare knows."""
    laspy = pytest.importorskip("laspy")
    intensity = np.array([0, 1, 300, largest], float)
    back = round_trip(PointCloud(RNG.random((4, 3)), intensity=intensity), tmp_path / "scan.las")
    assert np.array_equal(back.intensity, intensity)
    written = laspy.read(tmp_path / "scan.las")
    assert np.array_equal(written.intensity, intensity) is is_own
    assert ("scalar_Intensity" in written.point_format.dimension_names) is not is_own


def test_las_keeps_intensity_that_is_no_whole_number(tmp_path):
    needs_library(".las")
    intensity = RNG.random(N)
    back = round_trip(PointCloud(RNG.random((N, 3)), intensity=intensity), tmp_path / "scan.las")
    assert np.array_equal(back.intensity, intensity)
    assert not back.attributes


def test_las_columns_of_the_standard_come_back(tmp_path):
    needs_library(".las")
    cloud = PointCloud(RNG.random((N, 3)), attributes={"classification": np.arange(N) % 7})
    assert np.array_equal(round_trip(cloud, tmp_path / "scan.las").attributes["classification"], np.arange(N) % 7)


def test_las_leaves_out_what_does_not_fit_its_own_columns(tmp_path, caplog):
    needs_library(".las")
    whole = np.arange(N)
    attributes = {"X": whole, "user_data": whole * 100, "classification": whole + 0.5, "label": whole * 0}
    back = round_trip(PointCloud(RNG.random((N, 3)), attributes=attributes), tmp_path / "scan.las")
    assert back.attributes.keys() == {"label"}
    assert caplog.messages[0].endswith("the attribute 'X', the attribute 'user_data', the attribute 'classification'")


@pytest.mark.parametrize(
    ("suffix", "left_out"),
    [
        (".npy", "normals, times, intensity, colors, attributes, viewpoint"),
        (".bin", "the digits of the points beyond float32, normals, times, colors, attributes, viewpoint"),
        (".csv", "the viewpoint"),
        (".las", "the viewpoint"),
        (".e57", "attributes"),
    ],
)
def test_what_a_format_cannot_carry_is_named_in_a_warning(suffix, left_out, tmp_path, caplog):
    needs_library(suffix)
    with caplog.at_level(logging.WARNING, "fieldalign"):
        write_cloud(tmp_path / f"scan{suffix}", full_cloud())
    assert [record.getMessage() for record in caplog.records] == [
        f"{tmp_path}/scan{suffix}: {suffix} files have no place for {left_out}"
    ]


@pytest.mark.parametrize("suffix", [".ply", ".pcd", ".npz"])
def test_nothing_is_said_where_nothing_is_left_out(suffix, tmp_path, caplog):
    write_cloud(tmp_path / f"scan{suffix}", full_cloud())
    assert not caplog.records


def test_las_leaves_out_points_that_are_not_finite(tmp_path, caplog):
    needs_library(".las")
    points = RNG.random((N, 3))
    points[:2] = np.nan
    assert len(round_trip(PointCloud(points, times=np.arange(N) * 0.1), tmp_path / "scan.las")) == N - 2
    assert "2 points that are not finite" in caplog.text


def test_attributes_that_are_no_numbers_are_named(tmp_path, caplog):
    write_cloud(tmp_path / "scan.ply", PointCloud(RNG.random((2, 3)), attributes={"name": np.array(["a", "b"])}))
    assert "the attribute 'name'" in caplog.text


def test_suffixes_may_be_in_capitals_and_arrays_are_clouds(tmp_path):
    points = RNG.random((5, 3))
    for suffix in (".PLY", ".NPZ", ".Csv"):
        assert np.array_equal(round_trip(points, tmp_path / f"scan{suffix}").points, points)


# Several clouds in one file


def two_clouds(tmp_path):
    path = tmp_path / "pair.npz"
    clouds = {"p0": RNG.random((4, 3)).astype(np.float32), "p1": RNG.random((6, 3)).astype(np.float32)}
    np.savez(path, **clouds, pose=np.eye(4))
    return path, clouds


def test_a_fragment_names_one_array_of_an_npz(tmp_path):
    path, clouds = two_clouds(tmp_path)
    assert np.array_equal(read_cloud(f"{path}#p1").points, clouds["p1"])
    assert [len(cloud) for cloud in read_clouds(f"{path}#p0")] == [4]


@pytest.mark.parametrize("read", [read_cloud, lambda path: list(read_clouds(path))])
def test_several_clouds_and_none_named_is_an_error_that_lists_them(read, tmp_path):
    path, _ = two_clouds(tmp_path)
    with pytest.raises(CloudFileError, match=r"pair\.npz holds several clouds: p0, p1; name one"):
        read(path)


def test_a_fragment_that_names_nothing_is_an_error_that_lists_the_names(tmp_path):
    path, _ = two_clouds(tmp_path)
    with pytest.raises(CloudFileError, match=r"has no array 'p2'.* p0, p1"):
        read_cloud(f"{path}#p2")


def test_a_file_may_have_a_number_sign_in_its_name(tmp_path):
    points = RNG.random((5, 3))
    assert np.array_equal(round_trip(points, tmp_path / "scan.npz#1.npz").points, points)
    assert np.array_equal(round_trip(points, tmp_path / "scan#1.ply").points, points)


def e57_of_two_scans(path):
    pye57 = pytest.importorskip("pye57")
    with pye57.E57(str(path), mode="w") as file:
        for count in (5, 8):
            points = dict(zip(("cartesianX", "cartesianY", "cartesianZ"), RNG.random((3, count)), strict=True))
            colors = {f"color{name}": RNG.integers(0, 256, count) for name in ("Red", "Green", "Blue")}
            data = points | colors | {"intensity": RNG.random(count)}
            file.write_scan_raw(data, rotation=np.array([0.6, 0, 0, 0.8]), translation=np.array([10.0, 20.0, 30.0]))


def test_an_e57_of_another_writer_is_read_scan_by_scan(tmp_path):
    e57_of_two_scans(tmp_path / "site.e57")
    pye57 = pytest.importorskip("pye57")
    with pye57.E57(str(tmp_path / "site.e57")) as file:
        theirs = [file.read_scan(i, intensity=True, colors=True, ignore_missing_fields=True) for i in range(2)]
    ours = list(read_clouds(tmp_path / "site.e57"))
    for their, our in zip(theirs, ours, strict=True):
        assert np.allclose(our.points.T, [their[f"cartesian{axis}"] for axis in "XYZ"])
        assert np.array_equal(our.colors.T, [their[f"color{name}"] for name in ("Red", "Green", "Blue")])
        assert np.array_equal(our.intensity, their["intensity"])
        assert np.array_equal(our.viewpoint[:3, 3], [10, 20, 30])
    assert len(read_cloud(f"{tmp_path}/site.e57#1")) == len(next(read_clouds(f"{tmp_path}/site.e57#1"))) == 8


@pytest.mark.parametrize(
    ("fragment", "message"), [("", "holds 2 scans; take them"), ("#2", r"no scan '2': it holds 2")]
)
def test_an_e57_of_several_scans_needs_a_choice(fragment, message, tmp_path):
    e57_of_two_scans(tmp_path / "site.e57")
    with pytest.raises(CloudFileError, match=message):
        read_cloud(f"{tmp_path}/site.e57{fragment}")


def test_scans_of_an_e57_are_read_when_their_turn_comes(tmp_path, monkeypatch):
    e57_of_two_scans(tmp_path / "site.e57")
    from fieldalign.clouds.formats import e57

    turns = []
    read_scan = e57._read_scan
    monkeypatch.setattr(e57, "_read_scan", lambda *arguments: (turns.append(1), read_scan(*arguments))[1])
    scans = read_clouds(tmp_path / "site.e57")
    next(scans)
    assert len(turns) == 1
    scans.close()


# Writing is atomic


@pytest.mark.parametrize("suffix", [".ply", ".npz", ".csv"])
def test_a_failed_write_leaves_the_older_file_and_nothing_else(suffix, tmp_path, monkeypatch):
    path = tmp_path / f"scan{suffix}"
    write_cloud(path, plain_cloud())
    before = path.read_bytes()

    def breaks(file, cloud):
        file.write_bytes(b"half a fi")
        raise OSError(28, "No space left on device")

    monkeypatch.setitem(FORMATS, suffix, replace_write(suffix, breaks))
    with pytest.raises(CloudFileError, match=f"scan{suffix} cannot be written as {suffix}: No space left on device"):
        write_cloud(path, plain_cloud())
    assert path.read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def replace_write(suffix, write):
    return FORMATS[suffix]._replace(write=write)


@pytest.mark.parametrize("suffix", WRITABLE)
def test_nothing_but_the_file_is_left_after_a_write(suffix, tmp_path):
    needs_library(suffix)
    for _ in range(2):
        write_cloud(tmp_path / f"scan{suffix}", plain_cloud())
    assert [file.name for file in tmp_path.iterdir()] == [f"scan{suffix}"]


def test_a_written_file_has_the_usual_permissions_and_links_stay_links(tmp_path):
    usual, scan, link = tmp_path / "usual", tmp_path / "scan.ply", tmp_path / "link.ply"
    usual.touch()
    link.symlink_to(scan)
    write_cloud(link, plain_cloud())
    assert link.is_symlink()
    assert scan.stat().st_mode == usual.stat().st_mode


@pytest.mark.parametrize("suffix", WRITABLE)
def test_a_missing_folder_is_one_clear_error(suffix, tmp_path):
    needs_library(suffix)
    with pytest.raises(CloudFileError, match=r"nowhere/scan.* cannot be written: there is no folder .*nowhere"):
        write_cloud(tmp_path / "nowhere" / f"scan{suffix}", plain_cloud())


@pytest.mark.parametrize("suffix", WRITABLE)
def test_a_folder_in_the_place_of_the_file_is_one_clear_error(suffix, tmp_path):
    needs_library(suffix)
    (tmp_path / f"scan{suffix}").mkdir()
    with pytest.raises(CloudFileError, match="cannot be written"):
        write_cloud(tmp_path / f"scan{suffix}", plain_cloud())
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize("name", ["scan.obj", "scan.stl", "scan.docx", "scan"])
def test_only_known_suffixes_are_written(name, tmp_path):
    with pytest.raises(CloudFileError, match=r"its suffix must be one of \.ply, \.pcd"):
        write_cloud(tmp_path / name, plain_cloud())


def test_what_is_no_cloud_is_not_written(tmp_path):
    with pytest.raises(ArgumentError):
        write_cloud(tmp_path / "scan.ply", [1, 2, 3])


# Optional libraries


@pytest.mark.parametrize(
    ("suffix", "module", "extra"),
    [(".las", "laspy", "las"), (".laz", "lazrs", "las"), (".e57", "pye57", "e57")],
)
def test_a_missing_library_names_its_extra(suffix, module, extra, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, module, None)
    path = tmp_path / f"scan{suffix}"
    path.write_bytes(b"something")
    for attempt in (
        lambda: read_cloud(path),
        lambda: list(read_clouds(path)),
        lambda: write_cloud(path, plain_cloud()),
    ):
        with pytest.raises(MissingExtraError, match=rf"fieldalign\[{extra}\]"):
            attempt()
    assert path.read_bytes() == b"something"


def test_the_libraries_are_imported_when_they_are_needed():
    libraries = "{'trimesh', 'pypcd4', 'laspy', 'pye57'}"
    code = f"import sys, fieldalign.clouds.files; print({libraries} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "set()\n"


def test_clouds_that_differ_in_one_part_differ_in_their_files(tmp_path):
    cloud = full_cloud()
    write_cloud(tmp_path / "a.ply", cloud)
    write_cloud(tmp_path / "b.ply", replace(cloud, intensity=cloud.intensity + 1))
    assert (tmp_path / "a.ply").read_bytes() != (tmp_path / "b.ply").read_bytes()
