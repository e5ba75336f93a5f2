"""fieldalign deviation, and meshes and volumes as source and target of register and verify."""

import json
import sys

import numpy as np
import pytest
import trimesh

import fieldalign as fa
from fieldalign.fields import MeshField
from fieldalign.fields.files import read_field, write_mesh
from fieldalign.motions import apply, inverse

pytest.importorskip("igl")

NOISE = 0.005


def part():
    """A lump that no turn brings onto itself."""
    ball = trimesh.creation.icosphere(2)
    d = np.asarray(ball.vertices)
    radius = 1 + 0.3 * d[:, 0] + 0.25 * np.sin(3 * d[:, 1] + d[:, 0]) + 0.3 * np.cos(4 * d[:, 2] * d[:, 0])
    vertices = (d * radius[:, None] * [1.3, 1, 0.8]).astype(np.float32)
    return MeshField(vertices, ball.faces)


@pytest.fixture(scope="module")
def scans(tmp_path_factory, any_motion):
    """A folder with part.stl, aligned.ply on it, scan.ply away from it, truth.txt; and the motion between."""
    folder, rng, solid = tmp_path_factory.mktemp("part"), np.random.default_rng(3), part()
    T = any_motion(rng, 2.0)
    points = solid.spread(6000) + NOISE * rng.normal(size=(6000, 3))
    write_mesh(folder / "part.stl", solid.vertices, solid.faces)
    write_mesh(folder / "moved.ply", apply(inverse(T), solid.vertices), solid.faces)
    write_mesh(folder / "open.obj", solid.vertices, solid.faces[:-9])
    fa.write_cloud(folder / "aligned.ply", fa.PointCloud(points, intensity=np.arange(6000)))
    fa.write_cloud(folder / "scan.ply", fa.PointCloud(apply(inverse(T), points), intensity=np.arange(6000)))
    np.savetxt(folder / "truth.txt", T)
    return folder, T


def is_one_error(status, out, err):
    lines = err.splitlines()
    return status == 1 and out == "" and len(lines) == 1 and lines[0].startswith("Error: ")


# ------------------------------------------------------------------------------------------------------------ deviation


def test_the_numbers_are_printed_in_a_few_lines(call):
    status, out, err = call("deviation", "aligned.ply", "part.stl")
    assert (status, err) == (0, "")
    expected = fa.deviation("aligned.ply", "part.stl")
    assert out == str(expected) + "\n"
    assert out.startswith("6000 deviations, negative inside\nmean ")
    assert expected.statistics.standard_deviation == pytest.approx(NOISE, rel=0.05)


@pytest.mark.parametrize(("tolerance", "expected"), [(1, 0), (0.01, 3)])
def test_the_status_says_whether_all_are_within_the_tolerance(call, tolerance, expected):
    status, out, _ = call("deviation", "aligned.ply", "part.stl", "--tolerance", tolerance)
    assert status == expected
    assert f"within the tolerance of {tolerance}" in out


def test_a_pose_brings_the_scan_there(call):
    there, moved = (
        json.loads(call("deviation", *arguments, "--json", "-")[1])["statistics"]
        for arguments in (("aligned.ply", "part.stl"), ("scan.ply", "part.stl", "--pose", "truth.txt"))
    )
    assert all(there[name] == pytest.approx(moved[name], abs=1e-9) for name in there if there[name] is not None)


def test_what_register_wrote_is_a_pose(call):
    assert call("register", "scan.ply", "part.stl", "--json", "result.json")[0] == 0
    status, out, _ = call("deviation", "scan.ply", "part.stl", "--pose", "result.json", "--tolerance", 0.03)
    assert status == 0
    assert "100 % within the tolerance" in out


def test_json_is_what_the_library_answers(call):
    status, out, err = call("deviation", "aligned.ply", "part.stl", "--tolerance", 0.01, "--json", "-")
    assert (status, err) == (3, "")
    assert json.loads(out) == fa.deviation("aligned.ply", "part.stl", tolerance=0.01).to_dict()
    call("deviation", "aligned.ply", "part.stl", "--tolerance", 0.01, "--json", "numbers.json")
    with open("numbers.json") as file:
        assert json.load(file) == json.loads(out)


def test_the_output_is_coloured_and_keeps_all_that_the_scan_had(call):
    assert call("deviation", "aligned.ply", "part.stl", "--output", "coloured.ply")[0] == 0
    coloured, found = fa.read_cloud("coloured.ply"), fa.deviation("aligned.ply", "part.stl")
    assert np.array_equal(coloured.attributes["deviation"], found.values)
    assert np.array_equal(coloured.intensity, np.arange(6000))
    assert np.array_equal(coloured.colors, found.colored(coloured).colors)
    assert np.array_equal(coloured.points, fa.read_cloud("aligned.ply").points)


def test_the_outputs_lie_in_the_frame_of_the_part(call):
    arguments = ("--pose", "truth.txt", "--output", "coloured.ply", "--csv", "deviations.csv")
    assert call("deviation", "scan.ply", "part.stl", *arguments)[0] == 0
    expected = fa.read_cloud("aligned.ply").points
    for name in ("coloured.ply", "deviations.csv"):
        assert np.abs(fa.read_cloud(name).points - expected).max() < 1e-12


def test_the_csv_has_a_row_for_each_point(call):
    gaps = fa.read_cloud("aligned.ply").points.copy()
    gaps[5] = np.nan
    np.save("gaps.npy", gaps)
    status, out, _ = call("deviation", "gaps.npy", "part.stl", "--csv", "deviations.csv")
    assert status == 0
    assert "1 missing returns (NaN) left out" in out
    with open("deviations.csv") as file:
        assert file.readline() == "x,y,z,deviation\n"
        table = np.loadtxt(file, delimiter=",")
    assert np.array_equal(table[:, :3], gaps, equal_nan=True)
    assert np.array_equal(table[:, 3], fa.deviation(gaps, "part.stl").values, equal_nan=True)


def test_an_open_part_and_another_scan_have_no_side(call):
    for reference in ("open.obj", "aligned.ply"):
        status, out, _ = call("deviation", "aligned.ply", reference)
        assert status == 0
        assert "without a side" in out


@pytest.mark.parametrize("more", [(), ("--tolerance", "0.01")])
@pytest.mark.parametrize("reference", ["part.stl", "open.obj"])
def test_a_histogram_is_drawn(call, monkeypatch, more, reference):
    pytest.importorskip("matplotlib")
    monkeypatch.setattr("fieldalign.reports.histogram._DPI", 40)
    status, _, err = call("deviation", "aligned.ply", reference, "--picture", "histogram.png", *more)
    assert status in (0, 3)
    assert err == ""
    image = pytest.importorskip("matplotlib.image").imread("histogram.png")[..., :3]
    red = image[..., 0] - image[..., 2]
    assert (red > 0.3).sum() > 20
    assert ((red < -0.3).sum() > 20) == (reference == "part.stl")


@pytest.mark.parametrize("name", ["histogram.svg", "histogram.pdf"])
def test_of_a_scan_without_any_deviation_too(call, name):
    pytest.importorskip("matplotlib")
    assert call("deviation", "aligned.ply", "aligned.ply", "--picture", name)[0] == 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("aligned.ply",), "PART"),
        (("nowhere.ply", "part.stl"), "nowhere.ply does not exist"),
        (("aligned.ply", "nowhere.stl"), "nowhere.stl does not exist"),
        (("aligned.ply", "cut.stl"), "cut.stl is truncated or no STL"),
        (("aligned.ply", "part.step"), "suffix '.step'"),
        (("cut.ply", "part.stl"), "cut.ply"),
        (("aligned.ply", "part.stl", "--pose", "nowhere.txt"), "pose must be"),
        (("aligned.ply", "part.stl", "--pose", "1 0 0 0"), "pose must hold 16 numbers"),
        (("aligned.ply", "part.stl", "--tolerance", "0"), "tolerance must be a positive number"),
        (("aligned.ply", "part.stl", "--tolerance", "much"), "--tolerance"),
        (("nowhere.ply", "part.stl", "--output", "coloured.abc"), "coloured.abc cannot be written"),
        (("nowhere.ply", "part.stl", "--output", "away/coloured.ply"), "there is no folder away"),
        (("nowhere.ply", "part.stl", "--csv", "deviations.ply"), "--csv must end in .csv"),
        (("nowhere.ply", "part.stl", "--csv", "away/deviations.csv"), "there is no folder away"),
        (("nowhere.ply", "part.stl", "--picture", "histogram.bmp"), ".png"),
        (("nowhere.ply", "part.stl", "--picture", "away/histogram.png"), "away"),
        (("nowhere.ply", "part.stl", "--json", "away/numbers.json"), "there is no folder away"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_an_error_of_the_user_is_one_line_and_leaves_nothing(call, scans, arguments, words):
    """What cannot be written is said before anything is read."""
    (scans[0] / "cut.stl").write_bytes((scans[0] / "part.stl").read_bytes()[:-20])
    (scans[0] / "cut.ply").write_bytes((scans[0] / "aligned.ply").read_bytes()[:-20])
    (scans[0] / "part.step").write_text("ISO-10303-21;")
    before = set(scans[0].rglob("*"))
    answer = call("deviation", *arguments)
    assert is_one_error(*answer)
    assert words in answer[2]
    assert set(scans[0].rglob("*")) == before


def test_a_failed_call_leaves_an_older_output_as_it_was(call, scans):
    (scans[0] / "coloured.ply").write_text("old")
    assert is_one_error(*call("deviation", "aligned.ply", "nowhere.stl", "--output", "coloured.ply"))
    assert (scans[0] / "coloured.ply").read_text() == "old"


def test_without_matplotlib_the_extra_is_named(call, monkeypatch):
    for name in [name for name in sys.modules if name.split(".")[0] == "matplotlib"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    answer = call("deviation", "aligned.ply", "part.stl", "--picture", "histogram.png")
    assert is_one_error(*answer)
    assert "fieldalign[viz]" in answer[2]


# ---------------------------------------------------------------------------------------- register and verify a surface


def pose_of(out):
    return np.array([line.split() for line in out.splitlines()[1:5]], float)


def is_near(found, T):
    places = part().vertices
    return np.abs(apply(found @ inverse(T), places) - places).max() < NOISE


def test_a_scan_is_registered_to_the_triangles_of_a_file(call, scans):
    status, out, err = call("register", "scan.ply", "part.stl", "--output", "found.ply")
    assert (status, err) == (0, "")
    assert is_near(pose_of(out), scans[1])
    assert np.abs(pose_of(out) - fa.register("scan.ply", part()).T_target_source).max() < 1e-8
    assert np.array_equal(fa.read_cloud("found.ply").intensity, np.arange(6000))


@pytest.mark.parametrize("name", ["found.ply", "found.stl", "found.obj", "found.off"])
def test_a_mesh_is_registered_to_a_scan_and_written_moved(call, scans, name):
    status, out, err = call("register", "moved.ply", "aligned.ply", "--output", name)
    assert (status, err) == (0, "")
    assert is_near(pose_of(out), scans[1])
    found, source = read_field(name), read_field("moved.ply")
    moved = MeshField(apply(pose_of(out), source.vertices), source.faces)
    x = np.random.default_rng(0).normal(size=(100, 3))
    assert found.signed
    assert np.allclose(found.sample(x).value, moved.sample(x).value, atol=1e-6)


def test_a_mesh_is_registered_to_a_mesh_with_a_picture(call, scans, monkeypatch):
    pytest.importorskip("matplotlib")
    monkeypatch.setattr("fieldalign.reports.picture._DPI", 40)
    status, out, err = call("register", "moved.ply", "part.stl", "--picture", "both.png")
    assert (status, err) == (0, "")
    assert np.allclose(pose_of(out), scans[1], atol=1e-6)
    assert (scans[0] / "both.png").read_bytes().startswith(b"\x89PNG")


def volume_of(solid, path):
    low, high = solid.bounds
    step = 0.05
    axes = [np.arange(a - 0.2, b + 0.2, step) for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    values = solid.sample(grid.reshape(-1, 3)).value.reshape(grid.shape[:3])
    np.savez(path, values=values, origin=low - 0.2, spacing=step)


def test_a_volume_is_a_target_and_a_source_but_is_not_written(call, scans):
    volume_of(part(), "volume.npz")
    status, out, err = call("register", "scan.ply", "volume.npz")
    assert (status, err) == (0, "")
    assert is_near(pose_of(out), scans[1])
    status, out, err = call("register", "volume.npz", "scan.ply")
    assert (status, err) == (0, "")
    assert is_near(inverse(pose_of(out)), scans[1])
    answer = call("register", "volume.npz", "scan.ply", "--output", "moved_volume.ply")
    assert is_one_error(*answer)
    assert "the source must be points or triangles" in answer[2]
    assert call("deviation", "scan.ply", "volume.npz", "--pose", "truth.txt", "--tolerance", "0.05")[0] == 0


def test_verify_takes_triangles(call):
    status, out, err = call("verify", "scan.ply", "part.stl", "truth.txt")
    assert (status, err) == (0, "")
    assert str(fa.Reason.ACCEPTED) in out
    assert call("verify", "moved.ply", "scan.ply", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1")[0] == 0
    assert call("verify", "scan.ply", "part.stl", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1")[0] == 3


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("moved.ply", "scan.ply", "--output", "found.pcd"), "the suffix of a mesh must be one of"),
        (("moved.ply", "scan.ply", "--output", "away/found.stl"), "there is no folder away"),
        (("scan.ply", "part.stl", "--output", "found.stl"), "found.stl cannot be written"),
        (("scan.ply", "cut.stl"), "cut.stl is truncated or no STL"),
        (("cut.stl", "scan.ply"), "cut.stl is truncated or no STL"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_an_error_with_a_mesh_is_one_line(call, scans, arguments, words):
    (scans[0] / "cut.stl").write_bytes((scans[0] / "part.stl").read_bytes()[:-20])
    before = set(scans[0].rglob("*"))
    answer = call("register", *arguments)
    assert is_one_error(*answer)
    assert words in answer[2]
    assert set(scans[0].rglob("*")) == before


def test_without_libigl_the_extra_is_named(call, monkeypatch):
    monkeypatch.setitem(sys.modules, "igl", None)
    for verb in ("register", "deviation"):
        answer = call(verb, "scan.ply", "part.stl")
        assert is_one_error(*answer)
        assert "fieldalign[mesh]" in answer[2]
