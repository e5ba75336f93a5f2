"""KITTI's sequences as they are published, written and read back; the protocols of pairs; and the project's part."""

import pickle

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.errors import ArgumentError, CloudFileError, DataSetError
from fieldalign.experiments.data_sets import kitti
from fieldalign.motions import apply, inverse
from fieldalign.odometry.trajectory import Trajectory
from fieldalign.odometry.trajectory_files import write_trajectory

TR = np.array([[0, -1, 0, 0.1], [0, 0, -1, -0.2], [1, 0, 0, -0.3], [0, 0, 0, 1.0]])


@pytest.fixture
def drive(winding, rng):
    """Writes a sequence of n scans, every one of the same few points of the world; returns world_from_lidar."""

    def write(root, name, n=40, inner_poses=False, frames=None):
        folder = root / "sequences" / name
        (folder / "velodyne").mkdir(parents=True)
        world_from_lidar = winding(int(name), n)
        world = rng.uniform(-20, 20, (200, 3))
        for k in range(n) if frames is None else frames:
            fa.write_cloud(folder / "velodyne" / f"{k:06d}.bin", apply(inverse(world_from_lidar[k]), world))
        rows = " ".join(repr(float(value)) for value in TR[:3].ravel())
        (folder / "calib.txt").write_text(f"P0: {' '.join(['0'] * 12)}\nTr: {rows}\n")
        poses = folder / "poses.txt" if inner_poses else root / "poses" / f"{name}.txt"
        poses.parent.mkdir(exist_ok=True)
        poses_of_camera = TR @ inverse(world_from_lidar[0]) @ world_from_lidar @ inverse(TR)
        write_trajectory(poses, Trajectory(np.arange(float(n)), poses_of_camera), "kitti")
        return world_from_lidar

    return write


def lie_on_each_other(pair):
    source, target = pair.clouds()
    return np.abs(apply(pair.T_target_source, source) - target).max() < 1e-4


@pytest.mark.parametrize("inner_poses", [False, True])
@pytest.mark.parametrize("within", ["", "dataset"])
def test_a_sequence_in_the_lidars_frame(within, inner_poses, tmp_path, drive):
    truth = drive(tmp_path / within, "00", 12, inner_poses)
    found = kitti.sequence(tmp_path, "00")
    assert len(found) == 12
    assert found.frames == tuple(range(12))
    assert np.allclose(found.world_from_lidar, inverse(truth[0]) @ truth, atol=1e-9)
    assert found.truth == "KITTI's GPS and inertial sensors"
    assert found.points(3).shape == (200, 3)
    assert len(list(fa.read_sequence(found.folder))) == 12
    assert lie_on_each_other(pickle.loads(pickle.dumps(found)).pair(2, 9))


def test_successive_scans(tmp_path, drive):
    for name in ("10", "08", "07"):
        drive(tmp_path, name, 5)
    found = kitti.successive(tmp_path)
    assert [pair.name for pair in found] == [f"{name}/{k}_{k + 1}" for name in ("08", "10") for k in range(4)]
    assert all(lie_on_each_other(pair) for pair in found)
    assert [pair.sequence for pair in kitti.successive(tmp_path, ["07"])] == ["07"] * 4
    with pytest.raises(DataSetError, match="holds nothing of KITTI's sequence '09'"):
        kitti.successive(tmp_path, ["08", "09"])


def test_pairs_ten_metres_apart(tmp_path, drive):
    """Against the protocol in words: the last scan before the first beyond 10 m, then on from the one after it."""
    truth = drive(tmp_path, "09", 60)
    found = kitti.metres_apart(tmp_path, ["09"])
    camera = (truth @ inverse(TR))[:, :3, 3]
    i, expected = 0, []
    while i < 60:
        beyond = [j for j in range(i, min(i + 100, 60)) if np.linalg.norm(camera[j] - camera[i]) > 10]
        if beyond:
            expected.append((i, beyond[0] - 1))
        i = beyond[0] if beyond else i + 1
    assert [(pair.i, pair.j) for pair in found] == expected
    assert len(expected) > 3
    assert all(lie_on_each_other(pair) for pair in found)
    apart = [np.linalg.norm(pair.T_target_source[:3, 3]) for pair in found]
    assert 8 < min(apart) <= max(apart) < 10.5
    assert len(kitti.metres_apart(tmp_path, ["09"], distance=5)) > len(found)


def test_the_pair_that_is_known_to_be_bad_is_left_out(tmp_path, monkeypatch, drive):
    drive(tmp_path, "08", 30)
    names = [pair.name for pair in kitti.metres_apart(tmp_path)]
    first = kitti.metres_apart(tmp_path)[0]
    monkeypatch.setattr(kitti, "_BAD", ("08", first.i, first.j))
    assert [pair.name for pair in kitti.metres_apart(tmp_path)] == names[1:]


def test_nearby_pairs(tmp_path, drive):
    truth = drive(tmp_path, "08", 40)
    found = kitti.nearby(tmp_path, every=15, distance=4.0)
    expected = []
    for i in (0, 15, 30):
        for j in range(i + 1, 40):
            if np.linalg.norm(truth[j, :3, 3] - truth[i, :3, 3]) >= 4:
                break
            expected.append((i, j))
    assert [(pair.i, pair.j) for pair in found] == expected
    assert all(lie_on_each_other(pair) for pair in found)
    with pytest.raises(ArgumentError, match="every must be an integer of at least 1"):
        kitti.nearby(tmp_path, every=0)
    with pytest.raises(ArgumentError, match="distance must be a positive number"):
        kitti.nearby(tmp_path, distance=-1)


def test_a_scan_that_is_missing_moves_no_pose(tmp_path, drive):
    drive(tmp_path, "08", 10, frames=[0, 1, 4, 5, 9])
    found = kitti.successive(tmp_path)
    assert [(pair.i, pair.j) for pair in found] == [(0, 1), (1, 4), (4, 5), (5, 9)]
    assert all(lie_on_each_other(pair) for pair in found)


def test_sequences_that_are_broken(tmp_path, drive):
    drive(tmp_path, "08", 4)
    poses = tmp_path / "poses" / "08.txt"
    whole = poses.read_text()
    poses.write_text("\n".join(whole.splitlines()[:3]) + "\n")
    with pytest.raises(DataSetError, match=r"08\.txt holds 3 poses, but in .*08 the last scan is number 3"):
        kitti.successive(tmp_path)
    poses.write_text(whole[:-20])
    with pytest.raises(ArgumentError, match=r"08\.txt"):
        kitti.successive(tmp_path)
    poses.unlink()
    with pytest.raises(DataSetError, match="has scans, but no poses"):
        kitti.successive(tmp_path)
    poses.write_text(whole)
    (tmp_path / "sequences" / "08" / "velodyne" / "000001.bin").write_bytes(b"12345")
    first = kitti.successive(tmp_path)[0]
    with pytest.raises(CloudFileError, match=r"000001\.bin"):
        first.clouds()
    (tmp_path / "sequences" / "08" / "calib.txt").unlink()
    with pytest.raises(ArgumentError, match=r"calib\.txt is no calibration"):
        kitti.successive(tmp_path)


def test_a_folder_without_it(tmp_path):
    for read in (kitti.successive, kitti.nearby, kitti.metres_apart):
        with pytest.raises(DataSetError, match="holds nothing of KITTI's odometry sequences; looked for sequences/08"):
            read(tmp_path)
    with pytest.raises(DataSetError, match="holds nothing of the submaps of KITTI's sequence 07"):
        kitti.submaps(tmp_path)
    with pytest.raises(DataSetError, match="holds nothing of KITTI's sequence 'kitti00'"):
        kitti.sequence(tmp_path, "kitti00")


def overlaps(pair, distance):
    """The share of some of the source's points that have a target point near them, at the pose."""
    from scipy.spatial import cKDTree

    source, target = pair.clouds()
    return (cKDTree(target).query(apply(pair.T_target_source, source[::50]))[0] < distance).mean()


def test_the_part(data):
    for name in ("00", "kitti00"):
        assert len(kitti.sequence(data, name)) == 16
    assert len(kitti.successive(data)) == 15 + 21 + 29
    assert {pair.truth for pair in kitti.successive(data)} == {"SemanticKITTI", "KISS-ICP"}
    apart = kitti.metres_apart(data)
    assert len(apart) == 6
    assert len(kitti.submaps(data)) == 10
    for pair, distance in ((kitti.successive(data)[3], 0.3), (apart[2], 0.5), (kitti.submaps(data)[0], 0.5)):
        assert overlaps(pair, distance) > 0.6
