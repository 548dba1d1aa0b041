"""The edge to rclpy, which has types in part: the only module that imports it."""

from __future__ import annotations

import array
import importlib
import math
import os
import subprocess
import sys
import time
from typing import Any, Callable, Iterable, Sequence

import numpy as np

from ..frames import Rig
from .topics import ANSWERS, Topic


def _check_middleware() -> None:
    """ValueError for an RMW_IMPLEMENTATION that is not there: rcl would end the process as it is loaded."""
    name = os.environ.get("RMW_IMPLEMENTATION")
    if name and subprocess.run([sys.executable, "-c", "import rclpy"], capture_output=True, check=False).returncode:
        raise ValueError(f"RMW_IMPLEMENTATION={name}: the rclpy of {sys.executable} cannot be loaded with it")


_check_middleware()
rclpy: Any = importlib.import_module("rclpy")
for _name in ("context", "executors", "node", "qos", "signals"):
    importlib.import_module(f"rclpy.{_name}")

NODE = "turbidock"
_AGAIN_S = 2.0
_UNKNOWN = 1e6  # variance of what is not known


def _type(topic: Topic) -> Any:
    package, name = topic.type.split("/")
    return getattr(importlib.import_module(f"{package}.msg"), name)


def _qos() -> Any:
    return rclpy.qos.QoSProfile(depth=10)  # reliable, volatile


def check(arguments: Sequence[str]) -> None:
    """ValueError for --ros-args that cannot be."""
    context = rclpy.context.Context()
    try:
        _init(context, 0, arguments)
    except RuntimeError as error:
        raise ValueError(f"--ros-args: {str(error).partition(', at /')[0]}; other options stand before it, or after --") from None
    context.try_shutdown()


def _init(context: Any, domain: int, arguments: Sequence[str]) -> None:
    # Ctrl-C is the program's to handle; no log file
    rclpy.init(args=["turbidock", "--ros-args", "--disable-external-lib-logs", "--", *arguments], context=context,
               domain_id=domain, signal_handler_options=rclpy.signals.SignalHandlerOptions.NO)


class Wire:
    """A node of this process on a domain. `heard` has what came, with its topic, in order."""

    def __init__(self, domain: int, arguments: Sequence[str]) -> None:
        self._context = rclpy.context.Context()
        _init(self._context, domain, arguments)
        self._node = rclpy.node.Node(NODE, context=self._context, start_parameter_services=False, enable_rosout=False)
        self.name = str(self._node.get_fully_qualified_name())  # as it is remapped
        self._executor = rclpy.executors.SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._publishers: dict[Topic, Any] = {}
        self._subscriptions: dict[Topic, Any] = {}
        self._hearers: dict[str, Any] = {}  # clients of nodes, by name
        self.heard: list[tuple[Topic, Any]] = []

    def close(self) -> None:
        self._executor.shutdown(0)
        self._node.destroy_node()
        self._context.try_shutdown()

    def open(self, publishes: Iterable[Topic], hears: Iterable[Topic]) -> None:
        """Those of them that are not open yet."""
        for topic in publishes:
            if topic not in self._publishers:
                self._publishers[topic] = self._node.create_publisher(_type(topic), topic.name, _qos())
        for topic in hears:
            if topic not in self._subscriptions:
                self._subscriptions[topic] = self._node.create_subscription(_type(topic), topic.name, self._hear(topic), _qos())

    def _hear(self, topic: Topic) -> Callable[[Any], None]:
        return lambda message: self.heard.append((topic, message))

    def serve(self, service: str, name: str, act: Callable[[Any], str]) -> None:
        """A service of std_srvs with this name; `act` is given the request and returns what it says."""
        def answer(request: Any, response: Any) -> Any:
            response.success, response.message = True, act(request)
            return response

        self._node.create_service(getattr(importlib.import_module("std_srvs.srv"), service), name, answer)

    def serve_parameters(self, act: Callable[[str], None]) -> None:
        """What `ros2 param set` asks for, as "key=value"."""
        interfaces = importlib.import_module("rcl_interfaces.msg")
        of_type = {1: "bool_value", 2: "integer_value", 3: "double_value", 4: "string_value"}

        def answer(request: Any, response: Any) -> Any:
            for parameter in request.parameters:
                field = of_type.get(parameter.value.type)
                if field:
                    value = getattr(parameter.value, field)
                    act(f"{parameter.name}={str(value).lower() if isinstance(value, bool) else value}")
                response.results.append(interfaces.SetParametersResult(
                    successful=field is not None, reason="from the next frame on" if field else "must be one value"))
            return response

        self._node.create_service(importlib.import_module("rcl_interfaces.srv").SetParameters, "~/set_parameters", answer)

    def call(self, package: str, kind: str, name: str, goes_on: Callable[[], bool]) -> Any:
        """What a service of the nodes answers to an empty request; None where nobody does while it goes on."""
        service = getattr(importlib.import_module(f"{package}.srv"), kind)
        client = self._node.create_client(service, name)
        try:
            while not client.service_is_ready() and goes_on():
                self.spin(0.05)
            future = client.call_async(service.Request())
            while not future.done() and goes_on():
                self.spin(0.05)
            return future.result() if future.done() else None
        finally:
            self._node.destroy_client(client)

    def greet(self, goes_on: Callable[[], bool]) -> list[str]:
        """Finds the nodes that hear us and have parameter services, as they have by default, and settles with them. DDS tells
        a node of us in the order in which we make things, so they know all topics that are open before. Names: as settle."""
        services = {name for name, _ in self._node.get_service_names_and_types()}
        hear = {_name_of(info) for publisher in self._publishers.values()
                for info in self._node.get_subscriptions_info_by_topic(publisher.topic_name)}
        kind = importlib.import_module("rcl_interfaces.srv").GetParameters
        for name in sorted(hear):
            if f"{name}/get_parameters" in services and name not in self._hearers:
                self._hearers[name] = self._node.create_client(kind, f"{name}/get_parameters")
        return self.settle(goes_on)

    def settle(self, goes_on: Callable[[], bool]) -> list[str]:
        """Until they have answered a request, before which an executor takes what was sent before it; names of those that have
        not. An answer is lost where a node knows of the request before it knows of us: they are asked again."""
        futures: dict[str, list[Any]] = {name: [] for name in self._hearers}
        begun, waiting = time.monotonic(), list(futures)
        while waiting and goes_on():
            for name in waiting:
                due = time.monotonic() - begun >= _AGAIN_S * len(futures[name])
                if due and self._hearers[name].service_is_ready():
                    futures[name].append(self._hearers[name].call_async(self._hearers[name].srv_type.Request()))
            self.spin(0.05)
            waiting = [name for name in waiting if not any(future.done() for future in futures[name])]
        return waiting

    def spin(self, longest_s: float) -> None:
        """Lets one thing happen."""
        self._executor.spin_once(timeout_sec=longest_s)

    def send(self, topic: Topic, message: Any) -> None:
        self._publishers[topic].publish(message)

    # ---------------------------------------------------------------------------------- who is there

    def others(self) -> list[str]:
        """Names of the other nodes of the domain."""
        names = [f"{space.rstrip('/')}/{name}" for name, space in self._node.get_node_names_and_namespaces()]
        if self.name in names:
            names.remove(self.name)
        return sorted(name for name in names if not name.rpartition("/")[2].startswith("_"))

    def readers(self, topic: Topic) -> int:
        return int(self._publishers[topic].get_subscription_count())

    def writer_count(self, topic: Topic) -> int:
        """Of those whose messages come: len(writers) in a fifth of the time."""
        return int(self._subscriptions[topic].get_publisher_count())

    def writers(self, topic: Topic) -> list[str]:
        """Of a topic that we hear: names of the nodes, for each publisher."""
        return [_name_of(info) for info in self._node.get_publishers_info_by_topic(self._subscriptions[topic].topic_name)
                if info.topic_type == topic.type.replace("/", "/msg/")]

    def intruders(self) -> list[tuple[Topic, str]]:
        """Who else publishes what is ours to publish. One publisher of our name is ours."""
        found = []
        for topic, publisher in self._publishers.items():
            names = [_name_of(info) for info in self._node.get_publishers_info_by_topic(publisher.topic_name)]
            if self.name in names:
                names.remove(self.name)
            found += [(topic, name) for name in names]
        return found

    def mismatches(self) -> list[str]:
        """What does not fit between us and the nodes: types and QoS, a sentence each."""
        found = []
        for topic, endpoint in (*self._publishers.items(), *self._subscriptions.items()):
            ours = topic in self._publishers
            name = endpoint.topic_name
            infos = (self._node.get_subscriptions_info_by_topic(name) if ours
                     else self._node.get_publishers_info_by_topic(name))
            for info in infos:
                kind = info.topic_type.replace("/msg/", "/")
                if kind != topic.type:
                    found.append(f"{_name_of(info)} has {name} as {kind}, it is {topic.type}" + "".join(
                        f"; {kind} is {other.topic_name}" for same, other in self._subscriptions.items() if same.type == kind))
                    continue
                # a reader may ask for less than is offered
                if not ours and info.qos_profile.reliability == rclpy.qos.ReliabilityPolicy.BEST_EFFORT:
                    found.append(f"{_name_of(info)} publishes {name} as best effort, it must be reliable")
                if ours and info.qos_profile.durability == rclpy.qos.DurabilityPolicy.TRANSIENT_LOCAL:
                    found.append(f"{_name_of(info)} subscribes {name} as transient local, it must be volatile")
        return found

    def elsewhere(self) -> list[str]:
        """Topics of nodes that have our topics' names in a namespace or are another answer, a sentence each."""
        ours = [endpoint.topic_name for endpoint in (*self._publishers.values(), *self._subscriptions.values())]
        found = [f"{name} is another topic than {own}" for name, _ in self._node.get_topic_names_and_types()
                 for own in ours if name != own and name.endswith(own)]
        return found + [f"/{topic.name} is there, for --answer {answer}" for answer, topics in ANSWERS.items() for topic in topics
                        if topic not in self._subscriptions and self._node.count_publishers(topic.name)]

    def names(self, topics: Iterable[Topic]) -> str:
        """As they are called after remapping."""
        return ", ".join({**self._publishers, **self._subscriptions}[topic].topic_name for topic in topics)


def _name_of(info: Any) -> str:
    return f"{info.node_namespace.rstrip('/')}/{info.node_name}"


# -------------------------------------------------------------------------------------------- messages


def stamp_ns(message: Any) -> int | None:
    """Of its header; None where it has none."""
    header = getattr(message, "header", None)
    return None if header is None else int(header.stamp.sec) * 10**9 + int(header.stamp.nanosec)


def frame_id(message: Any) -> str:
    return str(message.header.frame_id).lstrip("/")


def _time(stamp: int) -> Any:
    return importlib.import_module("builtin_interfaces.msg").Time(sec=stamp // 10**9, nanosec=stamp % 10**9)


def _made(topic: Topic, stamp: int, frame: str = "") -> Any:
    message = _type(topic)()
    message.header.stamp = _time(stamp)
    message.header.frame_id = frame or topic.frame
    return message


def clock(topic: Topic, now: int) -> Any:
    return _type(topic)(clock=_time(now))


def image(topic: Topic, stamp: int, pixels: np.ndarray) -> Any:
    message = _made(topic, stamp)
    message.height, message.width, message.step = pixels.shape[0], pixels.shape[1], 3 * pixels.shape[1]
    message.encoding = "rgb8"
    data = array.array("B")
    data.frombytes(np.ascontiguousarray(pixels).data)
    message.data = data
    return message


def camera_info(topic: Topic, stamp: int, rig: Rig, is_right: bool) -> Any:
    message = _made(topic, stamp)
    message.height, message.width, message.distortion_model = rig.height, rig.width, "plumb_bob"
    message.d = [0.0] * 5
    message.k = [rig.fx, 0.0, rig.cx, 0.0, rig.fy, rig.cy, 0.0, 0.0, 1.0]
    message.r = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    message.p = [rig.fx, 0.0, rig.cx, -rig.fx * rig.baseline_m * is_right, 0.0, rig.fy, rig.cy, 0.0, 0.0, 0.0, 1.0, 0.0]
    return message


def _place(pose: Any, axes: Sequence[float]) -> None:
    pose.position.x, pose.position.y, pose.position.z = (float(value) for value in axes[:3])
    # math's, which are the C library's: a node gets sin(heading / 2) as the controllers in C++ compute it
    pose.orientation.z, pose.orientation.w = math.sin(axes[3] / 2), math.cos(axes[3] / 2)


def pose(topic: Topic, stamp: int, axes: Sequence[float], variance: Sequence[float] | None = None) -> Any:
    """Of x, y, z and heading; with covariance where the type has one."""
    message = _made(topic, stamp)
    if hasattr(message.pose, "covariance"):
        _place(message.pose.pose, axes)
        for at, value in zip((0, 7, 14, 35), variance if variance is not None else ()):
            message.pose.covariance[at] = float(value)
    else:
        _place(message.pose, axes)
    return message


def placed(topic: Topic, stamp: int, position: np.ndarray, quaternion_wxyz: np.ndarray) -> Any:
    """A PoseStamped."""
    message = _made(topic, stamp)
    p, q = message.pose.position, message.pose.orientation
    p.x, p.y, p.z = position.tolist()
    q.w, q.x, q.y, q.z = quaternion_wxyz.tolist()
    return message


def named(topic: Topic, stamp: int, names: Sequence[str], **fields: Sequence[float] | np.ndarray) -> Any:
    """A JointState with these names and, in these fields, values."""
    message = _made(topic, stamp)
    message.name = list(names)
    for field, values in fields.items():
        setattr(message, field, [float(value) for value in values])
    return message


def moving(topic: Topic, stamp: int, names: Sequence[str], *derivatives: np.ndarray) -> Any:
    """A JointTrajectory of one point: positions, velocities, accelerations."""
    message = _made(topic, stamp)
    message.joint_names = list(names)
    point = importlib.import_module("trajectory_msgs.msg").JointTrajectoryPoint()
    point.positions, point.velocities, point.accelerations = (values.tolist() for values in derivatives)
    message.points = [point]
    return message


def imu(topic: Topic, stamp: int, roll_pitch: Sequence[float], rates: Sequence[float]) -> Any:
    message = _made(topic, stamp)
    r, p = roll_pitch[0] / 2, roll_pitch[1] / 2
    message.orientation.w, message.orientation.x = math.cos(p) * math.cos(r), math.cos(p) * math.sin(r)
    message.orientation.y, message.orientation.z = math.sin(p) * math.cos(r), -math.sin(p) * math.sin(r)
    message.orientation_covariance[8] = message.angular_velocity_covariance[8] = _UNKNOWN
    message.angular_velocity.x, message.angular_velocity.y = (float(rate) for rate in rates)
    message.linear_acceleration_covariance[0] = -1.0  # there is none
    return message


def navigation(topic: Topic, stamp: int, child: str, reading: dict[str, Any]) -> Any:
    message = _made(topic, stamp)
    message.child_frame_id = child
    fix = reading["fix_xy_m"]
    x, y = (0.0, 0.0) if fix is None else fix
    _place(message.pose.pose, (x, y, reading["z_m"], reading["heading_rad"]))
    for at, std in ((0, reading["fix_std_m"]), (7, reading["fix_std_m"]), (14, reading["z_std_m"]),
                    (35, reading["heading_std_rad"])):
        message.pose.covariance[at] = _UNKNOWN if fix is None and at < 14 else float(std) ** 2
    for at in (0, 7, 14, 21, 28, 35):
        message.twist.covariance[at] = _UNKNOWN
    return message


def not_finite(message: Any) -> str:
    """Of an answer: the name of a number that is not finite, also of one that nobody uses; empty without any."""
    part = next((name for name in ("effort", "wrench", "twist", "pose") if hasattr(message, name)), "")
    return _not_finite(getattr(message, part) if part else message, part)


def _not_finite(value: Any, name: str) -> str:
    if isinstance(value, float):
        return "" if math.isfinite(value) else name
    if hasattr(value, "get_fields_and_field_types"):
        parts = {f"{name}.{field}".lstrip("."): getattr(value, field) for field in value.get_fields_and_field_types()}
    else:
        parts = {f"{name}[{at}]": element for at, element in enumerate(value)}
    return next((found for each, part in parts.items() if (found := _not_finite(part, each))), "")


def pose_of(message: Any) -> tuple[list[float], list[float], bool]:
    """Position, quaternion (w, x, y, z), and whether it was seen, of a PoseWithCovarianceStamped."""
    p, q = message.pose.pose.position, message.pose.pose.orientation
    return [p.x, p.y, p.z], [q.w, q.x, q.y, q.z], float(message.pose.covariance[0]) != -1.0


def numbers_of(message: Any, thrusters: Sequence[str]) -> list[float]:
    """Surge, sway, heave, yaw of a WrenchStamped, a TwistStamped or a Twist; the effort of each thruster of a JointState.
    ValueError where it has others."""
    if hasattr(message, "effort"):
        if sorted(message.name) != sorted(thrusters) or len(message.effort) != len(thrusters):
            raise ValueError(f"has {len(message.effort)} efforts of {', '.join(message.name) or 'nothing'}; must be of each of "
                             f"{', '.join(thrusters)}")
        efforts = dict(zip(message.name, message.effort))
        return [float(efforts[thruster]) for thruster in thrusters]
    linear, angular, _ = _halves(message)
    return [linear.x, linear.y, linear.z, angular.z]


def _halves(message: Any) -> tuple[Any, Any, str]:
    if hasattr(message, "wrench"):
        return message.wrench.force, message.wrench.torque, "torque"
    both = getattr(message, "twist", message)
    return both.linear, both.angular, "angular"


def unused(message: Any) -> str:
    """Names of an answer's numbers that are not zero and that nobody uses; empty without any."""
    if hasattr(message, "effort"):
        return ""
    _, angular, name = _halves(message)
    return ", ".join(f"{name}.{axis}" for axis in "xy" if getattr(angular, axis))
