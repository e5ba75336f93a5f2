"""Whatever is handed in for scans of a drive and for trajectories: an answer, or one of fieldalign's own exceptions."""

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given
from strategies import clouds, examples, is_pose, motions, numbers, of_wrong_kind, points, poses, refusing, right_points

import fieldalign as fa
from fieldalign.odometry.line_file import LineFile

pytestmark = pytest.mark.filterwarnings("ignore:.*is float32 with coordinates:UserWarning")


@st.composite
def trajectories(draw):
    """A right trajectory of a few poses."""
    listed = draw(st.lists(motions(), min_size=1, max_size=6))
    times = draw(st.sampled_from((np.arange(len(listed)) * 0.1, np.zeros(len(listed)), -np.arange(len(listed)) * 1e9)))
    return fa.Trajectory(times, np.array(listed))


@examples(120)
@given(
    st.one_of(clouds(), numbers(), st.lists(numbers(), max_size=3)),
    st.one_of(st.lists(poses(), max_size=3), clouds()),
    st.one_of(st.none(), clouds()),
)
def test_trajectory(times, given_poses, covariances):
    with refusing():
        made = fa.Trajectory(times, given_poses, covariances)
        assert made.poses.shape == (len(made), 4, 4)
        assert len(made.distances) == len(made)


@examples(100)
@given(
    trajectories(),
    trajectories(),
    st.fixed_dictionaries(
        {},
        optional={
            "max_difference": st.one_of(st.none(), numbers()),
            "alignment": st.one_of(st.sampled_from(("positions", "origin", "none")), numbers()),
            "delta": numbers(),
            "unit": st.one_of(st.sampled_from(("frames", "metres")), numbers()),
            "all_pairs": st.one_of(st.booleans(), numbers()),
        },
    ),
)
def test_evaluate(trajectory, truth, keywords):
    with refusing():
        found = fa.evaluate(trajectory, truth, **keywords)
        assert len(found.truth) == len(found.absolute.translation)
        assert np.isfinite(found.absolute.translation).all()
        assert isinstance(str(found), str)
        found.to_dict()


@examples(40)
@given(trajectories(), st.one_of(st.sampled_from(("tum", "kitti")), numbers()))
def test_trajectory_files(tmp_path_factory, trajectory, format_):
    path = tmp_path_factory.getbasetemp() / "trajectory.txt"
    with refusing():
        fa.write_trajectory(path, trajectory, format_)
        assert np.allclose(fa.read_trajectory(path).poses, trajectory.poses, rtol=1e-12, atol=1e-12)


scans = st.one_of(st.none(), right_points((0, 10, 150)), points(), clouds())


@examples(40)
@given(
    st.lists(
        st.tuples(scans, st.one_of(st.none(), st.none(), clouds(), numbers()), st.one_of(st.none(), numbers())),
        min_size=1,
        max_size=5,
    ),
    st.booleans(),
)
def test_odometry(steps, whole):
    odometry = fa.Odometry(whole=whole)
    for cloud, times, stamp in steps:
        with refusing():
            assert is_pose(odometry.step(cloud, times, stamp))
            assert isinstance(odometry.last.reason, fa.Tracking)
    assert len(odometry.trajectory) == len(odometry.results)
    assert odometry.map.points.shape[1] == 3
    with refusing():
        assert len(fa.close_loops(odometry).trajectory) == len(odometry.trajectory)


@examples(30)
@given(
    st.one_of(right_points((150,)), clouds()),
    st.lists(st.tuples(scans, st.one_of(st.none(), clouds())), max_size=2),
    numbers(),
)
def test_localizer(surroundings, steps, seed):
    with refusing():
        localizer = fa.Localizer(surroundings, seed=seed)
        for cloud, times in steps:
            with refusing():
                pose = localizer.step(cloud, times)
                assert pose is None or is_pose(pose)


@examples(20)
@given(of_wrong_kind())
def test_close_loops_of_what_is_no_drive(drive):
    with refusing():
        fa.close_loops(drive)


def test_a_line_file_refuses_a_folder(tmp_path):
    with refusing():
        LineFile(tmp_path)
