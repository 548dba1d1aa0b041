"""A trial stepped frame by frame."""

from __future__ import annotations

import os
import subprocess
from typing import Any, Callable, Iterable, Iterator, Sequence

import numpy as np

from . import _core
from .plug_in import Controller
from .results import Result
from .scenario import Path, Scenario, Settings, as_yaml, scenario_of


class _Hand(Controller):
    """The controller of a trial that is steered by hand."""

    seen, wanted = _core.Observation(), _core.Reference()
    next = came = np.zeros(4)
    in_control = asked = False
    parts: Sequence[str] = ("surge", "sway", "heave", "yaw")  # of a demand

    def start(self) -> None:
        if self.asks_for in ("thrusts", "thruster_volts"):
            self.parts = self.vehicle["thrusters"]

    def observe(self, seen: _core.Observation) -> None:
        self.seen = seen

    def demand(self, seen: _core.Observation, wanted: _core.Reference) -> np.ndarray:
        self.wanted, self.asked = wanted, True
        return self.next

    def given(self, frame: int, given: np.ndarray) -> None:
        self.came, self.in_control, self.asked = given, self.asked, False


class Trial(_core.Trial):
    """A trial under way.

        trial = turbidock.Trial("sea_night_active", seed=77, images=True)
        for frame in trial:
            left, right = trial.images            # read-only; what you keep is never overwritten
            print(frame.time_s, frame.true_position, frame.estimated_position)
        print(trial.result().digest)              # that of turbidock.run

    With `steered`, you are the controller: `trial.step([surge, sway, heave, yaw])` in N, N, N and
    N m (steered: True or what Controller.asks_for may be), while the docking procedure says what is wanted. A trial belongs
    to the thread and the process that made it. `with turbidock.Trial(...) as trial:` frees its memory
    at the end.
    """

    def __init__(self, scenario: Scenario | Path = "sea_night_active", *, seed: int | None = None,
                 settings: Settings = None, gains: Path = "", controller: type | str | None = None,
                 estimator: type | str | None = None, plugins: Iterable[type] = (),
                 images: bool = False, steered: bool | str = False) -> None:
        made = scenario_of(scenario, seed=seed, settings=settings, gains=gains,
                           controller=controller, estimator=estimator, plugins=plugins)
        self._by_hand: _Hand | None = None
        if steered:
            self._by_hand = hand = _Hand()
            hand.asks_for = "forces" if steered is True else steered
            made._cpp.plugins.add_controller("steered", lambda: hand, [], hand.asks_for, True, False, True, False, True, "")
            made["control.use"] = "steered"
        super().__init__(made._cpp, images)
        self._scenario = made
        self._result: Result | None = None

    @property
    def _hand(self) -> _Hand:
        if self._by_hand is None:
            raise ValueError("of a trial with `steered` only")
        return self._by_hand

    @property
    def seen(self) -> _core.Observation:
        """Steered: the filtered pose that a controller would see."""
        return self._hand.seen

    @property
    def wanted(self) -> _core.Reference:
        """Steered: where the procedure wants the marker."""
        return self._hand.wanted

    @property
    def given(self) -> np.ndarray:
        """Steered: what came of your demand in the last frame: less where thrusters saturate."""
        return self._hand.came

    @property
    def authority(self) -> np.ndarray:
        """Steered: all that the vehicle has on each axis alone, in the demand's unit."""
        return self._hand.authority

    @property
    def in_control(self) -> bool:
        """Steered: whether your demand counted in the last frame; not while the vehicle searches
        or drifts."""
        return self._hand.in_control

    def step(self, demand: Sequence[float] | np.ndarray | None = None) -> None:
        """Lets the next frame's time pass. ValueError after the end."""
        if self._by_hand:
            given: Any = demand
            parts = self._by_hand.parts
            asked = np.array(given, float) if np.shape(given) == (len(parts),) else np.array(np.nan)
            if not np.isfinite(asked).all():
                raise ValueError(f"step() takes {len(parts)} numbers, {', '.join(parts)}, not {demand!r}")
            self._by_hand.next = asked
        elif demand is not None:
            raise ValueError("step() takes a demand of a steered trial only")
        self.advance()

    def set(self, key: str, value: Any) -> None:
        """Changes water, lamps, sea or a controller's key from the next frame on."""
        self.assign(f"{key}={as_yaml(value)}")

    def project(self, points: Any = None, *, estimate: bool = False) -> np.ndarray:
        """Pixels in the left and the right image, (2, n, 2), of points [m] in the marker's frame, (n, 3); without any of the
        balls' centres. Where they truly were at the image, or where the estimate has them."""
        frame = self.frame
        pose = ((frame.estimated_position, frame.estimated_quaternion_wxyz) if estimate else
                (frame.true_position_at_image, frame.true_quaternion_at_image_wxyz))
        if points is None:
            points = [ball["position_m"] for ball in self.balls]
        return self.rig.project(points, *pose)

    def overlay(self) -> np.ndarray:
        """Both images side by side, (height, 2 width, 3), with a ring where the estimate has each ball: white where F
        reaches `procedure.lost_fitness`, else grey."""
        rig, frame = self.rig, self.frame
        picture = np.concatenate(self.images, axis=1)
        color = 255 if frame.fitness >= self._scenario["procedure.lost_fitness"] else 128
        depth = max(float(frame.estimated_position[0]), 0.1)
        for side, places in enumerate(self.project(estimate=True)):
            image = picture[:, side * rig.width:(side + 1) * rig.width]
            v, u = np.mgrid[:rig.height, :rig.width]
            for (at_u, at_v), ball in zip(places, self.balls):
                off = np.hypot(u - at_u, v - at_v) - rig.fx * ball["radius_m"] / depth
                image[np.abs(off) < 1] = color
        return picture

    def save_video(self, file: Path, step: Callable[[], Any] | None = None) -> None:
        """Lets the trial go on to its end, by `step` or else by itself, and films `overlay` of each frame (by ffmpeg)."""
        fps = self._scenario["trial.clock.frames_per_second"]
        size = f"{2 * self.rig.width}x{self.rig.height}"
        command = ["ffmpeg", "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size, "-r", str(fps),
                   "-i", "-", "-pix_fmt", "yuv420p", os.fspath(file)]
        film = subprocess.Popen(command, stdin=subprocess.PIPE)
        try:
            assert film.stdin
            while not self.ended:
                (step or self.step)()
                film.stdin.write(self.overlay().tobytes())
        except BrokenPipeError:  # it says below why
            pass
        finally:
            film.communicate()
        if film.returncode:
            raise RuntimeError(f"save_video(): ffmpeg wrote no {file}")

    def result(self) -> Result:
        """The result, interrupted where the trial has not ended; it cannot be stepped after that."""
        if self._result is None:
            self._result = Result(*self.finish())
        return self._result

    def __enter__(self) -> Trial:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<Trial, {'ended' if self.ended else 'under way'}, steered: {self._by_hand is not None}>"

    def __iter__(self) -> Iterator[_core.Frame]:
        while not self.ended:
            self.step()
            yield self.frame
