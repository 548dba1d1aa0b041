"""A trial stepped frame by frame."""

from __future__ import annotations

from typing import Any, Iterator, Sequence

import numpy as np

from . import _core
from .results import Result
from .scenario import Scenario, as_yaml


class Trial:
    """A trial under way.

        trial = turbidock.Trial("sea_night_active", seed=77, images=True)
        for frame in trial:
            left, right = trial.images            # read-only; what you keep is never overwritten
            print(frame.time_s, frame.true_position, frame.estimated_position)
        print(trial.result().digest)              # that of turbidock.run

    With `steered`, you are the control law: `trial.step([surge, sway, heave, yaw])` in N, N, N and
    N m (steered="volts": in volts, from -2.5 to 2.5), while the docking procedure says what is
    wanted (`trial.wanted`). A trial belongs to the thread and the process that made it.
    """

    def __init__(self, scenario: Scenario | str = "sea_night_active", *, images: bool = False,
                 steered: bool | str = False, **options: Any) -> None:
        made = scenario if isinstance(scenario, Scenario) else Scenario(scenario, **options)
        if isinstance(scenario, Scenario) and options:
            raise TypeError(f"give {', '.join(options)} to the Scenario")
        unit = ("forces" if steered else "") if isinstance(steered, bool) else steered
        self._core = _core.Trial(made._core, images, unit)
        self._result: Result | None = None

    def step(self, demand: Sequence[float] | np.ndarray | None = None) -> None:
        """Lets the next frame's time pass. ValueError after the end."""
        self._core.step(demand)

    @property
    def ended(self) -> bool:
        return self._core.ended

    @property
    def frame(self) -> _core.Frame:
        """The last frame: truth, estimate, commands."""
        return self._core.frame

    @property
    def images(self) -> tuple[np.ndarray, np.ndarray]:
        """What the estimator saw last, left and right, (height, width, 3), RGB, without a copy."""
        return self._core.images

    @property
    def seen(self) -> _core.Observation:
        """Steered: the filtered pose that a law would see."""
        return self._core.seen

    @property
    def wanted(self) -> _core.Reference:
        """Steered: where the procedure wants the marker."""
        return self._core.wanted

    @property
    def given(self) -> np.ndarray:
        """Steered: what came of your demand in the last frame: less where thrusters saturate."""
        return self._core.given

    @property
    def authority(self) -> np.ndarray:
        """Steered: all that the vehicle has on each axis alone, in the demand's unit."""
        return self._core.authority

    @property
    def in_control(self) -> bool:
        """Steered: whether your demand counted in the last frame; not while the vehicle
        searches or drifts."""
        return self._core.in_control

    def set(self, key: str, value: Any) -> None:
        """Changes water, lamps, sea or a law's key from the next frame on."""
        self._core.set(f"{key}={as_yaml(value)}")

    def push(self, newton: Sequence[float]) -> None:
        """A steady force on the vehicle, in the world's axes, until another."""
        self._core.push(list(newton))

    def result(self) -> Result:
        """The result, interrupted where the trial has not ended; it cannot be stepped after that."""
        if self._result is None:
            self._result = Result(*self._core.finish())
        return self._result

    def __iter__(self) -> Iterator[_core.Frame]:
        while not self.ended:
            self.step()
            yield self.frame
