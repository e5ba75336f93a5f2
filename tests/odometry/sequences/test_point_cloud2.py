"""PointCloud2: the layouts and the clocks of the common sensors, and messages that lie."""

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.odometry.sequences.point_cloud2 import cloud_of
from fieldalign.odometry.sequences.point_times import seconds_of, with_seconds

STAMP = 1_700_000_000.25

XYZ = {"x": (0, "f4"), "y": (4, "f4"), "z": (8, "f4")}
# What the drivers write, with the padding that they leave: layout, bytes a point, and (name, values) of the times.
SENSORS = {
    "velodyne": (XYZ | {"intensity": (12, "f4"), "ring": (16, "u2"), "time": (18, "f4")}, 22, lambda t: t),
    "velodyne, before the stamp": (XYZ | {"intensity": (12, "f4"), "time": (18, "f4")}, 22, lambda t: t - 0.1),
    "ouster": (
        XYZ | {"intensity": (16, "f4"), "t": (20, "u4"), "reflectivity": (24, "u2"), "ring": (26, "u2")},
        48,
        lambda t: t * 1e9,
    ),
    "livox": (XYZ | {"intensity": (12, "f4"), "timestamp": (18, "f8")}, 26, lambda t: np.rint((STAMP + t) * 1e9)),
    "livox, from the stamp": (XYZ | {"offset_time": (12, "u4")}, 18, lambda t: t * 1e9),
    "hesai": (XYZ | {"intensity": (16, "f4"), "timestamp": (24, "f8"), "ring": (32, "u2")}, 48, lambda t: STAMP + t),
    "robosense": (XYZ | {"intensity": (16, "u1"), "timestamp": (20, "f8")}, 32, lambda t: STAMP + t),
}


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("sensor", SENSORS)
def test_common_sensors_are_understood(scan, message_of, sensor, order):
    layout, point_step, times = SENSORS[sensor]
    named = next(name for name in ("time", "t", "timestamp", "offset_time") if name in layout)
    columns = scan | {named: times(scan["after"]), "reflectivity": scan["ring"]}
    cloud = cloud_of(message_of(columns, layout, point_step, order), STAMP)
    expected = np.stack([scan[name] for name in "xyz"], axis=1).astype(np.float32)
    assert cloud.points.dtype == np.float32
    assert cloud.points.dtype.isnative
    assert np.array_equal(cloud.points, expected)
    first = -0.1 if "before" in sensor else 0.0
    np.testing.assert_allclose(cloud.times, STAMP + first + scan["after"], rtol=0, atol=1e-6)
    if "intensity" in layout:
        assert np.array_equal(cloud.intensity, scan["intensity"])
    if "ring" in layout:
        assert np.array_equal(cloud.attributes["ring"], scan["ring"])
        assert cloud.attributes["ring"].dtype.isnative
    assert named not in cloud.attributes


def test_doubles_stay_doubles(scan, message_of):
    cloud = cloud_of(message_of(scan, {"x": (3, "f8"), "y": (11, "f8"), "z": (24, "f8")}, 40), None)
    assert cloud.points.dtype == np.float64
    assert np.array_equal(cloud.points[:, 2], scan["z"])
    assert cloud.times is None


def test_rows_of_an_image_may_be_padded(scan, message_of):
    flat = cloud_of(message_of(scan, XYZ, 16), None)
    image = cloud_of(message_of(scan, XYZ, 16, height=4, row_padding=13), None)
    assert np.array_equal(flat.points, image.points)


def test_a_row_step_of_nothing_is_no_matter_in_one_row(scan, message_of):
    message = message_of(scan, XYZ, 16)
    message.row_step = 0
    assert len(cloud_of(message, None)) == 24


def test_missing_returns_are_nan(scan, message_of):
    for name in "xyz":
        scan[name][[3, 7]] = 0
        scan[name][5] = np.nan
    scan["x"][9] = 0
    missing = np.isnan(cloud_of(message_of(scan, XYZ, 12), None).points).any(axis=1)
    assert np.flatnonzero(missing).tolist() == [3, 5, 7]


def test_an_empty_message_is_an_empty_cloud(message_of):
    nothing = {name: np.empty(0) for name in "xyz"}
    message = message_of(nothing, XYZ, 16)
    assert len(cloud_of(message, STAMP)) == 0
    message.height = message.width = 0
    assert len(cloud_of(message, STAMP)) == 0


def broken(message, **changes):
    for name, value in changes.items():
        setattr(message, name, value)
    return message


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"width": 25}, "promises 25 points, at least 400 bytes, but holds only 384"),
        ({"width": 2**32 - 1}, "promises 4294967295 points"),
        ({"data": np.empty(0, np.uint8)}, "promises 24 points"),
        ({"point_step": 6}, "fields that do not fit into its 6 bytes"),
        ({"fields": []}, "has no columns x, y, z"),
        ({"fields": [], "point_step": 0, "width": 2**32 - 1, "height": 2**32 - 1}, "promises 184467440651196"),
        ({"height": 2, "width": 12, "row_step": 100}, "has rows of 100 bytes, but 12 points of 16"),
    ],
)
def test_messages_that_lie_are_refused(scan, message_of, changes, words):
    with pytest.raises(fa.CloudFileError, match=words):
        cloud_of(broken(message_of(scan, XYZ, 16), **changes), None)


def test_a_field_of_an_unknown_type_is_refused(scan, message_of):
    message = message_of(scan, XYZ, 16)
    message.fields[1].datatype = 99
    with pytest.raises(fa.CloudFileError, match="field 'y' of type 99"):
        cloud_of(message, None)


# ---------------------------------------------------------------------------------------------------------------- times


@pytest.mark.parametrize("stamp", [0.0, 0.1, 3.2, STAMP])
@pytest.mark.parametrize("begins", [0.0, -0.05, -0.1])
def test_times_are_on_the_stamps_clock(stamp, begins):
    after = np.linspace(begins, begins + 0.1, 50)
    np.testing.assert_allclose(seconds_of(after, stamp), stamp + after, rtol=0, atol=1e-6)
    if stamp not in (0.0, 0.1):  # of a sweep that begins about 0, the two clocks can be confused
        np.testing.assert_allclose(seconds_of(stamp + after, stamp), stamp + after, rtol=0, atol=1e-6)


def test_absolute_times_of_a_clock_that_begins_with_the_drive():
    for k in range(5):
        times = 0.1 * k + np.linspace(0, 0.09, 50)
        np.testing.assert_allclose(seconds_of(times, 0.1 * k), times, atol=1e-12)


def test_a_clock_of_its_own_begins_with_the_stamp():
    times = np.linspace(523.4, 523.5, 50)
    np.testing.assert_allclose(seconds_of(times, STAMP), STAMP + times - 523.4, rtol=0, atol=1e-6)
    nanoseconds = (times * 1e9).astype(np.uint64)
    np.testing.assert_allclose(seconds_of(nanoseconds, STAMP), STAMP + times - 523.4, rtol=0, atol=1e-6)
    np.testing.assert_allclose(seconds_of(times, None), times)


def test_whole_nanoseconds_lose_nothing():
    times = np.array([1_700_000_000_123_456_789, 1_700_000_000_123_456_790], np.uint64)
    first, last = seconds_of(times, 1_700_000_000.2) - 1_700_000_000.0
    assert first == pytest.approx(0.123456789, abs=3e-7)  # as near as float64 comes there
    assert last >= first


def test_times_that_are_all_the_same_are_none():
    assert seconds_of(np.zeros(5, np.float32), 1.0) is None
    assert seconds_of(np.full(5, np.nan), 1.0) is None
    assert seconds_of(np.empty(0), 1.0) is None


def test_a_time_that_is_missing_is_the_first_one():
    assert seconds_of(np.array([np.nan, 0.25, 0.5]), 8.0).tolist() == [8.25, 8.25, 8.5]


def test_times_of_a_file_are_taken_from_wherever_they_are():
    points, after = np.zeros((3, 3)), np.array([0, 1e7, 2e7])
    for cloud in (
        fa.PointCloud(points, times=after),
        fa.PointCloud(points, attributes={"timestamp": after, "ring": np.arange(3)}),
    ):
        found = with_seconds(cloud, 5.0)
        np.testing.assert_allclose(found.times, [5, 5.01, 5.02])
        assert "timestamp" not in found.attributes
    plain = fa.PointCloud(points, attributes={"ring": np.arange(3)})
    assert with_seconds(plain, 5.0) is plain
