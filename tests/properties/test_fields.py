"""Whatever is handed in for a field: an answer of the right shape, or one of fieldalign's own exceptions."""

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given
from strategies import clouds, examples, laid_out, numbers, of_wrong_kind, points, refusing, right_points

import fieldalign as fa
from fieldalign.fields import CallableField, MeshField, PointField, VolumeField, sampled, spread_over

pytestmark = pytest.mark.filterwarnings("ignore:.*is float32 with coordinates:UserWarning")

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
PLACES = np.random.default_rng(1).normal(size=(20, 3))


def check_field(field, places=PLACES):
    """It answers about the places, in the right shapes and without NaN."""
    for part, shape in zip(sampled(field, places), ((20,), (20, 3), (20, 3), (20, 3)), strict=True):
        assert part.shape == shape
        assert np.isfinite(part).all()
    assert np.shape(field.bounds) == (2, 3)
    spread = spread_over(field, 30)
    assert spread.shape[1] == 3
    assert np.isfinite(spread).all()


@examples(100)
@given(clouds())
def test_point_field(cloud):
    with refusing():
        field = PointField(cloud)
        check_field(field)
        assert field.keypoints().dtype == np.uint32


@examples(80)
@given(right_points((3, 10)), st.one_of(points(), clouds()))
def test_places_that_a_field_is_asked_at(cloud, places):
    with refusing():
        for part in PointField(cloud).sample(places):
            assert len(part) == len(places)
            assert np.isfinite(part).all()


@st.composite
def faces(draw):
    """Triangles, right or not."""
    rng = np.random.default_rng(draw(st.integers(0, 1000)))
    drawn = rng.integers(
        draw(st.sampled_from((0, 0, 0, -3))), draw(st.sampled_from((4, 4, 10))), (draw(st.integers(0, 12)), 3)
    )
    return drawn.astype(draw(st.sampled_from(("i8", "i4", "u1", "f8", ">i8", "u8"))))


@examples(120)
@given(
    st.one_of(st.just(CORNERS), points(), clouds()),
    st.one_of(st.just(FACES), laid_out(faces()), of_wrong_kind()),
    st.one_of(st.sampled_from((None, True, False)), numbers()),
)
def test_mesh_field(vertices, triangles, signed):
    with refusing():
        check_field(MeshField(vertices, triangles, signed=signed))


@st.composite
def volumes(draw):
    """Values (I, J, K) of a sphere, some of them spoilt."""
    shape = draw(st.tuples(*[st.sampled_from((0, 1, 2, 3, 6))] * 3))
    grid = np.stack(np.indices(shape), axis=-1) - np.array(shape) / 2.0
    values = (np.linalg.norm(grid, axis=-1) - 1.5) * draw(st.sampled_from((1e-300, 1e-3, 1.0, 1e10, 1e300)))
    if values.size and draw(st.booleans()):
        values.flat[draw(st.integers(0, values.size - 1)) :: 3] = draw(st.sampled_from((np.nan, np.inf, 0.0, 1e308)))
    return values


@examples(120)
@given(
    st.one_of(laid_out(volumes()), clouds()),
    st.fixed_dictionaries(
        {},
        optional={
            "origin": st.one_of(st.just((1.0, 2.0, 3.0)), numbers(), clouds()),
            "spacing": st.one_of(st.just(0.5), numbers(), clouds()),
            "seen": st.one_of(st.none(), clouds()),
            "truncation": numbers(),
            "signed": st.one_of(st.booleans(), numbers()),
            "interpolation": st.one_of(st.sampled_from(("linear", "cubic")), numbers()),
        },
    ),
)
def test_volume_field(values, keywords):
    with refusing():
        check_field(VolumeField(values, **keywords))


@examples(60)
@given(
    st.one_of(laid_out(volumes().map(lambda v: v[None])), clouds()),
    st.one_of(st.just([[0, 0, 0]]), clouds(), of_wrong_kind()),
)
def test_volume_of_blocks(blocks, indices):
    with refusing():
        check_field(VolumeField.from_blocks(blocks, indices))


def sphere(x):
    return np.linalg.norm(x, axis=1) - 1


FUNCTIONS = (
    sphere,
    lambda x: np.abs(sphere(x)),
    lambda x: sphere(x)[:, None],
    lambda x: np.full(len(x), np.nan),
    lambda x: x,
    lambda x: None,
    lambda x: 1 / 0,
    lambda x: "far",
    lambda x: np.zeros(len(x)),
    lambda x: sphere(x).tolist(),
    lambda x: sphere(x).astype(complex),
    lambda x: sphere(x) * 1e308,
    lambda x: x[:, 0] * 0 + 1,
    len,
    print,
    None,
    3,
)


@examples(120)
@given(
    st.sampled_from(FUNCTIONS),
    st.one_of(st.sampled_from(([[-2.0] * 3, [2.0] * 3], [[-1e200] * 3, [1e200] * 3], [[1, 1, 1]] * 2)), clouds()),
    st.one_of(st.none(), st.sampled_from(FUNCTIONS)),
    st.one_of(st.none(), st.booleans(), numbers()),
)
def test_callable_field(function, bounds, gradient, signed):
    with refusing():
        check_field(CallableField(function, bounds, gradient=gradient, signed=signed))


class Foreign:
    """A field of someone else."""

    signed = False

    def __init__(self, bounds, answer):
        self.bounds, self._answer = bounds, answer

    def sample(self, x):
        return self._answer(x)


ANSWERS = (
    lambda x: (np.ones(len(x)), np.ones(x.shape), x, x),
    lambda x: (np.ones(len(x)), np.ones(x.shape), x),
    lambda x: None,
    lambda x: (np.ones(3), np.ones(x.shape), x, x),
    lambda x: (np.full(len(x), np.nan), np.ones(x.shape), x, x),
    lambda x: 1 / 0,
    lambda x: ("a", "b", "c", "d"),
    lambda x: (sphere(x), x / (1e-300 + np.linalg.norm(x, axis=1)[:, None]), x, x),
)


@examples(30)
@given(st.sampled_from(ANSWERS), st.one_of(st.just([[-2.0] * 3, [2.0] * 3]), clouds()))
def test_foreign_field(answer, bounds):
    with refusing(ZeroDivisionError):  # its own
        result = fa.register(right := PLACES, Foreign(bounds, answer))
        assert np.isfinite(result.T_target_source).all()
        assert len(right) == 20
