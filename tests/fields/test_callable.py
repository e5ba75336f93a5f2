"""The field of a function, against what is known of boxes and spheres."""

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.evaluation import rotation_error, translation_error
from fieldalign.fields import CallableField, DistanceField, sampled
from fieldalign.motions import apply

BOUNDS = [[-1.5, -1.5, -1.5], [1.5, 1.5, 1.5]]


def sphere(x):
    return np.linalg.norm(x, axis=1) - 1


def boxes(x):
    """The exact distance to the union of two boxes, of which no turn makes the same."""
    found = []
    for centre, half in (([0, 0, 0], [1, 0.6, 0.3]), ([0.5, 0.2, 0.6], [0.25, 0.3, 0.45])):
        outside = np.abs(x - np.array(centre)) - half
        found.append(np.linalg.norm(np.maximum(outside, 0), axis=1) + np.minimum(outside.max(axis=1), 0))
    return np.min(found, axis=0)


def test_it_is_a_field():
    assert isinstance(CallableField(sphere, BOUNDS), DistanceField)


def test_a_sphere_is_what_it_is(rng):
    x = rng.normal(size=(300, 3))
    value, gradient, foot, normal = sampled(CallableField(sphere, BOUNDS), x)
    out = x / np.linalg.norm(x, axis=1, keepdims=True)
    assert np.array_equal(value, sphere(x))
    for part in (gradient, foot, normal):
        assert np.allclose(part, out, atol=1e-8)


def test_a_gradient_that_is_given_is_used(rng):
    calls = []

    def outward(x):
        calls.append(len(x))
        return x / np.linalg.norm(x, axis=1, keepdims=True)

    field = CallableField(sphere, BOUNDS, gradient=outward)
    x = rng.normal(size=(20, 3))
    assert np.array_equal(field.sample(x).gradient, outward(x))
    assert 20 in calls


def test_differences_fit_the_unit():
    """In millimetres as in metres: the step is a share of the bounds."""
    small = CallableField(lambda x: np.linalg.norm(x, axis=1) - 1e-3, 1e-3 * np.array(BOUNDS))
    x = 1e-3 * np.array([[1.3, 0.1, -0.4], [0.2, 0.3, 0.1]])
    out = x / np.linalg.norm(x, axis=1, keepdims=True)
    assert np.allclose(small.sample(x).gradient, out, atol=1e-8)


def test_a_steeper_function_has_feet_on_the_same_surface(rng):
    x = rng.normal(size=(50, 3))
    steep = CallableField(lambda x: 3 * sphere(x), BOUNDS)
    assert np.allclose(steep.sample(x).foot, CallableField(sphere, BOUNDS).sample(x).foot, atol=1e-7)
    assert np.allclose(np.linalg.norm(steep.sample(x).normal, axis=1), 1)


@pytest.mark.parametrize(("function", "expected"), [(sphere, True), (lambda x: np.abs(sphere(x)), False)])
def test_the_sign_is_seen_or_told(function, expected):
    assert CallableField(function, BOUNDS).signed is expected
    assert CallableField(function, BOUNDS, signed=not expected).signed is not expected


def test_a_scan_finds_its_place_on_a_formula_from_any_pose(any_motion, rng):
    field = CallableField(boxes, BOUNDS)
    points = field.sample(rng.uniform(-1.2, 1.2, (20_000, 3))).foot
    T = any_motion(rng, 2.0)
    result = fa.register(apply(T, points), field)
    assert rotation_error(result.T_target_source @ T, np.eye(4)) < 0.2
    assert translation_error(result.T_target_source @ T, np.eye(4)) < 0.01


# --------------------------------------------------------------------------------------------------------------- errors


def raises(x):
    raise RuntimeError("no such place")


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (raises, "function of a CallableField raised RuntimeError: no such place"),
        (lambda x: x, r"must answer with shape \(512,\), but gave \(512, 3\)"),
        (lambda x: np.full(len(x), np.nan), "must give finite values"),
        (lambda x: None, "function of a CallableField"),
    ],
)
def test_a_function_without_an_answer_is_named_at_once(function, words):
    with pytest.raises(fa.FieldError, match=words):
        CallableField(function, BOUNDS)


def test_a_gradient_without_an_answer_is_named_at_once():
    with pytest.raises(fa.FieldError, match=r"gradient of a CallableField must answer with shape \(1, 3\)"):
        CallableField(sphere, BOUNDS, gradient=sphere)


@pytest.mark.parametrize("bounds", ["box", [[0, 0, 0]], [[0, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, np.inf]]])
def test_bounds_that_are_none_are_refused(bounds):
    with pytest.raises(fa.ArgumentError, match="bounds must be"):
        CallableField(sphere, bounds)


@pytest.mark.parametrize("wrong", [{"gradient": 3}, {"signed": "yes"}])
def test_other_arguments_are_named(wrong):
    with pytest.raises(fa.ArgumentError, match=next(iter(wrong))):
        CallableField(sphere, BOUNDS, **wrong)


def test_a_function_is_asked_for():
    with pytest.raises(fa.ArgumentError, match="function must be a function"):
        CallableField("sphere", BOUNDS)
