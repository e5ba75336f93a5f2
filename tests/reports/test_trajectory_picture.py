"""The picture of a trajectory: what is drawn, whole or not at all, and what is refused."""

import sys

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.motions import translation
from fieldalign.odometry.trajectory import Trajectory
from fieldalign.reports import trajectory_picture as module
from fieldalign.reports.trajectory_picture import trajectories_picture, trajectory_picture


@pytest.fixture
def drives(winding, monkeypatch):
    """A trajectory and the truth; coarse pictures are drawn faster."""
    monkeypatch.setattr(module, "_DPI", 40)
    truth = Trajectory(np.arange(80), winding(2, 80))
    return truth.in_world(translation([0, 0, 3.0])), truth


@pytest.fixture
def panels(monkeypatch):
    """The panels of the picture that is drawn."""
    drawn, make = [], module._panels
    monkeypatch.setattr(module, "_panels", lambda *how: drawn.extend((made := make(*how))[1]) or made)
    return drawn


def curves(axes):
    return {line.get_label(): line.get_xydata() for line in axes.get_lines()}


def test_the_ways_and_the_errors_are_drawn(drives, panels, tmp_path):
    pytest.importorskip("matplotlib")
    trajectory, truth = drives
    path = trajectory_picture(trajectory, tmp_path / "drive.png", truth, "a drive")
    assert path.read_bytes().startswith(b"\x89PNG")
    assert [entry.name for entry in tmp_path.iterdir()] == ["drive.png"]
    above, height, move, turn = panels
    assert np.array_equal(curves(above)["truth"], truth.positions[:, :2])
    assert np.array_equal(curves(above)["trajectory"], trajectory.positions[:, :2])
    assert np.array_equal(curves(height)["trajectory"], np.c_[truth.distances, trajectory.positions[:, 2]])
    (error,), (angle,) = (axes.get_lines() for axes in (move, turn))
    np.testing.assert_allclose(error.get_ydata(), 3)
    np.testing.assert_allclose(angle.get_ydata(), 0, atol=1e-6)
    assert above.get_title() == "a drive"
    assert panels[-1].get_xlabel() == "path (m)"


def test_several_trajectories_are_told_apart(drives, panels, tmp_path):
    pytest.importorskip("matplotlib")
    trajectory, truth = drives
    ways = {"a": trajectory, "b": truth.in_world(translation([1.0, 0, 0]))}
    trajectories_picture(ways, tmp_path / "drives.png", truth)
    above, height, move, _ = panels
    for name, way in ways.items():
        assert np.array_equal(curves(above)[name], way.positions[:, :2])
        assert np.array_equal(curves(height)[name], np.c_[truth.distances, way.positions[:, 2]])
    assert len({line.get_color() for line in above.get_lines()}) == 4  # of both ways, of the truth and of the start
    assert [line.get_ydata()[0] for line in move.get_lines()] == pytest.approx([3, 1])


@pytest.mark.parametrize("suffix", [".svg", ".pdf"])
def test_without_a_truth_there_are_no_errors(drives, panels, tmp_path, suffix):
    pytest.importorskip("matplotlib")
    trajectory_picture(drives[0], tmp_path / f"drive{suffix}")
    assert len(panels) == 2
    assert "truth" not in curves(panels[0])
    assert panels[0].get_title().startswith("80 poses over")


def test_one_pose_that_is_right_is_drawn(drives, tmp_path):
    pytest.importorskip("matplotlib")
    trajectory_picture(drives[0][:1], tmp_path / "one.png", drives[0][:1])


@pytest.mark.parametrize(
    ("rows", "true_rows", "name", "words"),
    [(80, 79, "a.png", "truth must have the 80 poses"), (0, 0, "a.png", "trajectory must have poses"),
     (80, 80, "a.bmp", "path"), (80, 80, "no/folder/a.png", "path")],
)
def test_what_cannot_be_drawn_is_refused(drives, tmp_path, rows, true_rows, name, words):
    with pytest.raises(fa.ArgumentError, match=words):
        trajectory_picture(drives[0][:rows], tmp_path / name, drives[1][:true_rows])
    assert not list(tmp_path.iterdir())


def test_without_matplotlib_the_extra_is_named(drives, tmp_path, monkeypatch):
    for name in [name for name in sys.modules if name.split(".")[0] == "matplotlib"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(fa.MissingExtraError, match=r"fieldalign\[viz\]"):
        trajectory_picture(drives[0], tmp_path / "a.png")
