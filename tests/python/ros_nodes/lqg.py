"""The controller of a scenario as a node: lqg.py SCENARIO [slow]. The same code, fed by messages that have its numbers exactly.
With `slow` it is busy with each frame before the first that asks for an answer."""

import sys
import time

import rclpy
import turbidock
from geometry_msgs.msg import WrenchStamped
from rclpy.node import Node
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory


def frame_of(message):
    stamp = message.header.stamp
    return round((stamp.sec + 1e-9 * stamp.nanosec) * 30)


class Lqg(Node):
    def __init__(self):
        super().__init__("lqg")
        self.controller = turbidock.Scenario(sys.argv[1]).make_controller()
        self.seen = self.wanted = None  # the frame whose pose was taken; what is wanted
        self.applied, self.poses = {}, {}  # what came, by its frame: topics keep no order among each other
        self.is_slow = "slow" in sys.argv
        self.wrench = self.create_publisher(WrenchStamped, "wrench", 10)
        self.create_subscription(JointState, "applied", self.on_applied, 10)
        self.create_subscription(JointState, "marker/axes", self.on_seen, 10)
        self.create_subscription(JointTrajectory, "marker/desired_axes", self.on_wanted, 10)

    def on_applied(self, message):
        self.applied[frame_of(message)] = message.effort
        self.take()

    def on_seen(self, message):
        self.poses[frame_of(message)] = message.position
        self.take()

    def take(self):
        """What came, frame by frame: a pose comes after what was applied in the frame before, but the first."""
        for frame in sorted(self.poses):
            if self.seen is not None and frame - 1 not in self.applied:
                return
            for before in sorted(before for before in self.applied if before < frame):
                self.controller.given(before, self.applied.pop(before))
            self.controller.observe(frame, self.poses.pop(frame))
            self.seen = frame
            if self.is_slow:
                time.sleep(0.1)
            self.answer()

    def on_wanted(self, message):
        self.wanted, self.is_slow = message, False
        self.answer()

    def answer(self):
        if not self.wanted or frame_of(self.wanted) != self.seen:
            return
        point, answer = self.wanted.points[0], WrenchStamped()
        answer.header.stamp, answer.header.frame_id = self.wanted.header.stamp, "base_link"
        f, t = answer.wrench.force, answer.wrench.torque
        f.x, f.y, f.z, t.z = self.controller.demand(point.positions, point.velocities, point.accelerations).tolist()
        self.wanted = None
        self.wrench.publish(answer)


rclpy.init()
rclpy.spin(Lqg())
