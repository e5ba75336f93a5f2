"""The field of triangles, against all triangles one by one, winding numbers, finite differences and plain sense."""

import sys

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

import fieldalign as fa
from fieldalign.fields import DistanceField, MeshField, sampled
from fieldalign.fields.protocol import planes_near

igl = pytest.importorskip("igl")

TURN = Rotation.from_euler("xyz", [0.3, -1.1, 2.0]).as_matrix()  # so that no face lies along an axis


def ball():
    """A sphere whose radius is 1 at its corners."""
    sphere = trimesh.creation.icosphere(2)
    return sphere.vertices, sphere.faces


def torus():
    ring = trimesh.creation.torus(1.0, 0.35, major_sections=24, minor_sections=12)
    return ring.vertices, ring.faces


def angle():
    """An L of unequal legs, with one reflex edge."""
    outline = np.array([[0, 0], [2, 0], [2, 0.5], [0.5, 0.5], [0.5, 1], [0, 1]])
    cap = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]])
    n, i = len(outline), np.arange(len(outline))
    j = (i + 1) % n
    vertices = np.r_[np.c_[outline, 0 * i], np.c_[outline, 0 * i + 0.7]] @ TURN.T
    return vertices, np.r_[cap[:, ::-1], cap + n, np.c_[i, j, j + n], np.c_[i, j + n, i + n]]


def sheet():
    """A part of a wavy surface, open."""
    u, v = np.meshgrid(np.linspace(0, 3, 13), np.linspace(0, 2, 9), indexing="ij")
    vertices = np.stack([u, v, 0.3 * np.sin(2 * u) * v], axis=-1).reshape(-1, 3) @ TURN.T
    corner = (np.arange(12)[:, None] * 9 + np.arange(8)).reshape(-1, 1)
    return vertices, np.r_[corner + [0, 9, 10], corner + [0, 10, 1]]


CLOSED = {"ball": ball, "torus": torus, "angle": angle}
SHAPES = CLOSED | {"sheet": sheet}
WORLDS = {"metres": (1.0, 0.0), "millimetres": (1000.0, 0.0), "utm": (1.0, 5e6)}  # factor and offset

shapes = pytest.mark.parametrize("shape", SHAPES)
closed = pytest.mark.parametrize("shape", CLOSED)
worlds = pytest.mark.parametrize("world", WORLDS)


def put_into(world, points):
    factor, offset = WORLDS[world]
    return factor * points + [offset, 0.1 * offset, 0]


def anywhere(field, rng, count):
    """Places in and around the bounds."""
    low, high = field.bounds
    return rng.uniform(low - 0.3 * (high - low), high + 0.3 * (high - low), (count, 3))


def about_edges(vertices, faces, rng, count, reach):
    """Places next to edges, and each third next to a corner."""
    ends = vertices[np.r_[faces[:, :2], faces[:, 1:]][rng.integers(2 * len(faces), size=count)]]
    share = rng.uniform(0, 1, (count, 1)) * (np.arange(count) % 3 > 0)[:, None]
    return ends[:, 0] + share * (ends[:, 1] - ends[:, 0]) + reach * rng.normal(size=(count, 3))


def on_segment(x, A, B):
    share = np.einsum("lfi,fi->lf", x[:, None] - A, B - A) / np.einsum("fi,fi->f", B - A, B - A)
    return A + np.clip(share, 0, 1)[..., None] * (B - A)


def in_triangle(x, A, B, C):
    """The feet on the triangles' planes (L, F, 3); infinite where they lie outside."""
    normal = np.cross(B - A, C - A)
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    foot = x[:, None] - np.einsum("lfi,fi->lf", x[:, None] - A, normal)[..., None] * normal
    inside = [np.einsum("lfi,fi->lf", np.cross(Q - P, foot - P), normal) >= 0 for P, Q in ((A, B), (B, C), (C, A))]
    return np.where(np.all(inside, axis=0)[..., None], foot, np.inf)


def by_all_triangles(vertices, faces, x):
    """Distance (L,) and foot (L, 3), from every triangle."""
    A, B, C = (vertices[faces[:, k]] for k in range(3))
    feet = np.stack([in_triangle(x, A, B, C), on_segment(x, A, B), on_segment(x, B, C), on_segment(x, C, A)], axis=1)
    feet = feet.reshape(len(x), -1, 3)
    apart = np.linalg.norm(x[:, None] - feet, axis=2)
    best = apart.argmin(axis=1)
    return apart.min(axis=1), feet[np.arange(len(x)), best]


def is_inside(field, x):
    return igl.winding_number(field.vertices - field.centre, field.faces, x - field.centre) > 0.5


# ------------------------------------------------------------------------------------------------------------- distance


@shapes
@worlds
def test_it_is_the_distance_to_the_nearest_triangle(shape, world, rng):
    vertices, faces = SHAPES[shape]()
    vertices = put_into(world, vertices)
    field = MeshField(vertices, faces)
    x, extent = anywhere(field, rng, 200), np.linalg.norm(np.ptp(vertices, axis=0))
    value, gradient, foot, _ = sampled(field, x)
    expected, foot_by_all = by_all_triangles(field.vertices - field.centre, field.faces, x - field.centre)
    assert np.abs(np.abs(value) - expected).max() < 1e-9 * extent
    apart = np.linalg.norm(foot - field.centre - foot_by_all, axis=1)
    assert np.median(apart) < 1e-9 * extent
    assert np.mean(apart > 1e-9 * extent) < 0.02  # two feet at one distance
    assert np.abs(x - value[:, None] * gradient - foot).max() < 1e-9 * extent


@shapes
def test_the_gradient_is_the_derivative(shape, rng):
    field = MeshField(*SHAPES[shape]())
    x, step = anywhere(field, rng, 300), 1e-6
    x = x[np.abs(field.sample(x).value) > 1e-3]
    ahead, behind = (np.stack([field.sample(x + s * e).value for e in np.eye(3)], axis=1) for s in (step, -step))
    off = np.abs((ahead - behind) / (2 * step) - field.sample(x).gradient).max(axis=1)
    assert np.mean(off < 1e-4) > 0.98  # but on ridges, where two parts are equally near
    assert np.allclose(np.linalg.norm(field.sample(x).gradient, axis=1), 1)


@shapes
def test_normals_are_those_of_the_nearest_triangles(shape, rng):
    field = MeshField(*SHAPES[shape]())
    x = anywhere(field, rng, 300)
    _, gradient, _, normal = field.sample(x)
    assert np.allclose(np.linalg.norm(normal, axis=1), 1)
    within_triangle = np.abs(np.einsum("li,li->l", gradient, normal)) > 1 - 1e-9
    assert within_triangle.mean() > 0.1
    if field.signed:
        assert (np.einsum("li,li->l", gradient, normal)[within_triangle] > 0).all()


@shapes
def test_planes_are_those_of_the_sample(shape, rng):
    field = MeshField(*SHAPES[shape]())
    x = anywhere(field, rng, 100)
    planes, (_, _, foot, normal) = planes_near(field, x, 10), sampled(field, x)
    assert np.array_equal(planes.mean, foot)
    assert np.allclose(np.abs(np.einsum("li,li->l", planes.normal, normal)), 1)
    assert np.array_equal(planes.thickness, np.zeros(100))
    assert np.isinf(planes.width).all()


@pytest.mark.parametrize("count", [0, 1, 2])
def test_few_places(count, rng):
    value, *others = MeshField(*angle()).sample(rng.normal(size=(count, 3)))
    assert value.shape == (count,)
    assert all(other.shape == (count, 3) for other in others)


def test_it_is_a_field_and_keeps_what_it_was_given():
    vertices, faces = torus()
    field = MeshField(vertices, faces)
    assert isinstance(field, DistanceField)
    assert len(field) == len(faces)
    assert np.array_equal(field.bounds, [np.min(vertices, axis=0), np.max(vertices, axis=0)])
    before = field.sample(np.ones((1, 3))).value
    vertices[:] = 0
    assert np.array_equal(field.sample(np.ones((1, 3))).value, before)


def test_vertices_that_no_face_uses_do_not_count():
    vertices, faces = angle()
    field = MeshField(np.r_[[[9.0, 9, 9], [np.nan, 0, 0]], vertices], faces + 2)
    assert np.array_equal(field.bounds, MeshField(vertices, faces).bounds)


def test_triangles_without_an_area_are_left_out():
    vertices, faces = angle()
    assert len(MeshField(vertices, np.r_[faces, [[0, 0, 1], [2, 2, 2]]])) == len(faces)


def test_numbers_of_other_kinds_are_taken():
    box = trimesh.creation.box([2, 2, 2])
    field = MeshField(box.vertices.astype(int), box.faces.astype(np.uint32))
    assert field.vertices.dtype == float
    assert np.allclose(field.sample([[3.0, 0, 0], [0, 0, 0.25]]).value, [2, -0.75])
    single = MeshField(box.vertices.astype(np.float32).tolist(), box.faces.tolist())
    assert np.array_equal(single.vertices, box.vertices)


# ----------------------------------------------------------------------------------------------------------------- sign


@closed
@worlds
def test_it_is_negative_inside(shape, world, rng):
    vertices, faces = CLOSED[shape]()
    field = MeshField(put_into(world, vertices), faces)
    assert field.signed
    x = anywhere(field, rng, 2000)
    inside = is_inside(field, x)
    assert 0.03 < inside.mean() < 0.6
    assert np.array_equal(field.sample(x).value < 0, inside)


@closed
@worlds
@pytest.mark.parametrize("reach", [0.05, 1e-3, 1e-6])
def test_the_side_is_right_next_to_edges_and_corners(shape, world, reach, rng):
    factor, offset = WORLDS[world]
    reach = factor * max(reach, 1e-11 * offset)
    vertices, faces = CLOSED[shape]()
    field = MeshField(put_into(world, vertices), faces)
    x = about_edges(field.vertices, field.faces, rng, 1500, reach)
    value = field.sample(x).value
    clear = np.abs(value) > 1e-6 * reach
    assert clear.mean() > 0.95
    assert np.array_equal(value[clear] < 0, is_inside(field, x)[clear])


def test_soup_with_its_own_corners_for_each_triangle_is_watertight(rng):
    vertices, faces = torus()
    soup = np.asarray(vertices)[faces].reshape(-1, 3).astype(np.float32)
    soup = np.where((soup == 0) & (rng.random(soup.shape) < 0.5), np.float32(-0.0), soup)
    field, x = MeshField(soup, np.arange(len(soup)).reshape(-1, 3)), rng.normal(size=(500, 3))
    assert field.signed
    assert np.allclose(field.sample(x).value, MeshField(vertices, faces).sample(x).value, atol=1e-6)


@closed
def test_the_way_of_winding_does_not_matter(shape, rng):
    vertices, faces = CLOSED[shape]()
    x = rng.normal(size=(300, 3))
    ours, inverted = MeshField(vertices, faces).sample(x), MeshField(vertices, faces[:, ::-1]).sample(x)
    for name in ("value", "gradient", "foot"):  # on an edge, the normal may be either triangle's
        assert np.allclose(getattr(ours, name), getattr(inverted, name), atol=1e-12)
    assert np.median(np.abs(ours.normal - inverted.normal)) < 1e-12


def test_one_triangle_that_winds_otherwise_leaves_it_unsigned():
    vertices, faces = angle()
    turned = faces.copy()
    turned[3] = turned[3, ::-1]
    assert not MeshField(vertices, turned).signed


def test_a_cavity_is_outside():
    outer, inner = trimesh.creation.box([4, 4, 4]), trimesh.creation.box([2, 2, 2])
    field = MeshField(np.r_[outer.vertices, inner.vertices], np.r_[outer.faces, inner.faces[:, ::-1] + 8])
    assert field.signed
    assert np.allclose(field.sample([[0, 0, 0], [1.6, 0, 0], [2.5, 0, 0]]).value, [1, -0.4, 0.5])


def test_open_meshes_are_unsigned(rng):
    field = MeshField(*sheet())
    value, gradient, _, _ = field.sample(anywhere(field, rng, 100))
    assert not field.signed
    assert (value > 0).all()
    assert np.allclose(np.linalg.norm(gradient, axis=1), 1)


@closed
def test_a_closed_mesh_may_be_taken_without_its_sign(shape, rng):
    signed, unsigned = (MeshField(*CLOSED[shape](), signed=s) for s in (True, False))
    x = anywhere(signed, rng, 300)
    (value, gradient, foot, _), plain = signed.sample(x), unsigned.sample(x)
    assert not unsigned.signed
    assert np.array_equal(plain.value, np.abs(value))
    assert np.array_equal(plain.gradient, gradient * np.sign(value)[:, None])
    assert np.array_equal(plain.foot, foot)


# ------------------------------------------------------------------------------------------------------- on the surface


def test_at_the_corners_the_distance_is_zero_and_the_gradient_a_normal():
    vertices, faces = angle()
    vertices = np.round(vertices, 6)
    field = MeshField(vertices, faces)
    value, gradient, _, normal = field.sample(vertices)
    assert np.abs(value).max() < 1e-15
    on = value == 0
    assert on.any()
    assert np.array_equal(gradient[on], normal[on])
    unsigned = MeshField(vertices, faces, signed=False).sample(vertices)
    assert not unsigned.gradient[unsigned.value == 0].any()


@closed
@worlds
def test_on_the_surface_the_gradient_is_the_normal(shape, world):
    """Where a place is on it but for rounding, the rounding is no direction."""
    vertices, faces = CLOSED[shape]()
    field = MeshField(put_into(world, vertices), faces)
    value, gradient, _, normal = field.sample(field.spread(500))
    assert np.abs(value).max() < 1e-9 * WORLDS[world][0]
    assert np.allclose(gradient, normal, atol=1e-3)


@shapes
@worlds
def test_spread_places_lie_on_the_triangles(shape, world):
    vertices, faces = SHAPES[shape]()
    field = MeshField(put_into(world, vertices), faces)
    places = field.spread(1500)
    assert places.shape == (1500, 3)
    assert np.abs(field.sample(places).value).max() < 2e-9 * WORLDS[world][0]
    assert np.array_equal(places, field.spread(1500))


@shapes
def test_spread_places_cover_evenly_by_area(shape):
    vertices, faces = SHAPES[shape]()
    field, count = MeshField(vertices, faces), 5000
    A, B, C = (field.vertices[field.faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(B - A, C - A), axis=1) / 2
    face = field._tree.squared_distance(field._about, field.faces, field.spread(count) - field.centre)[1]
    share = np.bincount(face, minlength=len(field)) / count
    assert np.abs(share - area / area.sum()).max() < 1.5 / count + 1e-3 * share.max()
    # Within: no place of the surface is far from all of them.
    rng = np.random.default_rng(0)
    t = np.sort(rng.random((2, 2000)), axis=0)
    rows = rng.choice(len(field), 2000, p=area / area.sum())
    anywhere_on = A[rows] * t[0, :, None] + B[rows] * (t[1] - t[0])[:, None] + C[rows] * (1 - t[1])[:, None]
    gap = fa.fields.PointField(field.spread(count)).sample(anywhere_on).value
    assert gap.max() < 3.5 * np.sqrt(area.sum() / count)


@pytest.mark.parametrize("count", [0, 1.5, -1, "many"])
def test_a_count_of_places_is_asked_for(count):
    with pytest.raises(fa.ArgumentError, match="count must be an integer of at least 1"):
        MeshField(*angle()).spread(count)


# --------------------------------------------------------------------------------------------------------------- errors


def test_an_open_mesh_asked_for_a_sign_names_its_edges():
    vertices, faces = trimesh.creation.box().vertices, trimesh.creation.box().faces
    with pytest.raises(fa.FieldError, match=r"not watertight: 3 edges .* give signed=False, or close the mesh"):
        MeshField(vertices, faces[1:], signed=True)
    with pytest.raises(fa.FieldError, match="40 edges"):
        MeshField(*sheet(), signed=True)


NAN, HUGE = np.nan, np.inf
CORNERS = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]


@pytest.mark.parametrize(
    ("vertices", "faces", "words"),
    [
        (np.zeros((3, 2)), [[0, 1, 2]], r"vertices of a MeshField must be \(n, 3\) numbers, but have shape \(3, 2\)"),
        (np.zeros(9), [[0, 1, 2]], r"shape \(9,\)"),
        ([["a", "b", "c"]], [[0, 0, 0]], "vertices of a MeshField must be"),
        (np.array(CORNERS, complex), [[0, 1, 2]], "complex"),
        ([[0, 0, 0], [1, 0]], [[0, 1, 1]], "vertices of a MeshField must be"),
        (CORNERS, [[0, 1, 2], [0, 1]], "faces of a MeshField must be"),
        (CORNERS, [0, 1, 2], r"faces of a MeshField must be \(n, 3\) whole numbers, but have shape \(3,\)"),
        (CORNERS, [[0, 1, 2, 0]], r"shape \(1, 4\)"),
        (CORNERS, [[0.0, 1.0, 2.0]], "float64"),
        (CORNERS, [[True, False, True]], "bool"),
        (CORNERS, [[0, 1, 3]], "faces of a MeshField must be rows of its 3 vertices, but .* 0 to 3"),
        (CORNERS, [[-1, 1, 2]], "-1 to 2"),
        ([*CORNERS, [NAN, 0, 0]], [[0, 1, 2], [0, 1, 3]], "must be finite, but 1 faces have NaN or infinity"),
        ([*CORNERS, [HUGE, 0, 0]], [[0, 1, 3], [1, 2, 3]], "but 2 faces have NaN or infinity"),
        (CORNERS, [[0, 0, 1], [2, 2, 2]], "none of its 2 has one"),
        ([[0, 0, 0], [1, 1, 1], [2, 2, 2]], [[0, 1, 2]], "needs triangles with an area, but none of its 1 has one"),
        (CORNERS, np.zeros((0, 3), int), "needs at least one triangle, but has 0 faces on 3 vertices"),
        (np.zeros((0, 3)), [[0, 1, 2]], "1 faces on 0 vertices"),
    ],
)
def test_what_is_no_mesh_is_refused(vertices, faces, words):
    with pytest.raises(fa.FieldError, match=words):
        MeshField(vertices, faces)


@pytest.mark.parametrize("signed", ["yes", 2])
def test_signed_is_a_yes_or_no(signed):
    with pytest.raises(fa.FieldError, match="signed of a MeshField must be True, False or None"):
        MeshField(*angle(), signed=signed)


@pytest.mark.parametrize("place", [[NAN, 0, 0], [0, HUGE, 0]])
def test_places_must_be_finite(place):
    with pytest.raises(fa.FieldError, match="NaN or inf"):
        sampled(MeshField(*angle()), np.array([[1.0, 1, 1], place]))


def test_without_libigl_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "igl", None)
    with pytest.raises(fa.MissingExtraError, match=r"fieldalign\[mesh\]"):
        MeshField(*angle())
