"""fieldalign evaluate: the numbers, as people and as programs read them, and what is wrong with the files."""

import json

import numpy as np
import pytest

from fieldalign.evaluation import evaluate
from fieldalign.motions import exp_twist, inverse
from fieldalign.odometry.trajectory import Trajectory
from fieldalign.odometry.trajectory_files import write_trajectory

T_CAMERA_LIDAR = exp_twist(np.array([1.2, -1.2, 1.2, 0.0, -0.08, -0.27]))


@pytest.fixture(scope="module")
def scans(tmp_path_factory, winding):
    """A folder with a drive and its truth, in both formats, and the camera's truth with its calibration."""
    folder = tmp_path_factory.mktemp("drives")
    truth, found = (Trajectory(100 + np.arange(300) / 10, winding(9, 300, noise)) for noise in (0.0, 1e-3))
    for form in ("tum", "kitti"):
        write_trajectory(folder / f"{form}.txt", found, form)
        write_trajectory(folder / f"truth_{form}.txt", truth, form)
    write_trajectory(folder / "part.txt", found[100:250])
    write_trajectory(folder / "late.txt", Trajectory(truth.times + 1000, truth.poses))
    write_trajectory(folder / "camera.txt", truth.of_sensor(T_CAMERA_LIDAR), "kitti")
    (folder / "calib.txt").write_text("Tr: " + " ".join(map(repr, T_CAMERA_LIDAR[:3].ravel().tolist())))
    return folder, (found, truth)


def numbers(call, *args):
    status, out, err = call("evaluate", *args, "--json", "-")
    assert (status, err) == (0, "")
    return json.loads(out)


def test_the_numbers_are_printed_in_a_few_lines(call, scans):
    status, out, err = call("evaluate", "tum.txt", "truth_tum.txt")
    assert (status, err) == (0, "")
    found = evaluate(*scans[1])
    assert out == str(found) + "\n"
    lines = out.splitlines()
    assert lines[0].startswith("300 poses paired, of 300 and 300 of the truth, over ")
    assert lines[1].startswith(f"KITTI  {found.segments.translation_percent:.4g} %, ")
    assert [line[:5].strip() for line in lines[1:]] == ["KITTI", "ATE", "RPE"]


def test_json_holds_all_numbers(call, scans):
    plain, expected = numbers(call, "tum.txt", "truth_tum.txt"), evaluate(*scans[1]).to_dict()
    assert plain.keys() == expected.keys()
    for part in ("rmse", "maximum"):
        assert plain["ate"]["translation"][part] == pytest.approx(expected["ate"]["translation"][part], rel=1e-9)
    assert plain["kitti"]["by_length_m"].keys() == {"100", "200", "300"}
    assert plain["kitti"]["translation_percent"] == pytest.approx(expected["kitti"]["translation_percent"], rel=1e-9)


def test_a_file_is_written_whole(call, scans):
    status, out, _ = call("evaluate", "tum.txt", "truth_tum.txt", "--json", "out.json")
    assert status == 0
    assert out.startswith("300 poses")
    assert json.loads((scans[0] / "out.json").read_text())["paired"] == 300


def test_both_formats_say_the_same(call):
    tum, kitti = (numbers(call, f"{form}.txt", f"truth_{form}.txt") for form in ("tum", "kitti"))
    assert kitti["kitti"]["rotation_deg_per_m"] == pytest.approx(tum["kitti"]["rotation_deg_per_m"], rel=1e-6)
    mixed = numbers(call, "tum.txt", "truth_kitti.txt", "--format", "tum", "--truth-format", "kitti", "--by-row")
    assert mixed["ate"]["translation"]["rmse"] == pytest.approx(tum["ate"]["translation"]["rmse"], rel=1e-9)


def test_the_lidars_trajectory_against_the_cameras_truth(call):
    plain = numbers(call, "kitti.txt", "truth_kitti.txt")
    camera = numbers(call, "kitti.txt", "camera.txt", "--calib", "calib.txt")
    # The camera's path is not as long as the lidar's, so some segments end a frame earlier or later.
    assert camera["kitti"]["rotation_deg_per_m"] == pytest.approx(plain["kitti"]["rotation_deg_per_m"], rel=0.05)
    without = numbers(call, "kitti.txt", "camera.txt")
    assert without["kitti"]["translation_percent"] > 10 * camera["kitti"]["translation_percent"]


def test_a_part_of_the_drive_is_paired_by_its_times(call):
    plain = numbers(call, "part.txt", "truth_tum.txt", "--delta", 10, "--all-pairs", "--align", "origin")
    assert plain["paired"] == 150
    assert plain["poses"] == {"trajectory": 150, "truth": 300}
    assert plain["alignment"] == "origin"
    assert (plain["rpe"]["delta"], plain["rpe"]["unit"], plain["rpe"]["all_pairs"]) == (10, "frames", True)


def test_a_delta_of_metres(call, scans):
    plain = numbers(call, "tum.txt", "truth_tum.txt", "--delta", 12.5, "--unit", "metres")
    expected = evaluate(*scans[1], delta=12.5, unit="metres").to_dict()["rpe"]["translation"]["mean"]
    assert plain["rpe"]["translation"]["mean"] == pytest.approx(expected, rel=1e-9)


def test_a_plot_is_drawn(call, scans):
    pytest.importorskip("matplotlib")
    assert call("evaluate", "part.txt", "truth_tum.txt", "--plot", "plot.svg")[0] == 0
    assert (scans[0] / "plot.svg").read_bytes().startswith(b"<?xml")


def test_a_cameras_drive_is_drawn_from_above(call, scans, monkeypatch):
    """Not along the axis that the camera looks along."""
    module = pytest.importorskip("fieldalign.reports.trajectory_picture")
    drawn = []
    monkeypatch.setattr(module, "trajectory_picture", lambda *args: drawn.extend(args))
    assert call("evaluate", "kitti.txt", "camera.txt", "--calib", "calib.txt", "--plot", "plot.png")[0] == 0
    truth = scans[1][1]
    T = inverse(T_CAMERA_LIDAR)
    expected = truth.positions + truth.poses[:, :3, :3] @ T[:3, 3]  # the camera's places in the lidar's world
    np.testing.assert_allclose(drawn[2].positions, expected, atol=1e-9)


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (("nowhere.txt", "truth_tum.txt"), "nowhere.txt cannot be read as a trajectory"),
        (("calib.txt", "truth_tum.txt"), "calib.txt line 1 has 13 values"),
        (("tum.txt", "truth_kitti.txt"), "the trajectory has times, but the truth has none"),
        (("kitti.txt", "truth_tum.txt"), "the truth has times, but the trajectory has none"),
        (("tum.txt", "late.txt"), "no pose lies within 0.01 s of one of the truth: its times go from 100 to 129.9"),
        (("part.txt", "truth_tum.txt", "--by-row"), "as many poses as the truth"),
        (("tum.txt", "truth_tum.txt", "--delta", "1.5"), "delta must be an integer from 1 to 10000000"),
        (("tum.txt", "truth_tum.txt", "--json", "no/folder/a.json"), "there is no folder"),
        (("tum.txt", "truth_tum.txt", "--plot", "a.bmp"), "path"),
        (("tum.txt", "camera.txt", "--calib", "tum.txt"), "is no calibration of KITTI"),
    ],
)
def test_what_is_wrong_is_one_line(call, args, words):
    status, out, err = call("evaluate", *args)
    assert (status, out) == (1, "")
    assert err.startswith("Error: ")
    assert len(err.splitlines()) == 1
    assert words in err


def test_left_out_of_the_camera_means_the_inverse(scans):
    """What is written as the camera's is what KITTI means by it: T_camera_lidar P T_lidar_camera."""
    found = scans[1][1].of_sensor(T_CAMERA_LIDAR)
    np.testing.assert_allclose(found.poses[5], T_CAMERA_LIDAR @ scans[1][1].poses[5] @ inverse(T_CAMERA_LIDAR))
