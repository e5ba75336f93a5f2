"""The report of an experiment: what is wrong first, each registration a click away, beside the truth."""

from __future__ import annotations

import re
from functools import partial

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.experiments.case import Case, Moved
from fieldalign.experiments.results import Results
from fieldalign.motions import exp_twist, translation
from fieldalign.reports import page_experiment, pair_table, write_experiment_report

T = exp_twist(np.array([0.2, -0.1, 0.4, 0.3, 0.2, -0.4]))
EVIL = "</td></script><script>hacked = 1</script>"
TITLES = {"ours": "Ours <b>", "theirs": "Theirs"}


def row(off=0.0, accepted=None):
    return {
        "T": (translation([off, 0, 0]) @ T)[:3].ravel().tolist(), "accepted": accepted, "rre_deg": 0.0, "rte": off,
        "seconds": 0.01 + off, "cpu_seconds": 0.02,
    }


def results_of(corner, title="An experiment", success=(1.0, 0.1)):
    """Three cases by two methods: right, wrong and yet accepted, wrong, and one without a pose."""
    cases = [Case(f"{name} {EVIL}", "rooms", Moved(partial(np.asarray, corner[k::6]), T), T)
             for k, name in enumerate("abc")]
    found = [row(0.0, True), row(0.02), row(0.5, True), row(0.7), row(0.05, False), {"error": f"no {EVIL}"}]
    rows = {(case.name, method): found[2 * k + m] for k, case in enumerate(cases) for m, method in enumerate(TITLES)}
    return Results(cases, TITLES, rows, success, 0, {"title": title, "protocol": [f"What was done. {EVIL}"]})


@pytest.fixture(scope="module")
def results(corner):
    return results_of(corner)


@pytest.fixture(scope="module")
def report(results, tmp_path_factory):
    return write_experiment_report([results], tmp_path_factory.mktemp("report") / "experiment.html", EVIL)


def words_of(path):
    return re.findall(r'<span class="mark">([^<]*)</span>', path.read_text("utf-8"))


def test_the_page_is_sound(report, sound):
    sound(report)


def test_the_worst_comes_first(report, data_of):
    assert words_of(report) == ["wrong, yet accepted", "no pose", "wrong", "right", "right", "right"]
    data = data_of(report)
    assert [pair["scene"] for pair in data["pairs"]] == [0, 1, 2, 3, 4, 5]
    assert "0.5 from the truth; 1° and 0.1 are allowed. The method accepts it." in data["pairs"][0]["verdict"]
    assert data["pairs"][1]["verdict"].startswith(f"No pose: no {EVIL}")


def test_each_picture_holds_what_was_found_and_the_truth(report, data_of):
    wrong, without, *_ = data_of(report)["scenes"]
    assert [motion["name"] for motion in wrong["motions"]] == ["as found", "the truth"]
    assert [motion["name"] for motion in without["motions"]] == ["the truth"]
    assert np.allclose(wrong["motions"][1]["twist"], without["motions"][0]["twist"], atol=0.3)


def test_methods_stand_side_by_side(report):
    text = report.read_text("utf-8")
    assert re.findall(r'data-value="[\d.]+">([\d.]+%)</td>', text) == ["66.7%", "33.3%"]
    assert "<dt>wrong, yet accepted</dt><dd>1</dd>" in text


def test_symmetry_counts_where_there_may_be_some(results, tmp_path):
    turned = {"rre_modulo_deg": 0.1, "rte_modulo": 0.0}
    rows = {key: found if "error" in found else found | {"rre_deg": 90.0} | turned
            for key, found in results.rows.items()}
    symmetric = [Case(c.name, c.group, c.clouds, T, shape=partial(np.zeros, (3, 3))) for c in results.cases]
    again = Results(symmetric, TITLES, rows, results.success, 0, results.head)
    assert words_of(write_experiment_report([again], tmp_path / "symmetric.html")).count("right") == 5


def test_only_the_worst_of_many_have_pictures_and_rows(monkeypatch, results, tmp_path, data_of):
    monkeypatch.setattr(page_experiment, "_PICTURES", 2)
    monkeypatch.setattr(pair_table, "_ROWS", 4)
    asked = []
    path = write_experiment_report(
        [results], tmp_path / "few.html", progress=lambda done, of: asked.append((done, of))
    )
    assert [pair["scene"] for pair in data_of(path)["pairs"]] == [0, 1, None, None]
    assert "The first 4 of 6." in path.read_text("utf-8")
    assert asked == [(0, 2), (1, 2)]


def test_parts_share_one_table(corner, results, tmp_path, data_of):
    path = write_experiment_report([results, results_of(corner, "Another part")], tmp_path / "parts.html")
    assert len(data_of(path)["pairs"]) == 12
    assert path.read_text("utf-8").count('class="part"') == 2


def test_the_same_results_give_the_same_bytes(report, results, tmp_path):
    assert write_experiment_report([results], tmp_path / "again.html", EVIL).read_bytes() == report.read_bytes()


def test_nothing_to_report_is_refused(tmp_path):
    with pytest.raises(fa.ArgumentError, match="hold none"):
        write_experiment_report([], tmp_path / "none.html")


def test_tables_sort_and_a_method_can_be_chosen(chromium, report):
    chromium.open(report)
    order = "[...document.querySelectorAll('#pairs tbody tr:not([hidden])')].map(row => row.dataset.pair).join('')"
    assert chromium.run(order) == "012345"
    chromium.click("#pairs th:nth-child(4) .sort")  # off by; what has no pose stays last
    assert chromium.run(order) == "543021"
    chromium.click("#pairs th:nth-child(4) .sort")
    assert chromium.run(order) == "203451"
    only = "var o = document.getElementById('only'); o.value = {}; o.dispatchEvent(new Event('change'))"
    chromium.run(only.format("'Theirs'"))
    assert len(chromium.run(order)) == 3
    chromium.run(only.format("''"))
    assert len(chromium.run(order)) == 6
    chromium.click(".part th:nth-child(3) .sort")
    assert chromium.run("document.querySelector('.part tbody th').dataset.value") == "Theirs"
    assert chromium.complaints == []


def test_a_click_shows_the_registration_and_the_truth(chromium, report, seen):
    chromium.open(report)
    chromium.click("tr[data-pair='0'] .pick")
    assert chromium.run("document.getElementById('chosen').textContent").endswith("Ours <b>")
    found = seen(chromium)
    assert found["orange"] > 300
    assert found["blue"] > 300
    chromium.run("var p = document.getElementById('pose'); p.value = '1'; p.dispatchEvent(new Event('change'))")
    assert seen(chromium)["sum"] != found["sum"]
    assert chromium.run("typeof hacked") == "undefined"
    assert chromium.complaints == []


def test_a_phone_shows_all_of_it(chromium, report):
    chromium.open(report, width=390, height=844, dark=True)
    assert chromium.run("document.documentElement.scrollWidth") <= 390
