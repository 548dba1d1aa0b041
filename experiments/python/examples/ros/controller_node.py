"""A controller of your own as a ROS 2 node: docks by the marker's pose and where it is wanted.

    turbidock-ros run sea_night_active --answer wrench --launch "python3 controller_node.py"

An answer belongs to a frame: it has that frame's stamp."""

import contextlib
import math

import rclpy
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, WrenchStamped
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node


def axes_of(pose):
    """x, y, z [m] and heading [rad] of the marker in the camera head."""
    p, q = pose.position, pose.orientation
    return [p.x, p.y, p.z, 2 * math.atan2(q.z, q.w)]


class Controller(Node):
    """Proportional and derivative, by axis: surge, sway, heave [N] and yaw [N m]."""

    STIFFNESS = (60.0, 60.0, 60.0, 0.4)  # N/m, N m/rad
    DAMPING = (30.0, 30.0, 30.0, 0.2)  # N s/m, N m s/rad
    MOST = (2.0, 100.0, 100.0, 10.0)  # N, N m: slow enough ahead to stop
    SMOOTHING_S = 0.1  # of the rates

    def __init__(self):
        super().__init__("controller")
        self.sign = self.declare_parameter("sign", 1.0).value  # -1 steers away from the dock: for a gate that must fail
        self.last, self.rates = None, [0.0] * 4
        self.wrench = self.create_publisher(WrenchStamped, "wrench", 10)
        self.create_subscription(PoseWithCovarianceStamped, "marker/pose", self.on_pose, 10)
        self.create_subscription(PoseStamped, "marker/desired", self.on_desired, 10)
        self.waiting = None

    def on_pose(self, message):
        stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
        axes = axes_of(message.pose.pose)
        if self.last and stamp > self.last[0]:
            dt = stamp - self.last[0]
            share = dt / (dt + self.SMOOTHING_S)
            self.rates = [rate + share * ((now - before) / dt - rate)
                          for rate, now, before in zip(self.rates, axes, self.last[1])]
        self.last = stamp, axes
        self.answer()

    def on_desired(self, message):
        self.waiting = message
        self.answer()

    def answer(self):
        wanted = self.waiting
        if not wanted or not self.last:
            return
        if self.last[0] != wanted.header.stamp.sec + 1e-9 * wanted.header.stamp.nanosec:
            return  # one of the two is still under way
        terms = zip(self.STIFFNESS, self.DAMPING, self.MOST, self.last[1], axes_of(wanted.pose), self.rates)
        surge, sway, heave, yaw = (self.sign * max(-most, min(most, stiffness * (now - then) + damping * rate))
                                   for stiffness, damping, most, now, then, rate in terms)
        answer = WrenchStamped()
        answer.header.stamp, answer.header.frame_id = wanted.header.stamp, "base_link"
        answer.wrench.force.x, answer.wrench.force.y, answer.wrench.force.z = surge, sway, heave
        answer.wrench.torque.z = yaw
        self.wrench.publish(answer)
        self.waiting = None


rclpy.init()
with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
    rclpy.spin(Controller())
