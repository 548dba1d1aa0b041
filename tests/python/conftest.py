"""What the tests of the Python package share."""

import json
import os
import signal
import subprocess

import numpy as np
import pytest

import turbidock

QUICK = {"estimator.pose_source": "true_pose"}


class CopiedController(turbidock.Controller):
    """The published controller once more, in Python."""

    asks_for = "volts"
    surge_v_per_m = turbidock.Key(20.0, 0, 1000, "volts a metre of x")
    across_v_per_m = turbidock.Key(30.0, 0, 1000, "volts a metre of y and z")
    yaw_v = turbidock.Key(2.0, 0, 1000, "volts for eps3")

    def demand(self, seen, wanted):
        e = seen.position - wanted.position
        turn = np.sin(seen.position[3] / 2) - np.sin(wanted.position[3] / 2)
        return [np.clip(self.surge_v_per_m * e[0], -0.5, 0.5),
                np.clip(self.across_v_per_m * e[1], -2.5, 2.5),
                np.clip(self.across_v_per_m * e[2], -2.5, 2.5),
                np.clip(self.yaw_v * turn, -2.5, 2.5)]


class CopiedPid(turbidock.Controller):
    """pid without its integral, in Python: forces."""

    pose_filter = True
    kp_per_s2 = turbidock.Key(0.5, 0, 10, "acceleration a metre, or a radian")
    kd_per_s = turbidock.Key(1.0, 0, 10, "and for their rates")

    def demand(self, seen, wanted):
        error = seen.position - wanted.position
        rate = seen.rate - wanted.rate
        inertia = self.vehicle["inertia"]
        return inertia * self.kp_per_s2 * error + inertia * self.kd_per_s * rate


class BlindController(CopiedPid):
    """Goes on where the marker was seen last."""

    does = turbidock.Key("predict", doc="what it says of a marker that is out of sight")

    def observe(self, seen):
        self.last = seen.position

    def predict(self, frame):
        assert isinstance(frame, int)
        return {"predict": self.last, "shrug": None, "nan": [0, 0, 0, float("nan")]}[self.does]


class OddController(turbidock.Controller):
    """What may go wrong in a controller."""

    does = turbidock.Key("nothing", doc="what it does instead of steering")

    def demand(self, seen, wanted):
        if self.does == "raise":
            raise KeyError("no such gain")
        if self.does == "silent" and "MENDED" not in os.environ:
            raise turbidock.NoAnswer("no answer from the other program")
        if self.does == "interrupt":  # what Ctrl-C does
            signal.raise_signal(signal.SIGINT)
        if self.does == "nan":
            return [0, 0, float("nan"), 0]
        if self.does == "shape":
            return [0, 0, 0]
        while self.does == "hang":
            pass
        return np.zeros(4)


class FixedEstimator(turbidock.Estimator):
    """Says always the same, or misbehaves."""

    does = turbidock.Key("nothing")

    def update(self, left, right):
        if self.does == "raise":
            raise RuntimeError("no such ball")
        if self.does == "silent":
            raise turbidock.NoAnswer("no answer from the other program")
        if self.does == "interrupt":
            signal.raise_signal(signal.SIGINT)
        if self.does == "write":
            left[0, 0, 0] = 1
        while self.does == "hang":
            pass
        x = float("nan") if self.does == "nan" else 0.6
        return [x, 0, 0], [1, 0, 0, 0], 0.8


@pytest.fixture
def program():
    """The C++ program of this checkout, to compare with; PROGRAM names it."""
    path = os.environ.get("PROGRAM", "build/bin/turbidock")
    assert os.path.exists(path), f"{path}: build it first, or say where it is in PROGRAM"

    def run(scenario, out=None, **settings):
        sets = [word for key, value in settings.items()
                for word in ("--set", f"{key.replace('__', '.')}={value}")]
        to = ["--out", str(out)] if out else []
        text = subprocess.run([path, "run", scenario, *sets, *to, "--json", "--quiet"], check=True,
                              capture_output=True, text=True).stdout
        return json.loads(text)

    return run
