"""An estimator of your own as a ROS 2 node: the marker from three patches of colour, for clear water.

    turbidock-ros run pool_active --estimator --launch "python3 estimator_node.py"

An answer belongs to a frame: it has that frame's stamp, also where the marker is not seen."""

import contextlib

import numpy as np
import rclpy
from geometry_msgs.msg import PoseWithCovarianceStamped
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo, Image

BALLS = np.array([[0, 0, 0.07], [-0.07, 0, 0], [0, -0.07, 0]])  # red, green, blue, in the marker's frame [m]
LEAST = 12.0  # by how much a ball's colour exceeds the others


def patch(image, channel):
    """Centre (u, v) [px] of what has most of a colour; None without any."""
    blocks = image.reshape(image.shape[0] // 4, 4, image.shape[1] // 4, 4, 3).mean((1, 3))
    excess = np.maximum(blocks[:, :, channel] - np.delete(blocks, channel, axis=2).max(2) - LEAST, 0)
    v, u = np.unravel_index(excess.argmax(), excess.shape)
    near = np.s_[max(v - 12, 0):v + 13, max(u - 12, 0):u + 13]
    weights, (vs, us) = excess[near], np.mgrid[near]
    return 4 * np.array([(us * weights).sum(), (vs * weights).sum()]) / weights.sum() + 1.5 if weights.any() else None


class Patches(Node):
    def __init__(self):
        super().__init__("estimator")
        self.frame = {}  # what is known of the frame under way, by topic
        self.estimate = self.create_publisher(PoseWithCovarianceStamped, "estimate", 10)
        for topic, kind in (("left/image_raw", Image), ("right/image_raw", Image), ("right/camera_info", CameraInfo)):
            self.create_subscription(kind, topic, lambda message, topic=topic: self.on(topic, message), 10)

    def on(self, topic, message):
        self.frame[topic] = message
        if len({(each.header.stamp.sec, each.header.stamp.nanosec) for each in self.frame.values()}) == 1 and len(self.frame) == 3:
            answer = PoseWithCovarianceStamped()
            answer.header.stamp, answer.header.frame_id = message.header.stamp, "camera_head"
            if not self.locate(answer.pose.pose):
                answer.pose.covariance[0] = -1.0  # not seen
            self.estimate.publish(answer)

    def locate(self, pose):
        """Sets the marker's pose; False where it is not seen."""
        P = self.frame["right/camera_info"].p
        fx, cx, fy, cy, baseline = P[0], P[2], P[5], P[6], -P[3] / P[0]
        left, right = (np.frombuffer(m.data, np.uint8).reshape(m.height, m.width, 3)
                       for m in (self.frame["left/image_raw"], self.frame["right/image_raw"]))
        seen = []
        for channel in range(3):
            a, b = patch(left, channel), patch(right, channel)
            if a is None or b is None or a[0] <= b[0]:
                return False
            x = fx * baseline / (a[0] - b[0])
            seen.append([x, (cx - (a[0] + b[0]) / 2) * x / fx, (cy - a[1]) * x / fy])
        # the rotation that takes the balls of the marker nearest to those that are seen
        seen = np.array(seen)
        u, _, vt = np.linalg.svd((BALLS - BALLS.mean(0)).T @ (seen - seen.mean(0)))
        R = vt.T @ np.diag([1, 1, np.linalg.det(vt.T @ u.T)]) @ u.T
        w = np.sqrt(max(1 + np.trace(R), 1e-9)) / 2
        q = np.array([w, *np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / (4 * w)])
        q, p = q / np.linalg.norm(q), seen.mean(0) - R @ BALLS.mean(0)
        pose.orientation.w, pose.orientation.x, pose.orientation.y, pose.orientation.z = q.tolist()
        pose.position.x, pose.position.y, pose.position.z = p.tolist()
        return True


rclpy.init()
with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
    rclpy.spin(Patches())
