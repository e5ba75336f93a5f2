"""The report of a pair: a file that is whole, safe and small, and the same in a real browser as its parts say."""

from __future__ import annotations

import base64
import json
import re
from hashlib import sha256
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fieldalign as fa
from fieldalign.motions import apply, exp_twist, growth, translation
from fieldalign.reports import write_report
from fieldalign.reports.charts import curve, histogram, lever, share_bar
from fieldalign.reports.closeness import AGREES, ALONE, CONTRADICTS, closeness
from fieldalign.reports.page import Page, rendered
from fieldalign.reports.pose_forms import pose_forms

EVIL = "</title></script><script>hacked = 1</script><img src=x onerror='hacked = 1'> & <!-- \u2028"
@pytest.fixture(scope="module")
def clouds(corner):
    """A corner of a room twice, the second time moved, from other points, with a part missing."""
    T = exp_twist(np.array([0.1, 0.2, 0.5, 0.4, -0.3, 0.2]))
    noise = np.random.default_rng(3).normal(0, 0.004, corner.shape)
    target = apply(T, corner + noise)
    return corner[corner[:, 0] > 0.6], target, T


@pytest.fixture(scope="module")
def result(clouds):
    return fa.register(*clouds[:2])


@pytest.fixture(scope="module")
def report(clouds, result, tmp_path_factory):
    return write_report(result, *clouds[:2], tmp_path_factory.mktemp("report") / "report.html", "a onto b")


@pytest.fixture(scope="module")
def scene_of(data_of):
    return lambda path: data_of(path)["scenes"][0]


@pytest.fixture(scope="module")
def data(report, scene_of):
    return scene_of(report)


def unpacked(packed):
    """Places (n, 3) about the origin of the view."""
    steps = np.frombuffer(base64.b64decode(packed["points"]), "<i2").reshape(-1, 3)
    return np.array(packed["centre"]) + packed["half"] * steps / 32767


def after(data, x, motion=0):
    """Where places (n, 3) of the source are after the motion, as the viewer has it."""
    pivot, found = np.array(data["pivot"]), data["motions"][motion]
    grown = translation(pivot) @ growth(found["growth"]) @ translation(-pivot)
    return apply(exp_twist(np.array(found["twist"])) @ grown, x)


def test_a_page_is_sound(report, reader, sound):
    sound(report)
    ids = reader(report.read_text("utf-8")).values("id")
    assert {"verdict", "canvas", "between", "theme"} <= set(ids)


def test_the_policy_names_just_the_scripts_and_the_style_of_the_page(report, reader):
    page = reader(report.read_text("utf-8"))
    policy = next(attrs["content"] for _, attrs in page.elements if "http-equiv" in attrs)
    kinds = [attrs.get("type") for tag, attrs in page.elements if tag == "script"]
    programs = [text for text, kind in zip(page.texts["script"], kinds, strict=True) if kind is None]
    hashes = [base64.b64encode(sha256(t.encode()).digest()).decode() for t in [*programs, *page.texts["style"]]]
    assert sorted(re.findall(r"'sha256-([^']+)'", policy)) == sorted(hashes)
    assert "Permission is hereby granted" in programs[0]


def test_what_comes_from_outside_stays_text(clouds, result, tmp_path, reader):
    page = reader(write_report(result, *clouds[:2], tmp_path / "evil.html", EVIL).read_text("utf-8"))
    assert page.texts["title"][0] == EVIL
    assert page.texts["h1"] == [EVIL]
    assert len(page.texts["script"]) == 6
    assert "img" not in [tag for tag, _ in page.elements]
    held = reader(rendered(Page("t", "", data={"name": EVIL})))
    assert json.loads(held.texts["script"][0]) == {"name": EVIL}


def test_the_same_result_gives_the_same_bytes(clouds, result, report, tmp_path):
    again = write_report(result, *map(fa.prepare, clouds[:2]), tmp_path / "again.html", "a onto b")
    assert again.read_bytes() == report.read_bytes()


def test_a_report_of_millions_of_points_stays_small(rng, tmp_path, scene_of):
    points = rng.uniform(-1, 1, (1_000_000, 3))
    face = rng.integers(0, 3, len(points))
    points[np.arange(len(points)), face] = np.sign(points[np.arange(len(points)), face])
    source, target = fa.prepare(points * [3, 2, 1]), fa.prepare(points[::-1] * [3, 2, 1] + [1, 0, 0])
    result = fa.verify(source, target, translation([1.0, 0, 0]), search=False)
    path = write_report(result, source, target, tmp_path / "large.html")
    assert path.stat().st_size < 5e6
    assert len(unpacked(scene_of(path)["clouds"]["source"])) == 100_000


@pytest.mark.parametrize("name", ["report.txt", "nowhere/report.html", "report"])
def test_a_path_that_cannot_be_is_refused(clouds, result, tmp_path, name):
    with pytest.raises(fa.ArgumentError, match="a report must"):
        write_report(result, *clouds[:2], tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_an_error_leaves_the_old_page(clouds, result, tmp_path):
    path = tmp_path / "report.html"
    path.write_text("old")
    with pytest.raises(fa.ArgumentError, match="target"):
        write_report(result, clouds[0], np.zeros((5, 3)), path)
    assert path.read_text() == "old"


def test_the_view_holds_both_clouds_and_the_motion_between_them(clouds, result, data):
    source, target, _ = clouds
    origin = np.median(target, axis=0)
    drawn = unpacked(data["clouds"]["source"])
    assert np.abs(drawn - (source - origin)).max() < 1e-4
    assert np.abs(unpacked(data["clouds"]["target"]) - (target - origin)).max() < 1e-4
    assert np.allclose(after(data, drawn), apply(result.T_target_source, drawn + origin) - origin, atol=1e-9)
    assert np.allclose(np.linalg.norm(data["up"]), 1)


def test_the_view_stays_sharp_far_from_the_origin(clouds, tmp_path, scene_of):
    source, target, T = clouds
    far = np.array([4.5e6, 5.4e6, 200.0])
    motion = T @ translation(-far)
    result = fa.verify(source + far, target, motion, search=False)
    data = scene_of(write_report(result, source + far, target, tmp_path / "far.html"))
    end = after(data, unpacked(data["clouds"]["source"])) + np.median(target, axis=0)
    assert np.abs(end - apply(T, source)).max() < 1e-4


def test_a_report_in_the_plane_and_one_with_a_scale(tmp_path, scene_of):
    rng = np.random.default_rng(1)
    u = rng.uniform(0, 1, 1500)
    plan = np.r_[np.c_[4 * u, 0 * u], np.c_[0 * u, 3 * u], np.c_[4 * u, 3 - 0.4 * u], np.c_[1 + u, 1 + 0.3 * u]]
    c, s = np.cos(0.4), np.sin(0.4)
    moved = plan @ np.array([[c, s], [-s, c]]) + [1.0, 2.0]
    flat = fa.register(plan, moved)
    page = write_report(flat, plan, moved, tmp_path / "flat.html")
    data = scene_of(page)
    end = after(data, unpacked(data["clouds"]["source"]))
    near = fa.fields.PointField(unpacked(data["clouds"]["target"])).sample(end).value
    assert np.percentile(near, 90) < 0.05

    grown = fa.register(2.5 * plan, moved, scale=True)
    page = write_report(grown, 2.5 * plan, moved, tmp_path / "grown.html")
    assert "grown by" in page.read_text("utf-8")
    data = scene_of(page)
    assert np.isclose(data["motions"][0]["growth"], 0.4, rtol=1e-3)


def test_a_report_of_the_papers_method_shows_its_own_pseudo_points(clouds, tmp_path, scene_of):
    source, target = map(fa.prepare, clouds[:2])
    result = fa.register(source, target, init=clouds[2], method="paper")
    data = scene_of(write_report(result, source, target, tmp_path / "paper.html"))
    assert data["pseudo"]["of"] == "target"
    found = unpacked(data["pseudo"]) + np.median(clouds[1], axis=0)
    assert np.abs(found - target.last_pseudo_points).max() < 1e-3


def test_a_report_against_a_mesh_is_signed(tmp_path):
    pytest.importorskip("igl")
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float) * [3, 2, 1]
    faces = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6],
                      [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]])
    mesh = fa.fields.MeshField(corners, faces)
    points = mesh.spread(4000)
    result = fa.verify(points, mesh, np.eye(4), search=False)
    text = write_report(result, points, mesh, tmp_path / "mesh.html").read_text("utf-8")
    assert "negative inside" in text


def test_agreement_and_signed_distance():
    rng = np.random.default_rng(0)
    floor = np.c_[rng.uniform(-2, 2, (20_000, 2)), np.zeros(20_000)]
    other = fa.prepare(fa.PointCloud(floor, viewpoint=translation([0, 0, 1.5])))
    flat = np.c_[rng.uniform(-1, 1, (500, 2)), np.full(500, 0.03)]
    upright = np.c_[rng.uniform(-1, 1, 500), np.zeros(500), rng.uniform(-0.02, 0.02, 500)]
    away = np.c_[rng.uniform(-1, 1, (500, 2)), np.full(500, 0.9)]
    for places, expected in ((flat, AGREES), (upright, CONTRADICTS), (away, ALONE)):
        found = closeness(places, fa.prepare(places), other, np.eye(4), 0.1)
        assert (found.state == expected).mean() > 0.9
    near = closeness(flat, fa.prepare(flat), other, np.eye(4), 0.1)
    assert np.allclose(near.distance, -0.03, atol=1e-3)
    assert "sensor" in near.side
    under = closeness(flat - [0, 0, 0.06], fa.prepare(flat), other, np.eye(4), 0.1)
    assert np.allclose(under.distance, 0.03, atol=1e-3)


def test_poses_are_written_as_each_program_takes_them():
    T = exp_twist(np.array([0.3, -0.2, 2.5, 1.0, 2.0, -3.0]))
    numpy, compare, ros, plain = pose_forms(T)
    names = {"np": np}
    exec(numpy.text, names)
    assert np.array_equal(names["T"], T)
    assert np.array_equal([list(map(float, row.split())) for row in compare.text.splitlines()], T)
    lines = [line.split(":", 1)[1] for line in ros.text.splitlines()]
    shift, turn = (list(map(float, re.findall(r": (-?[\d.e-]+)", line))) for line in lines)
    assert np.allclose(shift, T[:3, 3], atol=0)
    assert np.allclose(Rotation.from_quat(turn).as_matrix(), T[:3, :3])
    assert np.array_equal(json.loads(plain.text)["T_target_source"], T)


def test_a_scale_is_told_where_ros_has_none():
    assert "scale" in pose_forms(growth(2.0))[2].note
    assert "scale" not in pose_forms(np.eye(4))[2].note
    flat = pose_forms(np.array([[0.0, -1, 3], [1, 0, 4], [0, 0, 1]]))
    assert flat[1].text.splitlines()[2] == "0.0 0.0 1.0 0.0"


@pytest.mark.parametrize("drawing", [
    curve([1.0, 0.1, 0.0], "size", "steps"), curve([0.0], "size", "steps"), curve([2.0], "<size>", "steps"),
    histogram(np.linspace(-1, 2, 50), 1.0, True, "distance"), histogram(np.zeros(3), 1e-12, False, "distance"),
    lever(3.0), lever(0.0), share_bar(0.4),
])
def test_charts_are_well_formed_and_within_their_frame(drawing):
    root = ElementTree.fromstring(drawing)
    width = float(root.get("viewBox").split()[2])
    for element in root.iter():
        for name in ("x", "cx", "y", "cy"):
            assert -1 <= float(element.get(name, 0)) <= width


def test_bars_stand_for_all_values():
    values = np.random.default_rng(0).normal(size=1000)
    counts = re.findall(r": (\d+) points", histogram(values, 1.0, True, "distance"))
    assert sum(map(int, counts)) == 1000


def test_the_package_holds_what_a_page_is_made_of():
    from importlib.resources import files

    names = {file.name for file in files("fieldalign.reports").joinpath("page").iterdir()}
    assert {"page.css", "page.js", "table.js", "stage.js", "camera.js", "pair.js", "model.js", "three.min.js",
            "three.LICENSE", "README.md"} <= names


# ---- In a real browser

@pytest.fixture
def blind(chromium):
    """A browser without WebGL."""
    script = "HTMLCanvasElement.prototype.getContext = () => null"
    made = chromium.call("Page.addScriptToEvaluateOnNewDocument", source=script)
    yield chromium
    chromium.call("Page.removeScriptToEvaluateOnNewDocument", **made)


def test_without_webgl_all_else_stands(blind, report):
    blind.open(report)
    assert blind.run("getComputedStyle(document.querySelector('.no-view')).display") == "block"
    assert blind.run("getComputedStyle(document.querySelector('.sliding')).display") == "none"
    blind.click("#tab2")
    assert not blind.run("document.getElementById('form2').hidden")


@pytest.fixture
def browser(chromium, report):
    """The report, open; it complained of nothing when the test ends."""
    chromium.open(report)
    yield chromium
    assert chromium.complaints == []


def test_the_page_loads_and_shows_both_clouds(browser, seen):
    found = seen(browser)
    assert found["orange"] > 500
    assert found["blue"] > 500
    assert browser.run("performance.getEntriesByType('resource').length") == 0
    assert browser.run("!document.querySelector('#viewer.off')")


def test_colouring_by_agreement_and_by_distance(browser, seen):
    browser.click("input[value=agreement]")
    assert seen(browser)["green"] > 1000
    assert browser.run("!document.querySelector('[data-legend=agreement]').hidden")
    assert browser.run("document.querySelector('[data-legend=cloud]').hidden")
    browser.click("input[value=distance]")
    found = seen(browser)
    assert found["green"] == 0
    assert found["all"] > 1000


def test_the_slider_moves_the_source(browser, seen):
    end = seen(browser)
    browser.run("document.getElementById('between').focus()")
    browser.press("b")
    assert browser.run("document.getElementById('where').value") == "before"
    begin = seen(browser)
    assert begin["sum"] != end["sum"]
    for _ in range(3):
        browser.press("ArrowRight")
    assert browser.run("document.getElementById('where').value") == "3 %"
    assert seen(browser)["sum"] != begin["sum"]
    browser.press("a")
    assert seen(browser)["sum"] == end["sum"]


def test_play_goes_from_before_to_after(browser):
    browser.click("#play")
    browser.wait_for("document.getElementById('where').value.endsWith('%')")
    browser.wait_for("document.getElementById('where').value === 'after'")


def test_clouds_and_pseudo_points_come_and_go(browser, seen):
    browser.click("#show-source")
    found = seen(browser)
    assert found["orange"] == 0
    assert found["blue"] > 500
    browser.click("#show-pseudo")
    assert seen(browser)["black"] > 100
    browser.click("#show-source")
    browser.click("#show-target")
    assert seen(browser)["orange"] > 500


def test_views_and_the_keyboard_turn_the_camera(browser, seen):
    pictures = [seen(browser)["sum"]]
    for view in ("above", "side"):
        browser.click(f"[data-view={view}]")
        pictures.append(seen(browser)["sum"])
    browser.run("document.getElementById('canvas').focus()")
    for key in ("ArrowLeft", "ArrowUp", "+"):
        browser.press(key)
        pictures.append(seen(browser)["sum"])
    assert len(set(pictures)) == len(pictures)
    browser.press("1")
    assert seen(browser)["sum"] == pictures[0]
    assert seen(browser)["all"] > 1000


def test_a_finger_turns_the_camera(browser, report, seen):
    browser.open(report, width=390, height=844)
    before = seen(browser)["sum"]
    box = browser.run("(b => [b.x + b.width / 2, b.y + b.height / 2])(document.querySelector('#canvas')."
                      "getBoundingClientRect())")
    for kind, shift in (("touchStart", 0), ("touchMove", 30), ("touchMove", 80)):
        browser.call("Input.dispatchTouchEvent", type=kind, touchPoints=[{"x": box[0] + shift, "y": box[1]}])
    browser.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    assert seen(browser)["sum"] != before
    assert seen(browser)["all"] > 500


def test_another_axis_can_be_turned_upwards(browser, seen):
    first = seen(browser)["sum"]
    label = "document.querySelector('[data-up]').textContent"
    browser.click("[data-up]")
    assert browser.run(label).startswith("Up: ")
    pictures, names = {seen(browser)["sum"]}, {browser.run(label)}
    while browser.run(label) != "Up: as found":
        browser.press("u")
        pictures.add(seen(browser)["sum"])
        names.add(browser.run(label))
    assert len(pictures) == len(names) >= 5
    assert seen(browser)["sum"] == first
    assert seen(browser)["all"] > 1000


def test_light_and_dark(browser, report, seen):
    background = "getComputedStyle(document.body).backgroundColor"
    light = browser.run(background)
    before = seen(browser)["sum"]
    browser.click("#theme")
    assert browser.run(background) != light
    assert seen(browser)["sum"] != before
    dark = browser.run(background)
    browser.open(report, dark=True)
    assert browser.run(background) == dark


def test_tabs_and_copying(browser, result):
    browser.click("#tab0")
    browser.press("ArrowRight")
    assert browser.run("document.activeElement.textContent") == "CloudCompare"
    assert browser.run("document.getElementById('form0').hidden")
    browser.click("#form1 .copy")
    browser.wait_for("document.getElementById('told').textContent !== ''")
    text = browser.run("document.querySelector('#form1 pre').textContent")
    assert np.allclose([list(map(float, row.split())) for row in text.splitlines()], result.T_target_source)


def test_the_focus_can_be_seen(browser):
    browser.press("Tab")
    assert browser.run("document.activeElement.className") == "skip"
    browser.press("Tab")
    assert browser.run("getComputedStyle(document.activeElement).outlineStyle") == "solid"


def test_a_phone_shows_all_of_it(browser, report, seen):
    browser.open(report, width=390, height=844)
    assert browser.run("document.documentElement.scrollWidth") <= 390
    assert seen(browser)["all"] > 500


def test_a_scan_named_as_a_script_does_nothing(browser, clouds, result, tmp_path, seen):
    browser.open(write_report(result, *clouds[:2], tmp_path / "evil.html", EVIL))
    assert browser.run("typeof hacked") == "undefined"
    assert seen(browser)["all"] > 500
    browser.run("document.body.insertAdjacentHTML('beforeend', '<b onclick=\"hacked = 1\" id=\"trap\">x</b>')")
    browser.run("document.getElementById('trap').click()")
    assert browser.run("typeof hacked") == "undefined"
    browser.wait_for("true")
    assert all("Content Security Policy" in complaint for complaint in browser.complaints)
    browser.complaints.clear()


def test_alternatives_can_be_looked_at(chromium, tmp_path, seen, scene_of):
    rng = np.random.default_rng(0)
    points = rng.uniform(-1, 1, (6000, 3))
    face = rng.integers(0, 3, len(points))
    points[np.arange(len(points)), face] = np.sign(points[np.arange(len(points)), face])
    points *= [3, 2, 1]
    result = fa.register(points[:3000], points[3000:])
    assert result.alternatives
    path = write_report(result, points[:3000], points[3000:], tmp_path / "box.html")
    data = scene_of(path)
    end = after(data, unpacked(data["clouds"]["source"]), motion=1) + np.median(points[3000:], axis=0)
    assert np.allclose(end, apply(result.alternatives[0].T_target_source, points[:3000]), atol=1e-3)
    chromium.open(path)
    first = seen(chromium)["sum"]
    chromium.run("document.getElementById('pose').focus()")
    chromium.run("const p = document.getElementById('pose'); p.value = '1'; p.dispatchEvent(new Event('change'))")
    assert seen(chromium)["sum"] != first
    assert chromium.complaints == []
