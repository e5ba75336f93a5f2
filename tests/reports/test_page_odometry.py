"""The report of a drive: the way over the map, what was not tracked, and the errors."""

from __future__ import annotations

import base64
import re

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.motions import translation
from fieldalign.reports import write_odometry_report
from fieldalign.reports.packing import beads
from fieldalign.reports.page_odometry import Stretch, _stretches
from fieldalign.reports.plan import WIDE, Plan

T, D, L = fa.Tracking.TRACKED, fa.Tracking.DEGENERATE, fa.Tracking.LOST


@pytest.fixture(scope="module")
def drive(winding):
    """A trajectory with covariances, the truth in another world, and a map around it."""
    poses = winding(2, 60)
    variances = np.tile(0.01 * np.eye(6), (60, 1, 1))
    truth = fa.Trajectory(np.arange(60), translation([5.0, 0, 0]) @ winding(2, 60, noise=1e-3))
    near = poses[:, None, :3, 3] + np.random.default_rng(0).normal(size=(60, 40, 3)) * [4, 4, 0.1]
    return fa.Trajectory(np.arange(60), poses, variances), truth, fa.PointCloud(near.reshape(-1, 3))


@pytest.fixture(scope="module")
def report(drive, tmp_path_factory):
    trajectory, truth, world = drive
    reasons = [T] * 20 + [D] * 5 + [T] * 10 + ["lost"] + [T] * 24
    path = tmp_path_factory.mktemp("report") / "drive.html"
    return write_odometry_report(
        trajectory, path, reasons=reasons, world=world, evaluation=fa.evaluate(trajectory, truth), title="a <b>drive"
    )


def test_the_page_is_sound(report, sound):
    sound(report)


def test_stretches_are_runs_that_were_not_tracked():
    assert _stretches([T, D, D, L, T, L]) == [Stretch(1, 2, D), Stretch(3, 3, L), Stretch(5, 5, L)]
    assert _stretches([]) == []


def test_the_page_tells_what_was_not_tracked_the_longest_first(report):
    text = report.read_text("utf-8")
    assert "<h1>a &lt;b&gt;drive</h1>" in text
    assert "<dt>tracked</dt><dd>54 of 60</dd>" in text
    assert re.findall(r"<tr><th scope=row>(frames? [^<]*)</th><td>(\d+)</td>", text) == [
        ("frames 20 to 24", "5"), ("frame 35", "1")
    ]
    assert text.count('class="off"') == 2
    assert text.count('class="chart"') == 4
    assert text.count('class="truth"') == 1


def test_without_map_reasons_and_truth_there_is_still_the_way(drive, tmp_path):
    trajectory = fa.Trajectory(drive[0].times, drive[0].poses)
    text = write_odometry_report(trajectory, tmp_path / "bare.html").read_text("utf-8")
    assert text.count('class="chart"') == 1
    assert "Not tracked" not in text
    still = write_odometry_report(trajectory[:1], tmp_path / "one.html", reasons=[T]).read_text("utf-8")
    assert "Every frame was tracked." in still


def test_what_cannot_be_reported_is_refused(drive, tmp_path):
    trajectory, *_ = drive
    with pytest.raises(fa.ArgumentError, match="reasons must be one for each of the 60 poses, but are 2"):
        write_odometry_report(trajectory, tmp_path / "a.html", reasons=[T, T])
    with pytest.raises(fa.ArgumentError, match="none"):
        write_odometry_report(trajectory[:0], tmp_path / "a.html")
    assert not list(tmp_path.iterdir())


def test_a_plan_keeps_shapes_and_holds_what_it_must():
    rng = np.random.default_rng(0)
    ground = np.c_[rng.uniform(0, 40, (5000, 2)), rng.normal(0, 0.01, 5000)]
    corners = np.array([[0.0, 0, 0], [0, 30, 0], [60, 30, 0]])
    plan = Plan(ground, corners, 1000)
    a, b, c = plan.at(corners)
    assert np.allclose([np.linalg.norm(a - b), np.linalg.norm(b - c)], [30 * plan.scale, 60 * plan.scale], rtol=1e-3)
    assert ((plan.at(corners) >= 0) & (plan.at(corners) <= (WIDE, plan.height))).all()
    assert b[0] < c[0]
    assert b[1] < a[1]  # y of the world is up
    assert 500 < plan.backdrop.count("M") <= 1700


def test_beads_follow_a_way_at_even_distances():
    way = np.array([[0.0, 0, 0], [1, 0, 0], [1, 0.5, 0]])
    packed = beads([way], 0.1, np.zeros(3))
    steps = np.frombuffer(base64.b64decode(packed["points"]), "<i2").reshape(-1, 3)
    places = np.array(packed["centre"]) + packed["half"] * steps / 32767
    assert np.allclose(places[[0, -1]], way[[0, -1]], atol=1e-4)
    apart = np.linalg.norm(np.diff(places, axis=0), axis=1)
    assert apart.max() < 0.1 + 1e-4
    assert len(places) == 17


def test_the_drive_in_3d_shows_map_way_truth_and_what_was_not_tracked(chromium, report, seen):
    chromium.open(report)
    chromium.click("[name=tint][value=plain]")
    every = seen(chromium, "model-canvas")
    assert every["orange"] > 200
    assert every["all"] > 2000
    assert chromium.run("[...document.querySelectorAll('#see label span')].map(e => e.textContent)")[:4] == [
        "start", "not tracked", "trajectory", "truth"]
    chromium.click("#see-way")
    without = seen(chromium, "model-canvas")
    assert without["orange"] == 0
    assert without["blue"] > 20
    chromium.click("#see-truth")
    assert seen(chromium, "model-canvas")["blue"] == 0
    lost = seen(chromium, "model-canvas")["sum"]
    chromium.click("#see-lost")
    assert seen(chromium, "model-canvas")["sum"] != lost
    chromium.press("c")
    assert chromium.run("document.querySelector('[name=tint][value=height]').checked")
    assert chromium.complaints == []


def test_the_page_loads_and_fits_a_phone(chromium, report):
    chromium.open(report)
    assert chromium.run("document.querySelector('.way').getBoundingClientRect().width") > 100
    assert chromium.complaints == []
    chromium.open(report, width=390, height=844, dark=True)
    assert chromium.run("document.documentElement.scrollWidth") <= 390
