"""fieldalign odometry: a drive through a room becomes files, and what is said of frames that are not tracked."""

import json
import sys

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.cli.progress import bar
from fieldalign.motions import translation

FRAMES = 14
@pytest.fixture(scope="module")
def scans(tmp_path_factory, seen_from):
    """A folder with a drive of a folder of clouds, its stamps and its truth; frame 6 of `broken` cannot be read."""
    folder = tmp_path_factory.mktemp("drives")
    poses = np.stack([translation([-3 + 0.3 * k, 0.02 * k**2, 1.5 + 0.3 * (k > 7)]) for k in range(FRAMES)])
    times = 100 + np.arange(FRAMES) / 10
    for name in ("drive", "broken"):
        (folder / name).mkdir()
        (folder / name / "times.txt").write_text("\n".join(map(str, times.tolist())))
    for k, pose in enumerate(poses):
        points = seen_from(pose[:3, 3], k).astype(np.float32)
        for name in ("drive", "broken"):
            fa.write_cloud(folder / name / f"{k}.ply", fa.PointCloud(points))
    (folder / "broken" / "6.ply").write_bytes(b"ply\nnothing")
    fa.write_trajectory(folder / "truth.txt", fa.Trajectory(times, poses))
    fa.write_trajectory(folder / "truth_kitti.txt", fa.Trajectory(times, poses), "kitti")
    return folder, poses


def test_a_drive_becomes_files(call, scans, tmp_path):
    status, out, err = call("odometry", "drive", "--output", tmp_path / "out", "--truth", "truth.txt")
    assert (status, err) == (0, "")
    assert {entry.name for entry in (tmp_path / "out").iterdir()} == {
        "trajectory_tum.txt", "trajectory_kitti.txt", "frames.csv", "map.ply", "summary.json", "trajectory.png",
    }
    found = fa.read_trajectory(tmp_path / "out" / "trajectory_tum.txt")
    evaluation = fa.evaluate(found, fa.read_trajectory(scans[0] / "truth.txt"))
    assert evaluation.absolute.translation.max() < 0.02
    assert out.startswith(f"{FRAMES} frames over ")
    assert str(evaluation).splitlines()[0] in out
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    rmse = summary["evaluation"]["ate"]["translation"]["rmse"]
    assert rmse == pytest.approx(evaluation.to_dict()["ate"]["translation"]["rmse"], rel=1e-6)
    world = scans[1][0]
    places = fa.read_cloud(tmp_path / "out" / "map.ply").transformed(world).points
    assert len(places) > 300
    assert np.abs(places).max() < 15.1


def test_truth_without_times_is_compared_row_for_row(call, tmp_path):
    status, out, _ = call("odometry", "drive", "--output", tmp_path, "--truth", "truth_kitti.txt", "--no-deskew")
    assert status == 0
    assert f"{FRAMES} poses paired" in out


def test_a_frame_that_is_not_tracked_is_told(call, tmp_path):
    status, out, _ = call("odometry", "broken", "--output", tmp_path)
    assert status == 3
    assert "missing: 1 frame (6)" in out
    assert "\nframe 6: " in out
    assert json.loads((tmp_path / "summary.json").read_text())["missing"] == [6]


def test_loops_are_told_even_if_there_are_none(call, tmp_path):
    status, out, _ = call("odometry", "drive", "--output", tmp_path, "--loops", "--report", tmp_path / "way.svg")
    assert status == 0
    assert "loops: 0 of 0 pairs accepted; the trajectory was left as it was" in out
    assert json.loads((tmp_path / "summary.json").read_text())["loops"]["mended"] is False
    assert (tmp_path / "way.svg").exists()
    assert not (tmp_path / "trajectory.png").exists()
    assert (tmp_path / "odometry_tum.txt").read_bytes() == (tmp_path / "trajectory_tum.txt").read_bytes()


def test_without_matplotlib_there_is_a_sentence(call, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    status, out, _ = call("odometry", "drive", "--output", tmp_path)
    assert status == 0
    assert "no picture: drawing a picture needs the extra 'viz'" in out
    assert not (tmp_path / "trajectory.png").exists()
    status, _, err = call("odometry", "drive", "--output", tmp_path, "--report", tmp_path / "way.png")
    assert status == 1
    assert "extra 'viz'" in err


def test_errors_are_one_line(call, tmp_path):
    for args, what in (
        (("nowhere", "--output", tmp_path), "nowhere does not exist"),
        (("drive", "--output", tmp_path, "--truth", "none.txt"), "none.txt cannot be read"),
        (("drive", "--output", tmp_path, "--topic", "/points"), "topic names a part of a bag"),
        (("drive", "--output", tmp_path, "--report", "way.bmp"), "path must end in"),
        (("drive",), "--output"),
    ):
        status, _, err = call("odometry", *args)
        assert status == 1
        assert what in err
        assert err.count("\n") == 1


def test_a_bar_of_unknown_length():
    with bar() as tell:
        tell("frames", 0, None)
        tell("frames", 3, None)


def test_a_report_that_is_a_page_comes_beside_the_picture(call, tmp_path):
    arguments = "--output", tmp_path / "out", "--truth", "truth.txt", "--report", tmp_path / "drive.html"
    status, _, _ = call("odometry", "broken", *arguments)
    assert status == 3
    text = (tmp_path / "drive.html").read_text("utf-8")
    assert "<th scope=row>frame 6</th>" in text
    assert 'class="truth"' in text
    assert (tmp_path / "out" / "trajectory.png").exists()
