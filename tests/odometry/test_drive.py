"""A whole drive with an odometry that knows the way: what is written, of which frames, and however it ends."""

import csv
import json
import os
import signal
import subprocess
import sys
from enum import Enum
from pathlib import Path
from threading import Thread
from types import SimpleNamespace

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.odometry import drive
from fieldalign.odometry.frames_file import UPPER
from fieldalign.odometry.sequences import Frame, Sequence
from fieldalign.odometry.trajectory_files import read_trajectory

FILES = ["frames.csv", "map.ply", "summary.json", "trajectory_kitti.txt", "trajectory_tum.txt"]


class Reason(Enum):
    TRACKED = "tracked"
    EMPTY = "empty"


class KnownWay:
    """An odometry that goes a given way, whatever it sees."""

    def __init__(self, poses):
        self.poses, self.last, self.calls = poses, None, []

    @property
    def map(self):
        return fa.PointCloud(self.poses[: len(self.calls), :3, 3])

    def step(self, cloud, times=None, stamp=None):
        if cloud is not None and np.isinf(cloud.points).any():
            raise fa.ArgumentError("cloud must be finite")
        number = len(self.calls)
        self.calls.append((None if cloud is None else len(cloud), times, stamp))
        self.last = SimpleNamespace(
            pose=self.poses[number], covariance=np.diag(np.arange(6) + number / 8) + 0.5,
            reason=Reason.EMPTY if cloud is None else Reason.TRACKED, seconds={"thin": 0.001, "align": 0.002},
        )
        return self.last.pose


def sequence_of(clouds, stamps=None, stop_at=None):
    """A sequence of clouds; a sentence is the reason of a missing one. At a frame, this process is interrupted."""

    def frames():
        for k, cloud in enumerate(clouds):
            if k == stop_at:
                signal.raise_signal(signal.SIGINT)
            stamp = None if stamps is None else stamps[k]
            is_there = not isinstance(cloud, str)
            yield Frame(k, stamp, cloud if is_there else None, "" if is_there else cloud)

    return Sequence("made", "a made sequence", len(clouds), frames)


@pytest.fixture
def clouds(rng):
    return [fa.PointCloud(rng.normal(size=(30 + k, 3)), times=np.linspace(0, 0.1, 30 + k)) for k in range(12)]


@pytest.fixture
def odometry(winding):
    return KnownWay(winding(5, 12))


def rows_of(folder):
    with open(folder / "frames.csv", newline="") as file:
        return list(csv.DictReader(file))


def names_in(folder):
    return sorted(entry.name for entry in folder.iterdir())


def test_everything_is_written(clouds, odometry, tmp_path):
    stamps = 1_700_000_000 + 0.1 * np.arange(12)
    heard = []
    found = drive.run(sequence_of(clouds, stamps), odometry, tmp_path / "new" / "out", lambda *args: heard.append(args))
    folder = tmp_path / "new" / "out"
    assert names_in(folder) == FILES
    assert heard == [(k, 12) for k in range(1, 13)]
    assert [call[0] for call in odometry.calls] == [len(cloud) for cloud in clouds]
    assert all(call[1] is cloud.times for call, cloud in zip(odometry.calls, clouds, strict=True))
    assert [call[2] for call in odometry.calls] == stamps.tolist()
    tum, kitti = (read_trajectory(folder / f"trajectory_{name}.txt", name) for name in ("tum", "kitti"))
    assert np.array_equal(tum.times, stamps)
    assert np.array_equal(kitti.poses, odometry.poses)
    np.testing.assert_allclose(tum.poses, odometry.poses, atol=1e-13)
    assert np.array_equal(found.trajectory.poses, odometry.poses)
    assert np.array_equal(fa.read_cloud(folder / "map.ply").points, odometry.map.points)


def test_the_frames_are_told_of_line_by_line(clouds, odometry, tmp_path):
    clouds[3] = "frame 3, it is said,\nis lost"
    found = drive.run(sequence_of(clouds), odometry, tmp_path)
    rows = rows_of(tmp_path)
    assert [int(row["frame"]) for row in rows] == list(range(12))
    assert [row["reason"] for row in rows] == ["tracked"] * 3 + ["empty"] + ["tracked"] * 8
    assert rows[3]["message"] == "frame 3, it is said, is lost"
    assert rows[3]["points"] == "0"
    assert rows[4]["points"] == "34"
    assert all(row["message"] == "" for row in rows[4:])
    assert float(rows[5]["step"]) >= 0
    triangle = [float(rows[5][f"c{i}{j}"]) for i, j in zip(*UPPER, strict=True)]
    expected = found.trajectory.covariances[5]
    assert triangle == expected[UPPER].tolist()
    assert expected[2, 2] == 2 + 5 / 8 + 0.5


def test_the_summary_says_how_far_and_how_fast(clouds, odometry, tmp_path):
    clouds[2] = clouds[7] = "lost"
    found = drive.run(sequence_of(clouds), odometry, tmp_path)
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary == found.to_dict()
    assert summary["frames"] == summary["frames_of_the_sequence"] == 12
    assert summary["missing"] == [2, 7]
    assert summary["reasons"] == {"tracked": 10, "empty": 2}
    assert summary["length"] == pytest.approx(found.trajectory.distances[-1])
    assert summary["times"] == "frame numbers"
    assert summary["seconds_a_frame_by_stage"] == {"thin": 0.001, "align": 0.002}
    assert summary["seconds_a_frame"].keys() == {"read", "step", "cpu"}
    assert summary["interrupted"] is False


def test_without_stamps_the_times_are_the_frames_numbers(clouds, odometry, tmp_path):
    found = drive.run(sequence_of(clouds), odometry, tmp_path)
    assert read_trajectory(tmp_path / "trajectory_tum.txt").times.tolist() == list(range(12))
    assert all(call[2] is None for call in odometry.calls)
    assert not found.trajectory.has_times


def test_a_cloud_that_the_odometry_refuses_is_missing(clouds, odometry, tmp_path):
    clouds[1] = fa.PointCloud(np.full((5, 3), np.inf))
    found = drive.run(sequence_of(clouds), odometry, tmp_path)
    assert found.rows[1].message == "cloud must be finite"
    assert found.rows[1].reason == "empty"
    assert len(found.rows) == 12


def test_what_a_run_before_left_is_replaced(clouds, odometry, tmp_path, winding):
    drive.run(sequence_of(clouds), odometry, tmp_path)
    again = KnownWay(winding(6, 12))

    def fails(*_):
        assert names_in(tmp_path) == ["frames.csv", "trajectory_kitti.txt", "trajectory_tum.txt"]
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        drive.run(sequence_of(clouds[:5]), again, tmp_path, fails)
    assert np.array_equal(read_trajectory(tmp_path / "trajectory_kitti.txt").poses, again.poses[:1])
    assert len(rows_of(tmp_path)) == 1


# --------------------------------------------------------------------------------------------------------- interruption


def test_an_interrupted_drive_is_whole_up_to_there(clouds, odometry, tmp_path):
    before = signal.getsignal(signal.SIGINT)
    found = drive.run(sequence_of(clouds, stop_at=4), odometry, tmp_path)
    assert signal.getsignal(signal.SIGINT) is before
    assert found.interrupted
    assert names_in(tmp_path) == FILES
    assert len(read_trajectory(tmp_path / "trajectory_tum.txt")) == 5
    assert len(rows_of(tmp_path)) == 5
    assert len(fa.read_cloud(tmp_path / "map.ply")) == 5
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["interrupted"] is True
    assert summary["frames"] == 5
    assert summary["frames_of_the_sequence"] == 12


def test_a_second_interrupt_ends_at_once(clouds, odometry, tmp_path):
    def twice(finished, of):
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGTERM)

    with pytest.raises(KeyboardInterrupt):
        drive.run(sequence_of(clouds), odometry, tmp_path, twice)
    assert len(read_trajectory(tmp_path / "trajectory_tum.txt")) == 1


def test_in_another_thread_signals_are_left_alone(clouds, odometry, tmp_path):
    found = []
    thread = Thread(target=lambda: found.append(drive.run(sequence_of(clouds), odometry, tmp_path)))
    thread.start()
    thread.join()
    assert len(found[0].rows) == 12


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="Windows knows no SIGKILL")
def test_a_killed_drive_leaves_all_lines(tmp_path):
    code = (
        "import os, signal, sys, numpy as np\n"
        "sys.path.insert(0, sys.argv[1])\n"
        "from test_drive import KnownWay, sequence_of\n"
        "import fieldalign as fa\n"
        "from fieldalign.odometry import drive\n"
        "clouds = [fa.PointCloud(np.zeros((3, 3)))] * 9\n"
        "end = lambda done, of: done == 7 and os.kill(os.getpid(), signal.SIGKILL)\n"
        "drive.run(sequence_of(clouds), KnownWay(np.tile(np.eye(4), (9, 1, 1))), sys.argv[2], end)\n"
    )
    paths = os.pathsep.join([str(Path(fa.__file__).parents[1]), *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run([sys.executable, "-c", code, Path(__file__).parent, tmp_path / "out"],
                          env=os.environ | {"PYTHONPATH": paths}, check=False)
    assert done.returncode == -signal.SIGKILL
    assert len(read_trajectory(tmp_path / "out" / "trajectory_tum.txt")) == 7
    assert len(rows_of(tmp_path / "out")) == 7


# --------------------------------------------------------------------------------------------------------------- errors


def test_a_sequence_without_any_frame_is_one_clear_error(odometry, tmp_path):
    with pytest.raises(fa.CloudFileError, match=r"\(a made sequence\) holds no frame that can be read: lost at sea"):
        drive.run(sequence_of(["lost at sea", "lost"]), odometry, tmp_path)


def test_reading_ahead_changes_nothing(clouds, odometry, tmp_path, winding):
    drive.run(sequence_of(clouds), odometry, tmp_path / "a")
    drive.run(sequence_of(clouds), KnownWay(winding(5, 12)), tmp_path / "b", prefetch=True)
    for name in ("trajectory_tum.txt", "map.ply"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_a_folder_that_cannot_be_made_is_one_clear_error(clouds, odometry, tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(fa.RunError, match="cannot be written"):
        drive.run(sequence_of(clouds), odometry, tmp_path / "file" / "out")
    assert odometry.calls == []
