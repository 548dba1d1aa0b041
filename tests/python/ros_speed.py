"""What the exchange with ROS 2 nodes adds to a frame, and what takes it. By hand, on a quiet machine:

    python ros_speed.py [frames]      # rows of assets/measured/speed_ros.csv

Nodes that answer at once. Wall time of a frame in ms: the median, what nine in ten take at most, medians of the parts; processor
time in ms a frame, means: of the simulator while it exchanges, and of the nodes.
"""

import os
import pathlib
import statistics
import sys
import time

import turbidock
from ros_command import NODES
from turbidock.ros import exchange, wire

SCENARIO = "pool_active"
spent, rows, own = {}, [], [0.0]


def timed(owner, name, part):
    """Counts what a function takes, but for what parts within it take, as that part of the frame."""
    function = getattr(owner, name)

    def call(*arguments, **named):
        before, begin = sum(spent.values()), time.perf_counter()
        try:
            return function(*arguments, **named)
        finally:
            took = time.perf_counter() - begin
            spent[part] = spent.get(part, 0) + took - (sum(spent.values()) - before)

    setattr(owner, name, call)


def nodes_processor_s():
    """Of all that the trial has started."""
    parents, times = {}, {}
    for folder in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        parents[int(folder.name)], times[int(folder.name)] = int(fields[1]), int(fields[11]) + int(fields[12])
    found, more = [], [os.getpid()]
    while more:
        more = [child for child, parent in parents.items() if parent in more]
        found += more
    return sum(times[each] for each in found) / os.sysconf("SC_CLK_TCK")


def frame(plug_in, name, is_last):
    """Writes down what a frame took where its last call ends."""
    function = getattr(plug_in, name)

    def call(*arguments):
        begin = time.process_time()
        try:
            return function(*arguments)
        finally:
            own[0] += time.process_time() - begin
            if is_last:
                rows.append((dict(spent), own[0], nodes_processor_s()))
                spent.clear()

    setattr(plug_in, name, call)


def measure(what, frames, **chosen):
    rows.clear()
    settings = {"trial.duration_s": frames / 30, "procedure.give_up_s": 1e3, "estimator.true_pose.found_after_s": 0, "estimator.pose_source": "true_pose"}
    if "estimator" in chosen:
        settings["estimator.pose_source"] = "cameras"
    turbidock.ros.use(launch=f"exec {sys.executable} {NODES / 'at_once.py'}")
    turbidock.run(SCENARIO, seed=1, settings=settings, **chosen)
    turbidock.ros.use()
    measured = [row for row in rows[20:] if "wait" in row[0]]  # past the nodes' start, and with an answer
    totals = [1e3 * sum(parts.values()) for parts, _, _ in measured]
    parts = [statistics.median(1e3 * row[0].get(part, 0) for row in measured) for part in PARTS]
    ours, nodes = (1e3 * (measured[-1][at] - measured[0][at]) / (len(measured) - 1) for at in (1, 2))
    print(what, len(measured), *(f"{value:.2f}" for value in (
        statistics.median(totals), statistics.quantiles(totals, n=10)[-1], *parts, ours, nodes)), f"{os.getloadavg()[0]:.1f}", sep=",")


PARTS = ("messages", "send", "wait")


def main():
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    timed(wire.Wire, "send", "send")
    timed(exchange.Link, "ask", "wait")
    for plug_in, names in ((turbidock.ros.WrenchController, ("observe", "demand", "given")), (turbidock.ros.ImageEstimator, ("update",))):
        for name in names:
            timed(plug_in, name, "messages")
            frame(plug_in, name, name == names[-1])
    print("what,frames,median_ms,of_nine_in_ten_ms,messages_ms,send_ms,wait_ms,processor_ms,nodes_processor_ms,load")
    measure("pose to wrench", frames, controller=turbidock.ros.WrenchController)
    measure("two images to pose", frames, estimator=turbidock.ros.ImageEstimator)


if __name__ == "__main__":
    main()
