"""Trajectories, and their files: read back as they were, read by evo as we read them, whole or not at all."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.motions import exp_twist, inverse
from fieldalign.odometry import line_file
from fieldalign.odometry.trajectory import Trajectory
from fieldalign.odometry.trajectory_files import TrajectoryWriter, read_trajectory, write_trajectory


@pytest.fixture
def trajectory(winding):
    """50 poses on the clock of a robot of today, to the nanosecond where float64 holds it."""
    return Trajectory(1_700_000_000.123456789 + 0.1 * np.arange(50), winding(3, 50) @ exp_twist(np.full(6, 2.0)))


def assert_equal_to(back, trajectory, times):
    np.testing.assert_array_equal(back.times, times)
    np.testing.assert_allclose(back.poses, trajectory.poses, rtol=0, atol=1e-13)


def test_distances_are_those_along_the_path(winding):
    found = Trajectory(np.arange(40), winding(0, 40))
    steps = [np.linalg.norm(b[:3, 3] - a[:3, 3]) for a, b in zip(found.poses, found.poses[1:], strict=False)]
    np.testing.assert_allclose(found.distances, [0, *np.cumsum(steps)], rtol=1e-12)
    assert len(Trajectory(np.empty(0), np.empty((0, 4, 4))).distances) == 0


def test_rows_are_taken_with_all_that_belongs_to_them(trajectory):
    whole = Trajectory(trajectory.times, trajectory.poses, np.arange(50)[:, None, None] * np.eye(6))
    part = whole[10:20]
    assert len(part) == 10
    assert part.times[0] == whole.times[10]
    assert np.array_equal(part.poses, whole.poses[10:20])
    assert part.covariances[3, 0, 0] == 13


def test_another_sensor_and_another_world(trajectory):
    T = exp_twist(np.array([0.3, -0.2, 0.9, 1.0, 2.0, 3.0]))
    np.testing.assert_allclose(trajectory.in_world(T).poses[7], T @ trajectory.poses[7], atol=1e-12)
    other = trajectory.of_sensor(T)
    np.testing.assert_allclose(other.poses[7], T @ trajectory.poses[7] @ inverse(T), atol=1e-12)
    np.testing.assert_allclose(other.of_sensor(inverse(T)).poses, trajectory.poses, atol=1e-12)


@pytest.mark.parametrize(
    ("times", "poses", "covariances", "words"),
    [
        (np.arange(2), np.eye(4)[None], None, r"poses must have shape \(2, 4, 4\)"),
        (np.zeros((1, 1)), np.eye(4)[None], None, r"times must have shape \(n,\)"),
        ([np.nan], np.eye(4)[None], None, "times must be finite, but row 0"),
        ([0, 1], [np.eye(4), np.full((4, 4), np.inf)], None, "poses must be finite, but row 1"),
        ([0, 1], [np.eye(4), np.diag([1, 1, -1, 1])], None, r"poses\[1\] is none"),
        ([0], [2 * np.eye(4)], None, r"poses\[0\] is none"),
        ([0], [np.eye(4) + np.diag([1e-2, 0, 0, 0])], None, r"poses\[0\] is none"),
        (["now"], np.eye(4)[None], None, "times must be an array of numbers"),
        ([0], np.eye(4)[None], np.eye(6), r"covariances must have shape \(1, 6, 6\)"),
    ],
)
def test_what_is_no_trajectory_is_refused(times, poses, covariances, words):
    with pytest.raises(fa.ArgumentError, match=words):
        Trajectory(times, poses, covariances)


# ---------------------------------------------------------------------------------------------------------------- files


@pytest.mark.parametrize("asked", ["tum", "auto"])
def test_tum_is_read_back(trajectory, tmp_path, asked):
    write_trajectory(tmp_path / "drive.txt", trajectory)
    back = read_trajectory(tmp_path / "drive.txt", asked)
    assert_equal_to(back, trajectory, trajectory.times)
    assert back.has_times


@pytest.mark.parametrize("asked", ["kitti", "auto"])
def test_kitti_is_read_back_exactly_but_for_the_times(trajectory, tmp_path, asked):
    write_trajectory(tmp_path / "drive.txt", trajectory, "kitti")
    back = read_trajectory(tmp_path / "drive.txt", asked)
    assert np.array_equal(back.poses, trajectory.poses)
    assert np.array_equal(back.times, np.arange(50))
    assert not back.has_times
    assert not back[3:5].has_times


def test_evo_reads_the_same(trajectory, tmp_path):
    file_interface = pytest.importorskip("evo.tools.file_interface")
    write_trajectory(tmp_path / "a.tum", trajectory)
    write_trajectory(tmp_path / "a.kitti", trajectory, "kitti")
    tum = file_interface.read_tum_trajectory_file(tmp_path / "a.tum")
    assert_equal_to(Trajectory(tum.timestamps, tum.poses_se3), trajectory, trajectory.times)
    kitti = file_interface.read_kitti_poses_file(tmp_path / "a.kitti")
    assert np.array_equal(kitti.poses_se3, trajectory.poses)


def test_comments_commas_and_blank_lines_are_no_poses(tmp_path):
    (tmp_path / "a.txt").write_text("# time x y z\n\n5,1,2,3,0,0,0,1\n 6 1 2 3 0 0 0.7071068 0.7071068 \n")
    back = read_trajectory(tmp_path / "a.txt")
    assert back.times.tolist() == [5, 6]
    np.testing.assert_allclose(back.poses[1, :3, :3], [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "holds no pose"),
        ("# nothing\n", "holds no pose"),
        ("1 2 3\n", "line 1 has 3 values"),
        ("0 0 0 0 0 0 0 1\n1 0 0 0\n", "line 2 has 4 values"),
        ("0 0 0 0 0 0 0 1\n" + "1 0 0 0 0 1 0 0 0 0 1 0\n", "line 2 has 12 values"),
        ("0 0 0 0 0 0 0 one\n", "line 1 is no row of numbers"),
        ("0 0 0 0 0 0 0 0\n", "the quaternion of pose 0 has length 0.0"),
        ("0 0 0 0 0 0 0 nan\n", "the quaternion of pose 0 has length nan"),
        ("0 0 inf 0 0 0 0 1\n", "poses must be finite"),
        ("1 0 0 0 0 1 0 0 0 0 2 0\n", "poses must be rigid"),
    ],
)
def test_what_is_no_trajectory_file_is_one_clear_error(tmp_path, text, words):
    (tmp_path / "bad.txt").write_text(text)
    with pytest.raises(fa.ArgumentError, match=words) as raised:
        read_trajectory(tmp_path / "bad.txt")
    assert "bad.txt" in str(raised.value)


def test_what_cannot_be_opened_is_one_clear_error(trajectory, tmp_path):
    with pytest.raises(fa.ArgumentError, match="cannot be read as a trajectory: No such file"):
        read_trajectory(tmp_path / "nowhere.txt")
    (tmp_path / "cloud.bin").write_bytes(b"\xff\xfe\xfd")
    with pytest.raises(fa.ArgumentError, match="it is no text"):
        read_trajectory(tmp_path / "cloud.bin")
    with pytest.raises(fa.ArgumentError, match="cannot be written"):
        write_trajectory(tmp_path / "no folder" / "a.txt", trajectory)
    for refused in (read_trajectory, TrajectoryWriter):
        with pytest.raises(fa.ArgumentError, match="format must be one of"):
            refused(tmp_path / "a.txt", "bag")


def test_a_file_is_replaced_whole_or_not_at_all(trajectory, tmp_path, monkeypatch):
    path = tmp_path / "drive.txt"
    path.write_text("old")
    monkeypatch.setattr("fieldalign.odometry.trajectory_files._line", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        write_trajectory(path, trajectory)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


# --------------------------------------------------------------------------------------------------------- line by line


@pytest.mark.parametrize("format", ["tum", "kitti"])
def test_a_growing_file_is_a_trajectory_after_each_pose(trajectory, tmp_path, format):
    whole = tmp_path / "whole.txt"
    write_trajectory(whole, trajectory, format)
    (tmp_path / "grows.txt").write_text("what a run before left\n" * 99)
    with TrajectoryWriter(tmp_path / "grows.txt", format) as writer:
        for k, (time, pose) in enumerate(zip(trajectory.times, trajectory.poses, strict=True), 1):
            writer.add(time, pose)
            assert len(read_trajectory(tmp_path / "grows.txt")) == k
    assert (tmp_path / "grows.txt").read_bytes() == whole.read_bytes()


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="Windows knows no SIGKILL")
def test_a_killed_writer_leaves_all_poses(tmp_path):
    code = (
        "import os, signal, sys, numpy as np\n"
        "from fieldalign.odometry.trajectory_files import TrajectoryWriter\n"
        "writer = TrajectoryWriter(sys.argv[1])\n"
        "for k in range(7): writer.add(k / 3, np.eye(4))\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    done = subprocess.run([sys.executable, "-c", code, tmp_path / "a.txt"], env=_environment(), check=False)
    assert done.returncode == -signal.SIGKILL
    assert read_trajectory(tmp_path / "a.txt").times.tolist() == [k / 3 for k in range(7)]


def _environment():
    return os.environ | {"PYTHONPATH": str(Path(fa.__file__).parents[1])}


def test_a_full_disk_leaves_whole_lines(tmp_path, monkeypatch):
    writer = TrajectoryWriter(tmp_path / "a.txt")
    writer.add(0.0, np.eye(4))
    write = os.write

    def full(file, data):
        """Takes ten bytes, then nothing."""
        if len(data) < 20:
            raise OSError(28, "No space left on device")
        return write(file, data[: len(data) - 10])

    monkeypatch.setattr(line_file.os, "write", full)
    with pytest.raises(fa.RunError, match=r"a\.txt cannot be written: No space left"):
        writer.add(1.0, np.eye(4))
    monkeypatch.undo()
    writer.close()
    assert read_trajectory(tmp_path / "a.txt").times.tolist() == [0]


def test_a_file_that_cannot_be_begun_is_one_clear_error(tmp_path):
    with pytest.raises(fa.RunError, match="cannot be written: No such file"):
        TrajectoryWriter(tmp_path / "no folder" / "a.txt")


def test_closing_twice_is_closing(tmp_path):
    writer = TrajectoryWriter(tmp_path / "a.txt")
    writer.close()
    writer.close()
