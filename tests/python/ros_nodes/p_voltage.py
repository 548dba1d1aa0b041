"""turbidock's p_voltage with the gains of its defaults as a ROS node: the same numbers, to the last bit. After five frames,
p_voltage.py silent: says no more; p_voltage.py die FILE: the first node to make the file kills itself."""

import math
import os
import signal
import sys

import rclpy
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger


class PVoltage(Node):
    def __init__(self):
        super().__init__("p_voltage")
        self.seen = self.wanted = None
        self.frames = 0
        self.volts = self.create_publisher(JointState, "volts", 10)
        self.create_service(Trigger, "reset", self.on_reset)
        self.create_subscription(PoseWithCovarianceStamped, "marker/pose", self.on_pose, 10)
        self.create_subscription(PoseStamped, "marker/desired", self.on_desired, 10)

    def on_reset(self, _, response):
        self.seen = self.wanted = None
        response.success = True
        return response

    def on_pose(self, message):
        self.seen = message
        self.answer()

    def on_desired(self, message):
        self.wanted = message
        self.answer()

    def answer(self):
        if not self.seen or not self.wanted or self.seen.header.stamp != self.wanted.header.stamp:
            return
        self.frames += 1
        if self.frames > 5 and "silent" in sys.argv:
            return
        if self.frames > 5 and "die" in sys.argv and is_first(sys.argv[2]):
            os.kill(os.getpid(), signal.SIGKILL)
        pose, wanted = self.seen.pose.pose, self.wanted.pose

        def limit(volts, most):
            return min(max(volts, -most), most)

        sway = limit(30.0 * (pose.position.y - wanted.position.y), 2.5)
        heave = limit(30.0 * (pose.position.z - wanted.position.z), 2.5)
        yaw = limit(2.0 * (pose.orientation.z - wanted.orientation.z), 2.5)
        surge = limit(limit(20.0 * (pose.position.x - wanted.position.x), 0.5), 2.5 - abs(yaw))
        answer = JointState()
        answer.header.stamp, answer.header.frame_id = self.seen.header.stamp, "base_link"
        answer.name = ["heave", "surge_left", "surge_right", "sway"]  # in whatever order
        answer.effort = [2.5 + inverse(demand) for demand in (heave, surge - yaw, surge + yaw, sway)]
        self.volts.publish(answer)


def inverse(demand):
    """As the allocation of volts has it, which is none but for rounding."""
    size = abs(demand)
    volts = size / 0.05 * (2.5 * (0.05 / 2.5)) if size < 0.05 else 2.5 * (size / 2.5)
    return math.copysign(volts, demand)


def is_first(file):
    """Of the processes that ask for this file."""
    try:
        open(file, "x").close()
    except FileExistsError:
        return False
    return True


rclpy.init()
rclpy.spin(PVoltage())
