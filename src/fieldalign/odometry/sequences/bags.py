"""ROS bags of both versions, and single MCAP files, through `rosbags` (extra 'bag'): one topic's scans, streamed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from ...clouds.cloud import PointCloud
from ...errors import ArgumentError, CloudFileError, missing_extra
from .folders import natural_order
from .point_cloud2 import cloud_of
from .sequence import Frame, Sequence, frame_of, reason_of

_SUFFIXES = (".bag", ".mcap", ".db3")
_TYPE = "sensor_msgs/msg/PointCloud2"


def is_bag(place: Path) -> bool:
    """Whether a path is a bag, or a folder that is one or holds the parts of one."""
    return bool(_parts(place))


def read_bag(place: Path, topic: str | None) -> Sequence:
    """The PointCloud2 messages of a topic, in the order in which they were recorded.

    Raises CloudFileError where it cannot be opened or has no such messages, ArgumentError where the topic is not one of
    those that have, or has to be chosen.
    """
    parts = _parts(place)
    with _opened(place, parts) as reader:
        counts: dict[str, int] = {}
        for connection in reader.connections:
            if connection.msgtype == _TYPE:
                counts[connection.topic] = counts.get(connection.topic, 0) + connection.msgcount
        chosen = _chosen(counts, topic, place, sorted({c.topic for c in reader.connections}))
    return Sequence(place.name, f"a bag, topic {chosen}", counts[chosen], partial(_frames, place, parts, chosen))


def _parts(place: Path) -> list[Path]:
    """What makes up a bag: the folder that its metadata.yaml describes, or files; of no bag, nothing."""
    if place.is_file():
        return [place] if place.suffix.lower() in _SUFFIXES else []
    if (place / "metadata.yaml").is_file():
        return [place]
    files = [file for file in place.iterdir() if file.suffix.lower() in _SUFFIXES]
    return sorted(files, key=natural_order)


def _chosen(counts: dict[str, int], topic: str | None, place: Path, topics: list[str]) -> str:
    if not counts:
        raise CloudFileError(f"{place} holds no messages of {_TYPE}; its topics are: {', '.join(topics) or 'none'}")
    if topic is None and len(counts) == 1:
        return next(iter(counts))
    if topic not in counts:
        held = ", ".join(f"{name} ({count})" for name, count in sorted(counts.items()))
        given = "is not given" if topic is None else f"is {topic!r}"
        raise ArgumentError(f"topic must be one of those of {place} with clouds, {held}, but {given}")
    return topic


def _frames(place: Path, parts: list[Path], topic: str) -> Iterator[Frame]:
    index = 0
    with _opened(place, parts) as reader:
        connections = [c for c in reader.connections if c.topic == topic and c.msgtype == _TYPE]
        messages = reader.messages(connections)
        while True:
            try:
                connection, recorded, data = next(messages)
            except StopIteration:
                return
            except Exception as error:  # of whatever library lies below; none of them can go on from there
                yield Frame(index, None, None, f"the rest of the bag cannot be read: {reason_of(error)}")
                return
            yield _frame(index, recorded / 1e9, partial(reader.deserialize, data, connection.msgtype))
            index += 1


def _frame(index: int, recorded: float, deserialize: Any) -> Frame:
    """The frame of a message; its stamp is the header's, or, where that is broken or 0, when it was recorded."""
    stamp = recorded

    def read() -> PointCloud:
        nonlocal stamp
        message = deserialize()
        stamp = message.header.stamp.sec + message.header.stamp.nanosec / 1e9 or recorded
        return cloud_of(message, stamp)

    frame = frame_of(index, recorded, read)
    return Frame(index, stamp, frame.cloud, frame.reason)


@contextmanager
def _opened(place: Path, parts: list[Path]) -> Iterator[Any]:
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise missing_extra("bag", "reading a bag") from error
    try:
        reader = AnyReader(parts, default_typestore=get_typestore(Stores.ROS2_HUMBLE))
        reader.open()
    except Exception as error:
        raise CloudFileError(f"{place} cannot be opened as a bag: {reason_of(error)} (a recorder that was cut off "
                             "leaves a bag without its index: `rosbag reindex`, `ros2 bag reindex` or `mcap recover` "
                             "mends it)") from error
    try:
        yield reader
    finally:
        reader.close()
