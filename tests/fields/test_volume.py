"""The field of a volume, against sums over all nodes, and against what is known of spheres and boxes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fieldalign as fa
from fieldalign.evaluation import rotation_error, translation_error
from fieldalign.fields import DistanceField, sampled
from fieldalign.fields.protocol import HasSpread
from fieldalign.fields.volume import VolumeField
from fieldalign.motions import apply

SIDE = 48
STEP = 3 / (SIDE - 1)
LOW = np.full(3, -1.5)
BAND = 4 * STEP
RADIUS = 1.03
CENTRE = np.array([0.031, -0.057, 0.022])  # no two places on the grid are alike


def nodes(shape=(SIDE,) * 3, origin=LOW, spacing=STEP):
    return origin + spacing * np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)


def sphere(x):
    return np.linalg.norm(x - CENTRE, axis=-1) - RADIUS


def outward(x):
    return (x - CENTRE) / np.linalg.norm(x - CENTRE, axis=1, keepdims=True)


def solid(x):
    """The distance to two boxes and a ball, of which no turn makes the same."""
    found = [np.linalg.norm(x - [-0.8, -0.3, 0.4], axis=-1) - 0.35]
    for centre, half in (([0, 0, 0], [1, 0.6, 0.3]), ([0.5, 0.2, 0.6], [0.25, 0.3, 0.45])):
        outside = np.abs(x - np.array(centre)) - half
        found.append(np.linalg.norm(np.maximum(outside, 0), axis=-1) + np.minimum(outside.max(axis=-1), 0))
    return np.min(found, axis=0)


def volume(kind="signed", shape=sphere, **options):
    values = shape(nodes()).astype(np.float32)
    if "unsigned" in kind:
        values = np.abs(values)
    if "truncated" in kind:
        return VolumeField(np.clip(values, -BAND, BAND), LOW, STEP, truncation=BAND, **options)
    return VolumeField(values, LOW, STEP, **options)


def near_sphere(rng, count, away):
    towards = outward(CENTRE + rng.normal(size=(count, 3)))
    return CENTRE + (RADIUS + rng.uniform(-away, away, (count, 1))) * towards


KINDS = ["signed", "signed truncated", "unsigned", "unsigned truncated"]


def test_it_is_a_field_that_knows_its_surface():
    assert isinstance(volume(), DistanceField)
    assert isinstance(volume(), HasSpread)


# ---------------------------------------------------------------------------------------------------- interpolation


def tent(t):
    return np.maximum(0, 1 - np.abs(t))


def keys(t):
    t = np.abs(t)
    return np.where(t < 1, 1.5 * t**3 - 2.5 * t**2 + 1, np.where(t < 2, -0.5 * t**3 + 2.5 * t**2 - 4 * t + 2, 0))


@pytest.fixture
def bumpy(rng):
    """A plane with noise: a slope that no step finds too small, and no symmetry."""
    return rng.normal(0, 0.05, (8, 7, 6)) + np.arange(8)[:, None, None] - 3.2


@pytest.mark.parametrize(("interpolation", "kernel", "rim"), [("linear", tent, 0), ("cubic", keys, 1)])
def test_values_and_gradients_are_those_of_the_interpolation(bumpy, rng, interpolation, kernel, rim):
    origin, spacing = np.array([3.0, -2, 10]), np.array([0.5, 1.0, 2.0])
    field = VolumeField(0.5 * bumpy, origin, spacing, interpolation=interpolation)
    u = rng.uniform(rim, np.array(bumpy.shape) - 1 - rim, (400, 3))
    x = origin + spacing * u
    weights = [kernel(u[:, [axis]] - np.arange(side)) for axis, side in enumerate(bumpy.shape)]
    sample = field.sample(x)
    assert np.allclose(sample.value, np.einsum("ijk,li,lj,lk->l", 0.5 * bumpy, *weights), atol=1e-13)
    for axis, step in enumerate(1e-6 * np.eye(3)):
        inside = np.abs(u - np.rint(u)).min(axis=1) > 1e-4  # the linear gradient jumps from cell to cell
        slope = (field.sample(x + step).value - field.sample(x - step).value) / 2e-6
        assert np.allclose(sample.gradient[inside, axis], slope[inside], atol=1e-8)


@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
def test_each_node_has_its_own_value(bumpy, interpolation):
    """To the outermost one, whose place is rounded."""
    origin, spacing = np.array([-1.1, 0.3, 5e6]), 0.1
    field = VolumeField(bumpy * spacing, origin, spacing, interpolation=interpolation)
    value = field.sample(nodes(bumpy.shape, origin, spacing).reshape(-1, 3)).value
    assert np.allclose(value, spacing * bumpy.ravel(), atol=1e-8)


def test_single_precision_stays_so():
    assert volume()._grid.nodes.dtype == np.float32
    whole = VolumeField(np.arange(27).reshape(3, 3, 3) - 13)
    assert whole._grid.nodes.dtype == np.float64


# --------------------------------------------------------------------------------------------------------- the sphere


@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
@pytest.mark.parametrize("kind", KINDS)
def test_a_sphere_is_nearly_what_it_is(rng, kind, interpolation):
    field = volume(kind, interpolation=interpolation)
    assert field.signed is ("unsigned" not in kind)
    x = near_sphere(rng, 500, 2 * STEP)
    value, gradient, foot, normal = sampled(field, x)
    out = outward(x)
    side = np.ones(len(x)) if field.signed else np.sign(sphere(x))
    assert np.allclose(value, side * sphere(x), atol=0.03 * STEP)
    assert np.allclose(foot, CENTRE + RADIUS * out, atol=0.1 * STEP)
    assert np.allclose(field.bounds, CENTRE + np.array([[-1], [1]]) * (RADIUS + STEP), atol=0.1 * STEP)
    assert (np.abs(np.einsum("li,li->l", normal, out)) > 0.998).all()
    far = np.abs(value) > STEP
    assert (side * np.einsum("li,li->l", gradient, out) > 0.95)[far].all()


def test_cubic_is_closer_and_smoother(rng):
    x = near_sphere(rng, 500, STEP)
    off = [np.abs(volume(interpolation=kind).sample(x).value - sphere(x)).max() for kind in ("cubic", "linear")]
    assert off[0] < 0.05 * off[1]


@pytest.mark.parametrize("kind", KINDS)
def test_places_anywhere_have_feet_on_the_sphere(rng, kind):
    """Outside the volume, in truncated cells and on the ridge in the middle: none passes for a place on the surface."""
    field = volume(kind)
    x = np.concatenate([rng.uniform(-3, 3, (1000, 3)), CENTRE[None], LOW[None]])
    value, _, foot, normal = sampled(field, x)
    assert np.allclose(sphere(foot), 0, atol=0.6 * STEP)  # after a step of Newton's from near the middle
    assert np.allclose(np.abs(value), np.abs(sphere(x)), atol=0.3 * STEP)
    assert np.allclose(np.linalg.norm(normal, axis=1), 1)
    if field.signed:
        assert np.array_equal(value < 0, sphere(x) < 0)


@settings(max_examples=20, deadline=None)
@given(place=st.tuples(*3 * [st.floats(-1e12, 1e12)]))
def test_no_place_is_without_an_answer(place):
    sampled(SOME, np.array([place]))


SOME = volume("signed truncated")


@pytest.mark.parametrize("kind", ["signed", "unsigned"])
def test_far_from_zero_it_is_the_same(rng, kind):
    shift = np.array([4.5e5, 5.2e6, 300])
    values = volume(kind)._grid.nodes[0]
    x = near_sphere(rng, 300, 3 * STEP)
    near = VolumeField(values, LOW, STEP).sample(x)
    far = VolumeField(values, LOW + shift, STEP).sample(x + shift)
    assert np.allclose(near.value, far.value, atol=1e-7)
    assert np.allclose(near.foot, far.foot - shift, atol=1e-7)


def test_in_millimetres_as_in_metres(rng):
    values = volume()._grid.nodes[0].astype(float)
    x = rng.uniform(-2, 2, (300, 3))
    metres = VolumeField(values, LOW, STEP, truncation=BAND).sample(x)
    milli = VolumeField(1000 * values, 1000 * LOW, 1000 * STEP, truncation=1000 * BAND).sample(1000 * x)
    assert np.allclose(1000 * metres.value, milli.value)
    assert np.allclose(metres.gradient, milli.gradient)


# ---------------------------------------------------------------------------------------------- what nobody has seen


def half_seen():
    seen = np.ones((SIDE,) * 3, bool)
    seen[SIDE // 2 :] = False
    return seen


def test_a_mask_says_the_same_as_nan(rng):
    values = sphere(nodes())
    x = rng.uniform(-1.5, 1.5, (300, 3))
    masked = VolumeField(values, LOW, STEP, seen=half_seen()).sample(x)
    missing = VolumeField(np.where(half_seen(), values, np.nan), LOW, STEP).sample(x)
    assert all(np.array_equal(one, other) for one, other in zip(masked, missing, strict=True))


def test_an_unseen_place_lies_far_from_the_surface_that_was_seen():
    field = VolumeField(sphere(nodes()), LOW, STEP, seen=half_seen())
    (value,), _, (foot,), _ = field.sample(CENTRE[None] + [RADIUS, 0, 0])  # on the sphere, but nobody knows
    assert foot[0] < STEP
    assert abs(value) > 1
    assert field.bounds[1, 0] < 2 * STEP


def test_truncated_values_keep_their_side():
    field = volume("signed truncated")
    inside, outside = field.sample([[0.3, 0.1, 0], [1.45, 1.4, 1.4]]).value
    assert inside < -BAND
    assert outside > BAND


def test_the_jump_behind_a_surface_is_no_surface():
    """As in fusion: in front of a wall free space, behind it nothing is known, then again free space, truncated."""
    depth = nodes((20, 8, 8), np.zeros(3), 1.0)[..., 0]
    values = np.clip(5.3 - depth, -3, 3)
    values[12:] = 3
    field = VolumeField(values, truncation=3.0)
    assert np.allclose(field.spread(50)[:, 0], 5.3)
    assert np.allclose(field.bounds[:, 0], [4.3, 6.3])


def test_signs_that_say_nothing_are_left_out(rng):
    x = near_sphere(rng, 100, 3 * STEP)
    left_out = volume(signed=False)
    assert not left_out.signed
    assert np.array_equal(left_out.sample(x).value, volume("unsigned").sample(x).value)


# ------------------------------------------------------------------------------------------------------------- blocks


def in_blocks(values, n):
    shape = np.array(values.shape) // n
    blocks = values.reshape(shape[0], n, shape[1], n, shape[2], n).transpose(0, 2, 4, 1, 3, 5).reshape(-1, n, n, n)
    return blocks, np.indices(shape).reshape(3, -1).T


@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
@pytest.mark.parametrize("kind", ["signed truncated", "unsigned"])
def test_blocks_in_any_order_say_the_same_as_the_whole_to_the_bit(rng, kind, interpolation):
    dense = volume(kind, interpolation=interpolation)
    blocks, indices = in_blocks(dense._grid.nodes[0], 8)
    blocks = np.clip(blocks, -BAND, BAND) if dense.signed else blocks
    order, band = rng.permutation(len(blocks)), BAND if dense.signed else None
    options = {"truncation": band, "interpolation": interpolation}
    field = VolumeField.from_blocks(blocks[order], indices[order], LOW, STEP, **options)
    x = rng.uniform(-1.4, 1.4, (2000, 3))
    for one, other in zip(dense.sample(x), field.sample(x), strict=True):
        assert np.array_equal(one, other)
    assert np.array_equal(dense.spread(500), field.spread(500))
    begun_elsewhere = VolumeField.from_blocks(blocks, indices - 3, LOW + 24 * STEP, STEP, **options)
    assert np.allclose(begun_elsewhere.sample(x).foot, dense.sample(x).foot, atol=1e-12)


def test_absent_blocks_are_unseen(rng):
    values = np.clip(sphere(nodes()), -BAND, BAND)
    blocks, indices = in_blocks(values, 8)
    crossed = (np.abs(blocks) < BAND).any(axis=(1, 2, 3))
    assert crossed.mean() < 0.8
    field = VolumeField.from_blocks(blocks[crossed], indices[crossed], LOW, STEP, truncation=BAND)
    x = near_sphere(rng, 500, 2 * STEP)
    whole = VolumeField(values, LOW, STEP, truncation=BAND).sample(x)
    assert np.array_equal(whole.value, field.sample(x).value)


def test_a_huge_volume_needs_the_memory_of_its_blocks():
    far = [[0, 0, 0], [300, 0, 0], [0, 300, 300]]
    wall = nodes((8, 8, 8), np.zeros(3), 1.0)[..., 0] - 3.3
    field = VolumeField.from_blocks(np.stack(3 * [wall]), far)
    assert np.allclose(field.sample([[2400 + 4.0, 3, 3], [3.0, 2401, 2402]]).value, [0.7, -0.3])


# ------------------------------------------------------------------------------------------------------------- spread


@pytest.mark.parametrize("count", [200, 2000, 15_000])
@pytest.mark.parametrize("kind", ["signed", "unsigned"])
def test_places_are_spread_evenly_over_the_surface(rng, kind, count):
    field = volume(kind)
    places = field.spread(count)
    assert abs(len(places) - count) < 0.02 * count
    assert np.allclose(sphere(places), 0, atol=0.05 * STEP)
    assert np.array_equal(places, volume(kind).spread(count))
    in_caps = (outward(places) @ outward(CENTRE + rng.normal(size=(100, 3))).T > 0.7).mean(axis=0)
    assert np.allclose(in_caps, 0.15, atol=0.04)


def test_a_plane_through_nodes_is_a_surface():
    """Exact zeros at the nodes have no sign."""
    for values in (nodes((6, 6, 6), np.zeros(3), 1.0)[..., 2] - 2, 2 - nodes((6, 6, 6), np.zeros(3), 1.0)[..., 2]):
        assert np.allclose(VolumeField(values).spread(20)[:, 2], 2)


# ------------------------------------------------------------------------------------------------------- registration


@pytest.fixture(scope="module")
def scan():
    rng = np.random.default_rng(3)
    points = rng.uniform(-1.2, 1.2, (60_000, 3))
    points = points[np.abs(solid(points)) < 0.1]
    for _ in range(4):
        steps = 1e-5 * np.eye(3)
        slope = np.stack([solid(points + step) - solid(points - step) for step in steps], axis=1) / 2e-5
        points = points - solid(points)[:, None] * slope
    return points[np.abs(solid(points)) < 1e-6]


@pytest.mark.parametrize("method", ["robust", "paper"])
@pytest.mark.parametrize("kind", KINDS)
def test_a_scan_finds_its_place_in_a_volume(scan, motion, rng, kind, method):
    T = motion(rng, 4, 0.05)
    result = fa.register(apply(T, scan), volume(kind, solid), init=np.eye(4), method=method)
    assert rotation_error(result.T_target_source @ T, np.eye(4)) < 0.5
    assert translation_error(result.T_target_source @ T, np.eye(4)) < 0.2 * STEP


def test_a_scan_finds_its_place_from_any_pose(scan, any_motion, rng):
    T = any_motion(rng, 2.0)
    result = fa.register(apply(T, scan), volume("signed truncated", solid, interpolation="cubic"))
    assert result.accepted
    assert rotation_error(result.T_target_source @ T, np.eye(4)) < 0.2


# ------------------------------------------------------------------------------------------------------------- errors

WALL = nodes((4, 5, 6), np.zeros(3), 1.0)[..., 0] - 1.3


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ("volume", r"must be \(I, J, K\) numbers with sides of at least 2, but have shape \(\)"),
        (np.zeros((4, 4)), r"shape \(4, 4\)"),
        (np.zeros((1, 4, 4)), r"shape \(1, 4, 4\)"),
        ([[1, 2], [3]], "rows differ"),
        (WALL > 0, "dtype bool"),
        (WALL + 1j, "dtype complex"),
        (np.where(WALL > 0, np.inf, WALL), "have infinity"),
        (np.full((3, 3, 3), np.nan), "seen and below the truncation, but has none"),
        (np.zeros((3, 3, 3)), "must differ from place to place, but all that are known are 0"),
        (WALL + 20, "between values that are known there is none"),
        (-WALL - 20, "between values that are known there is none"),
    ],
)
def test_a_volume_without_a_surface_is_named(values, words):
    with pytest.raises(fa.FieldError, match=words) as raised:
        VolumeField(values)
    assert "VolumeField" in str(raised.value)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"origin": (0, 0)}, "origin must be"),
        ({"origin": (0, 0, np.nan)}, "origin must be"),
        ({"origin": "here"}, "origin must be"),
        ({"spacing": 0}, "spacing must be"),
        ({"spacing": (1, 1)}, "spacing must be"),
        ({"spacing": (1, 1, -1)}, "spacing must be"),
        ({"spacing": "wide"}, "spacing must be"),
        ({"truncation": 0}, "truncation must be"),
        ({"truncation": 0.1}, "below the truncation, but has none"),
        ({"signed": "yes"}, "signed must be"),
        ({"interpolation": "spline"}, "interpolation must be one of linear, cubic"),
        ({"seen": np.ones((4, 5, 5), bool)}, r"seen of a VolumeField must be \(4, 5, 6\) bool"),
        ({"seen": np.ones((4, 5, 6))}, r"give weights > 0"),
        ({"seen": np.zeros((4, 5, 6), bool)}, "but has none"),
    ],
)
def test_wrong_arguments_are_named(wrong, words):
    with pytest.raises(fa.ArgumentError, match=words):
        VolumeField(WALL, **wrong)


@pytest.mark.parametrize(
    ("blocks", "indices", "words"),
    [
        (WALL, [[0, 0, 0]], r"blocks of a VolumeField must be \(B, n, n, n\)"),
        (WALL[None, :, :4, :4], [[0, 0]], r"must be \(1, 3\) whole numbers"),
        (WALL[None, :, :4, :4], [[0.0, 0, 0]], "dtype float64"),
        (np.stack(2 * [WALL]), [[1, 0, 0], [1, 0, 0]], "given twice"),
        (np.stack(2 * [WALL]), [[0, 0, 0], [2000, 2000, 2000]], "must lie together"),
        (np.zeros((0, 4, 4, 4)), np.zeros((0, 3), int), "but has none"),
    ],
)
def test_wrong_blocks_are_named(blocks, indices, words):
    with pytest.raises(fa.FieldError, match=words):
        VolumeField.from_blocks(blocks, indices)


def test_places_must_be_finite():
    with pytest.raises(fa.FieldError, match="finite places"):
        VolumeField(WALL).sample([[0, np.nan, 0]])
