"""The command line of many pairs: a table, files that are whole or not there, and the exit status."""

import csv
import json

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.motions import apply, exp_twist

T = exp_twist(np.array([0.5, -1, 0.7, 0.3, 0.2, -0.4]))


@pytest.fixture(scope="module")
def scans(corner, tmp_path_factory):
    """A folder with three scans of 1500 points, a truncated one, and lists of pairs in a folder below."""
    folder = tmp_path_factory.mktemp("scans")
    (folder / "lists").mkdir()
    cloud = corner[::4]
    for name, points in (("a", cloud), ("b", apply(T, cloud)), ("other", cloud * [1, 0.3, 2] @ T[:3, :3])):
        fa.write_cloud(folder / f"{name}.ply", points)
    (folder / "broken.ply").write_bytes((folder / "a.ply").read_bytes()[:-1000])
    np.savetxt(folder / "lists" / "pose.txt", T)
    numbers = " ".join(map(repr, T.ravel().tolist()))
    write = {
        "good": f"source,target,init\n../a.ply,../b.ply,\n../a.ply,../b.ply,pose.txt\n../a.ply,../b.ply,{numbers}\n",
        "mixed": "\ufeffnote, target , source\n".replace(" ", "") + "x,../b.ply,../a.ply\n\n,../b.ply,../other.ply\n"
        ",../broken.ply,../a.ply\n,../nowhere.ply,../a.ply\n",
    }
    for name, text in write.items():
        (folder / "lists" / f"{name}.csv").write_text(text, encoding="utf-8")
    return folder, T


def rows_of(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def test_all_accepted_is_status_0(call, scans):
    status, out, err = call("batch", "lists/good.csv", "--output", "results.csv", "--json", "results.json")
    assert (status, err) == (0, "")
    assert [line.split()[:2] for line in out.splitlines()] == [
        ["accepted", "1"], ["accepted_near_init", "2"], ["pairs", "3"]
    ]
    rows = rows_of("results.csv")
    assert [(row["source"], row["target"], row["accepted"]) for row in rows] == [("../a.ply", "../b.ply", "true")] * 3
    expected = fa.register("a.ply", "b.ply")
    pose = [float(rows[0][f"T{row}{column}"]) for row in range(4) for column in range(4)]
    assert np.array_equal(np.reshape(pose, (4, 4)), expected.T_target_source)
    assert float(rows[0]["rmse"]) == expected.rmse
    assert float(rows[0]["overlap"]) == expected.overlap
    with open("results.json") as file:
        plain = json.load(file)
    assert np.array_equal(fa.PairResult.from_dict(plain[0]).T_target_source, expected.T_target_source)


def test_what_fails_is_told_and_does_not_stop_the_rest(call):
    status, out, _ = call("batch", "lists/mixed.csv", "--output", "results.csv", "--workers", "2")
    assert status == 3
    table = dict(line.split()[:2] for line in out.splitlines() if not line.startswith("failed:"))
    assert (table["accepted"], table["failed"], table["pairs"]) == ("1", "2", "4")
    failures = [line for line in out.splitlines() if line.startswith("failed:")]
    assert "broken.ply" in failures[0]
    assert failures[1].endswith("nowhere.ply does not exist")
    rows = rows_of("results.csv")
    assert [row["reason"] == "failed" for row in rows] == [False, False, True, True]
    assert rows[3]["error"].endswith("nowhere.ply does not exist")
    assert rows[3]["T00"] == rows[3]["seconds"] == ""


def test_json_on_stdout_is_all_there_is(call):
    status, out, err = call("batch", "lists/mixed.csv", "--json", "-")
    assert (status, err) == (3, "")
    assert [one["reason"] == "failed" for one in json.loads(out)] == [False, False, True, True]


def test_a_run_goes_on(call, tmp_path, monkeypatch):
    first = call("batch", "lists/good.csv", "--run", tmp_path / "run", "--json", "-")
    monkeypatch.setattr("fieldalign.assembly.pairs.register", pytest.fail)
    assert call("batch", "lists/good.csv", "--run", tmp_path / "run", "--json", "-") == first
    status, out, err = call("batch", "lists/good.csv", "--run", tmp_path / "run", "--seed", 1)
    assert (status, out) == (1, "")
    assert "holds a run of other inputs: the setting seed was 0, but is 1" in err


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "must begin with a header that names source and target"),
        ("a.ply,b.ply\n", "must begin with a header"),
        ("source,other\na,b\n", "but lacks ['target']"),
        ("source,target\n", "must hold pairs, but holds none"),
        ("source,target\na.ply,b.ply\na.ply\n", "line 3: source and target must be paths"),
        ("source,target,init\na.ply,b.ply,1 2 3\n", "line 2: init must hold 16 numbers"),
        ("source,target,init\na.ply,b.ply,nowhere.txt\n", "line 2: init must be a file"),
        ("source,target\n\xff,b.ply\n", "cannot be read as CSV"),
    ],
)
def test_a_list_that_is_none_is_one_error(call, text, words):
    with open("list.csv", "w", encoding="latin-1") as file:
        file.write(text)
    status, out, err = call("batch", "list.csv")
    assert (status, out, len(err.splitlines())) == (1, "", 1)
    assert words in err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("nowhere.csv",), "nowhere.csv"),
        (("lists/good.csv", "--output", "nowhere/results.csv"), "there is no folder nowhere"),
        (("lists/good.csv", "--json", "nowhere/results.json"), "there is no folder nowhere"),
        (("lists/good.csv", "--workers", "0"), "--workers"),
        (("lists/good.csv", "--dask", "tcp://here:1", "--workers", "2"), "workers belong to a local cluster"),
        (("lists/good.csv", "--run", "a.ply"), "a.ply"),
    ],
)
def test_an_error_of_the_user_is_one_line(call, options, words):
    status, out, err = call("batch", *options)
    assert (status, out, len(err.splitlines())) == (1, "", 1)
    assert words in err


def test_a_report_holds_all_pairs(call, scans):
    folder, _ = scans
    status, _, _ = call("batch", "lists/mixed.csv", "--report", "report.html")
    assert status == 3
    assert (folder / "report.html").read_text("utf-8").count("<tr data-pair") == 4
