"""fieldalign localize: scans of a room on its map."""

import json

import numpy as np
import pytest

import fieldalign as fa

PLACES = [(-6.0, 1.0, 1.5), (-5.7, 1.1, 1.5), (-5.4, 1.2, 1.5)]


@pytest.fixture(scope="module")
def scans(tmp_path_factory, seen_from):
    """A map, three scans in a row (also as a drive with stamps) and one of another place."""
    folder = tmp_path_factory.mktemp("map")
    stations = [(-9.0, -3.0, 1.5), (-3.0, 3.0, 1.5), (2.0, -2.0, 1.5), (9.0, 2.0, 1.5), (0.0, 7.0, 1.5)]
    fa.write_cloud(folder / "map.ply", fa.PointCloud(np.concatenate([seen_from(s, 50) + s for s in stations])))
    (folder / "drive").mkdir()
    (folder / "drive" / "times.txt").write_text("7.0\n7.1\n7.2\n")
    for k, place in enumerate(PLACES):
        for name in (f"{k}.ply", f"drive/{k}.ply"):
            fa.write_cloud(folder / name, fa.PointCloud(seen_from(place, k)))
    fa.write_cloud(folder / "elsewhere.ply", fa.PointCloud(np.random.default_rng(0).uniform(-9, 9, (9000, 3))))
    return folder, None


def test_scans_are_found(call, scans):
    status, out, err = call("localize", "map.ply", "0.ply", "1.ply", "2.ply", "--json", "found.json")
    assert (status, err) == (0, "")
    lines = out.splitlines()
    assert lines[0].startswith("0.ply: found at -")
    assert [line.split()[1] for line in lines[1:]] == ["tracked", "tracked"]
    rows = json.loads((scans[0] / "found.json").read_text())
    for row, place in zip(rows, PLACES, strict=True):
        assert np.allclose(np.array(row["pose"])[:3, 3], place, atol=0.03)
        assert row["tracked"]
    assert rows[0]["search"]
    assert rows[1]["search"] is None


def test_a_drive_becomes_a_trajectory(call, tmp_path):
    status, out, _ = call("localize", "map.ply", "drive", "--trajectory", tmp_path / "way.txt")
    assert status == 0
    assert out.startswith("frame 0: found")
    way = fa.read_trajectory(tmp_path / "way.txt")
    assert np.allclose(way.times, [7, 7.1, 7.2])
    assert np.allclose(way.positions, PLACES, atol=0.03)


def test_a_scan_of_another_place_has_none(call):
    status, out, _ = call("localize", "map.ply", "elsewhere.ply", "0.ply", "--json", "-")
    assert status == 3
    rows = json.loads(out)
    assert (rows[0]["reason"], rows[0]["pose"], rows[1]["reason"]) == ("unplaced", None, "found")


def test_errors_are_one_line(call):
    for args, what in (
        (("none.ply", "0.ply"), "none.ply"),
        (("map.ply", "none.ply"), "none.ply"),
        (("map.ply", "0.ply", "--trajectory", "no/where.txt"), "there is no folder no"),
        (("map.ply",), "Missing argument"),
    ):
        status, _, err = call("localize", *args)
        assert status == 1
        assert what in err
        assert err.count("\n") == 1
