"""Clouds made ready once: what goes in, what is kept, and that nothing depends on it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

import fieldalign as fa
from fieldalign.errors import ArgumentError, CloudFileError
from fieldalign.fields import PointField
from fieldalign.prepare import prepare, prepare_pair
from fieldalign.prepared import PreparedCloud
from fieldalign.settings import Settings


class CountingSphere:
    """The signed field of a sphere, which counts how often it is asked."""

    signed = True

    def __init__(self, centre=(1.0, 2, 3), radius=0.5):
        self.centre, self.radius, self.calls = np.asarray(centre, float), radius, 0

    @property
    def bounds(self):
        return np.array([self.centre - self.radius, self.centre + self.radius])

    def sample(self, x):
        self.calls += 1
        away = x - self.centre
        length = np.linalg.norm(away, axis=1)
        normal = away / length[:, None]
        return length - self.radius, normal, self.centre + self.radius * normal, normal


@pytest.fixture
def sphere():
    return CountingSphere()


@pytest.fixture
def with_gaps(corner):
    """The corner's first 1000 points and 3 missing returns."""
    gaps = np.vstack([corner[:1000], np.full((3, 3), np.nan)])
    gaps[1001] = [1, 2, np.nan]  # one NaN is enough
    return gaps[np.random.default_rng(0).permutation(1003)]


def test_arrays_clouds_and_paths_are_prepared_alike(corner, tmp_path):
    path = tmp_path / "corner.npy"
    np.save(path, corner)
    for cloud in (corner, corner.tolist(), np.asfortranarray(corner), fa.PointCloud(corner), path, str(path)):
        prepared = prepare(cloud)
        assert isinstance(prepared.field, PointField)
        assert np.array_equal(prepared.field.points, corner)
        assert prepared.dropped == 0


def test_centre_and_extent_are_the_points(corner):
    prepared = prepare(corner)
    assert np.allclose(prepared.centre, corner.mean(axis=0), atol=1e-14)
    assert prepared.extent == pytest.approx(np.linalg.norm(np.ptp(corner, axis=0)), rel=1e-15)


def test_centre_and_extent_of_another_field_are_those_of_its_bounds(sphere):
    prepared = prepare(sphere)
    assert prepared.field is sphere
    assert np.allclose(prepared.centre, [1, 2, 3])
    assert prepared.extent == pytest.approx(np.sqrt(3))
    assert prepared.dropped == 0


@pytest.mark.parametrize(
    "bounds", [np.zeros((3, 2)), np.array([[0, 0, 0], [1, np.nan, 1]]), np.array([[0, 0, 0], [1, -1, 1.0]])]
)
def test_nonsensical_bounds_name_the_field(sphere, bounds):
    class Boundless(CountingSphere):
        pass

    Boundless.bounds = bounds
    with pytest.raises(ArgumentError, match=r"Boundless\.bounds must be \(2, 3\)"):
        _ = prepare(Boundless()).centre


def test_a_prepared_cloud_is_returned_as_it_is(corner, sphere):
    for prepared in (prepare(corner), prepare(sphere)):
        assert prepare(prepared) is prepared


def test_missing_returns_are_dropped_and_counted(corner, with_gaps):
    for cloud in (with_gaps, fa.PointCloud(with_gaps), with_gaps.astype(np.float32)):
        prepared = prepare(cloud)
        assert prepared.dropped == 3
        assert len(prepared.field) == 1000
    kept = prepare(with_gaps).field.points
    assert cKDTree(corner[:1000]).query(kept)[0].max() == 0


def test_missing_returns_can_be_refused(with_gaps, corner):
    with pytest.raises(ArgumentError, match=r"cloud must be finite, but 3 rows are not"):
        prepare(with_gaps, drop_nonfinite=False)
    assert prepare(corner, drop_nonfinite=False).dropped == 0


@pytest.mark.parametrize("value", [np.inf, -np.inf])
@pytest.mark.parametrize("drop", [True, False])
def test_infinity_is_never_dropped(with_gaps, value, drop):
    with_gaps[17, 2] = value
    with pytest.raises(ArgumentError, match="cloud must be finite"):
        prepare(with_gaps, drop_nonfinite=drop)


@pytest.mark.parametrize(
    ("cloud", "word"),
    [(np.zeros((5, 4)), "shape"), (None, "numbers"), (object(), "numbers"), ([[1, 2, 3], [4]], "rows")],
)
def test_what_is_no_cloud_is_one_clear_error(cloud, word):
    with pytest.raises(ArgumentError, match=f"^cloud must.*{word}"):
        prepare(cloud)


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.full((9, 3), np.nan), np.ones((9, 3))])
def test_a_cloud_without_three_distinct_points_is_refused(points):
    with pytest.raises(ArgumentError, match="at least 3 distinct points"):
        prepare(points)


def test_a_path_to_nothing_is_a_file_error(tmp_path):
    with pytest.raises(CloudFileError, match=r"nothing\.ply does not exist"):
        prepare(tmp_path / "nothing.ply")


def test_features_are_worked_out_once(sphere):
    prepared = PreparedCloud(sphere)
    settings = Settings("uniform", half_width=1.0)
    pseudo, sample = prepared.features(settings, 0, 1)
    asked = sphere.calls
    again = prepared.features(replace(settings, max_iterations=3, direction="none"), 0, 2)
    assert sphere.calls == asked  # neither the solver's settings nor threads have to do with them
    assert again[0] is pseudo
    assert again[1] is sample
    assert np.allclose(sample.value, np.linalg.norm(pseudo - sphere.centre, axis=1) - sphere.radius)


@pytest.mark.parametrize(
    "change",
    [
        {"pseudo_set": "neighbourhood"},
        {"pseudo_count": 900},
        {"half_width": 1.1},
        {"sigma": 0.3},
        {"pseudo_points": np.arange(30.0).reshape(10, 3)},
    ],
)
def test_other_settings_are_other_features(sphere, change):
    prepared, settings = PreparedCloud(sphere), Settings("uniform", half_width=1.0)
    pseudo, _ = prepared.features(settings, 0, 1)
    other, sample = prepared.features(replace(settings, **change), 0, 1)
    assert other is not pseudo
    assert np.allclose(sample.value, np.linalg.norm(other - sphere.centre, axis=1) - sphere.radius)
    assert prepared.features(settings, 0, 1)[0] is pseudo  # the first are kept beside them


def test_another_seed_is_other_features(sphere):
    prepared, settings = PreparedCloud(sphere), Settings()
    assert not np.array_equal(prepared.features(settings, 0, 1)[0], prepared.features(settings, 1, 1)[0])


def test_handed_in_points_are_told_apart_by_their_values(corner):
    prepared = prepare(corner)
    here, there = (np.full((10, 3), value) + np.arange(30).reshape(10, 3) for value in (0.0, 1.0))
    assert np.array_equal(prepared.features(Settings(pseudo_points=here), 0, 1)[0], here)
    assert np.array_equal(prepared.features(Settings(pseudo_points=there), 0, 1)[0], there)


def test_the_mean_feature_is_told_apart(corner):
    prepared = prepare(corner)
    one, five = (prepared.features(Settings(neighbours=k), 0, 1) for k in (1, 5))
    assert np.array_equal(one[0], five[0])  # the same places,
    distances, _ = cKDTree(corner).query(five[0], 5)
    assert np.allclose(one[1].value, distances[:, 0], atol=1e-14)
    assert np.allclose(five[1].value**2, (distances**2).mean(axis=1))  # another feature


def test_only_the_latest_features_are_kept(sphere):
    prepared, settings = PreparedCloud(sphere), Settings("uniform")
    first = prepared.features(settings, 0, 1)[0]
    for seed in range(1, 30):
        latest = prepared.features(settings, seed, 1)[0]
    assert len(prepared._features) == 8
    assert prepared.features(settings, 29, 1)[0] is latest
    drawn_again = prepared.features(settings, 0, 1)[0]
    assert drawn_again is not first
    assert np.array_equal(drawn_again, first)


def test_probes_stand_for_the_surface(corner, sphere):
    places, near = prepare(corner).probes
    assert places.shape == (200, 3)
    assert cKDTree(corner).query(places)[0].max() == 0
    distances, _ = cKDTree(corner).query(places, 2)
    assert near == pytest.approx(3 * np.median(distances[:, 1]))
    places, near = prepare(sphere).probes
    assert np.allclose(np.linalg.norm(places - sphere.centre, axis=1), 0.5)
    assert near == 0


def same_bits(one, other):
    names = ("T_target_source", "information", "covariance", "reference_point")
    return one.rmse == other.rmse and all(np.array_equal(getattr(one, n), getattr(other, n)) for n in names)


def test_prepared_or_not_the_answer_has_the_same_bits(register, corner, motion, rng):
    T = motion(rng, 25, 0.5)
    source, target = corner[:3000], corner @ T[:3, :3].T + T[:3, 3]
    plain = register(source, target)
    for pair in ((source, prepare(target)), (prepare(source), target), (prepare(source, threads=1), prepare(target))):
        assert same_bits(register(*pair), plain)


def test_one_target_serves_many_sources(register, corner, motion, rng):
    target = prepare(corner)
    for degrees in (10, 20, 30):
        T = motion(rng, degrees, 0.4)
        source = (corner - T[:3, 3]) @ T[:3, :3]
        result = register(source, target)
        assert result.accepted
        assert np.allclose(result.T_target_source, T, atol=1e-9)
        assert same_bits(register(source, target), result)  # nor has the registration before left a trace


def test_a_pair_is_prepared_alike_side_by_side(rng):
    source, target = rng.random((2, 25_000, 3))  # enough for a thread each
    source[7] = np.nan
    for threads in (1, 2, 3):
        moving, fixed = prepare_pair(source, target, threads, True)
        assert (moving.dropped, fixed.dropped) == (1, 0)
        assert np.array_equal(moving.field.points, source[~np.isnan(source[:, 0])])
        assert np.array_equal(fixed.field.points, target)
        assert np.array_equal(fixed.centre, prepare(target).centre)


def test_an_error_in_a_thread_names_its_cloud(rng):
    source, target = rng.random((2, 25_000, 3))
    target[5, 1] = np.inf
    with pytest.raises(ArgumentError, match=r"^target must be finite"):
        prepare_pair(source, target, 2, True)
    with pytest.raises(ArgumentError, match=r"^source must be finite"):
        prepare_pair(target, source, 2, True)


# ------------------------------------------------------------------------------------------------ of the robust method


def test_a_cloud_that_is_not_dense_is_its_own_last_level(corner):
    prepared = prepare(corner)
    assert prepared.fine is prepared.field
    assert prepared.exact is prepared.fine


def test_a_dense_cloud_is_thinned_for_the_last_level(rng):
    """To what it can use, on the same surface, and not to a voxel of the search."""
    away = rng.normal(size=(300_000, 3))
    ball = 2 * away / np.linalg.norm(away, axis=1)[:, None]
    prepared = prepare(ball)
    assert 10_000 < len(prepared.fine) < 100_000
    assert np.abs(np.linalg.norm(prepared.fine.points, axis=1) - 2).max() < 2e-3
    spacing = np.median(cKDTree(prepared.fine.points).query(prepared.fine.points, 2)[0][:, 1])
    assert spacing < prepared.scale.voxel / 2
    assert cKDTree(prepared.fine.points).query(ball[::100])[0].max() < prepared.scale.voxel


def test_far_outliers_are_no_part_of_the_last_level(corner):
    spoilt = prepare(np.vstack([corner, 1e6 * np.eye(3)]))
    assert len(spoilt.field) == len(corner) + 3
    assert np.array_equal(spoilt.fine.points, corner)
    assert spoilt.scale.voxel == pytest.approx(prepare(corner).scale.voxel, rel=0.05)


def test_a_formula_stands_for_itself_and_for_some_places(sphere):
    prepared = prepare(sphere)
    assert prepared.exact is sphere
    assert len(prepared.fine) == 30_000
    assert np.allclose(np.linalg.norm(prepared.fine.points - sphere.centre, axis=1), sphere.radius)


def test_surfels_are_kept_for_voxels_that_are_nearly_alike(corner):
    """On a ladder of quarter octaves from the cloud's own voxel: at most 9 percent from what is asked."""
    prepared = prepare(corner)
    own = prepared.scale.voxel
    assert prepared.surface(own) is prepared.surface(1.05 * own)
    assert prepared.surface(own).voxel == own
    for factor in (0.5, 0.8, 1.3, 2.7):
        surface = prepared.surface(factor * own)
        assert surface is prepared.surface(factor * own)
        assert surface.voxel / (factor * own) == pytest.approx(1, abs=0.091)
    assert len(prepared._surfaces) == 5


def test_pseudo_points_of_the_last_level_are_kept_and_lie_on_the_surface(corner, sphere):
    prepared = prepare(corner)
    planes = prepared.pseudo_planes(10)
    assert prepared.pseudo_planes(10) is planes
    assert prepared.pseudo_planes(15) is not planes
    assert 1000 < len(planes.mean) <= 2 * 5000
    assert cKDTree(corner).query(planes.mean)[0].max() < 0.1
    exact = prepare(sphere).pseudo_planes(10)
    assert np.allclose(np.linalg.norm(exact.mean - sphere.centre, axis=1), sphere.radius)
    assert not exact.thickness.any()


def test_a_copy_is_known_in_any_pose_order_and_precision(corner, any_motion, rng):
    T = any_motion(rng, 1e3)
    copy = rng.permutation(corner @ T[:3, :3].T + T[:3, 3])
    assert prepare(corner).is_copy_of(prepare(copy))
    assert prepare(copy).is_copy_of(prepare(corner))
    assert prepare(1000 * corner).is_copy_of(prepare(1000 * corner[::-1]))
    assert prepare(corner).is_copy_of(prepare(corner.astype(np.float32)))


def test_what_is_no_copy_is_none(corner, sphere):
    for other in (corner[:-1], 1.001 * corner, np.vstack([corner[:-300], corner[:300]]), sphere):
        assert not prepare(corner).is_copy_of(prepare(other))
        assert not prepare(other).is_copy_of(prepare(corner))
