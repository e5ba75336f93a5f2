"""The command line of many scans: a model, poses, everything as JSON, and the exit status."""

import json
from pathlib import Path

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.clouds.simulated import simulate_room
from fieldalign.motions import apply, exp_twist, inverse

T = exp_twist(np.array([0.5, -1, 0.7, 0.3, 0.2, -0.4]))
NAMES = ["a.ply", "b.ply", "c.ply"]
MOTIONS = dict(zip(NAMES, (np.eye(4), T, T @ T), strict=True))  # scan_from_world


@pytest.fixture(scope="module")
def scans(corner, tmp_path_factory):
    """A folder with three overlapping parts of the corner, each moved, a truncated scan, one of something else, and
    poses."""
    folder = tmp_path_factory.mktemp("scans")
    rng = np.random.default_rng(2)
    for k, (name, motion) in enumerate(MOTIONS.items()):
        part = corner[k::3]
        part = part[part[:, 0] < 2.4] if k == 1 else part
        fa.write_cloud(folder / name, fa.PointCloud(apply(motion, part), intensity=rng.uniform(0, 1, len(part))))
    (folder / "broken.ply").write_bytes((folder / "a.ply").read_bytes()[:-1000])
    fa.write_cloud(folder / "other.ply", rng.normal(size=(2000, 3)) * [1, 2, 1])
    poses = {
        "known": {"a.ply": translated(5).tolist(), "b.ply": (translated(5) @ inverse(T)).tolist(), "c.ply": None},
        "unknown": {"a.ply": np.eye(4).tolist(), "zzz.ply": np.eye(4).tolist()},
        "crooked": {"a.ply": (2 * np.eye(4)).tolist()}, "list": [1, 2], "number": 3,
    }
    for name, content in poses.items():
        (folder / f"{name}.json").write_text(json.dumps(content))
    (folder / "none.json").write_text("{")
    return folder, T


def translated(x):
    world = np.eye(4)
    world[0, 3] = x
    return world


def check_poses(poses, world=None):
    for name, motion in MOTIONS.items():
        assert np.allclose(poses[name], (np.eye(4) if world is None else world) @ inverse(motion), atol=0.02)


def test_all_placed_is_status_0(call):
    outputs = "--output", "model.ply", "--poses-to", "poses.json", "--json", "all.json"
    status, out, err = call("assemble", *NAMES, *outputs)
    assert (status, err) == (0, "")
    lines = out.splitlines()
    assert lines[0].startswith("3 of 3 scans placed, by 3 of 3 pairs, in ")
    assert lines[1].startswith("component 1: 3 scans, placed to ")
    check_poses(json.loads(Path("poses.json").read_text()))
    everything = json.loads(Path("all.json").read_text())
    assert everything["scans"] == NAMES
    assert everything["components"] == [[0, 1, 2]]
    assert everything["left_out"] == {}
    model = fa.read_cloud("model.ply")
    assert set(np.unique(model.attributes["scan"]).tolist()) == {0, 1, 2}
    assert model.normals is not None
    expected = fa.assemble(NAMES)
    assert np.array_equal(everything["poses"], expected.poses)


def test_broken_and_foreign_scans_are_told_and_do_not_stop_the_rest(call):
    status, out, _ = call("assemble", "broken.ply", *NAMES, "other.ply", "nowhere.ply", "--poses-to", "poses.json")
    assert status == 3
    assert out.startswith("3 of 6 scans placed")
    told = [line for line in out.splitlines() if line.startswith("left out: ")]
    assert [line.split(": ")[1] for line in told] == ["broken.ply", "nowhere.ply", "other.ply"]
    assert "does not exist" in told[1]
    poses = json.loads(Path("poses.json").read_text())
    assert poses["broken.ply"] is poses["other.ply"] is None
    check_poses(poses)


def test_each_scan_is_written_whole_and_moved(call, tmp_path):
    status, _, _ = call("assemble", *NAMES, "--moved", tmp_path / "moved", "--poses-to", "poses.json")
    assert status == 0
    poses = json.loads(Path("poses.json").read_text())
    for name in NAMES:
        before, after = fa.read_cloud(name), fa.read_cloud(tmp_path / "moved" / name)
        assert np.allclose(after.points, apply(np.array(poses[name]), before.points), atol=1e-5)
        assert np.array_equal(after.intensity, before.intensity)


def test_two_components_are_two_models_and_status_3(call, tmp_path):
    """The same three scans, and two of a room."""
    room = simulate_room(0)
    for name, yaw in (("d", 0.0), ("e", 0.3)):
        sensor = exp_twist(np.array([0, 0, yaw, 0, 0, 0]))
        sensor[:3, 3] = room.size[0] / 2 + yaw, room.size[1] / 2, 1.5
        fa.write_cloud(tmp_path / f"{name}.ply", room.scan(sensor, 5000, 0.004, (200, 110)))
    outputs = "--output", tmp_path / "model.ply", "--moved", tmp_path / "moved"
    status, out, err = call("assemble", *NAMES, tmp_path / "d.ply", tmp_path / "e.ply", *outputs)
    assert (status, err) == (3, "")
    assert out.startswith("5 of 5 scans placed")
    assert "component 2: 2 scans" in out
    assert set(fa.read_cloud(tmp_path / "model_2.ply").attributes["scan"].tolist()) == {3, 4}
    assert set(fa.read_cloud(tmp_path / "model.ply").attributes["scan"].tolist()) == {0, 1, 2}
    paths = [path.relative_to(tmp_path / "moved") for path in (tmp_path / "moved").rglob("*.ply")]
    written = {f"{path.parts[0]}/{path.name}" for path in paths}
    assert written == {f"component_1/{name}" for name in NAMES} | {"component_2/d.ply", "component_2/e.ply"}


def test_scans_of_one_name_do_not_overwrite_each_other(call, tmp_path):
    for number, name in enumerate(NAMES[:2]):
        (tmp_path / str(number)).mkdir()
        fa.write_cloud(tmp_path / str(number) / "scan.ply", fa.read_cloud(name))
    call("assemble", tmp_path / "0" / "scan.ply", tmp_path / "1" / "scan.ply", "--moved", tmp_path / "moved")
    written = {str(path.relative_to(tmp_path / "moved")) for path in (tmp_path / "moved").rglob("*.ply")}
    assert written == {"0/scan.ply", "1/scan.ply"}


def test_known_poses_are_the_world(call):
    status, _, err = call("assemble", *NAMES, "--poses", "known.json", "--sigma", 1, 0.1, "--poses-to", "poses.json")
    assert (status, err) == (0, "")
    check_poses(json.loads(Path("poses.json").read_text()), translated(5))


def test_a_fixed_scan_stays(call):
    status, _, err = call("assemble", *NAMES, "--poses", "known.json", "--fixed", "b.ply", "--poses-to", "poses.json")
    assert (status, err) == (0, "")
    poses = json.loads(Path("poses.json").read_text())
    assert np.allclose(poses["b.ply"], translated(5) @ inverse(T), rtol=0, atol=1e-12)
    check_poses(poses, translated(5))


def test_poses_that_were_written_are_read(call):
    call("assemble", *NAMES, "--poses-to", "poses.json")
    status, _, err = call("assemble", *NAMES, "--poses", "poses.json", "--poses-to", "again.json")
    assert (status, err) == (0, "")
    check_poses(json.loads(Path("again.json").read_text()))


def test_a_run_goes_on(call, tmp_path, monkeypatch):
    options = "--run", tmp_path / "run", "--poses-to", "poses.json"
    assert call("assemble", *NAMES, *options)[0] == 0
    before = Path("poses.json").read_bytes()
    monkeypatch.setattr("fieldalign.assembly.stages.register", pytest.fail)
    assert call("assemble", *NAMES, *options)[0] == 0
    assert Path("poses.json").read_bytes() == before
    status, out, err = call("assemble", *NAMES, *options, "--seed", 1)
    assert (status, out) == (1, "")
    assert "holds a run of other inputs: the setting seed was 0, but is 1" in err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ((), "SCANS"),
        (("a.ply",), "clouds must be at least two, but are 1"),
        ((*NAMES, "--fixed", "zzz.ply"), "fixed must name one of the scans, but is 'zzz.ply'"),
        ((*NAMES, "--fixed", "a.ply"), "fixed must be indices of clouds whose pose is given"),
        ((*NAMES, "--poses", "unknown.json"), "poses name scans that are not there, the first is 'zzz.ply'"),
        ((*NAMES, "--poses", "none.json"), "poses must be JSON, {scan: 4 x 4}, but none.json is not"),
        ((*NAMES, "--poses", "nowhere.json"), "nowhere.json is not"),
        ((*NAMES, "--poses", "crooked.json"), "the pose of a.ply must end in the row 0 0 0 1"),
        ((*NAMES, "--poses", "list.json"), "poses"),
        ((*NAMES, "--poses", "number.json"), "poses must be JSON"),
        ((*NAMES, "--sigma", "1", "1"), "pose_sigma says how well poses are known, but there are none"),
        ((*NAMES, "--poses", "known.json", "--sigma", "0", "1"), "pose_sigma"),
        ((*NAMES, "--dof", "yaw"), "--dof"),
        ((*NAMES, "--output", "model.nothing"), "model.nothing"),
        ((*NAMES, "--output", "nowhere/model.ply"), "nowhere"),
        ((*NAMES, "--poses-to", "nowhere/poses.json"), "nowhere"),
        ((*NAMES, "--json", "nowhere/all.json"), "nowhere"),
        ((*NAMES, "--workers", "0"), "--workers"),
        ((*NAMES, "--run", "a.ply"), "a.ply"),
    ],
)
def test_an_error_of_the_user_is_one_line(call, options, words):
    status, out, err = call("assemble", *options)
    assert (status, out, len(err.splitlines())) == (1, "", 1)
    assert words in err


@pytest.mark.parametrize("option", ["--output", "--poses-to", "--json"])
def test_a_folder_that_is_not_there_is_told_before_the_work(call, monkeypatch, option):
    monkeypatch.setattr(fa, "assemble", lambda *_, **__: pytest.fail("it worked for nothing"))
    status, _, err = call("assemble", *NAMES, option, "nowhere/file.ply")
    assert status == 1
    assert "there is no folder nowhere" in err


def test_json_on_stdout_is_all_there_is(call):
    """As in the other commands."""
    status, out, err = call("assemble", *NAMES, "--json", "-")
    assert (status, err) == (0, "")
    assert json.loads(out)["components"] == [[0, 1, 2]]


def test_a_report_shows_the_graph(call, scans):
    folder, _ = scans
    status, _, _ = call("assemble", *NAMES, "broken.ply", "--report", "report.html")
    assert status == 3
    text = (folder / "report.html").read_text("utf-8")
    assert text.count('class="node"') == 3
    assert "<b>broken.ply</b>: " in text
