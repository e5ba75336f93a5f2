"""The experiments on scenes from the command line: on small data sets in their published layouts, and on real scans."""

import json

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.cli import main
from fieldalign.experiments.data_sets.three_d_match import ALIGNED_SCENES, SCENES
from fieldalign.experiments.scenes.ablation import ROWS, row_settings
from fieldalign.motions import apply, exp_twist, inverse
from fieldalign.odometry.trajectory import Trajectory
from fieldalign.odometry.trajectory_files import write_trajectory
from fieldalign.settings import PRESETS

TR = np.array([[0, -1, 0, 0.1], [0, 0, -1, -0.2], [1, 0, 0, -0.3], [0, 0, 0, 1.0]])
STEP = exp_twist(np.array([0, 0, 0.02, 0.5, 0.01, 0]))
PEERS = """
import numpy as np
METHODS = {"kiss": ("", "a peer that answers the identity", {}), "svr": ("", "a peer of objects", {})}
def load(name):
    return lambda source, target, voxel, threads, init=None: np.eye(4)
"""
STANDING = """
import numpy as np
class Odometry:
    def __init__(self, deskew, reach, threads):
        assert (deskew, reach) == (False, 100.0)
    def step(self, points, times):
        return np.eye(4)
"""


@pytest.fixture
def experiment(tmp_path, capsys):
    """Runs an experiment in this process: what it printed, and the folder of its results."""
    output = tmp_path / "results"

    def run(name, data, *args):
        with pytest.raises(SystemExit) as ended:
            main(["experiment", name, "--data", str(data), "--output", str(output), "--workers", "1", *map(str, args)])
        out, err = capsys.readouterr()
        return ended.value.code, out + err, output

    return run


@pytest.fixture
def peers(tmp_path):
    folder = tmp_path / "peers"
    folder.mkdir()
    (folder / "__init__.py").write_text(PEERS)
    (folder / "kiss_icp.py").write_text(STANDING)
    return folder


@pytest.fixture
def indoor(tmp_path, corner, any_motion, rng):
    """Two scenes of three fragments: Predator's files of truth, and lists of aligned pairs."""
    data = tmp_path / "indoor"
    for scene in SCENES[:2]:
        (data / scene).mkdir(parents=True)
        world_from = [any_motion(rng, 1.0) for _ in range(3)]
        for k, T in enumerate(world_from):
            fa.write_cloud(data / scene / f"cloud_bin_{k}.ply", apply(inverse(T), corner[k::3]))
        for benchmark, pairs in (("3DMatch", [(0, 1), (0, 2)]), ("3DLoMatch", [(0, 2)])):
            folder = data / benchmark / scene
            folder.mkdir(parents=True)
            poses = {pair: inverse(world_from[pair[0]]) @ world_from[pair[1]] for pair in pairs}
            for file, blocks in (("gt.log", poses), ("gt.info", dict.fromkeys(pairs, 100 * np.eye(6)))):
                (folder / file).write_text("".join(
                    f"{i} {j} 3\n" + "\n".join(" ".join(map(repr, row)) for row in block.tolist()) + "\n"
                    for (i, j), block in blocks.items()))
    names = [f"{ALIGNED_SCENES[0]}@seq-01_{k:03d}.npz" for k in range(3)]
    for k, name in enumerate(names):
        np.savez(data / name, pcd=corner[k::3])
    (data / f"{ALIGNED_SCENES[0]}@seq-01-0.70.txt").write_text(
        f"{names[0]} {names[1]} 0.9\n{names[0]} {names[2]} 0.8\n")
    return data


@pytest.fixture
def streets(tmp_path, corner):
    """Six scans of sequences 00 and 08: a room of 30 m, from a sensor that drives through it."""
    data = tmp_path / "kitti"
    world_from_lidar = np.stack([np.linalg.matrix_power(STEP, k) for k in range(6)])
    for name in ("00", "08"):
        folder = data / "sequences" / name
        (folder / "velodyne").mkdir(parents=True)
        for k, T in enumerate(world_from_lidar):
            fa.write_cloud(folder / "velodyne" / f"{k:06d}.bin", apply(inverse(T), 10 * corner - [8, 8, 1]))
        (folder / "calib.txt").write_text("Tr: " + " ".join(repr(float(value)) for value in TR[:3].ravel()) + "\n")
        poses = TR @ world_from_lidar @ inverse(TR)
        write_trajectory(folder / "poses.txt", Trajectory(np.arange(6.0), poses), "kitti")
    return data, world_from_lidar


def read(file):
    return json.loads(file.read_text())


def measures_of(found, group="all"):
    return {entry["method"]: entry for entry in found["measures"] if entry["group"] == group}


def test_3dmatch(experiment, indoor, peers):
    status, said, output = experiment("3dmatch", indoor, "--peers", peers, "--limit", 4, "--columns",
                                      "default,default-any-pose,paper-truncation,kiss")
    assert status == 0, said
    names = ["3dmatch-paper", *(f"{benchmark}-{how}" for benchmark in ("3dmatch", "3dlomatch")
                                for how in ("as-they-lie", "turned"))]
    assert sorted(file.name for file in output.glob("*.*") if file.is_file()) == sorted(
        [f"{name}.json" for name in names] + ["3dmatch.md"])
    paper = read(output / "3dmatch-paper.json")
    assert list(paper["methods"]) == ["default", "default-any-pose", "paper-truncation", "kiss"]
    assert len(paper["rows"]) == 16
    for method in ("default", "default-any-pose"):
        assert measures_of(paper)[method]["success"]["share"] == 1
    for name in names[1:]:
        found = read(output / f"{name}.json")
        assert list(found["methods"]) == ["default-any-pose", "kiss"]
        ours, peer = measures_of(found).values()
        assert ours["recall_by_scenes"] == 1
        assert ours["recall_by_pairs"]["share"] == ours["recall_by_thresholds"]["share"] == 1
        assert peer["recall_by_pairs"]["share"] == 0
        assert len(found["cases"]) == (4 if name.startswith("3dmatch") else 2)
        assert set(measures_of(found, SCENES[0])) == {"default-any-pose", "kiss"}
    page = (output / "3dmatch.md").read_text()
    assert page.count("\n## ") == 5
    assert page.count("| GeoTransformer") == 1
    assert "row 8 of Table IV, whose figures are others" in page


def test_a_run_goes_on_and_parts_without_data_are_named(experiment, indoor):
    for file in indoor.glob("*.*"):
        file.unlink()
    _, _, output = experiment("3dmatch", indoor, "--limit", 1)
    before = {file: file.read_bytes() for file in output.glob("3dmatch.run/*/record.jsonl")}
    assert len(before) == 4
    status, said, _ = experiment("3dmatch", indoor, "--limit", 1)
    assert status == 0
    assert before == {file: file.read_bytes() for file in output.glob("3dmatch.run/*/record.jsonl")}
    assert "Left out" in said
    assert "Left out" in (output / "3dmatch.md").read_text()
    assert "3DMatch (benchmark 'aligned')" in said


def test_columns_that_there_are_not(experiment, indoor):
    status, said, output = experiment("3dmatch", indoor, "--columns", "default,kiss")
    assert status == 1
    assert "but 'kiss' is none; other people's methods need --peers FOLDER" in said
    assert list(output.iterdir()) == []


@pytest.mark.parametrize("name", ["3dmatch", "kitti", "kitti-trajectory", "ablation"])
def test_a_folder_without_data(experiment, tmp_path, name):
    (tmp_path / "empty").mkdir()
    status, said, _ = experiment(name, tmp_path / "empty")
    assert status == 1
    assert "holds nothing of" in said


def test_kitti(experiment, streets, peers):
    status, said, output = experiment("kitti", streets[0], "--peers", peers, "--limit", 2)
    assert status == 0, said
    for name, columns in (("kitti-nearby", 4), ("kitti-successive", 4)):
        found = read(output / f"{name}.json")
        assert len(found["methods"]) == columns
        assert [case["group"] for case in found["cases"]] == ["08", "08"]
        ours = measures_of(found)
        assert ours["default"]["success"]["share"] == ours["default-any-pose"]["success"]["share"] == 1
        assert ours["default"]["rte"]["rmse"] < 0.01
    assert not (output / "kitti-10m.json").exists()  # the drive is 3 m long
    assert not (output / "kitti-submaps.json").exists()
    assert said.count("Left out") == 3
    page = (output / "kitti.md").read_text()
    assert "uniform in [-1, 1] degree" in page
    assert "DeepVCP" in page


def test_scans_metres_apart(experiment, tmp_path, corner):
    folder = tmp_path / "part" / "kitti_10m_pairs"
    folder.mkdir(parents=True)
    T = exp_twist(np.array([0, 0, 0.05, 4.0, 0.2, 0]))
    np.savez(folder / "000.npz", source=10 * apply(inverse(T), corner), target=10 * corner,
             target_from_source=exp_twist(np.array([0, 0, 0.05, 40, 2.0, 0])))
    status, said, output = experiment("kitti", tmp_path / "part", "--columns", "default-any-pose")
    assert status == 0, said
    for name in ("kitti-10m", "kitti-10m-turned"):
        (ours,) = measures_of(read(output / f"{name}.json")).values()
        assert ours["recall_5deg_2m"]["share"] == ours["recall_1deg_0.3m"]["share"] == 1
        assert ours["rte_of_successes"] < 0.01


def test_a_trajectory(experiment, streets, peers):
    pytest.importorskip("matplotlib")
    data, truth = streets
    status, said, output = experiment("kitti-trajectory", data, "--peers", peers)
    assert status == 0, said
    found = read(output / "kitti-trajectory.json")
    assert found["scans"] == 6
    ours, paper, standing = found["methods"]
    assert [entry["method"] for entry in found["methods"]] == ["default", "paper", "kiss-icp"]
    assert ours["end_error_m"] < 0.02
    assert paper["end_error_m"] < 0.05
    assert standing["end_error_m"] == pytest.approx(np.linalg.norm(truth[5, :3, 3]))
    np.testing.assert_allclose(np.reshape(standing["poses"], (6, 3, 4)), [np.eye(4)[:3]] * 6)
    np.testing.assert_allclose(np.reshape(ours["poses"], (6, 3, 4)), truth[:, :3], atol=0.02)
    assert "fieldalign, odometry" in said
    assert (output / "kitti-trajectory.png").read_bytes().startswith(b"\x89PNG")


def test_a_trajectory_goes_on_from_its_steps(experiment, streets):
    data, _ = streets
    status, said, output = experiment("kitti-trajectory", data, "--columns", "paper", "--limit", 4)
    assert status == 0, said
    record = output / "kitti-trajectory.run" / "record.jsonl"
    lines = record.read_text().splitlines()
    assert len(lines) == 1 + 3
    status, _, _ = experiment("kitti-trajectory", data, "--columns", "paper", "--report", output / "drive.html")
    assert status == 0
    assert "the paper&#x27;s method, scan to scan</h1>" in (output / "drive.html").read_text("utf-8")
    assert record.read_text().splitlines()[:4] == lines
    assert len(record.read_text().splitlines()) == 1 + 5


def test_a_step_without_an_answer_repeats_the_motion_before(experiment, streets):
    data, truth = streets
    files = sorted((data / "sequences" / "00" / "velodyne").iterdir())
    fa.write_cloud(files[-1], np.zeros((5, 3)))
    status, said, output = experiment("kitti-trajectory", data, "--columns", "paper")
    assert status == 0, said
    found = read(output / "kitti-trajectory.json")
    assert "1 of 5 steps have no answer" in found["not_measured"]["paper"]
    (paper,) = found["methods"]
    np.testing.assert_allclose(np.reshape(paper["poses"], (6, 3, 4)), truth[:, :3], atol=0.05)


def test_the_rows_of_the_ablation():
    assert row_settings(8) == PRESETS["indoor"]
    assert len({repr(row_settings(number)) for number in ROWS}) == 8
    first = row_settings(1)
    assert (first.irls, first.share_limit, first.direction, first.pseudo_set) == (False, None, "none", "uniform")


def test_the_ablation(experiment, indoor):
    status, said, output = experiment("ablation", indoor, "--limit", 2, "--report", indoor / "page.html")
    assert status == 0, said
    assert (indoor / "page.html").read_text("utf-8").count('class="part"') == 1
    found = read(output / "ablation-3dmatch.json")
    assert list(found["methods"]) == [*(f"row-{number}" for number in range(1, 9)), "default", "default-any-pose"]
    assert measures_of(found)["default"]["success"]["share"] == 1
    assert "row 3: solved directly, truncation, uniform" in (output / "ablation.md").read_text()


@pytest.mark.parametrize(("name", "columns"), [
    ("3dmatch", "default,default-any-pose"), ("kitti", "default,default-any-pose"), ("ablation", "row-8,default"),
    ("kitti-trajectory", "default,paper"),
])
def test_on_real_scans(experiment, data, name, columns):
    status, said, output = experiment(name, data, "--limit", 2, "--columns", columns)
    assert status == 0, said
    if name != "kitti-trajectory":
        assert "Left out" not in said
        shares = [entry["success"]["share"] for file in output.glob("*.json") for method, entry in
                  measures_of(read(file)).items() if method.startswith("default")]
        assert min(shares) == 1
