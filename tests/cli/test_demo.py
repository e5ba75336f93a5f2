"""The demonstration: its files, and the truth about its answer."""

import importlib.util
import json
import re

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.cli import main
from fieldalign.evaluation import rotation_error, translation_error
from fieldalign.motions import apply

DRAWS = importlib.util.find_spec("matplotlib") is not None


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    """A demonstration of 20000 points: its exit status, its folder, what it printed."""
    folder = tmp_path_factory.mktemp("demo") / "a" / "folder"
    with pytest.MonkeyPatch.context() as patch:
        printed = []
        patch.setattr("click.echo", lambda message="", **_: printed.append(str(message)))
        with pytest.raises(SystemExit) as ended:
            main(["demo", "--points", "20000", "--output", str(folder), "--seed", "3"])
    return ended.value.code, folder, "\n".join(printed)


def test_it_is_accepted(demo):
    assert demo[0] == 0


def test_it_leaves_its_files_and_no_others(demo):
    expected = {"source.ply", "target.ply", "aligned.ply", "result.json", "truth.txt"}
    assert {path.name for path in demo[1].iterdir()} == expected | ({"picture.png"} if DRAWS else set())


def test_the_answer_is_near_the_truth(demo):
    _, folder, _ = demo
    found = np.array(json.loads((folder / "result.json").read_text())["T_target_source"])
    truth = np.loadtxt(folder / "truth.txt")
    assert rotation_error(found, truth) < 0.5
    assert translation_error(found, truth) < 0.02
    assert rotation_error(np.eye(4), truth) > 5  # and it was no gift


def test_the_printed_error_is_the_true_one(demo):
    _, folder, printed = demo
    found = np.array(json.loads((folder / "result.json").read_text())["T_target_source"])
    truth = np.loadtxt(folder / "truth.txt")
    degrees, millimetres = map(float, re.search(r"true error: (.*) degrees, (.*) mm; the scans were", printed).groups())
    assert degrees == pytest.approx(rotation_error(found, truth), abs=6e-4)
    assert millimetres == pytest.approx(1000 * translation_error(found, truth), abs=0.06)


def test_the_aligned_cloud_is_the_moved_source(demo):
    _, folder, _ = demo
    source, aligned = fa.read_cloud(folder / "source.ply"), fa.read_cloud(folder / "aligned.ply")
    found = np.array(json.loads((folder / "result.json").read_text())["T_target_source"])
    assert len(source) == len(aligned) == 20_000
    assert np.allclose(aligned.points, apply(found, np.asarray(source.points, float)), atol=1e-5)


def test_the_command_it_shows_is_the_one_it_ran(demo):
    _, folder, printed = demo
    command = "fieldalign register source.ply target.ply --output aligned.ply --json result.json"
    assert f"$ cd {folder} && {command}" in printed


@pytest.mark.parametrize(("option", "value"), [("--points", "0"), ("--seed", "-1"), ("--points", "many")])
def test_an_option_out_of_range_is_one_error(tmp_path, capsys, option, value):
    with pytest.raises(SystemExit) as ended:
        main(["demo", "--output", str(tmp_path), option, value])
    out, err = capsys.readouterr()
    assert ended.value.code == 1
    assert out == ""
    assert err.startswith("Error: ")
    assert err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_registration_that_fails_ends_the_demonstration(tmp_path, capfd):
    """Two points are too few."""
    with pytest.raises(SystemExit) as ended:
        main(["demo", "--output", str(tmp_path), "--points", "2"])
    assert ended.value.code == 1
    assert capfd.readouterr().err.startswith("Error: ")
