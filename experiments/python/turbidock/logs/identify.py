"""From logs of commands and motion to a vehicle's parameters.

    told = identify.inform("log.csv", "pool_active")      # before any fit: what this log can tell, and what to fly besides
    fit = identify.fit(["log.csv"], "pool_active")        # tables of motion (turbidock.logs.motion): files or dicts of arrays
    print(fit)                                            # values with 95 % intervals, held-out prediction
    fit.save("mine.yaml")                                 # the vehicle's data; beside mine.xml it is `vehicle.model: mine.xml`
    turbidock.run("sea_night_active", settings=fit.settings())   # the vehicle and the laws' model of it

The scenario names the vehicle: its MJCF, what is known of it before, and the water's density. The plant that is fitted is the
simulator's own, in open water. Masses and inertia of the rigid body, and the thrust at full voltage, are held: motion alone
tells only their ratio to everything else (`thrust_std` says how well the thrust is known). Method: _output_error.py.
"""

from __future__ import annotations

import argparse
import datetime
import os
import sys
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Collection, Iterable, Sequence

import numpy as np
import numpy.typing as npt

from .. import _core
from ..scenario import Path, Scenario, scenario_of
from ._log import errors
from ._output_error import (LEADS_ON, Linear, Part, correlation_time, covariance_of, disagreement, noise, reduce, share_of_noise, solve,
                            step_error)
from ._parameters import AXES, FINDS, Parameter, data_of, parameters_to_find, plain_vehicle, vehicle_yaml
from .._rotation import angles_of, product, turned
from ._task import BEFORE_S, WINDOW_S, MotionLike, Task, fitted
from .excitation import drift, plan
from .motion import Numbers, make_folder_of, whole_file, write_motion

if TYPE_CHECKING:
    import matplotlib.figure
    import pandas

TOLD = 0.5  # of what was known before: what a log leaves more uncertain than that is not told by it
FROM_NOISE = 0.1  # of its information: what seems to be told by no more than the measurements' noise is not told
CORRELATED = 0.9
SURE = 3.1  # standard deviations: of a thousand tests one is beyond by chance
LEAD_S, AHEAD_S = 4.0, 5.0  # of a held-out window: from which its state is known, and of its prediction
NO_OFFER = ("; none of what logs often have explains it: where the water moves, log it as water_x_mps, water_y_mps, water_z_mps, or fly "
            "where it stands")
UNITS = {"position": "m", "attitude": "rad", "velocity": "m/s", "turn_rate": "rad/s", "depth": "m"}


@dataclass
class Information:
    """What a log can tell."""

    parameters: list[Parameter]
    std: Numbers  # of each z after the log; before it 1
    correlation: Numbers
    from_noise: Numbers  # share of each parameter's information
    windows: int
    duration_s: float
    held: npt.NDArray[np.bool_]  # at their values before, as they were not told
    notes: list[str]
    wider: Numbers  # each interval, by this factor, than the noise that is left has it: windows differ by more

    def told(self) -> list[bool]:
        """Whether the log at least halves what was uncertain, by more than noise."""
        return [bool(std <= TOLD and share < FROM_NOISE and not held) for std, share, held in zip(self.std, self.from_noise, self.held)]

    def pairs(self) -> list[tuple[str, str, float]]:
        """Parameters that the log tells together rather than each, with their correlation."""
        names = [parameter.name for parameter in self.parameters]
        return sorted(((names[i], names[j], float(self.correlation[i, j])) for i in range(len(names)) for j in range(i)
                       if abs(self.correlation[i, j]) > CORRELATED), key=lambda pair: -abs(pair[2]))

    def advice(self) -> list[str]:
        """What to fly besides, a line each."""
        dark = [parameter for parameter, told in zip(self.parameters, self.told()) if not told]
        lines = []
        for axis in AXES:
            groups = [parameter.name.split(".")[0].replace("_", " ") for parameter in dark if parameter.name.endswith("." + axis)]
            how = ("hard stops and turns that tilt it, or thrusters that do" if axis in ("roll", "pitch") else "steps to full thrust and "
                   "back, then a coast" if groups == ["quadratic damping"] else "slow and fast motion to and fro, then a coast")
            lines += [f"{axis}: {how} ({', '.join(groups)})"] if groups else []
        others = {"trim.": "hover with the thrusters off, for seconds (trim)",
                  "thrust.reverse": "the same motion ahead and back (reverse thrust)",
                  "thrust.dead_band": "commands around neutral that hardly move it (dead band)",
                  "thrust.exponent": "thrust in several steps from little to full (exponent of the thrust curve)",
                  "thrust.lag": "quick reversals, logged at 10 Hz or more (thrusters' lag)",
                  "thrust.inflow": "full speed against thrust astern (loss with inflow)",
                  "thrust.scale": "none: pull it once with a spring balance (thrust)"}
        return lines + [line for begin, line in others.items() if any(parameter.name.startswith(begin) for parameter in dark)]

    def __str__(self) -> str:
        lines = [f"{self.windows} windows of {self.duration_s:.0f} s of motion", *self.notes, ""]
        for parameter, std, told in zip(self.parameters, self.std, self.told()):
            width = (f"within a factor {np.exp(1.96 * std * parameter.std):.2f}" if parameter.scale else
                     f"± {1.96 * std * parameter.std:.3g} {parameter.unit}")
            lines.append(f"  {parameter.name:26}{width:26}{'' if told else 'not told: held by what is known of it'}")
        for a, b, value in self.pairs()[:8]:
            lines.append(f"  {a} and {b} hang together: correlation {value:+.2f}")
        return "\n".join(lines + self.advised())

    def advised(self) -> list[str]:
        return ["", "To tell the rest, fly besides:", *(f"  {line}" for line in self.advice())] if self.advice() else []


@dataclass
class Fit:
    """A vehicle as its logs have it."""

    scenario: Scenario
    parameters: list[Parameter]
    z: Numbers
    information: Information  # at these parameters, with the noise that was found
    noise: dict[str, float]
    correlation_rows: float
    outliers: float  # share of measurements
    validation: dict[str, Any]
    source: str
    compared: dict[str, tuple[Numbers, Numbers, Numbers]] = field(default_factory=dict)  # by sensor: measured, predicted, the difference
    offsets_s: list[float] = field(default_factory=list)  # of each log's poses, roughly, besides delay.pose
    doubt: str = ""  # why no interval is to be believed

    def value(self, name: str) -> float:
        return self.values()[name]

    def _index(self, name: str) -> int:
        return [parameter.name for parameter in self.parameters].index(name)

    def values(self) -> dict[str, float]:
        return {parameter.name: parameter.value(z) for parameter, z in zip(self.parameters, self.z)}

    def interval(self, name: str) -> tuple[float, float]:
        """95 %."""
        i = self._index(name)
        half = 1.96 * self.information.std[i] * self.information.wider[i]
        return self.parameters[i].value(self.z[i] - half), self.parameters[i].value(self.z[i] + half)

    def told(self, name: str) -> bool:
        return self.information.told()[self._index(name)]

    def table(self) -> pandas.DataFrame:
        """A row a parameter: value, low and high of its 95 % interval, before, unit, told."""
        import pandas

        rows = [(parameter.name, parameter.value(z), *self.interval(parameter.name), parameter.before, parameter.unit,
                 self.told(parameter.name)) for parameter, z in zip(self.parameters, self.z)]
        return pandas.DataFrame(rows, columns=["parameter", "value", "low", "high", "before", "unit", "told"])

    def data(self) -> dict[str, Any]:
        """Keys of the vehicle's data with the values found."""
        vehicle = plain_vehicle(self.scenario)
        return data_of(vehicle, self.values()) | {
            "thrusters.dead_time_s": min(max(vehicle["thrusters"]["dead_time_s"] + self.latency_s(), 0.0), 1.0)}

    def latency_s(self) -> float:
        """Of the motion behind the commands, as it was told: by sensors on the commands' clock, else by the poses."""
        return self.values().get("delay.onboard", self.values().get("delay.pose", 0.0))

    def settings(self) -> dict[str, Any]:
        """For a scenario: the vehicle, and what its controller knows of it."""
        return {f"{group}.{key}": value for group in ("vehicle", "control.known_vehicle") for key, value in self.data().items()}

    def save(self, file: Path) -> None:
        """Writes the vehicle's data, with each number's interval and source in a comment. Whole or not at all."""
        comments = {str(row.parameter): f"{row.value:.4g} {self._width(row)}" if row.told else self._untold(row)
                    for row in self.table().itertuples()}
        text = vehicle_yaml(self.scenario, self.data(), comments, f"{self.source}, {datetime.date.today().isoformat()}")
        with whole_file(file) as out:
            out.write(text.encode())

    def _width(self, row: Any) -> str:
        return "(not to be believed)" if self.doubt else f"({row.low:.4g} to {row.high:.4g})"

    @staticmethod
    def _untold(row: Any) -> str:
        return "not told, kept" if row.value == row.before else f"{row.value:.4g} told only together with others"

    def plot(self) -> matplotlib.figure.Figure:
        """What every sensor measured and what is predicted, and the residuals, over the windows."""
        import matplotlib.pyplot as plt

        figure, axes = plt.subplots(len(self.compared), 2, figsize=(15, 3.5 * len(self.compared)), squeeze=False)
        for (whole, left), (kind, (measured, predicted, off)) in zip(axes, self.compared.items()):
            whole.plot(measured, ".", markersize=3)
            whole.set_prop_cycle(None)  # the same colours again
            whole.plot(predicted, linewidth=0.8)
            left.plot(off, ".", markersize=2)
            whole.set_title(f"{kind} [{UNITS[kind]}]: dots measured, lines predicted")
            left.set_title("predicted less measured")
            for sign in (-2, 2):
                left.axhline(sign * self.noise[kind], color="0.6", linewidth=0.8)
        for axis in axes[-1]:
            axis.set_xlabel("measurement")
        figure.tight_layout()
        return figure

    def __str__(self) -> str:
        lines = [f"of {self.source}", ""]
        for row in self.table().itertuples():
            lines.append(f"  {row.parameter:26}{row.value:10.4g}  " + (f"{self._width(row)} {row.unit}" if row.told else self._untold(row)))
        lines += ["", *(f"  {note}" for note in self.information.notes)]
        lines += [f"  not to be believed: {self.doubt}"] if self.doubt else []
        if self.latency_s() > 5e-4:
            lines.append(f"  motion follows the commands {1000 * self.latency_s():.0f} ms late: the vehicle's data have it as "
                         "thrusters.dead_time_s; set it to 0 where the motion's clock is late instead, as motion capture's or a camera's may be")
        lines += [f"  {name}: its poses' clock is {offset:+.1f} s off, besides delay.pose"
                  for name, offset in zip(self.source.split(", ")[1:], self.offsets_s) if offset]
        lines += [f"  noise of {kind}: {value:.3g}" for kind, value in self.noise.items()]
        if self.outliers > 0.001:
            lines.append(f"  {100 * self.outliers:.1f} % of the measurements are no noise and were left out")
        if self.correlation_rows > 1.5 and not self.doubt:
            lines.append(f"  what is left hangs together over {self.correlation_rows:.1f} rows: intervals are widened for it")
        if self.validation:
            lines.append(f"  held out: position after {AHEAD_S:g} s within {1000 * self.validation['median_m']:.0f} mm "
                         f"(median of {self.validation['windows']}), before the fit {1000 * self.validation['before_m']:.0f} mm")
        return "\n".join(lines + ([] if self.doubt else self.information.advised()))


def inform(logs: MotionLike | Sequence[MotionLike], scenario: Scenario | Path, *, water: str = "still", find: Collection[str] = (),
           thrust_std: float = 0, workers: int | None = None) -> Information:
    """What the logs can tell of the scenario's vehicle, before any fit: by the Fisher information at what is known of it."""
    task = Task(logs, scenario, water, thrust_std, workers, find)
    parts = task.parts(0)
    z = np.zeros(len(task.parameters))
    solve(task.problem, parts, z, with_z=False, most=6)
    linear = task.problem.linear(parts, z, task.problem.slopes(parts, z))
    reduced = reduce(linear, parts, [part.state for part in parts])
    covariance = np.asarray(np.linalg.inv(reduced.information + np.eye(len(z))), float)
    return _information(task, parts, share_of_noise(task.problem, parts, z, reduced, linear), covariance, np.ones(len(z)))


def fit(logs: MotionLike | Sequence[MotionLike], scenario: Scenario | Path, *, water: str = "still", find: Collection[str] = (),
        thrust_std: float = 0, held_out: float = 0.2, workers: int | None = None) -> Fit:
    """The parameters of the scenario's vehicle that explain the logs, from what the scenario says of it as a start and a prior.
    `water`: it is "still", or "steady" as a current that is found too; where the logs measured it, it is theirs. `find`: what else
    is found, of "lever_arm", "couplings", "tether", "sag". `held_out`: the share of each log, its end, that is predicted and not fitted."""
    task = Task(logs, scenario, water, thrust_std, workers, find)
    problem, parts = task.problem, task.parts(held_out)
    z = np.zeros(len(task.parameters))
    for most in (8, 3):
        problem.coarse = most == 8
        z, reduced, linear = solve(problem, parts, z, most=most, enough=LEADS_ON, slopes=problem.old)
        problem.floor = step_error(problem, parts, z, linear) if problem.coarse else problem.floor
        problem.std = noise(problem, linear, parts)
        problem.reject = True
    if believed := disagreement(linear, reduced) < SURE:
        z, reduced, linear = solve(problem, parts, z, most=3, enough=LEADS_ON, slopes=problem.old)
        problem.std = noise(problem, linear, parts)
        z, reduced, linear = solve(problem, parts, z, most=6)
    free, lacks, share = (z, reduced, linear), disagreement(linear, reduced) >= SURE, share_of_noise(problem, parts, z, reduced, linear)
    while True:  # what is not told stands at its value before, and the rest is fitted to that
        known = _information(task, parts, share, *covariance_of(linear, reduced))
        moved = ~np.array(known.told()) & ~problem.held & (z != 0)
        problem.held |= moved
        z = np.where(problem.held, 0, z)
        if not moved.any() or not believed:
            break
        z, reduced, linear = solve(problem, parts, z, most=2, slopes=problem.old)
    apart = disagreement(linear, reduced)
    if apart >= SURE and not lacks:  # several are told together, as other than their values before
        problem.held[:] = False
        z, reduced, linear = free
        known = _information(task, parts, share, *covariance_of(linear, reduced))
    doubt = "" if believed and (apart < SURE or not lacks) else _doubt(task, parts, free[0], linear, apart)
    weights = np.concatenate([weight for one in linear for weight in one.weight.values()])
    return Fit(task.scenario, task.parameters, z, known, problem.std, correlation_time(linear), float((weights == 0).mean()),
               {} if doubt else _validate(task, z, held_out), "turbidock-identify, " + ", ".join(task.names),
               {kind: _compared(kind, parts, linear) for kind in problem.std},
               [max((sensor.offset_s for sensor in log.sensors), key=abs) for log in task.logs], doubt)


def _doubt(task: Task, parts: list[Part], z: Numbers, linear: Sequence[Linear], apart: float) -> str:
    """Why a fit is not to be believed, and what of the usual lacks explains it."""
    left, kind = max((std / task.own_noise(kind), kind) for kind, std in task.problem.std.items())
    costs = [one.cost / len(one.residual) for one in linear]
    log, window = parts[np.argmax(costs)].log, parts[np.argmax(costs)].window  # where a hand held it, or it went wrong
    where = "" if max(costs) < 3 * np.median(costs) else ", most from {:.1f} to {:.1f} s of {}".format(
        window.first_s + log.clock_begin_s, window.last_s + log.clock_begin_s, log.name)
    return (f"what is left of {kind} is {left:.1f} times the log's own noise and hangs together over {correlation_time(linear):.1f} rows, and "
            f"windows of {WINDOW_S:g} s contradict each other{where}: the model lacks something" + _offer(task, parts, z, apart))


def _offer(task: Task, parts: list[Part], z: Numbers, apart: float) -> str:
    """Which of the usual lacks explains most of what is left: that with the largest gain of the likelihood by a linear step, less
    what as many parameters gain from noise (a score test; Schwarz 1978), if in a fit with it windows agree more, most of the cost
    beyond noise goes, and a value is beyond its own interval."""
    added_mass = plain_vehicle(task.scenario)["hydrodynamics"]["added_mass_diagonal"]
    more = {name: parameters_to_find(name, added_mass) for name in FINDS if name not in task.find}
    problem = task.with_more([parameter for each in more.values() for parameter in each])
    known = len(task.parameters)
    start = np.append(z, np.zeros(len(problem.parameters) - known))
    slopes = [{kind: (np.hstack([old[kind][0], by_z[:, known:]]), old[kind][1]) for kind, (by_z, _) in new.items()}
              for old, new in zip(task.problem.old, problem.slopes(parts, start, known, state=False))]
    linear = problem.linear(parts, start, slopes)
    reduced = reduce(linear, parts, [part.state for part in parts])
    normal, force, count = reduced.information + np.eye(len(start)), reduced.gradient + start, sum(len(one.residual) for one in linear)
    at = np.cumsum([known] + [len(each) for each in more.values()])
    tried = {"": np.arange(known)} | {name: np.r_[:known, first:last] for name, first, last in zip(more, at, at[1:])}
    scores = {name: float(force[free] @ np.linalg.solve(normal[np.ix_(free, free)], force[free])) - len(free) * np.log(count)
              for name, free in tried.items()}
    if not (best := max(scores, key=lambda name: scores[name])):
        return NO_OFFER
    problem = task.with_more(more[best])
    slopes = [{kind: (by_z[:, tried[best]], by_state) for kind, (by_z, by_state) in each.items()} for each in slopes]
    with_it, reduced, solved = solve(problem, parts, np.append(z, np.zeros(len(more[best]))), most=2, enough=LEADS_ON, slopes=slopes)
    after, (covariance, wider) = disagreement(solved, reduced), covariance_of(solved, reduced)
    sure = (wider * np.sqrt(np.diag(covariance)))[known:]
    by_noise = sum(raw.size * (task.own_noise(kind) / problem.std[kind])**2 for one in linear for kind, raw in one.raw.items())
    unexplained = [max(sum(one.cost for one in each) - by_noise, 0) for each in (solved, linear)]
    explains = after < 0.5 * apart and unexplained[0] <= 0.5 * unexplained[1] and (abs(with_it[known:]) > SURE * sure).any()
    values = ", ".join(f"{one.name} {one.value(to):.3g} {one.unit}" for one, to in zip(more[best], with_it[known:]))
    return NO_OFFER if not explains else f"; with {FINDS[best]} they agree{'' if after < SURE else ' more'}: {values}"


def _compared(kind: str, parts: Sequence[Part], linear: Sequence[Linear]) -> tuple[Numbers, Numbers, Numbers]:
    """What a sensor measured in the windows, what is predicted, of attitudes the angles, and by how much that is off."""
    rows = []
    for part, one in zip(parts, linear):
        if (sensor := part.log.sensor(kind)) is not None:
            values, off = sensor.values[part.window.rows[kind]], one.raw[kind]
            rows.append((angles_of(values), angles_of(product(values, turned(off))), off) if kind == "attitude" else (values, values + off, off))
    measured, predicted, off = (np.concatenate(each) for each in zip(*rows))
    return measured, predicted, off


def _information(task: Task, parts: Sequence[Part], share: Numbers, covariance: Numbers, wider: Numbers) -> Information:
    std, duration = np.sqrt(np.diag(covariance)), sum(part.window.last_s - part.window.first_s for part in parts)
    return Information(task.parameters, std, covariance / np.outer(std, std), share, len(parts), duration, task.problem.held,
                       [note for log in task.logs for note in log.notes], wider)


def _validate(task: Task, z: Numbers, held_out: float) -> dict[str, Any]:
    """How far predictions are off in what was held out."""
    before, after = (_misses(task, at, held_out) if held_out > 0 else np.zeros(0) for at in (np.zeros(len(z)), z))
    return {} if not len(after) else {"windows": len(after), "median_m": float(np.median(after)), "before_m": float(np.median(before))}


def _misses(task: Task, z: Numbers, held_out: float) -> Numbers:
    leads, targets = [], []
    for log in task.logs:
        position = log.sensor("position")
        windows = log.windows(WINDOW_S, BEFORE_S)
        if position is None or len(windows) < 2:
            continue
        first = windows[fitted(windows, held_out)].first_s
        for begin, end in log.stretches():
            at = max(begin + BEFORE_S, first)
            while at + LEAD_S + AHEAD_S < end:
                lead, ahead = log.window(at, at + LEAD_S, BEFORE_S), log.window(at + LEAD_S, at + LEAD_S + AHEAD_S, BEFORE_S)
                if lead and ahead:
                    leads.append(Part(log, lead, log.state_at(lead.begin_s)))
                    rows = np.flatnonzero(np.abs(position.time_s - (at + LEAD_S + AHEAD_S)) < 0.1)
                    ahead.begin_s, ahead.rows = lead.begin_s, {s.kind: rows if s is position else rows[:0] for s in log.sensors}
                    targets.append(ahead)
                at += 1.0
    if not leads:
        return np.zeros(0)
    solve(task.problem, leads, z, with_z=False, most=6)
    aims = [Part(lead.log, target, lead.state) for lead, target in zip(leads, targets)]
    simulated = task.problem.fly(aims, z, [(0, i, aim.state) for i, aim in enumerate(aims)], [z])
    misses = []
    for aim, states in zip(aims, simulated):
        if (sensor := aim.log.sensor("position")) is not None and len(rows := aim.window.rows["position"]):
            off = errors("position", states["position"], sensor.values[rows])
            misses.append(float(np.linalg.norm(np.median(off, axis=0))))
    return np.array(misses)


def main(arguments: Iterable[str] | None = None) -> int:
    """turbidock-identify."""
    parser = argparse.ArgumentParser(prog="turbidock-identify", description="A vehicle's parameters from logs of its motion")
    commands = parser.add_subparsers(dest="command", required=True)
    for name, about in (("inform", "what logs can tell, before any fit"), ("fit", "the parameters, with intervals")):
        command = commands.add_parser(name, help=about)
        command.add_argument("logs", nargs="+", help="tables of motion (CSV), `trajectory.csv` for instance")
        command.add_argument("--water", choices=("still", "steady"), default="still")
        command.add_argument("--find", nargs="+", default=[], choices=list(FINDS), help="what else the log has")
        command.add_argument("--thrust-std", type=float, default=0, help="relative, of what is known of the thrust")
        command.add_argument("--workers", type=int)
        if name == "fit":
            command.add_argument("--out", help="the vehicle's data (YAML)")
            command.add_argument("--plot", help="residuals as a picture")
    command = commands.add_parser("plan", help="commands that tell most, as a file to play")
    command.add_argument("--duration", type=float, default=60)
    command.add_argument("--pool", type=float, nargs=3, default=(4, 3, 1), metavar=("LENGTH", "WIDTH", "DEPTH"))
    command.add_argument("--most-thrust", type=float, default=0.7, help="share of full thrust")
    command.add_argument("--out", required=True)
    for command in commands.choices.values():
        command.add_argument("--scenario", required=True, help="names the vehicle and what is known of it")
        command.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="one key of the scenario")
    try:
        return _do(parser.parse_args(None if arguments is None else list(arguments)))
    except (_core.ConfigError, OSError) as error:
        print(error, file=sys.stderr)
        return 2


def _do(given: argparse.Namespace) -> int:
    scenario = scenario_of(given.scenario, settings=given.set)
    for file in filter(None, (getattr(given, "out", None), getattr(given, "plot", None))):
        if os.path.realpath(file) in map(os.path.realpath, getattr(given, "logs", ())):
            raise _core.ConfigError(f"{file}: is the log, which is not written over")
        make_folder_of(file)  # before a fit that takes long
    if given.command == "plan":
        made = plan(scenario, duration_s=given.duration, pool_m=tuple(given.pool), most_thrust=given.most_thrust)
        write_motion(made, given.out)
        (far_m, newton), most_m = drift(scenario, made), 0.5 * given.pool[2]
        if far_m > most_m:
            print(f"{given.out}: its buoyancy is known to {newton:.1f} N: flown open loop it may rise or sink by {far_m:.1f} m, and {most_m:g} m "
                  f"are free. Trim it to {newton * most_m / far_m:.2g} N first, or hold depth besides and log what the thrusters get")
        return 0
    options: dict[str, Any] = {"water": given.water, "find": given.find, "thrust_std": given.thrust_std, "workers": given.workers}
    if given.command == "inform":
        print(inform(given.logs, scenario, **options))
        return 0
    found = fit(given.logs, scenario, **options)
    print(found)
    if given.out:
        found.save(given.out)
    if given.plot:
        found.plot().savefig(given.plot)
    return 1 if found.doubt else 0
