"""Clouds drawn with characters: each dot where its point is, in the colour of its cloud."""

import numpy as np
import pytest

from fieldalign.reports import characters
from fieldalign.reports.cloud_picture import VIEWS, Layer
from fieldalign.reports.painting import Window

VIEW = np.eye(3)
WINDOW = Window(np.array([2.0, 4.0]), 4.0, 8.0)  # two columns and two lines of characters, a dot in each unit


def layer(places, color=(1.0, 0.0, 0.0), name="cloud"):
    points = np.array([(x + 0.5, y + 0.5, 0.0) for x, y in places])
    return Layer(name, points, np.tile(color, (len(points), 1)))


@pytest.mark.parametrize(("place", "symbol"), [
    ((0, 7), "⠁"), ((1, 7), "⠈"), ((0, 6), "⠂"), ((1, 6), "⠐"), ((0, 5), "⠄"), ((1, 5), "⠠"),
    ((0, 4), "⡀"), ((1, 4), "⢀"),
])
def test_each_place_is_its_dot(place, symbol):
    assert characters.draw([layer([place])], VIEW, WINDOW, 2, colored=False) == symbol


def test_lines_and_columns_are_in_order():
    drawn = characters.draw([layer([(0, 7), (2, 7), (3, 0)])], VIEW, WINDOW, 2, colored=False)
    assert drawn == "⠁⠁\n⠀⢀"


def test_plain_characters_tell_how_many_dots_are_set():
    full = [(x, y) for x in (0, 1) for y in (4, 5, 6, 7)]
    assert characters.draw([layer([*full, (2, 7)])], VIEW, WINDOW, 2, colored=False, braille=False) == "@."


def test_a_color_begins_where_it_changes():
    layers = [layer([(0, 7)]), layer([(2, 7)], (0.0, 0.0, 1.0))]
    assert characters.draw(layers, VIEW, WINDOW, 2, colored=True) == "\x1b[38;5;196m⠁\x1b[0m\x1b[38;5;21m⠁\x1b[0m"


def test_many_points_leave_room_between_them():
    rng = np.random.default_rng(0)
    points = np.c_[rng.uniform(0, 4, 100_000), rng.uniform(0, 8, 100_000), np.zeros(100_000)]
    window = Window(np.array([2.0, 4.0]), 4.0, 8.0)
    drawn = characters.draw([Layer("many", points, np.ones((len(points), 3)))], VIEW, window, 40, colored=False)
    dots = [bin(ord(c) - 0x2800).count("1") / 8 for c in drawn.replace("\n", "")]
    assert 0.3 < np.mean(dots) < 0.6


@pytest.mark.parametrize("side", VIEWS)
def test_views_are_rotations_that_see_what_they_say(side):
    up, ahead = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])
    view = VIEWS[side](up, ahead)
    assert np.allclose(view @ view.T, np.eye(3))
    assert np.linalg.det(view) == pytest.approx(1)
    to_the_viewer = {"above": (0, 0, 1), "front": (0, -1, 0), "side": (1, 0, 0)}
    if side in to_the_viewer:
        assert np.allclose(view[2], to_the_viewer[side])
    else:
        assert view[2, 2] > 0.5
        assert view[1, 2] > 0.5
