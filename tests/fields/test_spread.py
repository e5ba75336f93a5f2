"""Places on surfaces that are known by their distance alone: on them, everywhere, evenly, and as many as asked."""

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.fields import CallableField, PointField, spread_over

BOUNDS = 1.5 * np.array([[-1.0, -1, -1], [1, 1, 1]])
COUNTS = [100, 1000, 5000]


def sphere(x):
    return np.linalg.norm(x, axis=1) - 1


def torus(x):
    return np.hypot(np.hypot(x[:, 0], x[:, 1]) - 1, x[:, 2]) - 0.35


def plate(x):
    """A thin, sharp-edged one."""
    outside = np.abs(x - [0.1, 0.2, 0.3]) - [1.0, 0.7, 0.02]
    return np.linalg.norm(np.maximum(outside, 0), axis=1) + np.minimum(outside.max(axis=1), 0)


class Foreign:
    """A field of somebody else's, with no more than it must have."""

    def __init__(self, function, signed=True):
        self.signed, self.bounds, self.function = signed, BOUNDS, function

    def sample(self, x):
        value, step = self.function(x), 1e-6 * np.eye(3)
        gradient = np.stack([(self.function(x + e) - self.function(x - e)) / 2e-6 for e in step], axis=1)
        return value, gradient, x - value[:, None] * gradient, gradient


def all_over(function, rng, count=4000):
    """Places on the surface, by steps along the gradient from anywhere near it."""
    x = rng.uniform(*BOUNDS, (20 * count, 3))
    field = CallableField(function, BOUNDS)
    x = x[np.abs(field.sample(x).value) < 0.1][:count]
    for _ in range(3):
        x = field.sample(x).foot
    return x[np.abs(function(x)) < 1e-9]


surfaces = pytest.mark.parametrize(
    ("function", "area"),
    [(sphere, 4 * np.pi), (torus, 4 * np.pi**2 * 0.35), (plate, 2 * 2 * 1.4 + 0.04 * 6.8)],
    ids=["sphere", "torus", "plate"],
)


@surfaces
@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("make", [lambda f: CallableField(f, BOUNDS), Foreign], ids=["callable", "foreign"])
def test_they_lie_on_the_surface_and_are_about_as_many_as_asked(function, area, count, make):
    places = spread_over(make(function), count)
    assert places.shape[1:] == (3,)
    assert np.abs(function(places)).max() < 1e-8
    assert 0.8 * count < len(places) < 2 * count


@surfaces
@pytest.mark.parametrize("count", COUNTS)
def test_no_part_is_left_out_and_none_is_crowded(function, area, count, rng):
    places, apart = spread_over(CallableField(function, BOUNDS), count), np.sqrt(area / count)
    everywhere = all_over(function, rng, 4 * count)
    assert PointField(places).sample(everywhere).value.max() < 2 * apart
    per_place = np.bincount(PointField(places).nearest(everywhere)[1][:, 0], minlength=len(places))
    assert per_place.max() <= 8 * max(1, len(everywhere) / len(places))


@surfaces
def test_an_unsigned_field_has_the_same_surface(function, area):
    unsigned = CallableField(lambda x: np.abs(function(x)), BOUNDS)
    assert not unsigned.signed
    places = spread_over(unsigned, 2000)
    assert np.abs(function(places)).max() < 1e-4  # the difference of two values is no slope across the kink
    assert abs(len(places) / len(spread_over(CallableField(function, BOUNDS), 2000)) - 1) < 0.05


@pytest.mark.parametrize("slope", [0.5, 2.0])
def test_what_is_not_quite_a_distance_has_the_same_surface(slope, rng):
    places = spread_over(CallableField(lambda x: slope * sphere(x), BOUNDS), 2000)
    assert np.abs(sphere(places)).max() < 1e-9
    gap = PointField(places).sample(all_over(sphere, rng)).value.max()
    assert gap < 2 * np.sqrt(4 * np.pi / 2000)


def test_a_steep_field_is_found_wherever_it_lies():
    """Also halfway between the middles of the cells that are asked first."""
    places = spread_over(CallableField(lambda x: 3 * x[:, 2], BOUNDS), 1000)
    assert np.abs(places[:, 2]).max() < 1e-9


def test_the_unit_and_the_offset_do_not_matter():
    here = spread_over(CallableField(torus, BOUNDS), 500)
    far = np.array([5e6, 4e5, 0])
    there = spread_over(CallableField(lambda x: 1e3 * torus((x - far) / 1e3), far + 1e3 * BOUNDS), 500)
    assert len(there) == len(here)
    assert np.abs((there - far) / 1e3 - here).max() < 1e-6


def test_they_are_the_same_at_every_call():
    field = CallableField(torus, BOUNDS)
    assert np.array_equal(spread_over(field, 700), spread_over(field, 700))


def test_a_flat_box_of_bounds_is_enough():
    """A surface much larger one way than the other."""
    low, high = np.array([-10, -1, -0.01]), np.array([10, 1, 0.01])
    places = spread_over(CallableField(lambda x: x[:, 2], [low, high]), 1000)
    assert np.abs(places[:, 2]).max() < 1e-12
    assert 0.8 * 1000 < len(places) < 2000
    assert np.ptp(places[:, 0]) > 19


def test_a_field_that_knows_its_places_is_asked(rng):
    points = PointField(rng.normal(size=(500, 3)))
    assert np.array_equal(spread_over(points, 100), points.spread(100))


def nothing(x):
    return np.linalg.norm(x, axis=1) + 1


def elsewhere(x):
    return np.linalg.norm(x - 10, axis=1) - 1


@pytest.mark.parametrize("function", [nothing, elsewhere])
@pytest.mark.parametrize(
    ("make", "name"),
    [(lambda f: CallableField(f, BOUNDS), "CallableField"), (Foreign, "Foreign")],
    ids=["own", "foreign"],
)
def test_a_field_without_a_surface_is_named(function, make, name):
    with pytest.raises(fa.FieldError, match=f"{name} has no surface within its bounds"):
        spread_over(make(function), 1000)


def test_a_gradient_that_leads_nowhere_is_named():
    field = CallableField(sphere, BOUNDS, gradient=lambda x: 0 * x + [1.0, 0, 0])
    turned = CallableField(lambda x: sphere(x) + 0.2, BOUNDS, gradient=lambda x: -x)
    assert len(spread_over(field, 100))  # some are found
    with pytest.raises(fa.FieldError, match="its gradient leads to"):
        spread_over(turned, 5000)
