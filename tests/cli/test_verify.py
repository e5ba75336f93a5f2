"""fieldalign verify: the verdict on a pose of any other tool, in a sentence, as JSON, and as exit status."""

import json

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.cli.poses import read_pose
from fieldalign.clouds.simulated import simulate_pair
from fieldalign.motions import exp_twist


@pytest.fixture(scope="module")
def scans(tmp_path_factory):
    """A folder with two scans of a room, a right and a wrong pose, and the right pose."""
    folder, pair = tmp_path_factory.mktemp("scans"), simulate_pair(0, 20_000)
    fa.write_cloud(folder / "source.ply", pair.source.points)
    fa.write_cloud(folder / "target.ply", pair.target.points)
    np.savetxt(folder / "right.txt", pair.T_target_source)
    np.savetxt(folder / "wrong.txt", exp_twist(np.r_[0, 0, 0.5, 1, 0, 0]) @ pair.T_target_source)
    return folder, pair.T_target_source


def is_one_error(status, out, err):
    lines = err.splitlines()
    return status == 1 and out == "" and len(lines) == 1 and lines[0].startswith("Error: ")


def test_a_right_pose_is_accepted_in_a_sentence(call, scans):
    status, out, err = call("verify", "source.ply", "target.ply", "right.txt")
    assert (status, err) == (0, "")
    assert str(fa.Reason.ACCEPTED) in out
    assert "any clearly different pose" in out
    pose = np.array([line.split() for line in out.splitlines()[1:5]], float)
    assert np.allclose(pose, scans[1], atol=1e-8)


def test_a_wrong_pose_is_status_3(call):
    status, out, err = call("verify", "source.ply", "target.ply", "wrong.txt")
    assert (status, err) == (3, "")
    assert "Not accepted: " in out


def test_without_a_search_it_says_so(call):
    status, out, _ = call("verify", "source.ply", "target.ply", "right.txt", "--no-search")
    assert status == 0
    assert str(fa.Reason.ACCEPTED_NEAR_INIT) in out
    assert call("verify", "source.ply", "target.ply", "wrong.txt", "--no-search")[0] == 3


@pytest.mark.parametrize(("pose", "accepted"), [("right.txt", True), ("wrong.txt", False)])
def test_json_on_stdout_is_what_the_library_answers(call, pose, accepted):
    status, out, err = call("verify", "source.ply", "target.ply", pose, "--json", "-", "--seed", 3, "--threads", 2)
    assert (status, err) == (0 if accepted else 3, "")
    written = json.loads(out)
    expected = fa.verify("source.ply", "target.ply", read_pose(pose), seed=3).to_dict()
    assert written.keys() == expected.keys()
    for name in set(expected) - {"seconds"}:
        assert written[name] == json.loads(json.dumps(expected[name])), name
    assert written["accepted"] is accepted


def test_json_in_a_file_comes_beside_the_sentence(call):
    status, out, _ = call("verify", "source.ply", "target.ply", "right.txt", "--no-search", "--json", "verdict.json")
    assert status == 0
    with open("verdict.json") as file:
        written = json.load(file)
    assert written["message"] in out
    assert written["reason"] == "accepted_near_init"


def test_the_answer_of_register_can_be_verified(call):
    status, _, _ = call("register", "source.ply", "target.ply", "--json", "result.json")
    assert status == 0
    assert call("verify", "source.ply", "target.ply", "result.json")[0] == 0


def test_sixteen_numbers_are_a_pose(call, scans):
    numbers = " ".join(map(repr, scans[1].ravel().tolist()))
    assert call("verify", "source.ply", "target.ply", numbers, "--no-search")[0] == 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "SOURCE"),
        (("source.ply", "target.ply"), "POSE"),
        (("source.ply", "target.ply", "words.txt"), "words.txt"),
        (("source.ply", "target.ply", "short.txt"), "16 numbers"),
        (("source.ply", "target.ply", "nowhere.txt"), "nowhere.txt"),
        (("source.ply", "target.ply", "2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1"), "rigid"),
        (("nowhere.ply", "target.ply", "right.txt"), "nowhere.ply does not exist"),
        (("source.ply", "nowhere.ply", "right.txt"), "nowhere.ply does not exist"),
        (("source.ply", "target.ply", "right.txt", "--seed", "-1"), "seed must"),
        (("source.ply", "target.ply", "right.txt", "--threads", "0"), "threads must"),
        (("source.ply", "target.ply", "right.txt", "--no-search", "--json", "nowhere/verdict.json"), "nowhere"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_an_error_of_the_user_is_one_line_and_leaves_nothing(call, scans, arguments, words):
    (scans[0] / "words.txt").write_text("here it is")
    (scans[0] / "short.txt").write_text("1 0 0 0\n0 1 0 0\n")
    before = set(scans[0].rglob("*"))
    answer = call("verify", *arguments)
    assert is_one_error(*answer)
    assert words in answer[2]
    assert set(scans[0].rglob("*")) == before


def test_a_report_says_that_a_wrong_pose_is_not_accepted(call, scans):
    folder, _ = scans
    status, _, err = call("verify", "source.ply", "target.ply", "wrong.txt", "--report", "report.html")
    assert (status, err) == (3, "")
    assert "Not accepted" in (folder / "report.html").read_text("utf-8")
