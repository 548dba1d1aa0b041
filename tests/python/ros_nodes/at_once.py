"""Answers at once, whatever it is sent: no force, no marker."""

import rclpy
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, WrenchStamped
from rclpy.node import Node
from sensor_msgs.msg import Image


class AtOnce(Node):
    def __init__(self):
        super().__init__("at_once")
        self.stamps = {}
        self.wrench = self.create_publisher(WrenchStamped, "wrench", 10)
        self.estimate = self.create_publisher(PoseWithCovarianceStamped, "estimate", 10)
        self.create_subscription(PoseStamped, "marker/desired", self.on_desired, 10)
        self.create_subscription(PoseWithCovarianceStamped, "marker/pose", lambda _: None, 10)
        for topic in ("left/image_raw", "right/image_raw"):
            self.create_subscription(Image, topic, lambda message, topic=topic: self.on_image(topic, message), 10)

    def on_desired(self, message):
        answer = WrenchStamped()
        answer.header.stamp, answer.header.frame_id = message.header.stamp, "base_link"
        self.wrench.publish(answer)

    def on_image(self, topic, message):
        self.stamps[topic] = message.header.stamp
        if len(self.stamps) == 2 and len({(stamp.sec, stamp.nanosec) for stamp in self.stamps.values()}) == 1:
            answer = PoseWithCovarianceStamped()
            answer.header.stamp, answer.header.frame_id = message.header.stamp, "camera_head"
            answer.pose.covariance[0] = -1.0
            self.estimate.publish(answer)


rclpy.init()
rclpy.spin(AtOnce())
