"""The report of many scans: the graph, the pairs that fit worst first, and what is left out."""

from __future__ import annotations

import base64
import re
from dataclasses import replace

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.clouds.cloud import PointCloud
from fieldalign.motions import apply, exp_twist, inverse, translation
from fieldalign.reports import write_assembly_report
from fieldalign.reports.model_scene import component_models
from fieldalign.reports.page_assembly import _off

T = exp_twist(np.array([0.5, -1, 0.7, 0.3, 0.2, -0.4]))
NAMES = ["a.ply", "<script>hacked = 1</script>", "c.ply", "<b>noise"]


@pytest.fixture(scope="module")
def clouds(corner):
    """Three parts of a corner, moved, and something else."""
    parts = [apply(motion, corner[k::3]) for k, motion in enumerate((np.eye(4), T, T @ T))]
    return [*parts, np.random.default_rng(2).normal(size=(2000, 3)) * [1, 2, 1]]


@pytest.fixture(scope="module")
def assembly(clouds):
    return fa.assemble(clouds)


@pytest.fixture(scope="module")
def report(assembly, clouds, tmp_path_factory):
    return write_assembly_report(assembly, clouds, tmp_path_factory.mktemp("report") / "all.html", NAMES, "four scans")


def rows_of(path):
    return re.findall(r'<tr data-pair="\d+"><th scope="row" data-value="([^"]*)">', path.read_text("utf-8"))


def test_the_page_is_sound(report, sound):
    sound(report)


def test_the_page_holds_every_pair_scan_and_reason(report, assembly):
    text = report.read_text("utf-8")
    assert len(rows_of(report)) == len(assembly.edges) + len(assembly.doubted) == 3
    assert text.count('class="node"') == 3
    assert text.count('<path class="edge ') == 3
    assert "<b>&lt;b&gt;noise</b>: " in text
    assert text.count("<script") == 8


def test_the_same_assembly_gives_the_same_bytes(report, assembly, clouds, tmp_path):
    again = write_assembly_report(assembly, clouds, tmp_path / "again.html", NAMES, "four scans")
    assert again.read_bytes() == report.read_bytes()


def test_a_pair_is_measured_against_the_poses_of_all(assembly):
    i, j, result = assembly.edges[0]
    ours = inverse(assembly.poses[i]) @ assembly.poses[j]
    agreeing = replace(result, T_target_source=ours)
    assert np.allclose(_off(assembly, (i, j, agreeing, True)), 0, atol=1e-9)
    shifted = replace(result, T_target_source=translation([0.3, 0, 0.4]) @ ours)
    assert np.allclose(_off(assembly, (i, j, shifted, True)), (0.5, 0), atol=1e-9)


def test_what_is_not_believed_comes_first_then_what_fits_worst(assembly, clouds, tmp_path):
    (i, j, result), second, third = assembly.edges
    bent = replace(result, T_target_source=translation([0.2, 0, 0]) @ result.T_target_source)
    changed = replace(assembly, edges=[second, (i, j, bent)], doubted=[third])
    path = write_assembly_report(changed, clouds, tmp_path / "changed.html", list("abcd"))
    expected = [f"{'abcd'[q]} onto {'abcd'[p]}" for p, q, _ in (third, (i, j, bent), second)]
    assert rows_of(path) == expected
    assert 'class="edge doubted" data-pair="0"' in path.read_text("utf-8")


def test_the_model_is_packed_with_the_scan_of_each_point(report, assembly, data_of):
    (model,) = data_of(report)["models"]
    cloud = model["layers"]["cloud"]
    steps = np.frombuffer(base64.b64decode(cloud["points"]), "<i2").reshape(-1, 3)
    points = np.array(cloud["centre"]) + cloud["half"] * steps / 32767 + np.median(assembly.models[0].points, axis=0)
    assert np.abs(points - assembly.models[0].points).max() < 1e-4
    scans = np.frombuffer(base64.b64decode(cloud["scans"]), "<u2")
    assert np.array_equal(np.array(assembly.components[0])[scans], assembly.models[0].attributes["scan"])
    assert model["names"] == [f"{k + 1} {NAMES[k]}" for k in assembly.components[0]]


def test_components_share_the_points_and_have_frames_of_their_own(assembly):
    model = assembly.models[0]
    two = replace(assembly, components=[[0, 1, 2], [3]], models=[model, PointCloud(
        np.random.default_rng(0).normal(size=(500, 3)), attributes={"scan": np.full(500, 3)})])
    first, second = component_models(two, NAMES, 6)
    assert first["names"] != second["names"] == ["4 <b>noise"]
    assert component_models(two, NAMES, 1) == [first]


def test_scans_that_nothing_joins_make_a_page_without_a_table(assembly, clouds, tmp_path):
    reasons = dict.fromkeys(range(4), "it overlaps with no other")
    nothing = replace(assembly, poses=[None] * 4, components=[], edges=[], doubted=[], models=[], left_out=reasons)
    text = write_assembly_report(nothing, clouds, tmp_path / "nothing.html").read_text("utf-8")
    assert text.count("it overlaps with no other") == 4
    assert "<script>" in text
    assert 'id="pairs"' not in text


def test_as_many_names_as_scans_are_asked_for(assembly, clouds, tmp_path):
    with pytest.raises(fa.ArgumentError, match="names must be as many as the 4 scans, but are 1"):
        write_assembly_report(assembly, clouds, tmp_path / "report.html", ["a"])


def test_a_line_of_the_graph_shows_its_pair(chromium, report):
    chromium.open(report)
    line = "document.querySelector('.edge[data-pair=\"2\"]')"
    chromium.run(f"{line}.dispatchEvent(new MouseEvent('click', {{bubbles: true}}))")
    chromium.settle()
    assert chromium.run("document.querySelector('tr.chosen').dataset.pair") == "2"
    name = chromium.run("document.getElementById('chosen').textContent")
    assert name == chromium.run(f"{line}.textContent")
    assert chromium.run("typeof hacked") == "undefined"
    assert chromium.complaints == []


def test_the_model_is_coloured_by_scan_and_by_height(chromium, report, seen):
    chromium.open(report)
    picture = seen(chromium, "model-canvas")
    assert picture["all"] > 2000
    assert chromium.run("[...document.querySelectorAll('#scans li')].map(item => item.textContent)") == [
        "1 a.ply", "2 <script>hacked = 1</script>", "3 c.ply"]
    chromium.run("var s = document.getElementById('scan'); s.value = '1'; s.dispatchEvent(new Event('change'))")
    one = seen(chromium, "model-canvas")
    assert one["sum"] != picture["sum"]
    chromium.click("[name=tint][value=height]")
    assert seen(chromium, "model-canvas")["sum"] not in (one["sum"], picture["sum"])
    assert not chromium.run("document.querySelector('[data-tint=height]').hidden")
    assert chromium.run("document.getElementById('scan-label').hidden")
    chromium.click("[name=tint][value=plain]")
    plain = seen(chromium, "model-canvas")
    assert plain["orange"] == plain["blue"] == plain["green"] == 0
    assert chromium.run("typeof hacked") == "undefined"
    assert chromium.complaints == []


def test_keys_are_for_the_viewer_at_hand(chromium, report, seen):
    chromium.open(report)
    model, pair = seen(chromium, "model-canvas")["sum"], seen(chromium)["sum"]
    chromium.click("tr[data-pair='0'] .pick")
    pair = seen(chromium)["sum"]
    chromium.press("2")
    assert seen(chromium, "model-canvas")["sum"] == model
    assert seen(chromium)["sum"] != pair
    pair = seen(chromium)["sum"]
    chromium.run("document.getElementById('model-canvas').focus()")
    chromium.press("2")
    assert seen(chromium, "model-canvas")["sum"] != model
    assert seen(chromium)["sum"] == pair


def test_one_component_at_a_time(chromium, assembly, clouds, tmp_path, seen):
    noise = PointCloud(clouds[3], attributes={"scan": np.full(len(clouds[3]), 3)})
    two = replace(assembly, poses=[*assembly.poses[:3], np.eye(4)], components=[*assembly.components, [3]],
                  covariances=[*assembly.covariances[:3], np.eye(6)], models=[*assembly.models, noise], left_out={})
    chromium.open(write_assembly_report(two, clouds, tmp_path / "two.html", NAMES))
    first = seen(chromium, "model-canvas")["sum"]
    chromium.run("var c = document.getElementById('component'); c.value = '1'; c.dispatchEvent(new Event('change'))")
    assert seen(chromium, "model-canvas")["sum"] != first
    assert chromium.run("document.getElementById('scans').textContent") == "4 <b>noise"
    assert chromium.complaints == []


def test_a_phone_shows_all_of_it(chromium, report):
    chromium.open(report, width=390, height=844)
    assert chromium.run("document.documentElement.scrollWidth") <= 390
