import numpy as np
import pytest

from fieldalign.errors import FieldError
from fieldalign.fields import FieldSample, PointField, sampled
from fieldalign.fields.protocol import planes_near


class Sphere:
    """A unit sphere, signed, that answers a plain tuple."""

    signed = True
    bounds = np.array([[-1.0, -1, -1], [1, 1, 1]])

    def sample(self, x):
        length = np.linalg.norm(x, axis=1)
        normal = x / length[:, None]
        return length - 1, normal, normal, normal


def test_a_tuple_is_enough(rng):
    x = rng.normal(size=(10, 3))
    sample = sampled(Sphere(), x)
    assert np.allclose(x - sample.value[:, None] * sample.gradient, sample.foot)
    assert [part.shape for part in sample] == [(10,), (10, 3), (10, 3), (10, 3)]


def test_the_normal_is_worked_out_once_and_when_asked_for():
    calls = []

    def normals():
        calls.append(1)
        return np.ones((2, 3))

    sample = FieldSample(np.zeros(2), np.zeros((2, 3)), np.zeros((2, 3)), normals)
    assert not calls
    assert np.array_equal(sample.normal, sample.normal)
    assert len(calls) == 1


class Answering:
    signed = False
    bounds = np.zeros((2, 3))

    def __init__(self, answer):
        self.answer = answer

    def sample(self, x):
        return self.answer


@pytest.mark.parametrize(
    "answer",
    [
        None,
        (np.zeros(3), np.zeros((3, 3))),
        (np.zeros((3, 1)), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))),
        (np.zeros(3), np.zeros((3, 2)), np.zeros((3, 3)), np.zeros((3, 3))),
        (np.full(3, np.nan), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))),
        (np.zeros(3), np.full((3, 3), np.inf), np.zeros((3, 3)), np.zeros((3, 3))),
    ],
)
def test_nonsense_names_the_field(answer):
    with pytest.raises(FieldError, match=r"Answering\.sample"):
        sampled(Answering(answer), np.zeros((3, 3)))


# ------------------------------------------------------------------------------------------------------------- planes


def test_a_foreign_field_is_its_own_plane(rng):
    """Foot and normal: exact, so without thickness."""
    x = 0.3 * rng.normal(size=(40, 3)) + [1, 0, 0]
    planes = planes_near(Sphere(), x, 10)
    radial = x / np.linalg.norm(x, axis=1)[:, None]
    assert np.allclose(planes.mean, radial)
    assert np.allclose(planes.normal, radial)
    assert not planes.thickness.any()
    again = planes_near(Sphere(), x + 0.1, 10, planes)
    assert np.array_equal(again.mean, planes_near(Sphere(), x + 0.1, 10).mean)


def test_points_have_planes_through_their_neighbours(rng):
    cloud = rng.normal(size=(4000, 3))
    cloud /= np.linalg.norm(cloud, axis=1)[:, None]
    x = 1.2 * cloud[:40]
    few, many = (planes_near(PointField(cloud), x, k) for k in (4, 30))
    assert (many.thickness > few.thickness).mean() > 0.9
    assert np.abs((many.normal * cloud[:40]).sum(axis=1)).min() > 0.98


def test_nonsense_of_a_foreign_field_is_named_there_too():
    with pytest.raises(FieldError, match=r"Answering\.sample"):
        planes_near(Answering((np.zeros(3), np.zeros((3, 3)))), np.zeros((3, 3)), 10)
