"""A trial stepped frame by frame."""

from __future__ import annotations

from typing import Any, Iterator

from . import _core
from .results import Result
from .scenario import Scenario, as_yaml


class Trial(_core.Trial):
    """A trial under way.

        trial = turbidock.Trial("sea_night_active", seed=77, images=True)
        for frame in trial:
            left, right = trial.images            # read-only; what you keep is never overwritten
            print(frame.time_s, frame.true_position, frame.estimated_position)
        print(trial.result().digest)              # that of turbidock.run

    With `steered`, you are the controller: `trial.step([surge, sway, heave, yaw])` in N, N, N and
    N m (steered="volts": in volts, from -2.5 to 2.5), while the docking procedure says what is
    wanted (`trial.wanted`). A trial belongs to the thread and the process that made it.
    """

    def __init__(self, scenario: Scenario | str = "sea_night_active", *, images: bool = False,
                 steered: bool | str = False, **options: Any) -> None:
        made = scenario if isinstance(scenario, Scenario) else Scenario(scenario, **options)
        if isinstance(scenario, Scenario) and options:
            raise TypeError(f"give {', '.join(options)} to the Scenario")
        unit = ("forces" if steered else "") if isinstance(steered, bool) else steered
        super().__init__(made._core, images, unit)
        self._result: Result | None = None

    def set(self, key: str, value: Any) -> None:
        """Changes water, lamps, sea or a controller's key from the next frame on."""
        self.assign(f"{key}={as_yaml(value)}")

    def result(self) -> Result:
        """The result, interrupted where the trial has not ended; it cannot be stepped after that."""
        if self._result is None:
            self._result = Result(*self.finish())
        return self._result

    def __iter__(self) -> Iterator[_core.Frame]:
        while not self.ended:
            self.step()
            yield self.frame
