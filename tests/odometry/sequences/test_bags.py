"""Bags of both versions: written with rosbags, read back, and what is left of broken ones."""

import sys

import numpy as np
import pytest

import fieldalign as fa
from fieldalign.odometry.sequences import read_sequence
from fieldalign.odometry.sequences.sequence import ahead

pytest.importorskip("rosbags")

from rosbags import rosbag1, rosbag2
from rosbags.typesys import Stores, get_typestore

LAYOUT = {
    "x": (0, "f4"), "y": (4, "f4"), "z": (8, "f4"), "intensity": (12, "f4"), "ring": (16, "u2"), "time": (18, "f4"),
}
TYPE = "sensor_msgs/msg/PointCloud2"
START = 1_700_000_000_500_000_000  # ns
KINDS = ("bag", "sqlite3", "mcap")


def message(store, plain, number, stamp):
    """A message of rosbags' own class; stamp in ns."""
    types = store.types
    time = types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
    header = {"stamp": time, "frame_id": "lidar"}
    if store.fielddefs["std_msgs/msg/Header"][1][0][0] == "seq":  # of ROS 1
        header["seq"] = number
    fields = [types["sensor_msgs/msg/PointField"](f.name, f.offset, f.datatype, f.count) for f in plain.fields]
    return types[TYPE](
        header=types["std_msgs/msg/Header"](**header), height=plain.height, width=plain.width, fields=fields,
        is_bigendian=plain.is_bigendian, point_step=plain.point_step, row_step=plain.row_step, data=plain.data,
        is_dense=plain.is_dense,
    )


@pytest.fixture
def write_bag(tmp_path, message_of, rng):
    """Writes a bag of some kind: frames on each topic, half as many other messages; the i-th frame's first x is i."""

    def write(kind, topics=("/points",), frames=6, spoil=None, name="drive", stamped=True, first=0):
        store = get_typestore(Stores.ROS1_NOETIC if kind == "bag" else Stores.ROS2_HUMBLE)
        path = tmp_path / (f"{name}.bag" if kind == "bag" else name)
        plugin = getattr(rosbag2.StoragePlugin, kind.upper(), None)
        writer = rosbag1.Writer(path) if kind == "bag" else rosbag2.Writer(path, version=9, storage_plugin=plugin)
        serialize = store.serialize_ros1 if kind == "bag" else store.serialize_cdr
        text, text_type = store.types["std_msgs/msg/String"], "std_msgs/msg/String"
        with writer:
            talk = writer.add_connection("/chatter", text_type, typestore=store)
            connections = [writer.add_connection(topic, TYPE, typestore=store) for topic in topics]
            for k in range(first, first + frames):
                recorded = START + k * 100_000_000
                for connection in connections:
                    columns = {axis: rng.normal(size=50) + 1 for axis in "xyz"}
                    columns["x"][0] = k
                    columns |= {"intensity": np.arange(50), "ring": np.arange(50) % 16, "time": np.linspace(0, 0.1, 50)}
                    plain = message_of(columns, LAYOUT, 22)
                    made = message(store, plain, k, recorded - 1_000_000 if stamped else 0)
                    data = bytes(serialize(made, TYPE))
                    writer.write(connection, recorded, data if spoil != k else data[: len(data) // 2])
                if k % 2:
                    writer.write(talk, recorded, serialize(text("hello"), text_type))
        return path

    return write


def what_is_left_of(path):
    """Its frames, or the error."""
    try:
        return list(read_sequence(path))
    except fa.CloudFileError as error:
        return str(error)


def numbers(frames):
    return [None if frame.cloud is None else int(frame.cloud.points[0, 0]) for frame in frames]


@pytest.mark.parametrize("kind", KINDS)
def test_the_only_topic_with_clouds_is_read(write_bag, kind):
    sequence = read_sequence(write_bag(kind))
    assert sequence.length == 6
    assert sequence.kind == "a bag, topic /points"
    frames = list(sequence)
    assert numbers(frames) == list(range(6))
    assert numbers(sequence) == list(range(6))  # again
    stamps = (START - 1_000_000) / 1e9 + 0.1 * np.arange(6)
    np.testing.assert_allclose([frame.stamp for frame in frames], stamps, rtol=0, atol=5e-7)
    cloud = frames[3].cloud
    assert cloud.points.dtype == np.float32
    np.testing.assert_allclose(cloud.times, stamps[3] + np.linspace(0, 0.1, 50), rtol=0, atol=1e-6)
    assert cloud.intensity.tolist() == list(range(50))
    assert cloud.attributes["ring"][17] == 1


@pytest.mark.parametrize(("kind", "file"), [("mcap", "drive.mcap"), ("sqlite3", "drive.db3")])
def test_a_single_file_of_a_bag_is_read(write_bag, kind, file):
    path = write_bag(kind)
    assert numbers(read_sequence(path / file)) == list(range(6))
    (path / "metadata.yaml").unlink()  # as a recorder leaves it that was killed
    assert numbers(read_sequence(path)) == list(range(6))


def test_the_parts_of_a_bag_are_one_sequence(write_bag, tmp_path):
    (tmp_path / "parts").mkdir()
    for number, first in ((2, 0), (10, 6)):
        path = write_bag("bag", name=f"drive_{number}", first=first)
        path.rename(tmp_path / "parts" / path.name)
    sequence = read_sequence(tmp_path / "parts")
    assert sequence.length == 12
    assert numbers(sequence) == list(range(12))


@pytest.mark.parametrize("kind", KINDS)
def test_of_several_topics_one_is_to_be_chosen(write_bag, kind):
    path = write_bag(kind, ("/front", "/rear"))
    assert numbers(read_sequence(path, topic="/rear")) == list(range(6))
    for topic, given in ((None, "is not given"), ("/chatter", "is '/chatter'")):
        with pytest.raises(fa.ArgumentError, match=rf"/front \(6\), /rear \(6\), but {given}"):
            read_sequence(path, topic=topic)


@pytest.mark.parametrize("kind", KINDS)
def test_a_bag_without_clouds_is_one_clear_error(write_bag, kind):
    path = write_bag(kind, ())
    with pytest.raises(fa.CloudFileError, match="no messages of sensor_msgs/msg/PointCloud2; its topics are: /chatter"):
        read_sequence(path)


@pytest.mark.parametrize("kind", KINDS)
def test_a_broken_message_is_a_frame_without_a_cloud(write_bag, kind):
    frames = list(read_sequence(write_bag(kind, spoil=2)))
    assert numbers(frames) == [0, 1, None, 3, 4, 5]
    assert frames[2].reason
    assert "\n" not in frames[2].reason
    assert frames[2].stamp == pytest.approx(START / 1e9 + 0.2, abs=1e-6)  # when it was recorded


@pytest.mark.parametrize("kind", KINDS)
def test_without_a_stamp_the_time_of_recording_counts(write_bag, kind):
    frames = list(read_sequence(write_bag(kind, stamped=False)))
    assert frames[1].stamp == pytest.approx(START / 1e9 + 0.1, abs=1e-6)
    assert frames[1].cloud.times[0] == pytest.approx(frames[1].stamp)


@pytest.mark.parametrize(("kind", "file"), [("bag", ""), ("mcap", "drive.mcap"), ("sqlite3", "drive.db3")])
@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_a_bag_that_is_cut_off_is_one_clear_error_or_what_is_left_of_it(write_bag, kind, file, share):
    path = write_bag(kind, frames=20)
    whole = (path / file if file else path).read_bytes()
    (path / file if file else path).write_bytes(whole[: int(share * len(whole))])
    left = what_is_left_of(path)
    if isinstance(left, str):
        assert path.name in left
        assert "\n" not in left
    else:
        assert 0 < len(left) <= 21
        assert left[-1].cloud is None
        assert "the rest of the bag cannot be read" in left[-1].reason


def test_a_bag_that_is_cut_off_names_what_mends_it(write_bag):
    path = write_bag("mcap") / "drive.mcap"
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(fa.CloudFileError, match=r"cannot be opened as a bag: .*`mcap recover` mends it"):
        read_sequence(path)


def test_what_is_damaged_in_the_middle_ends_the_sequence_with_a_reason(write_bag):
    path = write_bag("bag", frames=200)
    whole = bytearray(path.read_bytes())
    half = len(whole) // 2
    whole[half : half + 40_000] = bytes(40_000)
    path.write_bytes(whole)
    frames = list(read_sequence(path))
    assert numbers(frames)[:50] == list(range(50))
    assert frames[-1].cloud is None
    assert frames[-1].reason


def test_a_bag_is_read_one_frame_ahead_and_closed(write_bag):
    for kind in KINDS:
        frames = ahead(iter(read_sequence(write_bag(kind, name=kind))))
        assert next(frames).index == 0
        frames.close()  # by the thread that opened it: sqlite asks for that


def test_without_rosbags_the_extra_is_named(write_bag, monkeypatch):
    path = write_bag("bag")
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    with pytest.raises(fa.MissingExtraError, match=r"reading a bag needs the extra 'bag'"):
        read_sequence(path)


def test_the_text_of_a_bag_runs_nothing_and_names_no_file_elsewhere(write_bag, tmp_path):
    path = write_bag("sqlite3")
    text = (path / "metadata.yaml").read_text()
    (path / "metadata.yaml").write_text(f"{text}\nrun: !!python/object/apply:os.mkdir ['{tmp_path / 'made'}']\n")
    assert "cannot be opened as a bag" in what_is_left_of(path)
    assert not (tmp_path / "made").exists()
    (path / "drive.db3").rename(tmp_path / "drive.db3")
    (path / "metadata.yaml").write_text(text.replace("drive.db3", "../drive.db3"))
    assert "cannot be opened as a bag" in what_is_left_of(path)
