"""Checks of plain arguments: what is no number, no array or too large is told by a sentence."""

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.arguments import as_array, as_numbers, as_vector, check_positive, is_number
from fieldalign.odometry.trajectory_files import TrajectoryWriter

HUGE = 10**400  # no float64


@pytest.mark.parametrize("value", [HUGE, -HUGE, True, None, "1", 1j, np.complex128(1), np.array(1.0), [1.0]])
def test_what_is_no_number(value):
    assert not is_number(value)
    with pytest.raises(fa.ArgumentError, match=r"^length must be a positive number, but is "):
        check_positive("length", value)


@pytest.mark.parametrize("value", [1, 2.5, np.float32(1), np.int8(3), 10**300])
def test_what_is_one(value):
    assert is_number(value)
    check_positive("length", value)


@pytest.mark.parametrize(
    "value", [[HUGE, 1, 2], [1j, 1, 2], "abc", [[1, 2], [3]], object(), np.array(["2020-01-01"], "M8[D]"), lambda: 1]
)
def test_what_is_no_array_of_numbers(value):
    with pytest.raises(fa.FieldError, match=r"^axis must be three numbers, but "):
        as_numbers(value, "axis", "three numbers", fa.FieldError)
    with pytest.raises(fa.ArgumentError, match=r"^axis must be three numbers, but "):
        as_vector(value, "axis")


def test_extended_precision_that_float64_has_no_room_for_is_infinite():
    assert np.isinf(as_numbers(np.full(3, np.longdouble("1e4000")), "x")).all()


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.int32])
def test_masked_numbers_are_missing(dtype):
    given = np.ma.masked_array(np.arange(12).reshape(4, 3).astype(dtype), mask=np.arange(12).reshape(4, 3) == 4)
    array = as_array(given, "points", "numbers")
    assert np.argwhere(np.isnan(array)).tolist() == [[1, 1]]
    assert array.dtype == (np.float64 if dtype == np.int32 else dtype)
    assert fa.prepare(given).dropped == 1
    assert fa.prepare(given[:, :2]).dropped == 1


@pytest.mark.parametrize(
    "T", [np.eye(4) * 1j, np.eye(4) * 1e300, [[HUGE] * 4] * 4, np.diag([1, 1, 1, 1e16]), np.diag([1e-310, 1, 1, 1])]
)
def test_poses_that_are_none(T):
    for name, call in (
        ("T_target_source", lambda: fa.verify(np.eye(3), np.eye(3), T)),
        ("T", lambda: fa.PointCloud(np.eye(3)).transformed(T)),
    ):
        with pytest.raises(fa.ArgumentError, match=rf"^{name} must "):
            call()


@pytest.mark.parametrize("free", [np.array(1.0), 3, None, [1], [["rz"]]])
def test_freedoms_that_are_none(free):
    with pytest.raises(fa.ArgumentError, match=r"^dof must name freedoms"):
        fa.Dof(free)


@pytest.mark.parametrize("name", ["pseudo_count", "irls_steps", "max_iterations", "share_limit", "min_kept"])
def test_counts_that_would_take_all_memory_or_time(name):
    with pytest.raises(fa.ArgumentError, match=rf"^{name} must be an integer from"):
        fa.Settings(**{name: 10**12})


def test_more_threads_than_anyone_has():
    assert len(fa.thin(np.eye(3), 0.1, threads=10**30)) == 3


@pytest.mark.parametrize("stamp", [np.nan, np.inf, "now", HUGE, True])
def test_a_stamp_that_is_no_moment(stamp):
    with pytest.raises(fa.ArgumentError, match=r"^stamp must be a finite number of seconds"):
        fa.Odometry().step(np.eye(3), stamp=stamp)


@pytest.mark.parametrize("seconds", [-1, np.nan, "1", HUGE, object])
def test_a_difference_of_times_that_is_none(seconds):
    drive = fa.Trajectory(np.arange(3.0), np.tile(np.eye(4), (3, 1, 1)))
    with pytest.raises(fa.ArgumentError, match=r"^max_difference must be seconds"):
        fa.evaluate(drive, drive, max_difference=seconds)


def test_paths_that_can_be_none(tmp_path):
    path = f"{tmp_path}/a\0b.txt"
    drive = fa.Trajectory(np.arange(3.0), np.tile(np.eye(4), (3, 1, 1)))
    for call in (
        lambda: fa.read_trajectory(path),
        lambda: fa.write_trajectory(path, drive),
        lambda: fa.read_cloud(path),
        lambda: fa.write_cloud(path, np.eye(3)),
        lambda: fa.read_sequence(path),
        lambda: fa.register(path, path),
        lambda: fa.register_many([(np.eye(3), np.eye(3))], run_folder=path),
        lambda: TrajectoryWriter(path),
    ):
        with pytest.raises(fa.FieldalignError, match=r"a\0b"):
            call()


def test_more_frames_than_any_drive_has():
    drive = fa.Trajectory(np.arange(3.0), np.tile(np.eye(4), (3, 1, 1)))
    for delta in (2**63, HUGE):
        with pytest.raises(fa.ArgumentError, match=r"^delta must be an integer from 1 to"):
            fa.evaluate(drive, drive, delta=delta)


def test_deviations_of_what_float64_does_not_resolve():
    with pytest.raises(fa.ArgumentError, match=r"^cloud must have coordinates below"):
        fa.deviation(np.full((4, 3), 1e300), np.eye(3))


class Field:
    signed = False

    def __init__(self, bounds, answer):
        self.bounds, self._answer = bounds, answer

    def sample(self, x):
        return self._answer


@pytest.mark.parametrize("bounds", ["none", [[0] * 3], [[1] * 3] * 2, [[0] * 3, [np.inf] * 3], [[0j] * 3] * 2])
def test_bounds_of_a_foreign_field_that_are_none(bounds):
    with pytest.raises(fa.FieldError, match=r"bounds"):
        fa.register(np.eye(3), Field(bounds, None))


def test_answers_of_a_foreign_field_that_are_none():
    with pytest.raises(fa.FieldError, match=r"^an answer of Field.sample must be"):
        fa.register(np.eye(3), Field([[0] * 3, [1] * 3], ("a", "b", "c", "d")))


@pytest.mark.parametrize("x", [np.full((1, 3), np.nan), np.full((1, 3), 1e200), np.zeros((2, 2)), "places"])
def test_places_that_are_none(x):
    sphere = fa.fields.CallableField(lambda x: np.linalg.norm(x, axis=1) - 1, [[-2] * 3, [2] * 3])
    for field in (fa.fields.PointField(np.eye(3)), sphere):
        with pytest.raises(fa.ArgumentError, match=r"^(x|a field) must "):
            field.sample(x)
