import numpy as np
import pytest
from scipy.spatial import cKDTree

from fieldalign.errors import ArgumentError
from fieldalign.fields import DistanceField, PointField


def clouds():
    rng = np.random.default_rng(0)
    sphere = rng.normal(size=(4000, 3))
    return {
        "random": rng.random((5000, 3)),
        "surface": sphere / np.linalg.norm(sphere, axis=1)[:, None],
        "duplicates": np.repeat(rng.random((50, 3)), 100, axis=0),
        "far outlier": np.vstack([rng.random((5000, 3)), [[1e9, 0, 0]]]),
        "line": np.c_[rng.random(3000), np.zeros((3000, 2))],
        "plane": np.c_[rng.random((3000, 2)), np.zeros(3000)],
        "ever denser": np.c_[1e6 * 2.0 ** -np.arange(400), np.zeros((400, 2))],
        "spinning sensor": rng.normal(size=(20000, 3)) * rng.exponential(3, (20000, 1)) ** 3,
        "utm": rng.random((3000, 3)) + [5e6, 4e5, 100],
        "float32": rng.random((3000, 3)).astype(np.float32),
        "many equal": np.vstack([np.zeros((30000, 3)), rng.random((10, 3))]),
        "three": np.eye(3),
        "tiny": 1e-9 * rng.random((500, 3)),
        "huge": 1e12 * rng.random((500, 3)),
    }


@pytest.mark.parametrize("name", clouds())
def test_nearest_is_exact(name):
    points, rng = clouds()[name], np.random.default_rng(1)
    centre = points.mean(axis=0, dtype=float)
    size = np.ptp(points, axis=0).max()
    near = points[rng.integers(0, len(points), 300)] + 0.02 * size * rng.normal(size=(300, 3))
    queries = np.vstack([near, points[:50], centre + size * rng.uniform(-3, 3, (100, 3))])
    k = min(5, len(points))
    expected, _ = cKDTree(points.astype(float) - centre).query(queries - centre, k)
    got, rows = PointField(points).nearest(queries, k)
    tolerance = 1e-15 * (size + np.abs(queries).max())
    assert np.abs(got - expected).max() <= 4 * tolerance
    to_rows = np.linalg.norm(queries[:, None] - points[rows], axis=2)
    assert np.abs(got - to_rows).max() <= 4 * tolerance


def test_sample_follows_the_definition(corner, rng):
    x = rng.uniform(-1, 4, (500, 3))
    value, gradient, foot, normal = PointField(corner).sample(x)
    distance, row = cKDTree(corner).query(x)
    assert np.allclose(value, distance, atol=1e-14)
    assert np.allclose(foot, corner[row], atol=1e-14)
    assert np.allclose(x - value[:, None] * gradient, foot, atol=1e-14)
    assert np.allclose(np.linalg.norm(normal, axis=1), 1)


def test_gradient_is_the_derivative(corner, rng):
    x, h = rng.uniform(-1, 4, (200, 3)), 1e-6
    for k in (1, 5):
        field = PointField(corner, neighbours=k)
        steps = h * np.eye(3)
        numeric = np.stack([(field.sample(x + s).value - field.sample(x - s).value) / (2 * h) for s in steps], axis=1)
        off = np.abs(numeric - field.sample(x).gradient).max(axis=1)
        assert np.quantile(off, 0.98) < 1e-5  # the derivative jumps where the nearest point changes


def test_mean_of_k_nearest(corner, rng):
    x = rng.uniform(-1, 4, (100, 3))
    distances, rows = cKDTree(corner).query(x, 5)
    sample = PointField(corner, neighbours=5).sample(x)
    assert np.allclose(sample.value**2, (distances**2).mean(axis=1))
    assert np.allclose(sample.foot, corner[rows].mean(axis=1))
    assert np.allclose(2 * sample.value[:, None] * sample.gradient, 2 * (x[:, None] - corner[rows]).mean(axis=1))


def test_on_a_point_the_value_is_zero_and_everything_finite(corner):
    sample = PointField(corner).sample(corner[:100])
    assert np.abs(sample.value).max() < 1e-15
    assert np.isfinite(sample.gradient).all()


def test_a_guess_changes_nothing(corner, rng):
    field, x = PointField(corner), rng.uniform(-1, 4, (500, 3))
    plain = field.sample(x)
    for guess in (plain.place, field.sample(x + 0.1).place, np.zeros(500, np.uint32)):
        guessed = field.sample(x, guess)
        assert np.array_equal(guessed.value, plain.value)
        assert np.array_equal(guessed.foot, plain.foot)


def test_a_guess_that_the_tree_has_not_is_refused(corner):
    with pytest.raises(ValueError, match="guess"):
        PointField(corner).sample(corner[:2], np.array([0, len(corner)], np.uint32))


def test_threads_change_no_bit(rng):
    points = rng.random((150_000, 3)) ** 3
    x = rng.uniform(-0.2, 1.2, (3000, 3))
    one = PointField(points, threads=1)
    for threads in (2, 3, 8):
        many = PointField(points, threads=threads)
        assert all(np.array_equal(a, b) for a, b in zip(one.sample(x), many.sample(x), strict=True))
        assert np.array_equal(one.centre, many.centre)


@pytest.mark.parametrize("layout", ["strided", "fortran", "integer", "read only", "list"])
def test_any_layout_of_points(layout):
    points = np.random.default_rng(3).integers(0, 1000, (200, 3)).astype(float)
    variants = {
        "strided": np.repeat(points, 2, axis=0)[::2],
        "fortran": np.asfortranarray(points),
        "integer": points.astype(np.int32),
        "read only": points.copy(),
        "list": points.tolist(),
    }
    given = variants[layout]
    if layout == "read only":
        given.flags.writeable = False
    x = points[:20] + 0.4
    assert np.array_equal(PointField(given).sample(x).value, PointField(points).sample(x).value)


def test_normals_of_a_plane(rng):
    plane = np.c_[rng.random((2000, 2)), np.zeros(2000)] @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
    field = PointField(plane + [5e6, 4e6, 0])
    normals = field.normals(field.points[:100])
    expected = np.linalg.svd(plane - plane.mean(axis=0), full_matrices=False)[2][2]
    assert np.abs(np.abs(normals @ expected) - 1).max() < 1e-9


def test_spacing_passes_over_duplicates():
    grid = np.stack(np.meshgrid(*3 * [np.arange(6.0)]), axis=-1).reshape(-1, 3)
    field = PointField(np.repeat(grid, 3, axis=0))
    assert np.allclose(field.spacing(grid), 1)


def test_keypoints_lie_at_corners_not_on_planes():
    u = np.linspace(0, 1, 41)
    a, b = (m.ravel() for m in np.meshgrid(u, u))
    faces = [np.insert(np.c_[a, b], axis, side, axis=1) for axis in range(3) for side in (0.0, 1.0)]
    cube = np.unique(np.vstack(faces), axis=0)
    cube += 1e-4 * np.random.default_rng(0).normal(size=cube.shape)
    found = PointField(cube).points[PointField(cube).keypoints(gamma=0.9)]
    assert len(found) >= 8
    corners = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1]), axis=-1).reshape(-1, 3)
    assert cKDTree(found).query(corners)[0].max() < 0.15
    assert np.isclose(np.abs(found - 0.5).max(axis=1), 0.5, atol=0.01).all()


def test_a_point_field_is_a_distance_field(corner):
    assert isinstance(PointField(corner), DistanceField)


def test_utm_coordinates_lose_nothing(corner, rng):
    x = rng.uniform(-1, 4, (300, 3))
    offset = np.array([5e6, 4e5, 300.0])
    shifted = (corner + offset) - offset  # what float64 leaves of the points there
    here, there = PointField(shifted).sample(x), PointField(corner + offset).sample(x + offset)
    assert np.abs(here.value - there.value).max() < 2e-9


@pytest.mark.parametrize(
    ("points", "word"),
    [
        (np.zeros((5, 2)), "shape"),
        (np.zeros(5), "shape"),
        (np.zeros((0, 3)), "distinct"),
        (np.ones((9, 3)), "distinct"),
        (np.repeat(np.eye(3)[:2], 5, axis=0), "distinct"),
        (np.vstack([np.eye(3), [[np.nan, 0, 0]]]), "finite"),
        (np.vstack([np.eye(3), [[np.inf, 0, 0]]]), "finite"),
        (1e300 * np.eye(3), "below"),
        (np.array([["a", "b", "c"]]), "numbers"),
        (np.eye(3) + 1j, "real"),
        ([[1, 2, 3], [4, 5]], "rows"),
    ],
)
def test_bad_points_are_one_clear_error(points, word):
    with pytest.raises(ArgumentError, match=f"points.*{word}"):
        PointField(points)


def test_neighbours_out_of_range(corner):
    for k in (0, 65, 1.5, True):
        with pytest.raises(ArgumentError, match="neighbours"):
            PointField(corner, neighbours=k)


def test_float32_at_utm_size_warns(corner):
    with pytest.warns(UserWarning, match="float32"):
        PointField((corner + [5e6, 4e5, 0]).astype(np.float32))
