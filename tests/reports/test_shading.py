"""Clouds painted as surfaces: what is nearest is seen, lit, and dark only where something nearer begins."""

import numpy as np
import pytest

from fieldalign.reports.painting import Window
from fieldalign.reports.shading import Layer, paint_surfaces

RED, BLUE = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
WINDOW = Window(np.zeros(2), 2.0, 1.0)


def sheet(z, color, left=-1.0, right=1.0, normal=(0.0, 0.0, 1.0)):
    x, y = np.meshgrid(np.linspace(left, right, 200), np.linspace(-0.5, 0.5, 100))
    points = np.stack([x, y, np.full(x.shape, z)], axis=-1).reshape(-1, 3)
    return Layer(points, np.tile(normal, (len(points), 1)), np.tile(color, (len(points), 1)))


def painted(*layers):
    image = paint_surfaces(layers, np.eye(3), WINDOW, 200)
    assert image.shape == (100, 200, 4)
    return image


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_the_nearest_layer_is_seen_in_whatever_order_they_come(order):
    layers = sheet(0.0, RED), sheet(1.0, BLUE, left=0.0)
    image = painted(*(layers[k] for k in order))
    assert image[50, 20, 0] > 100 > image[50, 20, 2]
    assert image[50, 180, 2] > 100 > image[50, 180, 0]


def test_nothing_is_clear_and_no_edge_before_nothing_is_darkened():
    image = painted(sheet(0.0, RED, right=0.0))
    assert (image[:, 150:, 3] == 0).all()
    assert (image[:, :90, 3] == 255).all()
    assert len(np.unique(image[5:-5, 5:90, 0])) == 1


def test_beside_something_nearer_it_is_darker():
    image = painted(sheet(0.0, RED), sheet(0.5, BLUE, left=0.0))
    far = image[50, :, 0].astype(int)
    edge = int(np.flatnonzero(image[50, :, 2] > 100)[0]) - 1
    assert far[edge] < 0.8 * far[20]
    assert far[edge - 10] == far[20]


def test_a_slope_does_not_darken_itself():
    points = sheet(0.0, RED).points
    slope = Layer(points + [0, 0, 1] * points[:, :1], np.tile([-0.7, 0, 0.7], (len(points), 1)),
                  np.tile(RED, (len(points), 1)))
    assert len(np.unique(painted(slope)[5:-5, 5:-5, 0])) == 1


def test_light_falls_on_normals_of_either_sign_alike():
    ways = [painted(sheet(0.0, RED, normal=n))[50, 100, 0] for n in ((0.3, 0.2, 0.9), (-0.3, -0.2, -0.9))]
    assert ways[0] == ways[1]
    assert painted(sheet(0.0, RED, normal=(0.9, -0.4, 0.1)))[50, 100, 0] < ways[0]
