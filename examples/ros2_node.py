"""A ROS 2 node: PointCloud2 in; the sensor's pose, and the map, out.

    python3 examples/ros2_node.py --ros-args -r points:=/velodyne_points

Topics: `points` (sensor_msgs/PointCloud2) in; `odometry` (nav_msgs/Odometry, with covariance) and `tf` out. A scan that
does not tell the whole pose is said in the log, and its pose is the prediction.

rclpy and the messages come with ROS 2; fieldalign is installed beside them (pip install fieldalign).
"""

import numpy as np
import rclpy
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry as OdometryMessage
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import PointCloud2
from tf2_ros import TransformBroadcaster

import fieldalign as fa
from fieldalign.odometry.sequences import cloud_of

# Of the covariance: fieldalign has (turns, shifts), ROS has (shifts, turns).
ROS_ORDER = [3, 4, 5, 0, 1, 2]


class FieldalignNode(Node):
    """Follows a sensor, scan by scan."""

    def __init__(self):
        super().__init__("fieldalign")
        self.world = self.declare_parameter("world_frame", "odom").value
        self.odometry = fa.Odometry()
        self.publisher = self.create_publisher(OdometryMessage, "odometry", 10)
        self.broadcaster = TransformBroadcaster(self)
        self.create_subscription(PointCloud2, "points", self.on_scan, qos_profile_sensor_data)

    def on_scan(self, message):
        """The next scan."""
        stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
        pose = self.odometry.step(cloud_of(message, stamp), stamp=stamp)
        last = self.odometry.last
        if not last.tracked:
            self.get_logger().warning(str(last.reason))
        self.publisher.publish(self.odometry_message(message.header, pose, last.covariance))
        self.broadcaster.sendTransform(self.transform_message(message.header, pose))

    def odometry_message(self, header, pose, covariance):
        """nav_msgs/Odometry of a pose (4, 4) world_from_sensor and its covariance (6, 6), twist order (w, v)."""
        told = OdometryMessage()
        told.header.stamp, told.header.frame_id, told.child_frame_id = header.stamp, self.world, header.frame_id
        place = told.pose.pose
        place.position.x, place.position.y, place.position.z = map(float, pose[:3, 3])
        put(place.orientation, pose)
        told.pose.covariance = np.ravel(covariance[np.ix_(ROS_ORDER, ROS_ORDER)]).tolist()
        return told

    def transform_message(self, header, pose):
        """geometry_msgs/TransformStamped of a pose (4, 4) world_from_sensor."""
        told = TransformStamped()
        told.header.stamp, told.header.frame_id, told.child_frame_id = header.stamp, self.world, header.frame_id
        shift = told.transform.translation
        shift.x, shift.y, shift.z = map(float, pose[:3, 3])
        put(told.transform.rotation, pose)
        return told


def put(quaternion, pose):
    """A pose's rotation into a message's quaternion; ROS and SciPy put the scalar last."""
    quaternion.x, quaternion.y, quaternion.z, quaternion.w = map(float, Rotation.from_matrix(pose[:3, :3]).as_quat())


def main():
    """Spins until Ctrl-C."""
    rclpy.init()
    node = FieldalignNode()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        fa.write_trajectory("trajectory.txt", node.odometry.trajectory)
        fa.write_cloud("map.ply", node.odometry.map)
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
