"""The experiments on objects, from the command line: on a small data set, on the real one, and through a kill."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from fieldalign.cli import main
from fieldalign.experiments import Request, figures
from fieldalign.experiments.alone import Alone
from fieldalign.experiments.objects import common, efficiency, robustness
from fieldalign.motions import apply

SIMPLE = "modelnet40", "success-rate", "density", "noise"


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    monkeypatch.setattr(figures, "_DPI", 60)


def experiment(name, data, output, *options):
    """The status of a run in this process, and what it wrote."""
    with pytest.raises(SystemExit) as ended:
        main(["experiment", name, "--data", str(data), "--output", str(output), "--workers", "1", *map(str, options)])
    return ended.value.code, json.loads((Path(output) / f"{name}.json").read_text())


@pytest.mark.parametrize("name", SIMPLE)
def test_small_set_in_its_published_layout(name, small, tmp_path, monkeypatch):
    monkeypatch.setattr(robustness, "_DENSE", 5000)
    monkeypatch.setattr(robustness, "_NOISY", 1000)
    status, found = experiment(name, small, tmp_path, "--limit", 2, "--columns", "default,paper")
    assert status == 0
    assert len(found["cases"]) == 2
    assert len(found["rows"]) == 4
    assert not any("error" in row for row in found["rows"])
    assert all("rre_modulo_deg" in row for row in found["rows"])
    assert (tmp_path / f"{name}.md").read_text().startswith(f"# {found['title']}")
    assert (tmp_path / f"{name}.png").is_file() == (name != "modelnet40")


def test_a_page_of_an_experiment(small, tmp_path):
    page = tmp_path / "page.html"
    status, found = experiment("modelnet40", small, tmp_path, "--columns", "paper", "--report", page)
    assert status == 0
    text = page.read_text("utf-8")
    assert text.count("<tr data-pair") == len(found["rows"]) == 4
    assert f"<h1>{found['title']}</h1>" in text
    assert text.count('"name":"the truth"') == 4


@pytest.mark.parametrize(("name", "page", "said"), [
    ("pseudo-sets", "page.html", "pseudo-sets is a picture"), ("noise", "page.png", "must end in .html"),
])
def test_a_page_that_cannot_be_is_refused_before_any_work(name, page, said, small, tmp_path, capsys):
    arguments = ["--data", str(small), "--output", str(tmp_path / "out"), "--report", str(tmp_path / page)]
    with pytest.raises(SystemExit) as ended:
        main(["experiment", name, *arguments])
    assert ended.value.code == 1
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_modelnet40_takes_both_splits_and_both_sets_of_motions(small, tmp_path):
    _, found = experiment("modelnet40", small, tmp_path, "--columns", "paper")
    assert [(case["name"].split()[0], case["group"]) for case in found["cases"]] == [
        (shape, group) for group in (common.GTCSV, common.AS_TEXT) for shape in ("piano_0001", "sofa_0001")]
    assert max(row["rre_deg"] for row in found["rows"]) < 1e-6
    text = (tmp_path / "modelnet40.md").read_text()
    assert "PointNetLK-Revisited" in text  # published, beside
    assert "Euler RMSE" in text


def test_without_gt_poses_one_set_is_run_and_said(small, tmp_path):
    alone = tmp_path / "alone"
    alone.mkdir()
    (alone / "ModelNet40").symlink_to(small / "ModelNet40")
    _, found = experiment("modelnet40", alone, tmp_path, "--columns", "paper")
    assert {case["group"] for case in found["cases"]} == {common.AS_TEXT}
    assert "no gt_poses.csv" in (tmp_path / "modelnet40.md").read_text()


def test_success_rate_takes_what_modelnet40_has_measured(small, tmp_path):
    experiment("modelnet40", small, tmp_path, "--columns", "paper")
    record = (tmp_path / "modelnet40.run" / "record.jsonl").read_bytes()
    experiment("success-rate", small, tmp_path, "--columns", "paper")
    assert (tmp_path / "modelnet40.run" / "record.jsonl").read_bytes() == record
    assert not (tmp_path / "success-rate.run").exists()


def test_levels_of_density_and_noise(small):
    thin = robustness.DENSITY.cases(small, 0)
    assert len(thin) == 10  # the test split has one shape
    source, target = thin[-1].clouds()
    assert (len(source), len(target)) == (200, 200_000)
    moved = apply(thin[-1].T_target_source, source)
    assert np.isin(moved.round(9), target.round(9)).all()
    noisy = robustness.NOISE.cases(small, 0)
    assert [float(case.group) for case in noisy] == [*np.arange(1, 11).round() / 100, 0.2]
    source, target = noisy[4].clouds()
    off = apply(noisy[4].T_target_source, source) - target
    assert off.std() == pytest.approx(0.05 * np.sqrt(2), rel=0.02)  # of both clouds, so independent


def test_efficiency(small, tmp_path, monkeypatch):
    monkeypatch.setattr(efficiency, "_COUNTS", (300, 3000))
    monkeypatch.setattr(efficiency, "_POINTS", 1000)
    status, found = experiment("efficiency", small, tmp_path, "--columns", "paper")
    assert status == 0
    assert all(row["seconds"] > 0 for part in ("one_thread", "all_threads") for row in found[part]["rows"])
    assert [row["case"].split()[1] for row in found["growth"]] == ["300", "3000"]
    assert all(row["peak_mib"] >= 0 for row in found["growth"])
    assert "1.97" in (tmp_path / "efficiency.md").read_text()
    assert (tmp_path / "efficiency.png").is_file()


def test_growth_leaves_out_what_is_slow(small, tmp_path, monkeypatch):
    monkeypatch.setattr(efficiency, "_COUNTS", (300, 3000))
    monkeypatch.setattr(efficiency, "_PATIENCE", 0.0)
    asked = Request(small, tmp_path, Alone(1, anew=True), columns=("paper",))
    assert list(dict(efficiency._grown(asked))) == [300]


def test_killed_run_goes_on(small, tmp_path):
    """Killed in mid-run; what was recorded stays as it is, and nothing is done twice."""
    command = ["experiment", "noise", "--data", str(small), "--output", str(tmp_path), "--columns", "default-any-pose"]
    running = subprocess.Popen([sys.executable, "-m", "fieldalign", *command, "--workers", "1"],
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=os.environ.copy())
    record = tmp_path / "noise.run" / "record.jsonl"
    deadline = time.monotonic() + 60
    while not (record.exists() and record.read_bytes().count(b"\n") > 2) and time.monotonic() < deadline:
        time.sleep(0.01)
    running.send_signal(signal.SIGKILL)
    running.wait()
    before = record.read_bytes()
    before = before[: before.rfind(b"\n") + 1]
    assert not (tmp_path / "noise.json").exists()
    _, found = experiment("noise", small, tmp_path, "--columns", "default-any-pose")
    after = record.read_bytes()
    keys = [json.loads(line[9:]).get("key") for line in after.splitlines()][1:]
    assert after.startswith(before)
    assert len(keys) == len(set(keys)) == len(found["rows"]) == 11


def test_folder_without_shapes_is_a_users_error(tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    with pytest.raises(SystemExit) as ended:
        main(["experiment", "noise", "--data", str(tmp_path / "empty"), "--output", str(tmp_path)])
    assert ended.value.code == 1
    assert "holds no meshes" in capsys.readouterr().err


@pytest.mark.parametrize(("name", "limit", "groups"), [("modelnet40", 2, 2), ("shapenet", 12, 6), ("noise", 1, 1)])
def test_real_data(name, limit, groups, data, tmp_path):
    status, found = experiment(name, data, tmp_path, "--limit", limit, "--columns", "paper")
    assert status == 0
    assert len({case["group"] for case in found["cases"]}) == groups
    assert not any("error" in row for row in found["rows"])
