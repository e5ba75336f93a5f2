"""The field of a torch module, against the same functions in NumPy."""

import pickle
import threading

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.evaluation import rotation_error, translation_error
from fieldalign.fields import CallableField, sampled, torch_module
from fieldalign.motions import apply

torch = pytest.importorskip("torch")

BOUNDS = [[-1.5, -1.5, -1.5], [1.5, 1.5, 1.5]]


class Sphere(torch.nn.Module):
    """The distance to a sphere, in the precision of its radius; counts its passes and the places in them."""

    def __init__(self, dtype=torch.float64):
        super().__init__()
        self.radius = torch.nn.Parameter(torch.ones((), dtype=dtype))
        self.passes = []

    def forward(self, x):
        self.passes.append((len(x), x.dtype, torch.is_grad_enabled()))
        return x.norm(dim=1) - self.radius


class Of(torch.nn.Module):
    """A function of tensors as a module."""

    def __init__(self, function):
        super().__init__()
        self.function = function

    def forward(self, x):
        return self.function(x)


def boxes(x):
    """The exact distance to the union of two boxes, of which no turn makes the same."""
    found = []
    for centre, half in (([0, 0, 0], [1, 0.6, 0.3]), ([0.5, 0.2, 0.6], [0.25, 0.3, 0.45])):
        outside = (x - x.new_tensor(centre)).abs() - x.new_tensor(half)
        found.append(outside.clamp(min=0).norm(dim=1) + outside.amax(dim=1).clamp(max=0))
    return torch.minimum(*found)


def test_a_sphere_is_what_it_is(rng):
    x = rng.normal(size=(300, 3))
    field = CallableField(Sphere(), BOUNDS)
    value, gradient, foot, normal = sampled(field, x)
    out = x / np.linalg.norm(x, axis=1, keepdims=True)
    assert field.signed
    assert np.allclose(value, np.linalg.norm(x, axis=1) - 1, rtol=1e-12, atol=1e-12)
    for part in (gradient, foot, normal):
        assert part.dtype == np.float64
        assert np.allclose(part, out, atol=1e-12)


@pytest.mark.parametrize("dtype", [torch.float64, torch.float32, torch.bfloat16])
def test_a_module_is_asked_in_its_own_precision(dtype, rng):
    module = Sphere(dtype)
    sample = CallableField(module, BOUNDS).sample(rng.normal(size=(20, 3)))
    assert {of for _, of, _ in module.passes} == {dtype}
    assert sample.value.dtype == sample.gradient.dtype == np.float64


def test_a_module_without_parameters_is_asked_in_double_precision(rng):
    x = rng.normal(size=(20, 3))
    field = CallableField(Of(lambda x: x.norm(dim=1) - 1), BOUNDS)
    assert np.allclose(field.sample(x).value, np.linalg.norm(x, axis=1) - 1, rtol=1e-15, atol=1e-15)


def test_a_buffer_tells_the_precision_too():
    module = Of(lambda x: x.norm(dim=1) - module.radius)
    module.register_buffer("count", torch.ones((), dtype=torch.int64))
    module.register_buffer("radius", torch.ones((), dtype=torch.float32))
    value = CallableField(module, BOUNDS).sample([[1.1, 0.0, 0.0]]).value
    assert value == np.float32(1.1) - np.float32(1)


def test_value_and_gradient_come_from_one_pass(rng):
    module = Sphere()
    field = CallableField(module, BOUNDS)
    module.passes.clear()
    sample = field.sample(rng.normal(size=(20, 3)))
    assert module.passes == [(20, torch.float64, True)]
    assert np.allclose(np.linalg.norm(sample.normal, axis=1), 1)
    assert len(module.passes) == 2


def test_many_places_are_asked_in_parts(rng, monkeypatch):
    module = Sphere()
    field = CallableField(module, BOUNDS)
    x = rng.normal(size=(25, 3))
    whole = field.sample(x)
    monkeypatch.setattr(torch_module, "_AT_ONCE", 10)
    module.passes.clear()
    parts = field.sample(x)
    assert [count for count, *_ in module.passes] == [10, 10, 5]
    assert np.array_equal(parts.value, whole.value)
    assert np.array_equal(parts.gradient, whole.gradient)


def test_no_places_are_no_error():
    assert CallableField(Sphere(), BOUNDS).sample(np.empty((0, 3))).gradient.shape == (0, 3)


def test_the_gradient_is_that_of_differences(rng):
    torch.manual_seed(0)
    module = torch.nn.Sequential(torch.nn.Linear(3, 16), torch.nn.Tanh(), torch.nn.Linear(16, 1)).double()
    x = rng.uniform(-1, 1, (50, 3))
    by_values = CallableField(lambda x: module(torch.from_numpy(x)).detach().numpy()[:, 0], BOUNDS)
    assert np.allclose(CallableField(module, BOUNDS).sample(x).gradient, by_values.sample(x).gradient, atol=1e-8)


def test_a_gradient_that_is_given_is_used(rng):
    module = Sphere()
    field = CallableField(module, BOUNDS, gradient=lambda x: 2 * x)
    x = rng.normal(size=(20, 3))
    assert np.array_equal(field.sample(x).gradient, 2 * x)
    assert not any(with_gradient for *_, with_gradient in module.passes)


@pytest.mark.parametrize("switched_off", [torch.no_grad, torch.inference_mode])
def test_it_does_not_matter_what_the_caller_has_switched_off(switched_off, rng):
    x = rng.normal(size=(20, 3))
    field = CallableField(Sphere(), BOUNDS)
    with switched_off():
        gradient = field.sample(x).gradient
    assert np.array_equal(gradient, field.sample(x).gradient)


def test_the_module_and_the_places_stay_as_they_are(rng):
    module, x = Sphere(), rng.normal(size=(20, 3))
    before = x.copy()
    CallableField(Of(lambda x: module(x.mul_(1.0))), BOUNDS, gradient=lambda x: x).sample(x)
    CallableField(module, BOUNDS).sample(x)
    assert np.array_equal(x, before)
    assert module.radius.grad is None
    assert module.training


def test_several_threads_may_ask_one_field(rng):
    field, x = CallableField(Sphere(), BOUNDS), rng.normal(size=(1000, 3))
    expected, answers = field.sample(x).gradient, []
    threads = [threading.Thread(target=lambda: answers.append(field.sample(x).gradient)) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(answer, expected) for answer in answers)
    assert len(answers) == 4


def test_it_can_be_sent_to_another_process(rng):
    torch.manual_seed(0)
    field = CallableField(torch.nn.Sequential(torch.nn.Linear(3, 16), torch.nn.Tanh(), torch.nn.Linear(16, 1)), BOUNDS)
    x = rng.normal(size=(20, 3))
    assert np.array_equal(pickle.loads(pickle.dumps(field)).sample(x).gradient, field.sample(x).gradient)


def test_a_scan_finds_its_place_on_a_module_from_any_pose(any_motion, rng):
    field = CallableField(Of(boxes), BOUNDS)
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
        (lambda x: x, r"function of a CallableField must answer with shape \(512,\), but gave \(512, 3\)"),
        (lambda x: x.sum(), "function of a CallableField"),
        (lambda x: x[:, 0] * torch.nan, "function of a CallableField must give finite values"),
        (lambda x: None, "function of a CallableField raised AttributeError"),
        (lambda x: x[:, 0].detach(), "gradient of a CallableField raised RuntimeError"),
        (lambda x: (x[:, 0] * 0).sqrt(), "gradient of a CallableField must give finite values"),
    ],
)
def test_a_module_without_an_answer_is_named_at_once(function, words):
    with pytest.raises(fa.FieldError, match=words):
        CallableField(Of(function), BOUNDS)


def test_a_module_that_stops_answering_is_named():
    module = Of(lambda x: x.norm(dim=1))
    field = CallableField(module, BOUNDS)
    module.function = raises
    with pytest.raises(fa.FieldError, match="function of a CallableField raised RuntimeError: no such place"):
        field.sample(np.ones((5, 3)))
    module.function = lambda x: x[:, :2]
    with pytest.raises(fa.FieldError, match=r"function of a CallableField must answer with shape \(5,\)"):
        field.sample(np.ones((5, 3)))
