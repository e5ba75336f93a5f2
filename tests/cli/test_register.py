"""The command line of one pair: exit status, one line for an error, and files that are whole or not there."""

import json
import re
import subprocess
import sys

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.cli import VERBS
from fieldalign.evaluation import rotation_error
from fieldalign.motions import apply


@pytest.fixture(scope="module")
def scans(corner, tmp_path_factory):
    """A folder with source.ply and target.npy, and the motion between them."""
    folder = tmp_path_factory.mktemp("scans")
    angle = 0.5
    T = np.eye(4)
    T[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    T[:3, 3] = [0.2, -0.3, 0.1]
    intensity = np.arange(len(corner), dtype=np.float32)
    normals = np.tile([0.6, 0.0, 0.8], (len(corner), 1))
    fa.write_cloud(folder / "source.ply", fa.PointCloud(corner, normals=normals, intensity=intensity))
    np.save(folder / "target.npy", apply(T, corner))
    np.save(folder / "tiny.npy", 0.01 * corner)
    np.savetxt(folder / "truth.txt", T)
    return folder, T


PAPER = ("--method", "paper")


def pose_of(out):
    lines = out.splitlines()
    assert lines[0] == "T_target_source ="
    return np.array([line.split() for line in lines[1:5]], float)


def is_one_error(status, out, err):
    lines = err.splitlines()
    return status == 1 and out == "" and len(lines) == 1 and lines[0].startswith("Error: ")


# ---------------------------------------------------------------------------------------------------------- answering


def test_an_accepted_pose_is_printed(call, scans):
    status, out, err = call("register", "source.ply", "target.npy")
    assert (status, err) == (0, "")
    assert np.allclose(pose_of(out), scans[1], atol=1e-8)
    assert str(fa.Reason.ACCEPTED) in out
    shares = re.search(r"overlap (\d+)% of the source, (\d+)% of the target", out)
    assert all(int(share) > 95 for share in shares.groups())


def test_a_pose_that_is_not_accepted_is_status_3(call):
    status, out, err = call("register", "source.ply", "tiny.npy")
    assert (status, err) == (3, "")
    assert "Not accepted: " in out
    assert pose_of(out).shape == (4, 4)
    assert out.splitlines()[-1].startswith("One is 100 times as large as the other: are both in one unit?")


def test_missing_returns_are_told(call, scans, corner):
    np.save("gaps.npy", np.vstack([corner, np.full((7, 3), np.nan)]))
    status, out, _ = call("register", "gaps.npy", "target.npy")
    assert status == 0
    assert "7 missing returns (NaN) of the source left out" in out
    assert "of the target left out" not in out


def test_json_on_stdout_is_json_and_nothing_else(call, scans):
    status, out, err = call("register", "source.ply", "target.npy", "--json", "-")
    assert (status, err) == (0, "")
    result = json.loads(out)
    assert result["accepted"] is True
    assert np.allclose(result["T_target_source"], scans[1], atol=1e-8)


def test_json_of_a_pose_not_accepted_says_so(call):
    status, out, _ = call("register", "source.ply", "tiny.npy", "--json", "-")
    assert status == 3
    assert json.loads(out)["accepted"] is False


def test_json_in_a_file_is_what_the_library_answers(call, corner):
    status, out, _ = call("register", "source.ply", "target.npy", "--json", "result.json", "--seed", 5, "--threads", 1)
    assert status == 0
    with open("result.json") as file:
        written = json.load(file)
    result = fa.register(corner, np.load("target.npy"), seed=5).to_dict()
    assert written.keys() == result.keys()
    for name in set(result) - {"seconds"}:
        assert written[name] == json.loads(json.dumps(result[name])), name
    assert np.allclose(pose_of(out), written["T_target_source"], atol=1e-9)


def test_the_output_is_the_moved_cloud_with_all_that_it_had(call, scans, corner):
    status, _, err = call("register", "source.ply", "target.npy", "--output", "aligned.ply")
    assert (status, err) == (0, "")
    aligned, T = fa.read_cloud("aligned.ply"), scans[1]
    assert np.allclose(aligned.points, apply(T, corner), atol=1e-8)
    assert np.array_equal(aligned.intensity, np.arange(len(corner)))
    assert np.allclose(aligned.normals, T[:3, :3] @ [0.6, 0, 0.8], atol=1e-6)


def test_a_picture_is_drawn(call, monkeypatch):
    pytest.importorskip("matplotlib")
    monkeypatch.setattr("fieldalign.reports.picture._DPI", 40)
    status, _, err = call("register", "source.ply", "target.npy", "--picture", "both.png")
    assert (status, err) == (0, "")
    with open("both.png", "rb") as file:
        assert file.read(8) == b"\x89PNG\r\n\x1a\n"


@pytest.mark.parametrize("preset", fa.PRESETS)
def test_the_settings_are_those_of_the_name(call, corner, preset):
    _, out, _ = call("register", "source.ply", "target.npy", *PAPER, "--settings", preset, "--json", "-")
    expected = fa.register(corner, np.load("target.npy"), method="paper", settings=preset).to_dict()
    assert json.loads(out)["T_target_source"] == expected["T_target_source"]
    assert json.loads(out)["history"] == expected["history"]


def test_the_papers_method_has_the_preset_of_rooms(call, corner):
    _, out, _ = call("register", "source.ply", "target.npy", *PAPER, "--json", "-")
    expected = fa.register(corner, np.load("target.npy"), method="paper").to_dict()
    assert json.loads(out)["history"] == expected["history"]


@pytest.mark.parametrize("options", [(), (*PAPER, "--length-scale", 1000)], ids=["robust", "paper"])
def test_millimetres_give_the_same_motion(call, scans, corner, options):
    np.save("source_mm.npy", 1000 * corner)
    np.save("target_mm.npy", 1000 * np.load("target.npy"))
    status, out, _ = call("register", "source_mm.npy", "target_mm.npy", *options)
    found, T = pose_of(out), scans[1]
    assert status == 0
    assert rotation_error(found, T) < 1e-6
    assert np.allclose(found[:3, 3], 1000 * T[:3, 3], atol=1e-5)


# ---------------------------------------------------------------------------------------------------- the first guess


def write_guess(name, T):
    if name == "pose.npy":
        np.save(name, T)
    elif name == "pose.txt":
        np.savetxt(name, T)
    elif name in ("pose.json", "result.json"):
        with open(name, "w") as file:
            json.dump(T.tolist() if name == "pose.json" else {"T_target_source": T.tolist(), "accepted": True}, file)
    elif name == "row.txt":
        np.savetxt(name, T.reshape(1, 16))
    else:
        return {"numbers": " ", "commas": ", "}[name].join(map(repr, T.ravel().tolist()))
    return name


@pytest.mark.parametrize(
    "form", ["pose.txt", "row.txt", "pose.npy", "pose.json", "result.json", "numbers", "commas"]
)
def test_a_guess_is_read_from_anything(call, scans, form):
    guess = write_guess(form, scans[1])
    status, out, _ = call("register", "source.ply", "target.npy", "--json", "-", *PAPER, "--init", guess)
    assert status == 0
    assert json.loads(out)["iterations"] == 1  # without it there are more
    assert np.allclose(json.loads(out)["T_target_source"], scans[1], atol=1e-9)


@pytest.mark.parametrize("options", [{}, {"search_radius": 0.5}, {"search_angle": 20.0}], ids=str)
def test_a_guess_and_how_far_to_search_around_it_are_handed_on(call, corner, scans, options):
    np.savetxt("guess.txt", scans[1])
    words = [word for name, value in options.items() for word in (f"--{name.replace('_', '-')}", value)]
    _, out, _ = call("register", "source.ply", "target.npy", "--json", "-", "--init", "guess.txt", *words)
    expected = fa.register(corner, np.load("target.npy"), init=scans[1], **options).to_dict()
    assert json.loads(out)["history"] == expected["history"]


BAD_GUESSES = {
    "words.txt": "here it is",
    "short.txt": "1 0 0 0\n0 1 0 0\n",
    "ragged.txt": "1 0 0 0\n0 1 0\n",
    "broken.json": "{",
    "other.json": '{"pose": 1}',
    "names.json": '{"T_target_source": "identity"}',
    "none.npy": "no array",
}


@pytest.mark.parametrize("name", [*BAD_GUESSES, "empty.npy"])
def test_a_file_without_a_pose_is_one_error(call, name):
    with open(name, "w") as file:
        file.write(BAD_GUESSES.get(name, ""))
    answer = call("register", "source.ply", "target.npy", "--init", name)
    assert is_one_error(*answer)
    assert "init must" in answer[2]
    assert name in answer[2]


@pytest.mark.parametrize(
    "text", ["nowhere.txt", "1 0 0 0", "", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 x", "2 0 0 0 0 2 0 0 0 0 2 0 0 0 0 1",
             "1 0 0 0 0 1 0 0 0 0 -1 0 0 0 0 1", "nan 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"]
)
def test_a_guess_that_is_no_pose_is_one_error(call, text):
    answer = call("register", "source.ply", "target.npy", "--init", text)
    assert is_one_error(*answer)
    assert "init must" in answer[2]


# ------------------------------------------------------------------------------------------------------------- errors


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "TARGET"),
        (("--bogus",), "--bogus"),
        (("target.npy", "--bogus"), "--bogus"),
        (("target.npy", "more.npy"), "more.npy"),
        (("nowhere.ply",), "nowhere.ply does not exist"),
        (("two\nlines.ply",), "two lines.ply does not exist"),
        (("foreign.ply",), "foreign.ply is not a PLY file"),
        (("unknown.abc",), "suffix '.abc'"),
        (("target.npy", "--settings", "cellar"), "cellar"),
        (("target.npy", "--seed", "-1"), "seed must"),
        (("target.npy", "--seed", "one"), "--seed"),
        (("target.npy", "--threads", "0"), "threads must"),
        (("target.npy", "--method", "icp"), "--method"),
        (("target.npy", "--settings", "indoor"), "--settings and --length-scale belong to --method paper"),
        (("target.npy", "--length-scale", "10"), "--settings and --length-scale belong to --method paper"),
        (("target.npy", *PAPER, "--length-scale", "0"), "--length-scale"),
        (("target.npy", *PAPER, "--length-scale", "long"), "--length-scale"),
        (("target.npy", *PAPER, "--settings", "cellar"), "cellar"),
        (("target.npy", *PAPER, "--init", "truth.txt", "--search-angle", "9"), "method 'paper' never searches"),
        (("target.npy", "--search-radius", "1"), "there is no init"),
        (("target.npy", "--init", "truth.txt", "--search-radius", "0"), "search_radius must be a positive number"),
        (("target.npy", "--init", "truth.txt", "--search-angle", "200"), "search_angle must be at most 180"),
        (("target.npy", "--output", "aligned.abc"), "aligned.abc cannot be written"),
        (("target.npy", "--output", "aligned.obj"), "aligned.obj cannot be written"),
        (("target.npy", "--output", "nowhere/aligned.ply"), "there is no folder"),
        (("target.npy", "--picture", "both.bmp"), ".png"),
        (("target.npy", "--picture", "nowhere/both.png"), "nowhere"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_an_error_of_the_user_is_one_line_and_leaves_nothing(call, scans, arguments, words):
    for name, text in (("foreign.ply", "hello"), ("unknown.abc", "1 2 3")):
        (scans[0] / name).write_text(text)
    before = set(scans[0].rglob("*"))
    answer = call("register", "source.ply", *arguments)
    assert is_one_error(*answer)
    assert words in answer[2]
    assert set(scans[0].rglob("*")) == before


@pytest.mark.parametrize("path", ["nowhere/result.json", "."])
def test_json_that_cannot_be_written_is_one_error(call, path):
    assert is_one_error(*call("register", "source.ply", "target.npy", "--json", path))


def test_an_error_in_the_last_output_leaves_nothing_of_the_first(call, scans):
    before = set(scans[0].rglob("*"))
    answer = call("register", "source.ply", "target.npy", "--output", "aligned.ply", "--picture", "both.bmp")
    assert is_one_error(*answer)
    assert set(scans[0].rglob("*")) == before


def test_a_failed_call_leaves_an_older_output_as_it_was(call, scans):
    (scans[0] / "aligned.ply").write_text("old")
    assert is_one_error(*call("register", "source.ply", "nowhere.ply", "--output", "aligned.ply"))
    assert (scans[0] / "aligned.ply").read_text() == "old"


def test_an_empty_or_infinite_cloud_is_one_error(call):
    np.save("infinite.npy", np.diag([1, np.inf, 1]))
    np.save("empty.npy", np.zeros((0, 3)))
    np.save("flat.npy", np.zeros((9, 2)))
    for name in ("infinite.npy", "empty.npy", "flat.npy"):
        assert is_one_error(*call("register", name, "target.npy"))
        assert is_one_error(*call("register", "source.ply", name))


def test_an_error_in_the_target_names_it(call):
    np.save("infinite.npy", np.diag([1, np.inf, 1]))
    assert "target must be finite" in call("register", "source.ply", "infinite.npy")[2]


def test_an_unknown_verb_is_one_error(call):
    answer = call("regster")
    assert is_one_error(*answer)
    assert "regster" in answer[2]


# --------------------------------------------------------------------------------------------------------------- help


@pytest.mark.parametrize("flag", ["--help", "-h"])
def test_help_lists_the_verbs(call, flag):
    status, out, err = call(flag)
    assert (status, err) == (0, "")
    listed = [line.split()[0] for line in out.partition("Commands:")[2].splitlines() if line.strip()]
    assert [word for word in listed if word in VERBS] == list(VERBS)
    assert "Exit status: 0 accepted" in out


@pytest.mark.parametrize("verb", VERBS)
def test_each_verb_has_help(call, verb):
    status, out, err = call(verb, "--help")
    assert (status, err) == (0, "")
    assert out.startswith(f"Usage: fieldalign {verb} ")


def test_the_version_is_told(call):
    status, out, _ = call("--version")
    assert status == 0
    assert fa.__version__ in out


def test_as_a_program(scans):
    """The same in a process of its own: nothing but JSON on stdout, nothing on stderr."""
    ran = subprocess.run(
        [sys.executable, "-m", "fieldalign", "register", "source.ply", "target.npy", "--json", "-"],
        cwd=scans[0], capture_output=True, text=True,
    )
    assert (ran.returncode, ran.stderr) == (0, "")
    assert np.allclose(json.loads(ran.stdout)["T_target_source"], scans[1], atol=1e-8)
    ran = subprocess.run(
        [sys.executable, "-m", "fieldalign", "register", "nowhere.ply", "target.npy"],
        cwd=scans[0], capture_output=True, text=True,
    )
    assert is_one_error(ran.returncode, ran.stdout, ran.stderr)


def test_a_warning_is_one_line(call):
    far = np.load("target.npy").astype(np.float32) + np.float32(5e6)
    np.save("far.npy", far)
    status, out, err = call("register", "far.npy", "far.npy", "--json", "-", *PAPER)
    assert status == 0
    assert json.loads(out)["accepted"]
    assert [line.split(":")[0] for line in err.splitlines()] == ["Warning", "Warning"]
    assert "float32" in err


def test_what_a_format_cannot_hold_is_told(call):
    status, _, err = call("register", "source.ply", "target.npy", "--output", "moved.npy")
    assert status == 0
    assert err.startswith("Warning: moved.npy: .npy files have no place for")


# --------------------------------------------------------------------------------------------------- freedoms and scale


def test_what_is_not_free_stays(call, scans):
    """The truth turns about z and shifts."""
    _, out, _ = call("register", "source.ply", "target.npy", "--dof", "levelled")
    assert np.allclose(pose_of(out), scans[1], atol=1e-6)
    assert np.array_equal(pose_of(out)[2, :3], [0, 0, 1])
    about = "--dof-axis", "0,0,2", "--dof-centre", "1 2 0"
    _, out, _ = call("register", "source.ply", "target.npy", "--dof", "rz z", *about)
    turned = pose_of(out)
    assert np.allclose(apply(turned, np.array([[1.0, 2, 0]]))[0, :2], [1, 2], atol=1e-6)


def test_another_unit_is_found(call, scans):
    folder, T = scans
    np.save(folder / "millimetres.npy", 1000 * fa.read_cloud(folder / "source.ply").points)
    status, out, _ = call("register", "millimetres.npy", "target.npy", "--scale", "--output", "metres.ply")
    assert status == 0
    assert np.allclose(1000 * pose_of(out)[:3, :3], T[:3, :3], atol=1e-3)
    assert np.allclose(fa.read_cloud("metres.ply").points, np.load("target.npy"), atol=1e-2)
    (folder / "millimetres.npy").unlink()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--dof", "sideways"), "dof must name freedoms among rx, ry, rz, x, y, z"),
        (("--dof-axis", "0,0,1"), "there is no --dof"),
        (("--dof", "yaw", "--dof-axis", "up"), "axis of dof must be three"),
        (("--scale", "--method", "paper"), "leave search, search_radius, search_angle and scale out"),
    ],
)
def test_freedoms_that_are_none_are_one_line(call, options, words):
    answer = call("register", "source.ply", "target.npy", *options)
    assert is_one_error(*answer)
    assert words in answer[2]


def test_a_report_is_written_and_names_both_files(call, scans):
    folder, _ = scans
    code, _, _ = call("register", "source.ply", "target.npy", "--report", "report.html")
    assert code == 0
    text = (folder / "report.html").read_text("utf-8")
    assert "<h1>source.ply onto target.npy</h1>" in text
    assert "Accepted" in text


def test_a_report_that_cannot_be_written_is_told_before_any_work(call, scans):
    code, _, err = call("register", "missing.ply", "target.npy", "--report", "report.txt")
    assert code == 1
    assert err == "Error: a report must end in .html, but is 'report.txt'\n"
