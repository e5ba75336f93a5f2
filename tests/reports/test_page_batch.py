"""The report of many pairs: what failed first, a table that sorts, and each pair a click away."""

from __future__ import annotations

import re

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.motions import apply, exp_twist
from fieldalign.reports import pair_table, write_batch_report

T = exp_twist(np.array([0.5, -1, 0.7, 0.3, 0.2, -0.4]))


@pytest.fixture(scope="module")
def pairs(corner, tmp_path_factory):
    """Three pairs: two right, the one between cannot be read and has a name that means harm."""
    folder = tmp_path_factory.mktemp("scans")
    cloud = corner[::3]
    np.save(folder / "a.npy", cloud)
    np.save(folder / "b.npy", apply(T, cloud))
    np.save(folder / "c.npy", apply(T, corner[1::3]))
    names = [("a.npy", "b.npy"), ("<img src=x onerror=hacked=1>.npy", "b.npy"), ("a.npy", "c.npy")]
    return [(str(folder / one), str(folder / other)) for one, other in names]


@pytest.fixture(scope="module")
def results(pairs):
    return fa.register_many(pairs)


@pytest.fixture(scope="module")
def report(pairs, results, tmp_path_factory):
    return write_batch_report(results, pairs, tmp_path_factory.mktemp("report") / "batch.html", "three <pairs>")


def test_the_page_is_sound(report, sound):
    sound(report)


def test_what_failed_comes_first_and_has_no_picture(report, results, data_of):
    data = data_of(report)
    assert [pair["scene"] is None for pair in data["pairs"]] == [True, False, False]
    assert "does not exist" in data["pairs"][0]["verdict"]
    strengths = [result.evidence.strength for result in results if result.error is None]
    rows = re.findall(r'data-value="([\d.e+-]+)">[\d.e+-]+×', report.read_text("utf-8"))
    assert [float(value) for value in rows] == sorted(strengths)


def test_the_page_is_the_same_again_and_holds_no_element_from_outside(report, results, pairs, tmp_path):
    again = write_batch_report(results, pairs, tmp_path / "again.html", "three <pairs>")
    assert again.read_bytes() == report.read_bytes()
    assert "<img" not in report.read_text("utf-8")


def test_only_the_weakest_of_many_have_pictures(monkeypatch, results, pairs, tmp_path, data_of):
    monkeypatch.setattr(pair_table, "_PICTURES", 2)
    asked = []
    path = write_batch_report(results, pairs, tmp_path / "few.html", progress=lambda done, of: asked.append((done, of)))
    assert [pair["scene"] for pair in data_of(path)["pairs"]] == [None, 0, None]
    assert asked == [(0, 2), (1, 2)]


def test_a_table_of_very_many_holds_the_weakest(monkeypatch, results, pairs, tmp_path, data_of):
    monkeypatch.setattr(pair_table, "_ROWS", 2)
    path = write_batch_report(results, pairs, tmp_path / "first.html")
    assert len(data_of(path)["pairs"]) == 2
    assert "The first 2 of 3." in path.read_text("utf-8")


def test_clouds_that_are_gone_leave_their_rows(results, pairs, tmp_path, data_of):
    gone = [(str(tmp_path / "gone.npy"), target) for _, target in pairs]
    path = write_batch_report(results, gone, tmp_path / "gone.html")
    assert data_of(path)["scenes"] == []
    assert path.read_text("utf-8").count("<tr data-pair") == 3


def test_as_many_pairs_as_results_are_asked_for(results, pairs, tmp_path):
    with pytest.raises(fa.ArgumentError, match="as many as the 3 results, but are 2"):
        write_batch_report(results, pairs[:2], tmp_path / "report.html")


def test_a_row_shows_its_pair(chromium, report, results):
    chromium.open(report)
    assert chromium.run("document.querySelector('tr.chosen').dataset.pair") == "1"
    chromium.click("tr[data-pair='2'] .pick")
    assert chromium.run("document.getElementById('said').textContent").startswith("Accepted")
    name = chromium.run("document.getElementById('chosen').textContent")
    (result,) = [r for r in results if f"{r.source} onto {r.target}" == name]
    named = {"np": np}
    exec(chromium.run("document.querySelector('#form0 pre').textContent"), named)
    assert np.array_equal(named["T"], result.T_target_source)
    chromium.click("tr[data-pair='0'] .pick")
    assert chromium.run("document.getElementById('viewer').hidden")
    assert chromium.run("typeof hacked") == "undefined"
    assert chromium.complaints == []


def test_columns_sort_both_ways_and_what_failed_stays_last(chromium, report):
    chromium.open(report)
    order = "[...document.querySelectorAll('tbody tr')].map(row => row.dataset.pair).join('')"
    assert chromium.run(order) == "012"
    chromium.click("th:nth-child(3) .sort")
    assert chromium.run(order) == "120"
    chromium.click("th:nth-child(3) .sort")
    assert chromium.run(order) == "210"
    assert chromium.run("document.querySelector('th:nth-child(3)').getAttribute('aria-sort')") == "descending"


def test_a_phone_scrolls_the_table_alone(chromium, report):
    chromium.open(report, width=390, height=844)
    assert chromium.run("document.documentElement.scrollWidth") <= 390


def test_without_any_picture_the_table_still_works(chromium, results, pairs, tmp_path):
    gone = [(str(tmp_path / "gone.npy"), target) for _, target in pairs]
    chromium.open(write_batch_report(results, gone, tmp_path / "gone.html"))
    chromium.click("tr[data-pair='1'] .pick")
    assert chromium.run("document.getElementById('said').textContent").startswith("Accepted")
    assert chromium.complaints == []
