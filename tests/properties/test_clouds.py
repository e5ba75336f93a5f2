"""Whatever is handed in for clouds and poses: an answer of the right shape, or one of fieldalign's own exceptions."""

import warnings

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given
from strategies import clouds, examples, is_pose, motions, numbers, of_wrong_kind, points, poses, refusing, right_points

import fieldalign as fa

pytestmark = pytest.mark.filterwarnings("ignore:.*is float32 with coordinates:UserWarning")

PER_POINT = ("normals", "times", "intensity", "colors")
anything = st.one_of(clouds(), numbers())


def check_result(result, size):
    """A result holds what its documentation says, and a pose that may be used only where it was found."""
    assert is_pose(result.T_target_source, size)
    assert isinstance(result.reason, fa.Reason)
    assert result.accepted == (result.reason is fa.Reason.ACCEPTED)
    assert 0 <= result.overlap <= 1
    assert 0 <= result.overlap_target <= 1
    assert np.isfinite(result.information).all()
    assert np.isfinite(result.covariance).all()
    assert isinstance(str(result), str)
    result.to_dict()


@examples(150)
@given(
    clouds(),
    st.dictionaries(st.sampled_from((*PER_POINT, "viewpoint")), anything),
    st.dictionaries(st.text(), anything),
)
def test_point_cloud(cloud, parts, attributes):
    with refusing():
        made = fa.PointCloud(cloud, attributes=attributes, **parts)
        assert made.points.shape == (len(made), 3)
        assert made.points.dtype in (np.float32, np.float64)
        assert len(made[::2]) == -(-len(made) // 2)
        assert len(made[np.zeros(len(made), bool)]) == 0


@examples(60)
@given(st.one_of(right_points(), points()), poses())
def test_moved_cloud(cloud, T):
    with refusing():
        assert fa.PointCloud(cloud, viewpoint=np.eye(4)).transformed(T).points.shape == cloud.shape


@examples(100)
@given(clouds(), numbers(), st.sampled_from((None, 1, 2)))
def test_thin(cloud, voxel, threads):
    with refusing():
        thinned = fa.thin(cloud, voxel, threads=threads)
        assert len(thinned) <= len(cloud)
        assert np.isfinite(thinned.points).all()


@examples(150)
@given(clouds())
def test_prepare(cloud):
    with refusing():
        prepared = fa.prepare(cloud)
        assert np.isfinite(np.asarray(prepared.points if hasattr(prepared, "points") else prepared.field.points)).all()


@examples(60)
@given(clouds(), st.one_of(clouds(), right_points((10, 40))))
def test_register(source, target):
    with refusing():
        result = fa.register(source, target)
        check_result(result, 3 if np.shape(target)[1] == 2 else 4)
        assert not (result.accepted and min(len(source), len(target)) < 4)


@examples(50)
@given(right_points((3, 10, 40, 150)), right_points((3, 10, 40, 150)), st.booleans())
def test_register_right_points_of_any_shape(source, target, scale):
    """Of two clouds that have nothing in common but their scale, none is accepted by chance; none crashes."""
    with refusing():
        check = fa.register(source, target, scale=scale)
        assert check.T_target_source.shape == (4, 4)
        assert np.isfinite(check.T_target_source).all()


BOX = np.random.default_rng(0).random((40, 3))
KEYWORDS = {
    "init": poses(),
    "search": st.one_of(st.sampled_from((None, True, False)), numbers()),
    "search_radius": numbers(),
    "search_angle": numbers(),
    "method": st.sampled_from(("robust", "paper", "other", None, 3)),
    "settings": st.one_of(st.sampled_from((None, "object", "nothing", fa.Settings())), numbers()),
    "seed": numbers(),
    "threads": numbers(),
    "dof": st.one_of(st.sampled_from((None, "yaw", "planar", "x y", "w", (), ("rz",), [1], fa.Dof("z"))), numbers()),
    "scale": st.one_of(st.booleans(), numbers()),
}


@examples(120)
@given(st.fixed_dictionaries({}, optional=KEYWORDS))
def test_keywords_of_register(keywords):
    with refusing(TypeError if "nothing" in keywords else fa.FieldalignError):
        result = fa.register(BOX, BOX @ np.diag([-1.0, -1.0, 1.0]), **keywords)
        assert np.isfinite(result.T_target_source).all()
        assert result.T_target_source.shape == (4, 4)


@examples(40)
@given(right_points((3, 10, 40)), st.one_of(right_points((3, 10, 40)), clouds()), poses(), st.booleans())
def test_verify(source, target, T, search):
    with refusing():
        result = fa.verify(source, target, T, search=search)
        check_result(result, len(T))
        assert not result.accepted or len(source) > 3


@examples(120)
@given(clouds(), st.one_of(right_points(), clouds()), poses(), st.one_of(st.none(), numbers()))
def test_deviation(cloud, reference, T, tolerance):
    with refusing():
        found = fa.deviation(cloud, reference, T, tolerance=tolerance)
        assert found.values.shape == (len(cloud),)
        assert found.feet.shape == (len(cloud), 3)
        assert isinstance(str(found), str)
        assert len(found.colored(cloud)) == len(cloud)


@examples(30)
@given(
    st.lists(
        st.one_of(st.tuples(right_points((3, 10)), clouds()), st.tuples(clouds(), clouds(), poses()), of_wrong_kind()),
        max_size=3,
    )
)
def test_register_many(pairs):
    with refusing():
        for found, pair in zip(fa.register_many(pairs), pairs, strict=True):
            assert len(pair) in (2, 3)
            assert found.accepted == (found.reason is fa.Reason.ACCEPTED)
            assert (found.error is not None) == (found.reason is fa.Reason.FAILED)
            assert found.error is None or np.isnan(found.T_target_source).all()


@examples(10)
@given(
    st.lists(st.one_of(right_points((10, 40)), clouds()), max_size=3),
    st.one_of(st.none(), st.lists(poses(), max_size=3)),
)
def test_assemble(given_clouds, given_poses):
    with refusing():
        found = fa.assemble(given_clouds, poses=given_poses)
        assert len(found.poses) == len(given_clouds)
        assert all(T is None or is_pose(T) for T in found.poses)


@examples(100)
@given(
    st.one_of(st.text(), st.lists(st.text()), numbers(), st.sampled_from(("rz", "x, y", ["rx", "z"]))),
    st.one_of(st.none(), poses(), numbers()),
    st.one_of(st.none(), st.just([0, 0, 1]), numbers(), clouds()),
)
def test_dof(free, axis, centre):
    with refusing():
        assert set(fa.Dof(free, axis, centre).free) <= {"rx", "ry", "rz", "x", "y", "z"}


@examples(150)
@given(st.dictionaries(st.sampled_from([*fa.Settings.__dataclass_fields__]), st.one_of(numbers(), clouds())))
def test_settings(fields):
    with refusing():
        assert fa.Settings(**fields).scaled(2.0).half_width > 0


@examples(60)
@given(st.sampled_from(("voxel", "pseudo_points", "points")), numbers())
def test_odometry_settings(name, value):
    with refusing():
        assert isinstance(fa.OdometrySettings(**{name: value}), fa.OdometrySettings)


@pytest.mark.slow
def test_ten_million_points():
    """Answered, not refused: thinned at once, and registered on itself, moved."""
    rng = np.random.default_rng(0)
    room = rng.random((10_000_000, 3), np.float32)
    room[np.arange(len(room)), rng.integers(0, 3, len(room))] = 0
    room[::7] *= [0.5, 0.3, 0.8]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len(fa.thin(room, 0.05)) < 10_000


@examples(20)
@given(motions(), right_points((10,)))
def test_poses_come_back_as_they_went(T, cloud):
    moved = fa.PointCloud(cloud).transformed(T)
    assert np.allclose(
        moved.transformed(np.linalg.inv(T)).points, cloud, atol=1e-6 * (1 + np.abs(cloud).max() + np.abs(T).max())
    )
