"""Folders of clouds and KITTI's layouts: the order, the stamps, and what is missing or broken."""

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.motions import exp_twist
from fieldalign.odometry.sequences import read_sequence
from fieldalign.odometry.sequences.kitti import read_calibration
from fieldalign.odometry.sequences.sequence import ahead
from fieldalign.odometry.sequences.stamps import read_stamps


def cloud(number):
    """Four points; the first one's x is the number, by which a frame is known again."""
    return fa.PointCloud(np.array([[number, 0, 0], [0, 1, 0], [-1, 0, 1], [0, -1, 2]], np.float32))


def write(folder, names, suffix=".bin", first=0):
    folder.mkdir(parents=True, exist_ok=True)
    for number, name in enumerate(names, first):
        fa.write_cloud(folder / f"{name}{suffix}", cloud(number))


def numbers(sequence):
    """Of the clouds; None of those that are missing."""
    return [None if frame.cloud is None else int(frame.cloud.points[0, 0]) for frame in sequence]


def stamps(sequence):
    return [frame.stamp for frame in sequence]


@pytest.fixture
def kitti(tmp_path):
    """An odometry sequence of 12 frames."""
    write(tmp_path / "sequences" / "00" / "velodyne", [f"{k:06}" for k in range(12)])
    (tmp_path / "sequences" / "00" / "times.txt").write_text("".join(f"{0.1 * k:e}\n" for k in range(12)))
    return tmp_path / "sequences" / "00"


@pytest.fixture
def drive(tmp_path):
    """A raw drive of 5 frames."""
    write(tmp_path / "drive" / "velodyne_points" / "data", [f"{k:010}" for k in range(5)])
    lines = [f"2011-09-26 13:02:25.{964389445 + k * 1_000_000}\n" for k in range(5)]
    (tmp_path / "drive" / "velodyne_points" / "timestamps.txt").write_text("".join(lines))
    return tmp_path / "drive"


# --------------------------------------------------------------------------------------------------------------- KITTI


def test_an_odometry_sequence_is_read(kitti):
    sequence = read_sequence(kitti)
    assert sequence.length == 12
    assert sequence.name == "00"
    assert numbers(sequence) == list(range(12))
    assert numbers(sequence) == list(range(12))  # again
    np.testing.assert_allclose(stamps(sequence), 0.1 * np.arange(12))
    assert [frame.index for frame in sequence] == list(range(12))
    assert all(frame.cloud.times is None for frame in sequence)
    assert all(frame.cloud.intensity is not None for frame in sequence)


def test_the_folder_over_the_only_sequence_is_that_sequence(kitti):
    assert numbers(read_sequence(kitti.parents[1])) == list(range(12))
    write(kitti.parent / "01" / "velodyne", ["000000"])
    with pytest.raises(fa.CloudFileError, match="sequences holds 00, 01; name one of them"):
        read_sequence(kitti.parents[1])


def test_without_times_there_are_no_stamps(kitti):
    (kitti / "times.txt").unlink()
    assert stamps(read_sequence(kitti)) == [None] * 12


def test_a_number_that_is_missing_is_a_frame_that_is_missing(kitti):
    (kitti / "velodyne" / "000004.bin").unlink()
    frames = list(read_sequence(kitti))
    assert numbers(frames) == [0, 1, 2, 3, None, *range(5, 12)]
    assert frames[4].stamp == pytest.approx(0.4)
    assert frames[5].stamp == pytest.approx(0.5)
    assert frames[4].reason.endswith("000004.bin does not exist")


def test_a_part_of_a_sequence_has_its_own_stamps(kitti):
    for k in (0, 1, 2, 11):
        (kitti / "velodyne" / f"{k:06}.bin").unlink()
    sequence = read_sequence(kitti)
    assert sequence.length == 8
    assert numbers(sequence) == list(range(3, 11))
    np.testing.assert_allclose(stamps(sequence), 0.1 * np.arange(3, 11))


def test_as_many_times_as_files_belong_to_them_in_order(kitti):
    (kitti / "velodyne" / "000004.bin").unlink()
    (kitti / "times.txt").write_text("".join(f"{k}\n" for k in range(11)))
    sequence = read_sequence(kitti)
    assert numbers(sequence) == [0, 1, 2, 3, *range(5, 12)]
    assert stamps(sequence) == list(range(11))


def test_too_few_times_are_one_clear_error(kitti):
    (kitti / "times.txt").write_text("0\n1\n")
    with pytest.raises(fa.CloudFileError, match="00 holds 2 times, but the last frame is number 11"):
        read_sequence(kitti)


def test_a_broken_frame_ends_nothing(kitti):
    (kitti / "velodyne" / "000002.bin").write_bytes(b"")
    (kitti / "velodyne" / "000003.bin").write_bytes(b"half a point")
    frames = list(read_sequence(kitti))
    assert numbers(frames) == [0, 1, None, None, *range(4, 12)]
    assert frames[2].reason.endswith("is empty (0 bytes)")
    assert "has 12 bytes" in frames[3].reason
    assert frames[4].reason == ""


def test_a_sequence_of_broken_frames_is_one_clear_error(kitti):
    for file in (kitti / "velodyne").iterdir():
        file.write_bytes(b"?")
    frames = iter(read_sequence(kitti))
    assert [next(frames).cloud for _ in range(12)] == [None] * 12
    with pytest.raises(fa.CloudFileError, match=r"00 \(a KITTI odometry sequence\) holds no frame that can be read: .*"
                                                "000000.bin has 1 bytes"):
        next(frames)


def test_a_raw_drive_is_read(drive):
    for place in (drive, drive / "velodyne_points"):
        sequence = read_sequence(place)
        assert sequence.kind == "a KITTI raw drive"
        assert numbers(sequence) == list(range(5))
    # 2011-09-26 13:02:25 UTC
    np.testing.assert_allclose(stamps(sequence), 1317042145.964389445 + 0.001 * np.arange(5), rtol=0, atol=3e-7)


def test_a_raw_drive_lacks_frames_as_kittis_do(drive):
    (drive / "velodyne_points" / "data" / "0000000002.bin").unlink()
    frames = list(read_sequence(drive))
    assert numbers(frames) == [0, 1, None, 3, 4]
    assert frames[3].stamp - frames[2].stamp == pytest.approx(0.001, abs=1e-6)


def test_a_calibration_is_read(tmp_path):
    T = exp_twist(np.array([1.2, -1.2, 1.2, 0.1, 0.2, 0.3]))
    row = " ".join(f"{value:.12e}" for value in T[:3].ravel())
    (tmp_path / "calib.txt").write_text(f"P0: {'1 ' * 12}\nTr: {row}\n")
    np.testing.assert_allclose(read_calibration(tmp_path / "calib.txt"), T, atol=1e-12)
    (tmp_path / "calib.txt").write_text(f"P0: {'1 ' * 12}\n")
    for path in (tmp_path / "calib.txt", tmp_path / "nowhere.txt"):
        with pytest.raises(fa.ArgumentError, match="no line `Tr:` with 12 numbers"):
            read_calibration(path)


# -------------------------------------------------------------------------------------------------------------- folders


@pytest.mark.parametrize("suffix", [".ply", ".pcd", ".npz", ".npy", ".bin", ".xyz", ".txt", ".csv"])
def test_any_format_is_read_in_natural_order(tmp_path, suffix):
    write(tmp_path, ["scan2", "scan3", "scan10", "scan100"], suffix)
    sequence = read_sequence(tmp_path)
    assert sequence.length == 4
    assert numbers(sequence) == [0, 1, 2, 3]
    assert stamps(sequence) == [None] * 4


def test_what_is_no_frame_is_left_out(tmp_path):
    write(tmp_path, ["0", "1", "2"], ".npz")
    np.savez(tmp_path / "poses.npz", world_from_lidar=np.zeros((3, 4, 4)))
    np.savez(tmp_path / ".3.npz", xyz=np.zeros((3, 3)))
    write(tmp_path, ["map"], ".ply")
    (tmp_path / "notes.md").write_text("1")
    assert numbers(read_sequence(tmp_path)) == [0, 1, 2]


def test_names_without_numbers_are_frames_where_no_name_has_one(tmp_path):
    write(tmp_path, ["a", "b"], ".ply")
    assert numbers(read_sequence(tmp_path)) == [0, 1]


@pytest.mark.parametrize("name", ["times.txt", "timestamps.txt"])
def test_stamps_lie_beside_the_clouds(tmp_path, name):
    write(tmp_path, ["0", "1", "2"], ".txt")
    (tmp_path / name).write_text("# seconds\n5.5\n6.5\n\n7.5\n")
    assert stamps(read_sequence(tmp_path)) == [5.5, 6.5, 7.5]
    (tmp_path / name).write_text("5.5\n")
    with pytest.raises(fa.CloudFileError, match="holds 1 times, but there are 3 frames"):
        read_sequence(tmp_path)


def test_times_of_points_are_on_the_stamps_clock(tmp_path):
    for k in range(2):
        fa.write_cloud(tmp_path / f"{k}.npz", fa.PointCloud(np.zeros((3, 3)), times=np.array([0, 0.02, 0.05])))
    (tmp_path / "times.txt").write_text("100\n100.1\n")
    np.testing.assert_allclose([frame.cloud.times for frame in read_sequence(tmp_path)],
                               [[100, 100.02, 100.05], [100.1, 100.12, 100.15]])


def test_real_scans_are_read(data):
    sequence = read_sequence(data / "kitti00")
    assert sequence.length == 16
    frame = next(iter(sequence))
    assert frame.cloud.points.shape == (124668, 3)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda path: None, "does not exist"),
        (lambda path: path.mkdir(), "holds no clouds, which are files that end in .ply"),
        (lambda path: path.write_text("1 2 3"), "must be a folder of clouds or a bag"),
        (lambda path: (path / "sequences").mkdir(parents=True), "holds no sequence with a folder velodyne"),
        (lambda path: (path / "velodyne").mkdir(parents=True), "holds no clouds whose names are numbers"),
        (lambda path: write(path / "velodyne", ["a"]), "holds no clouds whose names are numbers"),
    ],
)
def test_what_is_no_sequence_is_one_clear_error(tmp_path, make, words):
    make(tmp_path / "place")
    with pytest.raises(fa.CloudFileError, match=words):
        read_sequence(tmp_path / "place")


@pytest.mark.parametrize("line", [
    "noon", "2011-13-01 00:00:00", "nan", "inf", "1 2",
    "2011-09-26T13:02:25-0100", "2011-09-26 13:02:25Z", "2300-01-01 00:00:00", "9999-01-01 00:00:00",
    "2011-09-26 13:02:25." + "3" * 80,
])  # the last ones: time zones, and years for which 64 bits have no nanoseconds
def test_what_is_no_time_is_one_clear_error(tmp_path, line):
    (tmp_path / "times.txt").write_text(f"1\n{line}\n")
    with pytest.raises(fa.CloudFileError, match=r"times\.txt line 2 is no time"):
        read_stamps(tmp_path / "times.txt")


def test_times_of_all_kinds_are_read(tmp_path):
    (tmp_path / "times.txt").write_text("1e-3\n-5\n1.5E+3\n1970-01-02 00:00:00.5\n")
    assert read_stamps(tmp_path / "times.txt") == [1e-3, -5, 1500, 86400.5]


def test_a_topic_is_of_bags_only(kitti):
    with pytest.raises(fa.ArgumentError, match="topic names a part of a bag"):
        read_sequence(kitti, topic="/points")


# --------------------------------------------------------------------------------------------------------------- sweeps


@pytest.mark.parametrize(("sweep", "expected"), [("clockwise", [0.5, 0.25, 0.0, 0.75]),
                                                 ("counterclockwise", [0.5, 0.75, 0.0, 0.25])])
def test_times_from_the_azimuth_where_they_are_asked_for(tmp_path, sweep, expected):
    """Points ahead, to the left, behind and to the right."""
    write(tmp_path, ["0", "1", "2"], ".ply", first=1)
    frames = list(read_sequence(tmp_path, sweep=sweep))
    for frame in frames:  # without stamps: shares of a sweep, about 0
        np.testing.assert_allclose(frame.cloud.times, np.array(expected) - 0.5, atol=1e-12)
    (tmp_path / "times.txt").write_text("7.0\n7.1\n7.4\n")
    for frame in read_sequence(tmp_path, sweep=sweep):
        np.testing.assert_allclose(frame.cloud.times, frame.stamp + (np.array(expected) - 0.5) * 0.1, atol=1e-9)


def test_points_with_times_keep_them(tmp_path):
    fa.write_cloud(tmp_path / "0.npz", fa.PointCloud(cloud(1).points, times=np.arange(4) / 100))
    frame = next(iter(read_sequence(tmp_path, sweep="clockwise")))
    assert np.array_equal(frame.cloud.times, np.arange(4) / 100)


def test_an_unknown_sweep_is_refused(kitti):
    with pytest.raises(fa.ArgumentError, match="sweep must be one of clockwise, counterclockwise"):
        read_sequence(kitti, sweep="left")


# ------------------------------------------------------------------------------------------------------------ streaming


def test_frames_are_read_one_at_a_time(kitti, monkeypatch):
    from fieldalign.odometry.sequences import folders

    read = []
    monkeypatch.setattr(folders, "read_cloud", lambda file: read.append(file.name) or cloud(0))
    frames = iter(read_sequence(kitti))
    next(frames)
    next(frames)
    assert read == ["000000.bin", "000001.bin"]


def test_one_frame_ahead_are_the_same_frames(kitti):
    sequence = read_sequence(kitti)
    assert numbers(ahead(iter(sequence))) == list(range(12))
    for file in (kitti / "velodyne").iterdir():
        file.write_bytes(b"?")
    with pytest.raises(fa.CloudFileError, match="holds no frame"):
        list(ahead(iter(sequence)))


def test_one_frame_ahead_and_no_more(kitti, monkeypatch):
    from fieldalign.odometry.sequences import folders

    read = []
    monkeypatch.setattr(folders, "read_cloud", lambda file: read.append(file.name) or cloud(0))
    frames = ahead(iter(read_sequence(kitti)))
    next(frames)
    frames.close()
    assert len(read) == 2
