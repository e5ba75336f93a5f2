"""The picture: it is written whole, shows both clouds before and after, and refuses what it cannot draw."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from fieldalign import errors
from fieldalign.clouds.cloud import PointCloud
from fieldalign.reports import painting, picture, views
from fieldalign.reports.picture import before_and_after

UP = np.array([0.0, 0.0, 1.0])


def room(rng, n=4000, ceiling=True):
    """Points on the faces of a room of 6 x 5 x 2.5, floor at 0."""
    size = np.array([6.0, 5.0, 2.5])
    points = rng.uniform(0, 1, (n, 3))
    face = rng.integers(5 if not ceiling else 6, size=n)
    axis, side = np.array([0, 0, 1, 1, 2, 2])[face], np.array([0, 1, 0, 1, 0, 1])[face]
    points[np.arange(n), axis] = side
    return points * size - size / 2


def tilted(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    """A coarser picture than a user gets: it takes a fourth of the time."""
    monkeypatch.setattr(picture, "_DPI", 40)


@pytest.fixture
def pair():
    rng = np.random.default_rng(0)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = tilted(0.3), (1.0, 0.2, 0.1)
    target = room(rng)
    source = (room(rng) - T[:3, 3]) @ T[:3, :3]
    return source, target, T


def shares_of_colors(image):
    """Share of orange and of blue pixels in each half, left and right."""
    red, blue = image[..., 0], image[..., 2]
    halves = np.array_split(red - blue, 2, axis=1)
    return [(np.mean(half > 0.15), np.mean(half < -0.15)) for half in halves]


def test_png_shows_both_colors_in_both_columns(pair, tmp_path):
    image_module = pytest.importorskip("matplotlib.image")
    path = before_and_after(*pair, tmp_path / "picture.png")
    image = image_module.imread(path)
    assert image.shape[1] > 400
    for orange, blue in shares_of_colors(image[..., :3]):
        assert orange > 0.01
        assert blue > 0.01
    assert [entry.name for entry in tmp_path.iterdir()] == ["picture.png"]  # no unfinished file is left


def test_only_after_the_registration_the_source_is_moved(pair, tmp_path, monkeypatch):
    pytest.importorskip("matplotlib")
    source, target, T = pair
    painted = []
    monkeypatch.setattr(picture, "paint", lambda clouds, *rest: painted.append(clouds) or painting.paint(clouds, *rest))
    before_and_after(source, target, T, tmp_path / "picture.png")
    assert len(painted) == 4
    for (before, fixed), (after, still) in (painted[:2], painted[2:]):
        assert np.array_equal(fixed, still)
        assert np.allclose(before @ T[:3, :3].T + T[:3, 3], after)
        assert 0.5 * len(source) < len(before) < 0.9 * len(source)  # the ceiling is gone
        assert np.isin(before[:, 0], source[:, 0]).all()
        assert after[:, 2].max() < 1.1  # of 1.25


@pytest.mark.parametrize(("suffix", "beginning"), [(".svg", b"<?xml"), (".PDF", b"%PDF")])
def test_suffix_picks_the_format(pair, tmp_path, suffix, beginning):
    pytest.importorskip("matplotlib")
    path = before_and_after(*pair, str(tmp_path / "picture") + suffix, title="<5 & 6>")
    written = path.read_bytes()
    assert written.startswith(beginning)
    assert len(written) < 4_000_000
    if suffix == ".svg":
        assert written.count(b"<image") == 4


def test_same_clouds_same_picture(pair, tmp_path):
    pytest.importorskip("matplotlib")
    pictures = [before_and_after(*pair, tmp_path / f"{i}.png").read_bytes() for i in range(2)]
    assert pictures[0] == pictures[1]


def test_clouds_of_any_kind_are_drawn_and_left_alone(pair, tmp_path):
    pytest.importorskip("matplotlib")
    source, target, T = pair
    source[:5] = np.nan
    copies = source.copy(), target.copy()
    before_and_after(PointCloud(source, viewpoint=np.eye(4)), target.astype(np.float32), T, tmp_path / "a.png")
    before_and_after(source[5:8], target[:1], T, tmp_path / "few.png")
    before_and_after(source[5:] + 1e6, target, T, tmp_path / "far.png", up=(0, -1, 0))
    assert np.array_equal(source, copies[0], equal_nan=True)
    assert np.array_equal(target, copies[1])


def test_without_matplotlib_the_extra_is_named(pair, tmp_path, monkeypatch):
    for name in [name for name in sys.modules if name.split(".")[0] == "matplotlib"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(errors.MissingExtraError, match=r"fieldalign\[viz\]"):
        before_and_after(*pair, tmp_path / "picture.png")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"path": "picture.bmp"}, "path"),
        ({"path": "picture"}, "path"),
        ({"path": "no/such/folder/picture.png"}, "path"),
        ({"T_target_source": np.eye(3)}, "T_target_source"),
        ({"T_target_source": np.full((4, 4), np.nan)}, "T_target_source"),
        ({"source": np.full((9, 3), np.nan)}, "source"),
        ({"target": np.zeros((0, 3))}, "target"),
        ({"target": np.zeros((5, 2))}, "target"),
        ({"up": (0, 0, 0)}, "up"),
    ],
)
def test_bad_arguments(pair, tmp_path, arguments, named):
    good = dict(zip(("source", "target", "T_target_source"), pair, strict=True)) | {"path": "picture.png"}
    asked = good | arguments
    with pytest.raises(errors.ArgumentError, match=named):
        before_and_after(**asked | {"path": tmp_path / asked["path"]})
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("angle", [0.0, 0.12, -0.28])
def test_level_finds_the_vertical_of_a_tilted_room(angle):
    points = room(np.random.default_rng(1)) @ tilted(angle).T
    found = views.level(points, UP)
    assert np.degrees(np.arccos(found @ tilted(angle) @ UP)) < 0.8


def test_ceiling_is_cut_only_where_there_is_one():
    rng = np.random.default_rng(2)
    top = views.ceiling(room(rng)[:, 2])
    assert 0 < top < 1.2
    assert views.ceiling(room(rng, ceiling=False)[:, 2]) == np.inf
    assert views.ceiling(np.zeros(5)) == np.inf


def test_views_are_rotations_that_look_down():
    ahead = views.ahead(np.zeros(3), np.array([[2.0, 0, 5], [4, 0, -3]]), UP)
    assert np.allclose(ahead, (1, 0, 0))
    for view in (views.from_above(UP, ahead), views.obliquely(UP, ahead)):
        assert np.allclose(view @ view.T, np.eye(3))
        assert np.linalg.det(view) > 0
        assert view[2] @ UP > 0.3  # the viewer is above
        assert view[1] @ UP >= 0
        assert view[1] @ ahead > 0  # what is ahead is higher in the picture


def test_the_nearer_cloud_hides_the_farther_one():
    grid = np.stack(np.meshgrid(np.linspace(-1, 1, 60), np.linspace(-1, 1, 60), [0.0]), axis=-1).reshape(-1, 3)
    view = np.eye(3)
    window = painting.Window(np.zeros(2), 1.0, 1.0)
    image = painting.paint((grid + UP, grid), view, window, 50)
    assert image.shape == (50, 50, 4)
    assert np.mean(image[..., 0] > image[..., 2]) > 0.95  # the source is the nearer one
    image = painting.paint((grid - UP, grid), view, window, 50)
    assert np.mean(image[..., 0] < image[..., 2]) > 0.95


def test_what_is_higher_is_higher_in_the_image():
    low, high = np.array([[0.0, -0.9, 0.0]]), np.array([[0.0, 0.9, 0.0]])
    image = painting.paint((low, high), np.eye(3), painting.Window(np.zeros(2), 2.0, 2.0), 100).astype(int)
    orange, blue = image[..., 0] - image[..., 2] > 50, image[..., 2] - image[..., 0] > 50
    assert np.nonzero(blue)[0].max() < 50 <= np.nonzero(orange)[0].min()
