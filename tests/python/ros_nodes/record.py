"""Steers by nothing, and writes the stamp of each frame, with the clock when it was answered: record.py FILE."""

import sys

import rclpy
from geometry_msgs.msg import PoseStamped, WrenchStamped
from rclpy.node import Node
from rosgraph_msgs.msg import Clock


class Record(Node):
    def __init__(self, file):
        super().__init__("record")
        self.file, self.now, self.waiting = file, 0, None
        self.wrench = self.create_publisher(WrenchStamped, "wrench", 10)
        self.create_subscription(PoseStamped, "marker/desired", self.on_frame, 10)
        self.create_subscription(Clock, "/clock", self.on_clock, 10)

    def on_clock(self, message):
        self.now = message.clock.sec + 1e-9 * message.clock.nanosec
        self.answer()

    def on_frame(self, message):
        self.waiting = message
        self.answer()

    def answer(self):
        if not self.waiting:
            return
        stamp = self.waiting.header.stamp
        if self.now < stamp.sec + 1e-9 * stamp.nanosec + 0.09:  # the clock is still under way
            return
        print(stamp.sec + 1e-9 * stamp.nanosec, self.now, file=self.file, flush=True)
        answer = WrenchStamped()
        answer.header.stamp, answer.header.frame_id = stamp, "base_link"
        self.waiting = None
        self.wrench.publish(answer)


rclpy.init()
rclpy.spin(Record(open(sys.argv[1], "w")))
