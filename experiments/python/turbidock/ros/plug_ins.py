"""The user's nodes as controllers and as an estimator of a trial."""

from __future__ import annotations

import hashlib
import math
from typing import Any, Sequence

import numpy as np

from .. import _core
from ..frames import rotation
from ..plug_in import Controller, Estimator, Key
from . import exchange, wire
from .topics import (ANSWERS, APPLIED, AXES, CONTROLLER, DESIRED, ESTIMATE, HEAD, IMAGES, IMU, LEFT, NAVIGATION, PLACE,
                     POSE, QUALITY, SEEN, WANTED)

_NOT_SEEN = -0.2  # F of a marker that is not there, as in true_pose
_SEEN = 0.9


def _code(cls: type) -> str:
    """Of what is known of the nodes: empty without their version, and then no later call goes on with a batch's file."""
    text = exchange.code_of_stack()
    return hashlib.sha256(f"{cls.__name__} {text}".encode()).hexdigest()[:16] if text else ""


class _NodeController(Controller):
    """A node that gets the marker's pose and where it is wanted, and answers with a demand."""

    pose_filter = False
    _answer, _nothing = "wrench", 0.0
    _least, _most = -1e6, 1e6  # what the core takes

    @classmethod
    def _code(cls) -> str:
        return _code(cls)

    def start(self) -> None:
        self._link = exchange.link()
        self._link.enter("controller", self, CONTROLLER, ANSWERS[self._answer])
        self._parts = AXES if self.asks_for == "forces" else self.vehicle["thrusters"]
        self._sent = -1
        self._begun = self._asked = False

    def __del__(self) -> None:
        if hasattr(self, "_link"):
            self._link.leave("controller", self)

    def observe(self, seen: _core.Observation) -> None:
        self._link.await_nodes((DESIRED, WANTED), ANSWERS[self._answer])
        self._begun = True
        stamp = exchange.stamp_of(self, seen.frame)
        self._link.begin_frame(exchange.arrival_of(self, seen.frame))
        send = self._link.send
        send(POSE, wire.pose(POSE, stamp, seen.position.tolist(),
                             None if seen.variance is None else seen.variance.tolist()))
        send(SEEN, wire.named(SEEN, stamp, PLACE, position=seen.position, velocity=() if seen.rate is None else seen.rate))
        send(QUALITY, wire.named(QUALITY, stamp, ("fitness",), position=(seen.fitness,)))
        send(IMU, wire.imu(IMU, stamp, seen.roll_pitch.tolist(), seen.roll_pitch_rate.tolist()))
        if seen.navigation is not None:
            send(NAVIGATION, wire.navigation(NAVIGATION, stamp, HEAD, seen.navigation))

    def demand(self, seen: _core.Observation, wanted: _core.Reference) -> Sequence[float] | np.ndarray:
        stamp = exchange.stamp_of(self, seen.frame)
        self._link.send(WANTED, wire.moving(WANTED, stamp, PLACE, wanted.position, wanted.rate, wanted.acceleration))
        self._link.send(DESIRED, wire.pose(DESIRED, stamp, wanted.position.tolist()))
        self._asked = True
        answer = self._link.ask(ANSWERS[self._answer], stamp)
        if answer is None:  # stopped
            return np.full(len(self._parts), self._nothing)
        topic, message = answer
        self._link.require_finite(topic, message)
        try:
            numbers = wire.numbers_of(message, self._parts)
        except ValueError as error:
            raise self._link.wrong(topic, str(error)) from None
        for part, number in zip(self._parts, numbers):
            if not self._least <= number <= self._most:
                raise self._link.wrong(topic, f"{part} is {number:g}, must be in {self._least:g} to {self._most:g}")
        self._link.say_once(topic, wire.unused(message))
        frame = "" if not topic.frame else wire.frame_id(message)
        if frame != topic.frame:
            raise self._link.wrong(topic, f"frame_id '{frame}', must be {topic.frame}")
        return self.demand_of(numbers, seen)

    def demand_of(self, numbers: list[float], seen: _core.Observation) -> Sequence[float] | np.ndarray:
        """Of what was answered."""
        return numbers

    def given(self, frame: int, given: np.ndarray) -> None:
        if not self._begun or frame <= self._sent:  # before, some would hear it and others not
            return
        self._sent = frame
        self._link.send(APPLIED, wire.named(APPLIED, exchange.stamp_of(self, frame), AXES, effort=given))
        if not self._asked:
            self._link.settle()
        self._asked = False


class WrenchController(_NodeController):
    """Answers with WrenchStamped."""

    name = "ros_wrench"


class ThrustsController(_NodeController):
    """Answers with the thrust of each thruster."""

    name, asks_for, _answer = "ros_thrusts", "thrusts", "thrusts"


class VoltsController(_NodeController):
    """Answers with the voltage of each thruster."""

    name, asks_for, _answer, _nothing = "ros_volts", "thruster_volts", "volts", 2.5
    _least, _most = 0.0, 5.0


class TwistController(_NodeController):
    """Answers with a velocity through the water. It is kept by the vehicle's known drag and a share of the error in speed."""

    name, pose_filter, _answer = "ros_twist", True, "twist"
    gain_per_s = Key(2.0, 0.0, 100.0, "acceleration for each m/s, or rad/s, of error in speed")

    def demand_of(self, axes: list[float], seen: _core.Observation) -> np.ndarray:
        wanted = np.array(axes)
        assert seen.rate is not None
        v = self.vehicle
        drag = wanted * (v["linear_damping"] + v["quadratic_damping"] * np.abs(wanted))
        return np.asarray(drag + v["inertia"] * self.gain_per_s * (wanted + seen.rate))  # the marker comes as the vehicle goes


class ImageEstimator(Estimator):
    """A node that gets the images of both cameras and answers where the marker is."""

    name = "ros_estimator"

    @classmethod
    def _code(cls) -> str:
        return _code(cls)

    def start(self) -> None:
        self._link = exchange.link()
        self._link.enter("estimator", self, IMAGES, (ESTIMATE,))
        self._last: tuple[Sequence[float], Sequence[float]] = ([1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0])

    def __del__(self) -> None:
        if hasattr(self, "_link"):
            self._link.leave("estimator", self)

    def update(self, left: np.ndarray, right: np.ndarray) -> tuple[Any, Any, float]:
        self._link.await_nodes(IMAGES[:2], (ESTIMATE,))
        stamp = exchange.stamp_of(self, self.frame)
        self._link.begin_frame(exchange.arrival_of(self, self.frame))
        for topic, is_right in zip(IMAGES[2:], (False, True)):
            self._link.send(topic, wire.camera_info(topic, stamp, self.rig, is_right))
        for topic, pixels in zip(IMAGES, (left, right)):
            self._link.send(topic, wire.image(topic, stamp, pixels))
        answer = self._link.ask((ESTIMATE,), stamp)
        if answer is None:  # stopped
            return *self._last, _NOT_SEEN
        _, message = answer
        position, quaternion, is_seen = wire.pose_of(message)
        if not is_seen:
            return *self._last, _NOT_SEEN
        self._link.require_finite(ESTIMATE, message)
        if abs((length := math.hypot(*quaternion)) - 1) > 1e-3:
            raise self._link.wrong(ESTIMATE, f"has a quaternion of length {length:g}")
        self._last = self._in_head(wire.frame_id(message), position, quaternion)
        return *self._last, _SEEN

    def _in_head(self, frame: str, position: list[float], quaternion: list[float]) -> tuple[Sequence[float], Sequence[float]]:
        if frame == HEAD:
            return position, quaternion
        if frame != LEFT:
            raise self._link.wrong(ESTIMATE, f"frame_id '{frame}', must be {HEAD} or {LEFT}")
        # x of the head is z of the optical frame, y is -x, z is -y
        turn = (0.5, -0.5, 0.5, -0.5)
        place = rotation(turn) @ np.array(position) + (0, self.rig.baseline_m / 2, 0)
        (a, b, c, d), (w, x, y, z) = turn, quaternion
        turned = [a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y,
                  a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w]
        return place, turned


CONTROLLERS = {"wrench": WrenchController, "twist": TwistController, "thrusts": ThrustsController,
               "volts": VoltsController}
