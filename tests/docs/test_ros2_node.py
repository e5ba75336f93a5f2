"""The ROS 2 node: real messages (of rosbags) through the node, on a small stand-in for rclpy."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fieldalign as fa
from fieldalign.clouds.simulated import simulate_room

pytest.importorskip("rosbags")
from rosbags.typesys import Stores, get_typestore

NODE = Path(__file__).parents[2] / "examples/ros2_node.py"
STORE = get_typestore(Stores.ROS2_HUMBLE)
TYPES = STORE.types


class StandIn:
    """As rclpy's Node, as far as it is used: what is published is kept."""

    def __init__(self, name):
        self.name, self.published, self.warned, self.subscriptions = name, [], [], {}

    def declare_parameter(self, name, value):
        return SimpleNamespace(value=value)

    def create_publisher(self, kind, topic, depth):
        return SimpleNamespace(publish=self.published.append)

    def create_subscription(self, kind, topic, callback, profile):
        self.subscriptions[topic] = callback

    def get_logger(self):
        return SimpleNamespace(warning=self.warned.append)


def empty(name):
    """A message whose parts are there to be filled, as ROS's own constructors make them."""
    def make():
        fields = {field: kind for field, kind in TYPES[name].__annotations__.items() if not field.startswith("__")}
        values = {}
        for field, kind in fields.items():
            of = kind if isinstance(kind, str) else kind.__name__
            inner = next((known for known in TYPES if known.rsplit("/", 1)[-1] == of.rsplit("__", 1)[-1]), None)
            values[field] = empty(inner)() if inner else None
        return SimpleNamespace(**values)

    return make


@pytest.fixture
def node(monkeypatch):
    """The example's node, on the stand-in."""
    parts = {
        "rclpy": {}, "rclpy.node": {"Node": StandIn}, "rclpy.qos": {"qos_profile_sensor_data": None},
        "geometry_msgs": {}, "geometry_msgs.msg": {"TransformStamped": empty("geometry_msgs/msg/TransformStamped")},
        "nav_msgs": {}, "nav_msgs.msg": {"Odometry": empty("nav_msgs/msg/Odometry")},
        "sensor_msgs": {}, "sensor_msgs.msg": {"PointCloud2": TYPES["sensor_msgs/msg/PointCloud2"]},
        "tf2_ros": {"TransformBroadcaster": lambda node: SimpleNamespace(sendTransform=node.published.append)},
    }
    for name, contents in parts.items():
        module = ModuleType(name)
        vars(module).update(contents)
        monkeypatch.setitem(sys.modules, name, module)
    spec = importlib.util.spec_from_file_location("ros2_node", NODE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.FieldalignNode()


def message_of(points, seconds):
    """A PointCloud2 that went over the wire: written as CDR bytes and read again."""
    field, time = TYPES["sensor_msgs/msg/PointField"], TYPES["builtin_interfaces/msg/Time"]
    header = TYPES["std_msgs/msg/Header"](time(sec=int(seconds), nanosec=round(seconds % 1 * 1e9)), "lidar")
    rows = np.zeros((len(points), 4), np.float32)
    rows[:, :3] = points
    message = TYPES["sensor_msgs/msg/PointCloud2"](
        header=header, height=1, width=len(points),
        fields=[field(name, 4 * k, 7, 1) for k, name in enumerate(("x", "y", "z", "intensity"))],
        is_bigendian=False, point_step=16, row_step=16 * len(points), data=rows.view(np.uint8).ravel(), is_dense=True,
    )
    kind = message.__msgtype__
    return STORE.deserialize_cdr(STORE.serialize_cdr(message, kind), kind)


def test_node_follows_the_sensor(node):
    room, pose = simulate_room(3), np.eye(4)
    for k in range(4):
        pose[:3, :3] = Rotation.from_euler("z", 2 * k, degrees=True).as_matrix()
        pose[:3, 3] = 2.5 + 0.05 * k, 2.5, 1.5
        scan = room.scan(pose, 8000, field_of_view=(360, 70), seed=k)
        node.subscriptions["points"](message_of(scan.points, 100 + 0.5 * k))
    odometry, transform = node.published[-2:]
    place, q = odometry.pose.pose.position, odometry.pose.pose.orientation
    assert np.allclose([place.x, place.y, place.z], [0.15, 0, 0], atol=0.01)
    assert np.isclose(np.degrees(Rotation.from_quat([q.x, q.y, q.z, q.w]).as_rotvec()[2]), 6, atol=0.1)
    assert (odometry.header.frame_id, odometry.child_frame_id) == ("odom", "lidar")
    assert (odometry.header.stamp.sec, odometry.header.stamp.nanosec) == (101, 500_000_000)
    assert transform.transform.translation.x == place.x
    assert not node.warned
    covariance = np.reshape(odometry.pose.covariance, (6, 6))
    assert np.array_equal(covariance[:3, :3], node.odometry.last.covariance[3:, 3:])  # ROS: shifts first


def test_node_says_what_it_cannot_place(node):
    scan = simulate_room(3).scan(np.array([[1, 0, 0, 2.5], [0, 1, 0, 2.5], [0, 0, 1, 1.5], [0, 0, 0, 1.0]]), 4000)
    node.subscriptions["points"](message_of(scan.points, 1.0))
    node.subscriptions["points"](message_of(np.zeros((0, 3)), 1.1))
    assert node.warned == [str(fa.Tracking.EMPTY)]
    assert len(node.published) == 4
