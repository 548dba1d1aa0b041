"""An experiment to fly: commands that tell most of a vehicle, within a pool and a share of its thrust.

Candidates are blocks of ten seconds, each of one axis or two: sums of sines (Morelli, "Multiple input design for real-time
parameter estimation in the frequency domain", 2003) and steps to and fro (3-2-1-1, Marchand 1977), in two strengths and both
signs. Every candidate is simulated on the vehicle as it is known before; the block with the largest gain of ln det of information
and prior comes next, until the time is full or none stays in the pool."""

from __future__ import annotations

from typing import Any, Iterator, Mapping

import numpy as np

from .. import _core
from ..scenario import Path, Scenario, scenario_of
from ._log import Log
from ._output_error import Part, Problem, reduce
from ._parameters import Parameter, buoyancy_newton, parameters_of, plain_vehicle, scenario_with, still
from .motion import POSITION, QUATERNION, Numbers

BLOCK_S = 10.0
COAST_S = 2.0  # at its end, at neutral
BEGIN = np.array([[0, 0, -5.0, 1] + [0] * 9])  # at rest, 5 m deep
COMMANDS_HZ = 10  # as logs have them: what changes between two logged commands is lost to identify
AXES = ("surge_newton", "sway_newton", "heave_newton", "yaw_newton_m")
POSITION_STD_M, ATTITUDE_STD_RAD = 0.005, 0.0087


def plan(scenario: Scenario | Path, *, duration_s: float = 60, pool_m: tuple[float, float, float] = (4, 3, 1),
         most_thrust: float = 0.7, workers: int = 1) -> dict[str, Numbers]:
    """Commands over time for the scenario's vehicle (`THRUSTER_v`, as playback takes them), begun in the middle of a pool of
    this length, width and depth, along W's axes, with the bow along the length. They use at most that share of each axis'
    thrust. ConfigError where not one block stays in the pool."""
    if not (duration_s >= BLOCK_S and 0 < most_thrust <= 1):
        raise _core.ConfigError(f"an experiment of {duration_s:g} s at {most_thrust:g} of the thrust: a block takes {BLOCK_S:g} s, all is 1")
    made = still(scenario_of(scenario))
    made._cpp.set(["trial.clock.ticks_per_frame=4"])  # of 120 Hz or so: quick, and near enough to choose by
    parameters = parameters_of(made, delays=())
    blocks = list(_candidates(made, most_thrust))
    simulated = [_fly(made, block) for block in blocks]
    room = 0.5 * np.array(pool_m)
    kept = [i for i, states in enumerate(simulated) if (np.abs(states[:, :3] - states[0, :3]) < room).all()]
    if not kept:
        raise _core.ConfigError(f"no block of {BLOCK_S:g} s stays in a pool of {pool_m[0]:g} x {pool_m[1]:g} x {pool_m[2]:g} m")
    # A block and its mirror image tell the same.
    known = {i: _information(made, parameters, blocks[i], simulated[i], workers) for i in sorted({i - i % 2 for i in kept})}
    chosen = np.zeros((0, 4))
    total = np.eye(len(parameters))
    for _ in range(int(duration_s / BLOCK_S)):
        gains = sorted(kept, key=lambda i: -float(np.linalg.slogdet(total + known[i - i % 2])[1]))
        for i in gains:
            states = _fly(made, np.concatenate([chosen, blocks[i]]))
            if (np.abs(states[:, :3] - states[0, :3]) < room).all():
                chosen, total = np.concatenate([chosen, blocks[i]]), total + known[i - i % 2]
                break
        else:
            break
    return _table(made, chosen)


def drift(scenario: Scenario | Path, commands: Mapping[str, Numbers]) -> tuple[float, float]:
    """How far a plan may leave its depth, m, as the vehicle's buoyancy is known to so many newtons (95 %)."""
    made = still(scenario_of(scenario))
    buoyancy = next(parameter for parameter in parameters_of(made) if parameter.name == "trim.buoyancy")
    models = [scenario_with(made, {buoyancy.name: buoyancy.value(z)}) for z in (-1.96, 0, 1.96)]
    ends = _core.predict([model._cpp for model in models], dict(commands), np.zeros(1), [commands["time_s"][-1:]], np.arange(3),
                         np.zeros(3, np.int64), np.repeat(BEGIN, 3, axis=0), 1)
    return max(abs(float(end[0, 2] - ends[1][0, 2])) for end in ends), 1.96 * buoyancy.std


def _table(scenario: Scenario, demands: Numbers) -> dict[str, Numbers]:
    """Demands by axis, besides what holds the vehicle's depth as far as its buoyancy is known, as the thrusters' voltages."""
    demands = demands - np.array([0, 0, buoyancy_newton(plain_vehicle(scenario)), 0])
    time_s = np.arange(len(demands)) / COMMANDS_HZ
    times, volts = _core.commands(scenario._cpp, {"time_s": time_s} | {name: demands[:, i] for i, name in enumerate(AXES)}, "plan")
    return {"time_s": times} | {f"{name}_v": volts[:, i] for i, name in enumerate(_core.thrusters(scenario._cpp))}


def _candidates(scenario: Scenario, most_thrust: float) -> Iterator[Numbers]:
    """Demands by axis, (n, 4), in newtons."""
    most, back = _core.authority(scenario._cpp)
    full = most_thrust * np.minimum(most, -back)
    axes = [full * (np.arange(4) == axis) for axis in range(4) if full[axis] > 0]
    for strength in (0.3, 0.6, 1.0):
        shapes = [shape * strength for shape in _shapes()]
        blocks = [np.outer(shape, axis) for axis in axes for shape in shapes]
        blocks += [np.outer(shapes[0], axis) + np.outer(0.6 * shapes[1], axes[-1]) for axis in axes[:-1]]  # while it turns
        for block in blocks:  # each before its mirror image
            yield block
            yield -block


def _shapes() -> Iterator[Numbers]:
    """In -1 to 1 over a block, and 0 while it coasts."""
    count, length = int(BLOCK_S * COMMANDS_HZ), BLOCK_S - COAST_S
    t = np.arange(count) / COMMANDS_HZ
    for harmonics in ((1, 2, 5), (2, 3, 7)):
        # phases after Schroeder 1970, which keep the peak low
        total = np.sum([np.cos(2 * np.pi * k * t / length - np.pi * i * i / len(harmonics)) for i, k in enumerate(harmonics)], axis=0)
        window = np.clip(np.minimum(t, length - t) / 0.5, 0, 1)
        yield np.asarray(window * total / np.abs(total[t < length]).max())
    for unit in (0.5, 1.0):
        pattern = np.concatenate([np.full(int(n * unit * COMMANDS_HZ), s) for n, s in ((3, 1), (2, -1), (1, 1), (1, -1))])
        once = np.concatenate([pattern, -pattern])[:int(length * COMMANDS_HZ)]
        yield np.pad(once, (0, count - len(once)))


def _fly(scenario: Scenario, demands: Numbers) -> Numbers:
    """States at COMMANDS_HZ of the vehicle from rest, trimmed."""
    times = np.arange(0, len(demands) / COMMANDS_HZ, 1 / COMMANDS_HZ)
    return _core.predict([scenario._cpp], _table(scenario, demands), np.zeros(1), [times], none := np.zeros(1, np.int64), none, BEGIN, 1)[0]


def _information(scenario: Scenario, parameters: list[Parameter], demands: Numbers, states: Numbers, workers: int) -> Any:
    """Of a block, by the parameters' z."""
    motion = _table(scenario, demands) | dict(zip(POSITION + QUATERNION, states[:, :7].T))
    log = Log(motion, scenario, "block")
    problem = Problem([log], [scenario], parameters, workers)
    problem.std = {"position": POSITION_STD_M, "attitude": ATTITUDE_STD_RAD}
    window = log.window(0.0, float(motion["time_s"][-1]) + 1e-6, 0.0)
    assert window is not None
    parts = [Part(log, window, BEGIN[0])]
    z = np.zeros(len(parameters))
    return reduce(problem.linear(parts, z, problem.slopes(parts, z)), parts, [parts[0].state]).information
