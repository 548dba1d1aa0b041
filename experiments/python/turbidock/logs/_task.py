"""Logs made ready for a fit: clocks aligned, thrusters' wiring checked, windows cut."""

from __future__ import annotations

import os
import tempfile
from typing import Any, Collection, Mapping, Sequence, Union

import numpy as np
import numpy.typing as npt

from .. import _core
from ..scenario import Path, Scenario, scenario_of
from ._log import Log, Window, averaged, errors
from ._output_error import Part, Problem
from ._parameters import FINDS, Parameter, parameters_of, still
from .motion import WATER, check_once, read_motion

MotionLike = Union[Path, Mapping[str, npt.ArrayLike]]

WINDOW_S = 5.0
SHORT_S, MUCH_BETTER = 2.0, 0.6  # windows that tell how thrusters are wired, and by how much
BEFORE_S = 0.3  # of a window's state before its first measurement: the clocks may be off by as much
FARTHEST_S = 2.0  # by which the poses' clock may be off
# How else poses are written: signs and order that make them ours.
OTHERWISE = {"position": (("vehicle_x_m and vehicle_y_m look exchanged", 1, [1, 0, 2]),
                          ("vehicle_y_m looks as if it pointed right", [1, -1, 1], [0, 1, 2]),
                          ("vehicle_x_m to vehicle_z_m look like feet", 0.3048, [0, 1, 2])),
             "velocity": (("surge_mps to heave_mps look like knots", 0.5144, [0, 1, 2]),
                          ("surge_mps to heave_mps look as along axes ahead, right, down", [1, -1, -1], [0, 1, 2])),
             "attitude": (("vehicle_qw to vehicle_qz look like x, y, z, w (ROS, SciPy)", 1, [3, 0, 1, 2]),
                          ("vehicle_qw to vehicle_qz look like the attitude of W in B", [1, -1, -1, -1], [0, 1, 2, 3]))}


class Task:
    """Logs made ready."""

    def __init__(self, logs: MotionLike | Sequence[MotionLike], scenario: Scenario | Path, water: str, thrust_std: float,
                 workers: int | None, find: Collection[str] = ()) -> None:
        given: list[Any] = [logs] if isinstance(logs, (str, os.PathLike)) or hasattr(logs, "keys") else list(logs)
        if not given:
            raise ValueError("no log")
        if water not in ("still", "steady"):
            raise ValueError(f"water must be still or steady, not {water!r}")
        if not set(find) <= set(FINDS):
            raise ValueError(f"find must be of {', '.join(FINDS)}, not {', '.join(find)}")
        self.find = [name for name in FINDS if name in find or name == "current" and water == "steady"]
        if workers is not None and workers < 1 or not 0 <= thrust_std < np.inf:
            raise _core.ConfigError(f"workers must be at least 1, thrust_std a number of at least 0, not {workers or 1} and {thrust_std}")
        self.scenario = scenario_of(scenario)
        files = [os.fspath(log) if isinstance(log, (str, os.PathLike)) else "" for log in given]
        self.names = [os.path.basename(file) or f"log {i + 1}" for i, file in enumerate(files)]
        self.logs = [Log(read_motion(file) if file else log, self.scenario, name) for log, file, name in zip(given, files, self.names)]
        check_once([file for file in files if file])
        self.folder = tempfile.TemporaryDirectory(prefix="turbidock_")
        scenarios = [still(self.scenario, self._series(log)) for log in self.logs]
        delays = {sensor.delay for log in self.logs for sensor in log.sensors}
        self.parameters = parameters_of(self.scenario, thrust_std=thrust_std, find=self.find, delays=delays)
        for log, made in zip(self.logs, scenarios):
            self._align(log, made, workers or 1)
            self._check_wiring(log, made, workers or 1)
        self.problem = Problem(self.logs, scenarios, self.parameters, workers or len(os.sched_getaffinity(0)))

    def _align(self, log: Log, scenario: Scenario, workers: int) -> None:
        """Finds by how much the poses' clock is off where that is more than a fit would find: the offset from which the
        vehicle as it is known before predicts best, each window from its measured beginning."""
        problem = Problem([log], [scenario], [], workers)
        costs = {}
        for offset in np.round(np.arange(-FARTHEST_S, FARTHEST_S + 1e-9, 0.2), 1):
            log.set_offset(float(offset))
            costs[float(offset)] = float(np.nan_to_num(_cost_before(problem, log, WINDOW_S), nan=np.inf))
        best = min(costs, key=lambda offset: costs[offset])
        log.set_offset(best if abs(best) > BEFORE_S / 2 and costs[best] < 0.8 * costs.get(0.0, np.inf) else 0.0)

    def _check_wiring(self, log: Log, scenario: Scenario, workers: int) -> None:
        """ConfigError where the vehicle as it is known before moves much more like the log with a thruster reversed, with two
        exchanged, or with its poses written otherwise."""
        problem = Problem([log], [scenario], [], workers)
        given, names = log.commands, [name for name in log.commands if name != "time_s"]
        plain, costs = _cost_before(problem, log, SHORT_S), {}
        for i, one in enumerate(names):
            tries = {f"thruster {one[:-2]} looks {how}": {one: volts} for how, volts in (
                ("reversed", 5 - given[one]), ("dead", np.full_like(given[one], 2.5)))}
            tries |= {f"thruster {one[:-2]} and {other[:-2]} look exchanged": {one: given[other], other: given[one]} for other in names[:i]}
            for words, change in tries.items():
                log.commands = given | change
                costs[words] = _cost_before(problem, log, SHORT_S)
        log.commands = given
        for sensor in log.sensors:
            values, std = sensor.values, sensor.std
            for words, by, order in OTHERWISE.get(sensor.kind, ()) if values.shape[1] == 3 or sensor.delay == "delay.pose" else ():
                sensor.values, sensor.std = values[:, order] * by, std * float(np.abs(by).max())
                costs[words] = _cost_before(problem, log, SHORT_S)
            sensor.values, sensor.std = values, std
        best = min(costs, key=lambda words: costs[words])
        if costs[best] < MUCH_BETTER * plain:
            raise _core.ConfigError(f"{log.name}: {best}: so the motion of {SHORT_S:g} s is predicted to {costs[best]:.1f} times the noise, "
                                    f"as it stands to {plain:.1f} times")

    def _series(self, log: Log) -> str:
        if not log.water:
            return ""
        name, there = os.path.join(self.folder.name, f"water_{id(log)}.csv"), np.isfinite(log.table[WATER[0]])
        # which every model reads anew
        times, water = averaged(log.table["time_s"][there] - log.clock_begin_s, np.stack([log.table[column][there] for column in WATER], axis=1))
        np.savetxt(name, np.column_stack([times, water]), delimiter=",", header="time_s," + ",".join(WATER), comments="", fmt="%.17g")
        return name

    def own_noise(self, kind: str) -> float:
        """Of a kind of sensor, by the logs' own third differences, and no less than the plant's own error."""
        return max(float(np.median([sensor.std for log in self.logs for sensor in log.sensors if sensor.kind == kind])),
                   self.problem.floor[kind])

    def with_more(self, parameters: Sequence[Parameter]) -> Problem:
        """The problem with these parameters besides."""
        made = Problem(self.logs, self.problem.scenarios, [*self.parameters, *parameters], self.problem.workers)
        made.std, made.floor, made.reject = self.problem.std, self.problem.floor, self.problem.reject
        return made

    def parts(self, held_out: float) -> list[Part]:
        """Windows of all but the last share of each log."""
        made = []
        for log in self.logs:
            windows = log.windows(WINDOW_S, BEFORE_S)
            made += [Part(log, window, log.state_at(window.begin_s)) for window in windows[:fitted(windows, held_out)]]
        if not made:
            raise _core.ConfigError(f"{', '.join(self.names)}: no stretch of {WINDOW_S:g} s without a gap or a jump in commands or motion")
        return made


def _cost_before(problem: Problem, log: Log, window_s: float) -> float:
    """By how many times its noise the log differs from what the vehicle as it is known before would do, from each window's
    measured beginning."""
    parts = [Part(log, window, log.state_at(window.begin_s)) for window in log.windows(window_s, BEFORE_S, 0.5 * window_s)]
    if not parts:
        return np.inf
    simulated = problem.fly(parts, np.zeros(0), [(0, i, part.state) for i, part in enumerate(parts)], [np.zeros(0)], coarse=True)
    off = [(errors(sensor.kind, states[sensor.kind], sensor.values[part.window.rows[sensor.kind]]), sensor.std)
           for part, states in zip(parts, simulated) for sensor in log.sensors]
    return float(np.mean([np.linalg.norm(each, axis=1).mean() / std for each, std in off]))


def fitted(windows: Sequence[Window], held_out: float) -> int:
    """How many of a log's windows are fitted; the others are for at least one prediction."""
    return len(windows) if held_out <= 0 else max(1, len(windows) - max(2, round(held_out * len(windows))))
