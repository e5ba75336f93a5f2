import numpy as np
import pytest

from fieldalign.errors import FieldError
from fieldalign.fields import FieldSample, sampled


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
