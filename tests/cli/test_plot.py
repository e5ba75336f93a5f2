"""fieldalign plot: figures as wide as asked for, drawings in a terminal, recordings for Rerun, and what it refuses."""

import errno
import json
import re
import sys

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.motions import apply, translation

pytest.importorskip("matplotlib")
BRAILLE = re.compile("[\u2801-\u28ff]")


@pytest.fixture(scope="module")
def scans(corner, winding, tmp_path_factory):
    """A folder with source.ply, target.ply, the motion between them, a mesh, and a trajectory with its truth."""
    folder = tmp_path_factory.mktemp("plots")
    T = translation([0.2, -0.3, 0.1])
    colors = np.tile([255, 0, 0], (len(corner), 1)).astype(np.uint8)
    fa.write_cloud(folder / "source.ply", fa.PointCloud(corner, colors=colors))
    fa.write_cloud(folder / "target.ply", apply(T, corner))
    (folder / "result.json").write_text(json.dumps({"T_target_source": T.tolist()}))
    poses = {"source.ply": T.tolist(), "target.ply": np.eye(4).tolist(), "nowhere.ply": None}
    (folder / "poses.json").write_text(json.dumps(poses))
    (folder / "part.off").write_text("OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n")
    times, ways = np.arange(60) / 10, [winding(1, 60), winding(1, 60, 0.001)]
    for name, way in zip(("truth", "way"), ways, strict=True):
        fa.write_trajectory(folder / f"{name}.txt", fa.Trajectory(times, way))
    fa.write_trajectory(folder / "kitti.txt", fa.Trajectory(times, ways[1]), "kitti")
    np.savetxt(folder / "cloud.txt", corner[:500])
    return folder, T


PAIR = ("plot", "source.ply", "target.ply", "--pose", "result.json")


def image_of(path):
    from matplotlib.image import imread

    return imread(path)[..., :3]


def share_of(image, color):
    """Of the pixels of a colour, however pale: those whose strongest channel is that of the colour."""
    return np.mean((image.argmax(axis=2) == np.argmax(color)) & (np.ptp(image, axis=2) > 0.2))


# ------------------------------------------------------------------------------------------------------------ figures


@pytest.mark.parametrize(("width", "pixels"), [("8.5cm", 335), ("85mm", 335), ("3in", 300), ("5", 197)])
def test_a_figure_is_as_wide_as_asked_for(call, width, pixels):
    status, out, err = call(*PAIR, "--output", "figure.png", "--width", width, "--dpi", 100)
    assert (status, out, err) == (0, "", "")
    assert abs(image_of("figure.png").shape[1] - pixels) <= 1


def test_both_clouds_are_seen_before_and_after(call):
    call(*PAIR, "--output", "figure.png", "--dpi", 100, "--view", "above", "--view", "side")
    image = image_of("figure.png")
    before, after = np.array_split(image, 2, axis=1)
    assert share_of(before, (1, 0, 0)) > 0.01
    assert share_of(after, (1, 0, 0)) < 0.001  # the same points, below the target's
    assert min(share_of(half, (0, 0, 1)) for half in (before, after)) > 0.01
    call(*PAIR, "--output", "after.png", "--dpi", 100, "--after-only", "--view", "above")
    assert share_of(image_of("after.png"), (1, 0, 0)) < 0.001


def test_views_differ(call):
    seen = []
    for view in ("above", "front", "side", "oblique"):
        call("plot", "source.ply", "--output", f"{view}.png", "--view", view, "--dpi", 60)
        seen.append(image_of(f"{view}.png"))
    assert len({image.tobytes() for image in seen}) == 4


@pytest.mark.parametrize(("suffix", "begin"), [("svg", b"<?xml"), ("pdf", b"%PDF"), ("png", b"\x89PNG")])
def test_each_format_is_what_its_suffix_says(call, suffix, begin):
    assert call(*PAIR, "--output", f"figure.{suffix}", "--dpi", 60, "--title", "two <scans>")[0] == 0
    with open(f"figure.{suffix}", "rb") as file:
        assert file.read(8).startswith(begin)


def test_letters_can_be_read_in_a_column(call):
    import matplotlib

    with matplotlib.rc_context({"svg.fonttype": "none"}):  # letters, not their outlines
        call(*PAIR, "--output", "figure.svg", "--dpi", 60)
        call("plot", "way.txt", "--truth", "truth.txt", "--output", "way.svg")
    for name in ("figure.svg", "way.svg"):
        with open(name) as file:
            sizes = [float(size) for size in re.findall(r"font-size: ([\d.]+)px", file.read())]
        assert len(sizes) >= 3
        assert min(sizes) >= 6.2, name  # an SVG's px is a point here
        assert max(sizes) < 9, name


def test_points_are_as_large_as_asked_for(call):
    white = []
    for size in (0.5, 4):
        call("plot", "source.ply", "--output", "one.png", "--dpi", 100, "--point-size", size)
        white.append(np.mean(image_of("one.png") > 0.99))
    assert white[1] < white[0] - 0.2


def test_colors_of_the_file_and_of_the_distance(call):
    call("plot", "source.ply", "--color", "file", "--output", "one.png", "--dpi", 60)
    assert share_of(image_of("one.png"), (1, 0, 0)) > 0.1
    assert share_of(image_of("one.png"), (0, 0, 1)) == 0
    reds = []
    for options in (("--pose", "result.json"), ()):
        call("plot", "source.ply", "target.ply", *options, "--after-only", "--color", "distance", "--limit", 0.1,
             "--output", "one.png", "--dpi", 60)
        reds.append(share_of(image_of("one.png")[:, :-90], (1, 0, 0)))  # without the bar
    assert reds[0] == 0
    assert reds[1] > 0.05


def test_scans_lie_where_the_poses_say_and_others_are_left_out(call):
    scans = ("source.ply", "target.ply", "nowhere.ply")
    assert call("plot", *scans, "--poses", "poses.json", "--output", "all.png", "--dpi", 60)[0] == 0
    assert call(*PAIR, "--after-only", "--output", "pair.png", "--dpi", 60)[0] == 0
    assert np.array_equal(image_of("all.png"), image_of("pair.png"))


def test_a_mesh_is_drawn_by_places_on_it(call):
    pytest.importorskip("igl")
    assert call("plot", "part.off", "--output", "part.png", "--dpi", 60)[0] == 0
    assert share_of(image_of("part.png"), (0, 0, 1)) > 0.2


@pytest.mark.parametrize("files", [("way.txt", "--truth", "truth.txt"), ("way.txt", "kitti.txt"), ("kitti.txt",),
                                   ("kitti.txt", "--truth", "truth.txt")], ids=" ".join)
def test_trajectories_are_drawn(call, files):
    assert call("plot", *files, "--output", "way.png", "--dpi", 80, "--width", "8cm")[0] == 0
    assert abs(image_of("way.png").shape[1] - 252) <= 1


def test_a_disk_that_refuses_is_named_and_the_older_figure_stays(call, monkeypatch):
    def refuse(path, content):
        with open(path, "wb") as file:
            file.write(content[:100])
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("pathlib.Path.write_bytes", refuse)
    for arguments in (PAIR, ("plot", "way.txt")):
        with open("figure.pdf", "w") as file:
            file.write("older")
        status, _, err = call(*arguments, "--output", "figure.pdf")
        assert (status, err) == (1, "Error: figure.pdf cannot be written: No space left on device\n")
        with open("figure.pdf") as file:
            assert file.read() == "older"


# ---------------------------------------------------------------------------------------------------------- terminals


def test_a_terminal_sees_characters_as_wide_as_it_is(call, monkeypatch):
    for columns in (40, 100):
        monkeypatch.setenv("COLUMNS", str(columns))
        status, out, _ = call(*PAIR, "--after-only")
        lines = out.splitlines()
        assert status == 0
        assert columns * 0.8 < max(map(len, lines[:-1])) < columns
        assert len(BRAILLE.findall(out)) > columns
        assert lines[-1] == "● source.ply  ● target.ply"
        assert "\x1b" not in out  # no terminal here


def test_colors_are_for_terminals_and_no_color_is_obeyed(call, monkeypatch):
    monkeypatch.setattr("fieldalign.cli.plot.sys.stdout.isatty", lambda: True, raising=False)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    assert set(re.findall("\x1b\\[38;5;(\\d+)m", call(*PAIR)[1])) == {"172", "31"}
    monkeypatch.setenv("NO_COLOR", "1")
    assert "\x1b" not in call(*PAIR)[1]


def test_a_terminal_without_braille_sees_plain_characters(call, monkeypatch):
    monkeypatch.setattr("fieldalign.cli.plot._knows_braille", lambda: False)
    _, out, _ = call(*PAIR)
    assert out.isascii()
    assert out.count("#") + out.count(":") > 50


def test_a_trajectory_in_a_terminal(call):
    status, out, _ = call("plot", "way.txt", "--truth", "truth.txt")
    assert status == 0
    assert len(BRAILLE.findall(out)) > 30
    assert re.search(r"● way.txt: 60 poses over [\d.]+ m", out)
    assert "● truth: 60 poses" in out


def test_a_text_of_points_is_a_cloud_and_no_trajectory(call):
    assert "poses" not in call("plot", "cloud.txt")[1]


# ------------------------------------------------------------------------------------------------------------- errors


@pytest.mark.parametrize(("arguments", "what"), [
    (("plot",), "FILES"),
    (("plot", "none.ply"), "none.ply"),
    (("plot", "source.ply", "--pose", "result.json"), "--pose belongs to two clouds"),
    (("plot", "source.ply", "--color", "distance"), "belongs to two clouds"),
    (("plot", "target.ply", "--color", "file"), "target.ply has none"),
    (("plot", "source.ply", "--limit", "1"), "--limit belongs to --color distance"),
    (("plot", "source.ply", "--up", "0,0,0"), "--up must be a direction"),
    (("plot", "source.ply", "--up", "z"), "--up must be a direction"),
    (("plot", "source.ply", "--width", "wide"), "no width such as 8.5cm"),
    (("plot", "source.ply", "--width", "-3"), "from 0.5 to 50 inches"),
    (("plot", "source.ply", "--output", "a.bmp"), "path must end in"),
    (("plot", "source.ply", "--output", "nowhere/a.png"), "folder that exists"),
    (("plot", "source.ply", "--output", "nowhere/a.rrd"), "no folder"),
    (("plot", "source.ply", "--truth", "truth.txt"), "--truth belongs to trajectories"),
    (("plot", "way.txt", "--pose", "result.json"), "--pose belongs to clouds"),
    (("plot", "way.txt", "kitti.txt", "--truth", "truth.txt"), "--truth belongs to one trajectory"),
    (("plot", "source.ply", "--poses", "poses.json"), "poses name scans that are not there"),
], ids=lambda value: " ".join(value[1:]) if isinstance(value, tuple) else "")
def test_what_cannot_be_drawn_is_one_line(call, arguments, what):
    status, out, err = call(*arguments)
    assert (status, out) == (1, "")
    assert err.count("\n") == 1
    assert what in err


# --------------------------------------------------------------------------------------------------------- recordings


def test_without_rerun_the_extra_is_named(call, monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    for arguments in (PAIR, ("plot", "way.txt")):
        status, _, err = call(*arguments, "--output", "scene.rrd")
        assert status == 1
        assert "extra 'rerun'" in err


def recorded(path):
    """What a recording holds: of each entity its rows, and the names of its columns."""
    chunks = pytest.importorskip("rerun.chunk", reason="the extra rerun is not installed")
    found = {}
    for chunk in chunks.RrdReader(path).stream():
        table = chunk.to_record_batch()
        found.setdefault(str(chunk.entity_path), {}).update({name: table.column(name).to_pylist()
                                                            for name in table.schema.names if name != "log_time"})
    return found


def test_a_pair_in_a_recording_is_what_it_was(call, scans, corner):
    pytest.importorskip("rerun", reason="the extra rerun is not installed")
    assert call(*PAIR, "--output", "scene.rrd")[0] == 0
    found, T = recorded("scene.rrd"), scans[1]
    points = np.array(found["/world/source.ply/points"]["Points3D:positions"][0])
    assert len(points) == len(corner)
    moved = found["/world/source.ply"]
    assert moved["pose"] == [0, 1]
    assert np.allclose(moved["Transform3D:translation"], [[[0, 0, 0]], [T[:3, 3]]], atol=1e-6)
    targets = np.array(found["/world/target.ply/points"]["Points3D:positions"][0])
    assert np.allclose(np.sort(targets, axis=0), np.sort(apply(T, points), axis=0), atol=1e-5)


def test_a_trajectory_in_a_recording_runs_along_the_time(call):
    pytest.importorskip("rerun", reason="the extra rerun is not installed")
    assert call("plot", "way.txt", "--truth", "truth.txt", "--output", "way.rrd")[0] == 0
    found = recorded("way.rrd")
    assert {"/world/way.txt/way", "/world/truth/way", "/world/truth/sensor"} <= set(found)
    sensor = found["/world/way.txt/sensor"]
    assert len(sensor["Transform3D:translation"]) == 60
    assert sensor["time"][-1].total_seconds() == pytest.approx(5.9)
