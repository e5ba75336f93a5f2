"""Deviations of points from surfaces of every kind, against what is known of boxes and spheres."""

import json
import tracemalloc

import numpy as np
import pytest
import trimesh

import fieldalign as fa
from fieldalign import inspection
from fieldalign.fields import CallableField, MeshField
from fieldalign.motions import apply, inverse

BOUNDS = [[-1.5, -1.5, -1.5], [1.5, 1.5, 1.5]]


@pytest.fixture(scope="module")
def box():
    pytest.importorskip("igl")
    mesh = trimesh.creation.box([2, 2, 2])
    return MeshField(mesh.vertices, mesh.faces)


@pytest.fixture(scope="module")
def open_box(box):
    return MeshField(box.vertices, box.faces[1:])


@pytest.fixture
def points(rng):
    return rng.uniform(-1.4, 1.4, (500, 3))


def from_box(points):
    outside = np.abs(points) - 1
    return np.linalg.norm(np.maximum(outside, 0), axis=1) + np.minimum(outside.max(axis=1), 0)


# ------------------------------------------------------------------------------------------------------------ distances


def test_from_a_closed_mesh_it_is_signed(box, points):
    found = fa.deviation(points, box)
    assert found.signed
    assert np.allclose(found.values, from_box(points), atol=1e-12)
    assert np.allclose(np.linalg.norm(points - found.feet, axis=1), np.abs(found.values))
    assert np.allclose(np.abs(found.feet).max(axis=1), 1)
    assert len(found) == 500


def test_from_an_open_mesh_it_has_no_sign_and_says_so(open_box, points):
    found = fa.deviation(points, open_box)
    assert not found.signed
    assert (found.values >= 0).all()
    assert "without a side" in str(found)
    assert "negative inside" in str(fa.deviation(points, CallableField(from_box, BOUNDS)))


def test_from_points_it_is_the_distance_to_the_nearest(points, rng):
    reference = rng.normal(size=(300, 3))
    found = fa.deviation(points, reference)
    apart = np.linalg.norm(points[:, None] - reference, axis=2)
    assert not found.signed
    assert np.allclose(found.values, apart.min(axis=1))
    assert np.allclose(found.feet, reference[apart.argmin(axis=1)])


def test_from_a_formula_and_a_volume(points):
    assert np.allclose(fa.deviation(points, CallableField(from_box, BOUNDS)).values, from_box(points))
    grid = np.stack(np.meshgrid(*[np.linspace(-1.5, 1.5, 61)] * 3, indexing="ij"), axis=-1)
    distances = np.linalg.norm(grid, axis=-1) - 1
    volume = pytest.importorskip("fieldalign.fields.volume").VolumeField(distances, [-1.5] * 3, 0.05)
    found = fa.deviation(points, volume)
    assert found.signed
    near = np.abs(np.linalg.norm(points, axis=1) - 1) < 0.3
    assert np.abs(found.values - np.linalg.norm(points, axis=1) + 1)[near].max() < 2e-3


def test_a_prepared_reference_and_files_give_the_same(box, points, tmp_path):
    expected = fa.deviation(points, box).values
    trimesh.Trimesh(box.vertices, box.faces, process=False).export(tmp_path / "part.stl")
    fa.write_cloud(tmp_path / "scan.ply", points)
    for cloud in (points, fa.PointCloud(points), tmp_path / "scan.ply", str(tmp_path / "scan.ply")):
        for reference in (box, fa.prepare(box), tmp_path / "part.stl"):
            assert np.array_equal(fa.deviation(cloud, reference).values, expected)


def test_the_vertices_of_a_mesh_file_are_measured_too(box, tmp_path):
    trimesh.creation.box([2, 2, 3]).export(tmp_path / "other.stl")
    assert np.allclose(fa.deviation(tmp_path / "other.stl", box).values, 0.5)


def test_a_pose_moves_the_points_first(box, points, any_motion, rng):
    T = any_motion(rng, 5.0)
    found = fa.deviation(apply(inverse(T), points), box, T)
    assert np.allclose(found.values, from_box(points), atol=1e-12)
    assert np.allclose(found.feet, fa.deviation(points, box).feet, atol=1e-12)
    assert np.allclose(found.T_reference_cloud, T)


def test_a_registration_and_its_deviations_go_together(any_motion, rng):
    pytest.importorskip("igl")
    ball = trimesh.creation.icosphere(3)
    d = np.asarray(ball.vertices)
    radius = 1 + 0.3 * d[:, 0] + 0.25 * np.sin(3 * d[:, 1] + d[:, 0]) + 0.3 * np.cos(4 * d[:, 2] * d[:, 0])
    part = MeshField(d * radius[:, None] * [1.3, 1, 0.8], ball.faces)
    T = any_motion(rng, 2.0)
    scan = apply(T, part.spread(8000) + 0.01 * rng.normal(size=(8000, 3)))
    result = fa.register(scan, part)
    found = fa.deviation(scan, part, result.T_target_source, tolerance=0.03)
    assert abs(found.statistics.mean) < 1e-3
    assert found.statistics.standard_deviation == pytest.approx(0.01, rel=0.05)
    assert found.statistics.within == pytest.approx(0.9973, abs=0.003)


@pytest.mark.parametrize(("factor", "shift"), [(1000.0, 0.0), (1.0, 5e6)], ids=["millimetres", "utm"])
def test_the_unit_and_the_offset_do_not_matter(box, points, factor, shift):
    far = np.array([shift, 0.1 * shift, 0])
    found = fa.deviation(factor * points + far, MeshField(factor * box.vertices + far, box.faces))
    assert np.abs(found.values / factor - from_box(points)).max() < 2e-9


def test_missing_returns_stay_in_their_rows(box, points):
    gaps = points.copy()
    gaps[[3, 40]] = np.nan
    gaps[70, 1] = np.nan
    found, whole = fa.deviation(gaps, box, tolerance=0.5), fa.deviation(points, box)
    missing = np.isin(np.arange(500), [3, 40, 70])
    assert np.array_equal(np.isnan(found.values), missing)
    assert np.isnan(found.feet[missing]).all()
    assert np.array_equal(found.values[~missing], whole.values[~missing])
    assert (found.statistics.count, found.statistics.missing) == (497, 3)
    assert "3 missing returns (NaN) left out" in str(found)


def test_pieces_do_not_show(box, points, monkeypatch):
    gaps = np.r_[np.full((30, 3), np.nan), points]
    whole = fa.deviation(gaps, box)
    monkeypatch.setattr(inspection, "_PIECE", 7)
    pieces = fa.deviation(gaps, box)
    assert np.array_equal(pieces.values, whole.values, equal_nan=True)
    assert np.array_equal(pieces.feet, whole.feet, equal_nan=True)
    assert np.array_equal(pieces.colored(gaps).colors, whole.colored(gaps).colors)


def test_many_points_take_little_more_than_what_is_answered(box):
    many = np.random.default_rng(0).uniform(-1, 1, (300_000, 3)).astype(np.float32)
    fa.deviation(many[:1000], box)
    tracemalloc.start()
    found = fa.deviation(many, box)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1.1 * (found.values.nbytes + found.feet.nbytes) + 40e6


# ----------------------------------------------------------------------------------------------------------- statistics


def test_the_statistics_are_what_they_are_called(box, points):
    found, d = fa.deviation(points, box, tolerance=0.25), from_box(points)
    s = found.statistics
    assert (s.count, s.missing) == (500, 0)
    assert s.mean == pytest.approx(d.mean())
    assert s.standard_deviation == pytest.approx(d.std())
    assert s.root_mean_square == pytest.approx(np.sqrt((d**2).mean()))
    assert s.median == pytest.approx(np.median(d))
    assert s.percentile_95 == pytest.approx(np.percentile(np.abs(d), 95))
    assert (s.minimum, s.maximum) == pytest.approx((d.min(), d.max()))
    assert s.within == np.mean(np.abs(d) <= 0.25)


def test_without_a_tolerance_no_share_is_told(box, points):
    assert fa.deviation(points, box).statistics.within is None
    assert "tolerance" not in str(fa.deviation(points, box))


def test_a_share_is_not_rounded_to_all(box):
    places = np.tile([[1.0, 0.5, 0.5]], (50_000, 1))
    places[7] = [1.3, 0, 0]
    assert "99.99 % within the tolerance of 0.2" in str(fa.deviation(places, box, tolerance=0.2))
    assert "100 % within the tolerance of 0.4" in str(fa.deviation(places, box, tolerance=0.4))


def test_it_is_shown_in_one_line(box, points):
    shown = repr(fa.deviation(points, box, tolerance=0.25))
    assert "500 points" in shown
    assert "\n" not in shown


def test_what_is_written_is_json(box, points):
    found = fa.deviation(points, box, np.eye(4), tolerance=0.25)
    read = json.loads(json.dumps(found.to_dict()))
    assert read["signed"] is True
    assert read["tolerance"] == 0.25
    assert read["T_reference_cloud"] == np.eye(4).tolist()
    assert read["statistics"]["root_mean_square"] == found.statistics.root_mean_square
    assert json.loads(json.dumps(fa.deviation(points, box).to_dict()))["statistics"]["within"] is None


# -------------------------------------------------------------------------------------------------------------- colours

ALONG = np.array([[0.5, 0, 0], [0.9, 0, 0], [1.0, 0, 0], [1.1, 0, 0], [1.5, 0, 0], [np.nan, 0, 0]])


def test_inside_is_blue_and_outside_red(box):
    found = fa.deviation(ALONG, box)
    colored = found.colored(ALONG, limit=0.2)
    inside, pale_inside, on, pale_outside, outside, missing = colored.colors.astype(int)
    assert inside[2] > inside[0] + 100
    assert outside[0] > outside[2] + 100
    assert np.ptp(on) == np.ptp(missing) == 0
    assert on[0] > missing[0]
    assert np.array_equal(pale_inside, np.rint((on + inside) / 2))
    assert np.array_equal(pale_outside, np.rint((on + outside) / 2))
    assert np.array_equal(colored.attributes["deviation"], found.values, equal_nan=True)


def test_the_limit_is_the_tolerance_or_what_most_keep_to(box, points):
    by_tolerance = fa.deviation(points, box, tolerance=0.1)
    assert np.array_equal(by_tolerance.colored(points).colors, by_tolerance.colored(points, 0.1).colors)
    plain = fa.deviation(points, box)
    assert np.array_equal(plain.colored(points).colors, plain.colored(points, plain.statistics.percentile_95).colors)


def test_all_else_of_the_cloud_is_kept(box, points):
    cloud = fa.PointCloud(points, intensity=np.arange(500), attributes={"beam": np.ones(500)}, viewpoint=np.eye(4))
    colored = fa.deviation(cloud, box).colored(cloud)
    assert np.array_equal(colored.points, points)
    assert np.array_equal(colored.intensity, cloud.intensity)
    assert set(colored.attributes) == {"beam", "deviation"}
    assert colored.viewpoint is not None
    assert set(cloud.attributes) == {"beam"}


def test_where_all_is_zero_all_is_pale(box):
    found = fa.deviation(ALONG[2:3], box)
    assert np.ptp(found.colored(ALONG[2:3]).colors) == 0


# --------------------------------------------------------------------------------------------------------------- errors


@pytest.mark.parametrize(
    ("cloud", "words"),
    [
        (np.zeros((3, 2)), r"cloud must have shape \(N, 3\)"),
        ([["a"]], "cloud must be"),
        (np.zeros((0, 3)), "must have points, but none of its 0 rows is one"),
        (np.full((4, 3), np.nan), "none of its 4 rows"),
        (np.array([[0, 0, 0], [np.inf, 0, 0]]), "row 1 is"),
        (None, "cloud must be"),
    ],
)
def test_what_is_no_cloud_is_refused(box, cloud, words):
    with pytest.raises(fa.ArgumentError, match=words):
        fa.deviation(cloud, box)


def test_a_field_is_no_cloud(box):
    with pytest.raises(fa.ArgumentError, match="cloud must be"):
        fa.deviation(box, box)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"tolerance": 0}, "tolerance must be a positive number"),
        ({"tolerance": np.nan}, "tolerance must be a positive number"),
        ({"T_reference_cloud": 2 * np.eye(4)}, "T_reference_cloud must"),
        ({"T_reference_cloud": np.eye(3)}, "T_reference_cloud must be"),
        ({"reference": np.eye(9)[:, :2]}, "reference must be a surface or points in space"),
        ({"reference": np.zeros((9, 4))}, r"reference must have shape \(N, 3\)"),
        ({"reference": np.zeros((9, 3))}, "reference must hold at least 3 distinct points"),
        ({"reference": "nowhere.stl"}, "nowhere.stl does not exist"),
        ({"cloud": "nowhere.ply"}, "nowhere.ply does not exist"),
    ],
)
def test_other_arguments_are_named(box, points, arguments, words):
    with pytest.raises(fa.ArgumentError, match=words):
        fa.deviation(**{"cloud": points, "reference": box} | arguments)


def test_colours_need_the_same_points(box, points):
    found = fa.deviation(points, box)
    with pytest.raises(fa.ArgumentError, match="must have the 500 points of these deviations, but has 499"):
        found.colored(points[1:])
    with pytest.raises(fa.ArgumentError, match="limit must be a positive number"):
        found.colored(points, limit=0)
