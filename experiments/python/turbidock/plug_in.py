"""Controllers and estimators of your own."""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass
from typing import Any, Iterable, Sequence, Union

import numpy as np

from . import _core
from ._code import digest_of
from .frames import Rig

Value = Union[bool, int, float, str]


@dataclass(frozen=True)
class Key:
    """A key of a plug-in in a scenario: its default, range and meaning. A class attribute; on an
    instance it is the value that the trial's scenario gives, or without a trial the default."""

    default: Value
    low: float | None = None
    high: float | None = None
    doc: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.default, (bool, int, float, str)):
            raise TypeError(f"a key's default must be a bool, a number or text, not {self.default!r}")

    def __get__(self, instance: Any, owner: type) -> Any:
        return self if instance is None else self.default


class _PlugIn:
    name: str = ""  # of its group of keys in a scenario; else made of the class's own

    @classmethod
    def plugin_name(cls) -> str:
        """What scenarios call it: MyController is my_controller."""
        return cls.name or re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", cls.__name__).lower()

    @classmethod
    def _keys(cls) -> list[tuple[str, Value, float | None, float | None, str]]:
        rows = {}
        for base in reversed(cls.__mro__):
            for key, value in vars(base).items():
                if isinstance(value, Key):
                    rows[key] = (key, value.default, value.low, value.high, value.doc)
        return list(rows.values())

    @classmethod
    def _code(cls) -> str:
        """A digest of its code, empty where it cannot be had."""
        return digest_of(cls) or ""


class Controller(_PlugIn):
    """A controller from what is seen and what is wanted to forces. An instance is made for each trial;
    only `demand` must be written.

        class Mine(turbidock.Controller):
            pose_filter = True
            gain = turbidock.Key(60.0, 0, 1000, "newtons a metre")

            def demand(self, seen, wanted):
                x, y, z, heading = seen.position - wanted.position + 0.8 * seen.rate
                return [min(self.gain * x, 2), self.gain * y, self.gain * z, 0.4 * heading]
    """

    # By axis: "forces", or "volts", which only the published vehicle understands. For each thruster: "thrusts" [N] or
    # "thruster_volts", 0 to 5, neutral 2.5; nothing else levels the vehicle meanwhile.
    asks_for: str = "forces"
    pose_filter: bool = False  # a Kalman filter before it, which also gives `seen.rate`
    setpoint: bool = False  # lead the desired pose with limited speed

    # Set before start():
    frame_s: float  # seconds from one image to the next
    delay_frames: int  # image n arrives at (n + delay_frames) * frame_s
    delay_s: float  # and was exposed so long before
    authority: np.ndarray  # all that the vehicle has on each axis: N, N, N, N m, or volts
    # As its builder knows it: inertia (kg, kg m^2), linear_damping, quadratic_damping by axis,
    # thruster_lag_s, head_ahead_m; names of its thrusters
    vehicle: dict[str, Any]

    def start(self) -> None:
        """Called once the keys are set, before the first frame."""

    def observe(self, seen: _core.Observation) -> None:
        """Called at every frame with a usable estimate, also while nothing is controlled."""

    def demand(self, seen: _core.Observation, wanted: _core.Reference
               ) -> Sequence[float] | np.ndarray:
        """Forces [N] for surge, sway, heave and a moment [N m] for yaw, or volts: positive when the
        marker is farther, further left, higher or turned counter-clockwise than wanted. Of more
        than the vehicle has it gives what it can, its heading first. Or a number for each of vehicle["thrusters"]."""
        raise NotImplementedError(f"{type(self).__name__} has no demand()")

    def predict(self, frame: int) -> Sequence[float] | np.ndarray | None:
        """Where its model says that the marker is, x, y, z [m] and heading [rad] in the camera head,
        at a frame without a usable estimate; None where it cannot tell. `procedure.blind_max_s` lets
        docking go on by it, and needs a controller that has it."""
        return None

    def given(self, frame: int, given: np.ndarray) -> None:
        """What came of the demand at the frame: less where the thrusters saturate, zero without
        control."""


class Estimator(_PlugIn):
    """Where the marker is, from a pair of images. An instance is made for each trial."""

    rig: Rig  # its cameras: width, height, fx, fy, cx, cy [px], baseline_m
    balls: list[dict[str, Any]]  # of the marker: name, position_m, radius_m
    seed: int  # for its own random numbers: the same in the same trial
    frame_s: float  # seconds from one image to the next
    delay_frames: int  # image n arrives at (n + delay_frames) * frame_s
    delay_s: float  # and was exposed so long before
    frame: int  # number of the image that update() is given

    def start(self) -> None:
        """Called once keys, rig, balls and seed are set, and to forget earlier frames."""

    def update(self, left: np.ndarray, right: np.ndarray
               ) -> tuple[Sequence[float] | np.ndarray, Sequence[float] | np.ndarray, float]:
        """Position [m] and quaternion (w, x, y, z) of the marker in the camera head, and a fitness
        in [-1, 1]: from 0.4 on a pose is acted on. Images are (height, width, 3), RGB, 8 bits."""
        raise NotImplementedError(f"{type(self).__name__} has no update()")


def plugins_of(classes: Iterable[type], kept: bool = False) -> _core.Plugins:
    """A registry of these classes; with `kept`, for results that are kept, it has a digest of their code. TypeError for one
    that is neither controller nor estimator."""
    plugins = _core.Plugins()
    for cls in classes:
        if kept and isinstance(cls, type) and issubclass(cls, _PlugIn) and not cls._code():
            warnings.warn(f"the code of {cls.plugin_name()} cannot be told: another call does not go on with this file",
                          stacklevel=4)
        if isinstance(cls, type) and issubclass(cls, Controller):
            plugins.add_controller(
                cls.plugin_name(), cls, cls._keys(), cls.asks_for, cls.pose_filter, cls.setpoint,
                cls.observe is not Controller.observe, cls.predict is not Controller.predict,
                cls.given is not Controller.given, cls._code() if kept else "")
        elif isinstance(cls, type) and issubclass(cls, Estimator):
            plugins.add_estimator(cls.plugin_name(), cls, cls._keys(), cls._code() if kept else "")
        else:
            raise TypeError(f"{cls!r} must be a class made from turbidock.Controller or "
                            "turbidock.Estimator")
    return plugins


def chosen(controller: type | str | None, estimator: type | str | None, plugins: Iterable[type]
           ) -> tuple[list[type], list[str]]:
    """All classes, with these two, and the assignments that choose them."""
    classes, assignments = list(plugins), []
    for choice, key in ((controller, "control.use"), (estimator, "estimator.use")):
        if choice is not None and not isinstance(choice, str) and choice not in classes:
            classes.append(choice)
        if choice is not None:
            assignments.append(f"{key}={getattr(choice, 'plugin_name', lambda: choice)()}")
    return classes, assignments
