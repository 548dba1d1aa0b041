"""Output error over short windows: which parameters, and which state at the beginning of each window, have the real plant
move as the log says. Gauss-Newton by finite differences, every flight of an iteration at once in C++; the windows' states are
eliminated (a Schur complement), so that their number costs nothing. Flights are made by few steps a frame and by fewer, and
extrapolated to endless ones (Richardson 1911): ten steps' work in place of sixteen, a twentieth of the plant's own error. Slopes serve
until they lead no further, as a flight without them costs a thirtieth; at the end fresh ones must lead no further.

Prior: every z is normal, 0 and 1 (_parameters.py). Noise: normal, of a standard deviation for each sensor that is found from
the residuals; measurements that no noise explains lose their weight (Huber 1981), then all of it, but in a window of which half
would go: there it is the state that is wrong. Residuals that hang together from row to row, which is what a wrong model or waves
leave, widen each interval by what they are at the frequencies that tell its parameter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Sequence

import numpy as np
import numpy.typing as npt

from .. import _core
from ..scenario import Scenario
from ._log import STATE, Log, Sensor, Window, errors
from ._parameters import Parameter, plain_vehicle, scenario_with
from .motion import Numbers
from .._rotation import product, rotated, turned

FREE = 12  # of a window's state: position in W, turn in B, velocity, turn rate
FREE_STD = np.array([3.0] * 3 + [0.3] * 3 + [0.5] * 3 + [0.5] * 3)  # about the first guess: next to nothing is known
STEP, STEP_Z = np.full(FREE, 1e-4), 1e-3
TICKS, FEWER_TICKS = 6, 4  # of physics a frame; the error is in proportion to their length
LEVER = ("lever.ahead", "lever.left", "lever.above")
SUSPECT, IMPOSSIBLE = 2.5, 6.0  # standard deviations
MOST = 0.5  # of a window that may be impossible
WRONG, HARDLY = 4.0, 0.05  # cost of a measurement, and share of it gained by fresh slopes: a model that is wrong, not yet to be found
BANDS = np.array([0, 1, 2, 3, 4, 5, 6, 8, 10, 13, 17, 22, 30])  # of residuals' spectra, half periods in a window
LEADS_ON, CONVERGED = 3.0, 0.1  # gain of the cost, in variances, by old slopes and by fresh ones


def moved(state: Numbers, by: Numbers) -> Numbers:
    """A state with its twelve degrees of freedom changed."""
    made = np.array(state)
    made[..., :3] += by[..., :3]
    made[..., 3:7] = product(state[..., 3:7], turned(by[..., 3:6]))
    made[..., 7:13] += by[..., 6:12]
    return made


@dataclass
class Part:
    """A window of a log, with what is compared in it."""

    log: Log
    window: Window
    state: Numbers  # at its beginning, the best guess so far


@dataclass
class Linear:
    """Residuals of one window and how they change: whitened, robustly weighted."""

    residual: Numbers
    by_z: Numbers  # (n, parameters)
    by_state: Numbers  # (n, FREE)
    raw: dict[str, Numbers]  # errors by sensor, (rows, components)
    weight: dict[str, Numbers]
    cost: float  # Huber's: quadratic, then linear


# By sensor: how its errors change with the parameters, (n, parameters), and with the state, (n, FREE)
Slopes = dict[str, tuple[Numbers, Numbers]]


class Problem:
    """Logs, a vehicle, the parameters to be told."""

    def __init__(self, logs: Sequence[Log], scenarios: Sequence[Scenario], parameters: Sequence[Parameter], workers: int) -> None:
        self.logs, self.scenarios, self.parameters, self.workers = list(logs), list(scenarios), list(parameters), workers
        self.index = {parameter.name: i for i, parameter in enumerate(self.parameters)}
        # Those that change the plant, not the log's clock or point.
        self.physical = [i for i, parameter in enumerate(self.parameters) if not parameter.name.startswith(("delay.", "lever."))]
        self.vehicles = [plain_vehicle(scenario) for scenario in self.scenarios]
        self.std = {sensor.kind: float(np.median([log_sensor.std for log in logs for log_sensor in log.sensors
                                                  if log_sensor.kind == sensor.kind])) for log in logs for sensor in log.sensors}
        self.floor = dict.fromkeys(self.std, 0.0)  # of each std, once `step_error` was asked
        self.held = np.zeros(len(self.parameters), bool)  # stay where they are
        self.reject = self.coarse = False  # what no noise explains; flights are not extrapolated
        self.old: list[Slopes] = []  # with which the last solve ended

    def values(self, z: Numbers) -> dict[str, float]:
        return {parameter.name: parameter.value(z[i]) for i, parameter in enumerate(self.parameters)}

    def _model(self, log: Log, z: Numbers, ticks: int) -> _core.Scenario:
        at = self.logs.index(log)
        made = scenario_with(self.scenarios[at], self.values(z), self.vehicles[at])._cpp
        made.set([f"trial.clock.ticks_per_frame={ticks}"])
        return made

    def times(self, sensor: Sensor, rows: npt.NDArray[np.int64], z: Numbers) -> Numbers:
        """When, on the commands' clock, the measurements were made."""
        values = self.values(z)
        drift = values.get("delay.drift", 0.0) if sensor.delay == "delay.pose" else 0.0
        times, middle = sensor.time_s[rows], 0.5 * (sensor.time_s[0] + sensor.time_s[-1])
        return np.asarray(times - values.get(sensor.delay, 0.0) - drift * (times - middle))

    def fly(self, parts: Sequence[Part], z: Numbers, flights: Sequence[tuple[int, int, Numbers]],
            models: Sequence[Numbers], coarse: bool = False) -> list[dict[str, Numbers]]:
        """States at the measurements of each flight (model, part, first state), by sensor. `coarse`: not extrapolated, for differences."""
        found: list[dict[str, Numbers]] = [{} for _ in flights]
        values = [self.values(model) for model in models]
        for log in self.logs:
            mine = [i for i, (_, part, _) in enumerate(flights) if parts[part].log is log]
            if not mine:
                continue
            used, part_of = np.unique([flights[i][1] for i in mine], return_inverse=True)
            used_models, model_of = np.unique([flights[i][0] for i in mine], return_inverse=True)
            times, orders = [], []
            for part in used:
                by_sensor = [self.times(sensor, parts[part].window.rows[sensor.kind], z) for sensor in log.sensors]
                joined = np.concatenate(by_sensor)
                order = np.argsort(joined, kind="stable")
                times.append(joined[order])
                orders.append((order, np.cumsum([0] + [len(one) for one in by_sensor])))
            sag = [values[model].get("thrust.sag", 0.0) / log.command_times[-1] for model in used_models]
            asked = (np.array([parts[part].window.begin_s for part in used]), times, model_of, part_of,
                     np.array([flights[i][2] for i in mine]).reshape(-1, STATE))
            states, *finer = [_core.predict([self._model(log, models[model], ticks) for model in used_models], log.commands, *asked,
                                            self.workers, sag) for ticks in ((FEWER_TICKS,) if coarse else (FEWER_TICKS, TICKS))]
            if finer:
                states = [(TICKS * fine - FEWER_TICKS * rough) / (TICKS - FEWER_TICKS) for fine, rough in zip(finer[0], states)]
            for i, at, simulated in zip(mine, part_of, states):
                order, edges = orders[at]
                unsorted = np.empty_like(simulated)
                unsorted[order] = simulated
                found[i] = {sensor.kind: unsorted[edges[k]:edges[k + 1]] for k, sensor in enumerate(log.sensors)}
                lever = np.array([values[flights[i][0]].get(name, 0.0) for name in LEVER])
                if lever.any() and "position" in found[i]:
                    found[i]["position"][:, :3] += rotated(found[i]["position"][:, 3:7], lever)
        return found

    def slopes(self, parts: Sequence[Part], z: Numbers, first: int = 0, state: bool = True) -> list[Slopes]:
        """Of every window's errors, about the parameters from the first on and, unless zero will do, its state."""
        models, free, count = [z], range(3, FREE if state else 3), len(parts)  # a vehicle elsewhere moves likewise
        physical = [at for at in self.physical if at >= first]
        flights: list[tuple[int, int, Numbers]] = [(0, i, part.state) for i, part in enumerate(parts)]
        for k in free:
            flights += [(0, i, moved(part.state, STEP * (np.arange(FREE) == k))) for i, part in enumerate(parts)]
        for at in physical:
            models.append(z + STEP_Z * (np.arange(len(z)) == at))
            flights += [(len(models) - 1, i, part.state) for i, part in enumerate(parts)]
        simulated = self.fly(parts, z, flights, models, coarse=True)
        edge = count * (1 + len(free))
        return [self._slopes(part, simulated[i], simulated[count + i:edge:count], dict(zip(physical, simulated[edge + i::count])))
                for i, part in enumerate(parts)]

    def _slopes(self, part: Part, base: dict[str, Numbers], by_state: list[dict[str, Numbers]],
                by_z: dict[int, dict[str, Numbers]]) -> Slopes:
        found = {}
        for sensor in part.log.sensors:
            kind, rows = sensor.kind, part.window.rows[sensor.kind]
            measured = sensor.values[rows]
            off = errors(kind, base[kind], measured)
            change = np.zeros((off.size, FREE))
            if kind == "position":
                change[:, :3] = np.tile(np.eye(3), (len(rows), 1))
            elif kind == "depth":
                change[:, 2] = -1
            for k, simulated in enumerate(by_state):
                change[:, 3 + k] = (errors(kind, simulated[kind], measured) - off).ravel() / STEP[3 + k]
            told = np.zeros((off.size, len(self.parameters)))
            for at, simulated in by_z.items():
                told[:, at] = (errors(kind, simulated[kind], measured) - off).ravel() / STEP_Z
            self._by_delay(sensor, rows, base[kind], told)
            for axis, name in enumerate(LEVER if kind == "position" else ()):
                if name in self.index:
                    along = rotated(base[kind][:, 3:7], np.broadcast_to(np.eye(3)[axis], (len(rows), 3)))
                    told[:, self.index[name]] = self.parameters[self.index[name]].std * along.ravel()
            found[kind] = (told, change)
        return found

    def linear(self, parts: Sequence[Part], z: Numbers, slopes: Sequence[Slopes]) -> list[Linear]:
        """Every window's errors at these parameters and its state, with slopes from near there."""
        simulated = self.fly(parts, z, [(0, i, part.state) for i, part in enumerate(parts)], [z], self.coarse)
        return [self._linear(part, states, slope) for part, states, slope in zip(parts, simulated, slopes)]

    def _linear(self, part: Part, states: dict[str, Numbers], slopes: Slopes) -> Linear:
        rows, raw, weights, cost = [], {}, {}, 0.0
        for sensor in part.log.sensors:
            kind = sensor.kind
            off = errors(kind, states[kind], sensor.values[part.window.rows[kind]])
            components = off.shape[1]
            size = np.linalg.norm(off, axis=1) / (self.std[kind] * np.sqrt(components))
            weight = np.minimum(1, SUSPECT / np.maximum(size, 1e-9))
            impossible = size > IMPOSSIBLE
            if self.reject and impossible.mean() < MOST:
                weight = np.where(impossible, 0, weight)
                size = np.minimum(size, IMPOSSIBLE)
            cost += components * float(np.where(size <= SUSPECT, size**2, SUSPECT * (2 * size - SUSPECT)).sum())
            scale = np.repeat(np.sqrt(weight) / self.std[kind], components)
            rows.append((off.ravel() * scale, *(each * scale[:, None] for each in slopes[kind])))
            raw[kind], weights[kind] = off, weight
        residual, by_z, by_state = (np.concatenate(each) for each in zip(*rows))
        return Linear(residual, by_z, by_state, raw, weights, cost)

    def _by_delay(self, sensor: Sensor, rows: npt.NDArray[np.int64], base: Numbers, told: Numbers) -> None:
        """An older measurement is of an earlier state."""
        at = self.index.get(sensor.delay)
        if at is None or len(rows) < 3:
            return
        times, along = sensor.time_s[rows], rotated(base[:, 3:7], base[:, 7:10])
        rates = {"position": along, "attitude": base[:, 10:13], "depth": -along[:, 2:3]}
        part = base[:, 7:10] if sensor.kind == "velocity" else base[:, 10:13]
        rate = rates[sensor.kind] if sensor.kind in rates else np.gradient(part, times, axis=0)
        told[:, at] = (-rate * self.parameters[at].std).ravel()
        if (drift := self.index.get("delay.drift")) is not None and sensor.delay == "delay.pose":
            middle = 0.5 * (sensor.time_s[0] + sensor.time_s[-1])
            told[:, drift] = (-rate * self.parameters[drift].std * (times - middle)[:, None]).ravel()


@dataclass
class Reduced:
    """Normal equations of the parameters alone, the prior not counted, and what gives each window's state."""

    information: Numbers
    gradient: Numbers
    cost: float
    windows: list[tuple[Numbers, Numbers, Numbers]]
    pulls: list[tuple[Numbers, Numbers]]  # each window's share of information and gradient


def reduce(linear: Sequence[Linear], parts: Sequence[Part], guesses: Sequence[Numbers], damping: float = 0) -> Reduced:
    """Eliminates the windows' states. Damped, they move less, as Levenberg and Marquardt have it."""
    cost, kept, pulls = 0.0, [], []
    for one, part, guess in zip(linear, parts, guesses):
        off = difference(part.state, guess) / FREE_STD**2
        inner = one.by_state.T @ one.by_state + np.diag(1 / FREE_STD**2)
        inner += damping * np.diag(np.diag(inner))
        cross = one.by_state.T @ one.by_z
        force = one.by_state.T @ one.residual + off
        solved = np.linalg.solve(inner, np.column_stack([cross, force]))
        pulls.append((one.by_z.T @ one.by_z - cross.T @ solved[:, :-1], one.by_z.T @ one.residual - cross.T @ solved[:, -1]))
        cost += float(one.residual @ one.residual)
        kept.append((inner, cross, force))
    information, gradient = (np.sum(each, axis=0) for each in zip(*pulls))
    return Reduced(information, gradient, cost, kept, pulls)


def share_of_noise(problem: Problem, parts: Sequence[Part], z: Numbers, reduced: Reduced, linear: Sequence[Linear]) -> Numbers:
    """Of each parameter's information, how much states that are off by no more than they may be would seem to give besides: a
    vehicle that stands, thought to turn, seems to tell how its turning is damped."""
    rng = np.random.default_rng(0)
    shaken = [Part(part.log, part.window, moved(part.state, np.asarray(np.linalg.solve(
        np.linalg.cholesky(inner).T, rng.standard_normal(FREE)), float))) for part, (inner, _, _) in zip(parts, reduced.windows)]
    seeming = np.zeros(len(z))
    for one, other, (inner, _, _) in zip(linear, problem.linear(shaken, z, problem.slopes(shaken, z, state=False)), reduced.windows):
        change = other.by_z - one.by_z
        cross = one.by_state.T @ change
        seeming += (change**2).sum(axis=0) - (cross * np.linalg.solve(inner, cross)).sum(axis=0)
    return seeming / np.maximum(np.diag(reduced.information), 1e-300)


def difference(state: Numbers, guess: Numbers) -> Numbers:
    """The twelve degrees of freedom by which two states differ."""
    return np.concatenate([state[:3] - guess[:3], errors("attitude", state, guess[3:7]), state[7:] - guess[7:]])


def solve(problem: Problem, parts: list[Part], z: Numbers, *, with_z: bool = True, most: int = 20,
          enough: float = CONVERGED, slopes: list[Slopes] = []) -> tuple[Numbers, Reduced, list[Linear]]:
    """The parameters and states of least error, by slopes that are taken at most so often, until fresh ones gain less than
    `enough`; `parts` get their states. With `with_z` off the parameters stay. `slopes`: of near there, to begin with."""
    guesses = [np.array(part.state) for part in parts]
    damping = 1e-3
    for _ in range(most):
        damping = min(damping, 1e-2)
        slopes = slopes or problem.slopes(parts, z, 0 if with_z else len(z))
        linear = problem.linear(parts, z, slopes)
        for part, one in zip(parts, linear):
            if not (np.isfinite(one.cost) and np.isfinite(one.by_z).all() and np.isfinite(one.by_state).all()):
                raise _core.ConfigError("{}: a prediction from {:.1f} s on leaves all bounds: are the thrusters' places, signs and strengths "
                                        "those of the MJCF?".format(part.log.name, part.window.first_s + part.log.clock_begin_s))
        # What is gained counts by what is left in most windows, which of a wrong model is more than noise.
        left = max(1.0, float(np.median([one.cost / len(one.residual) for one in linear])))
        gain, gains, begin = np.inf, [0.0], _cost(linear, parts, guesses, z)
        while gain >= LEADS_ON * left:
            found = _step(problem, parts, z, guesses, linear, slopes, damping, with_z)
            if found is None:
                break
            gain, z, linear, damping = found
            gains.append(gain)
        problem.old, slopes = slopes, []
        if gains[:2][-1] < enough * left or left > WRONG and sum(gains) < HARDLY * begin:
            break
    return z, reduce(linear, parts, guesses), linear


def _step(problem: Problem, parts: list[Part], z: Numbers, guesses: list[Numbers], linear: list[Linear], slopes: list[Slopes],
          damping: float, with_z: bool) -> tuple[float, Numbers, list[Linear], float] | None:
    """A step of Levenberg and Marquardt's: how much of the cost it gains, where it leads, and the next damping."""
    before = _cost(linear, parts, guesses, z)
    bounds = np.array([parameter.z_bounds() for parameter in problem.parameters]).reshape(-1, 2)
    old = [part.state for part in parts]
    for tried in range(8):
        reduced = reduce(linear, parts, guesses, damping)
        normal = reduced.information + np.eye(len(z))
        normal += damping * np.diag(np.diag(normal))
        normal[problem.held, problem.held] += 1e15
        step = np.linalg.solve(normal, -(reduced.gradient + z)) if with_z else np.zeros(len(z))
        new_z = np.clip(z + np.clip(step, -1.0, 1.0), *bounds.T)
        for part, state, (inner, cross, force) in zip(parts, old, reduced.windows):
            part.state = moved(state, np.asarray(-np.linalg.solve(inner, force + cross @ (new_z - z)), float))
        trial = problem.linear(parts, new_z, slopes)
        cost = _cost(trial, parts, guesses, new_z)
        if np.isfinite(cost) and cost <= before * (1 + 1e-9):
            return before - cost, new_z, trial, damping * (1 if tried else 0.2)
        damping = max(damping, 1e-3) * 10
        for part, state in zip(parts, old):
            part.state = state
    return None


def _cost(linear: Sequence[Linear], parts: Sequence[Part], guesses: Sequence[Numbers], z: Numbers) -> float:
    """Of errors, and of what was known before."""
    return (sum(one.cost for one in linear) + float(z @ z)
            + sum(float(((difference(part.state, guess) / FREE_STD) ** 2).sum()) for part, guess in zip(parts, guesses)))


def step_error(problem: Problem, parts: Sequence[Part], z: Numbers, rough: Sequence[Linear]) -> dict[str, float]:
    """By sensor, how far the scenario's plant is off endless steps by its own: `rough`, of FEWER_TICKS, is so in proportion. No less
    can a fit be asked to explain."""
    problem.coarse = False
    share = FEWER_TICKS / float(problem.scenarios[0]["trial.clock.ticks_per_frame"])
    off = [{kind: fine.raw[kind] - raw for kind, raw in each.raw.items()} for fine, each in zip(problem.linear(parts, z, problem.old), rough)]
    return {kind: share * float(np.sqrt(np.mean(np.concatenate([each[kind] for each in off if kind in each])**2))) for kind in problem.std}


def noise(problem: Problem, linear: Sequence[Linear], parts: Sequence[Part]) -> dict[str, float]:
    """Standard deviation of each sensor's noise from the residuals, less what was fitted to them."""
    found = dict(problem.std)
    fitted = (FREE * len(parts) + len(problem.parameters)) / np.mean([len(one.raw) for one in linear])
    for kind in found:
        # A normal error is within SUSPECT of the mean of its components often enough to count as all of them.
        good = np.concatenate([one.raw[kind][one.weight[kind] >= 1].ravel() for one in linear if kind in one.raw])
        if good.size:
            found[kind] = max(float(np.sqrt((good**2).sum() / max(good.size - fitted, 0.25 * good.size))), problem.floor[kind])
    return found


def disagreement(linear: Sequence[Linear], reduced: Reduced) -> float:
    """By how many standard deviations the windows' pulls at the parameters differ more than by the noise that is left, as it hangs
    together from row to row (Cochran's test of means, Biometrics 10, 1954; its square sum made normal after Satterthwaite 1946 and
    Wilson and Hilferty 1931)."""
    if len(linear) < 2:
        return 0.0
    rows = correlation_time(linear)
    whole = np.linalg.inv(np.linalg.cholesky(reduced.information + np.eye(len(reduced.information))))
    found = mean = variance = 0.0
    for told, pull in reduced.pulls:
        share = whole @ told @ whole.T
        free = share - share @ share
        found += float(((whole @ pull)**2).sum()) / rows
        mean += float(np.trace(free))
        variance += 2 * float((free * free.T).sum())
    spread = variance / (9 * mean**2)
    return float(((found / mean) ** (1 / 3) - 1 + spread) / np.sqrt(spread))


def covariance_of(linear: Sequence[Linear], reduced: Reduced) -> tuple[Numbers, Numbers]:
    """Of the parameters, with what is left as it hangs together (Morelli and Klein, J. Guidance 20, 1997): by sensor the spectrum of
    its residuals, in cosines over a window, of which the fit took a part that is known (Whittle's likelihood; Lucy 1974). Then by how
    many times windows pull at each parameter more than that has them (clusters' sandwich; its expectation, Bell and McCaffrey 2002)."""
    inverse = np.linalg.inv(reduced.information + np.eye(len(reduced.information)))
    took, bands = np.zeros((FREE + len(inverse),) * 2), len(BANDS)
    took[FREE:, FREE:] = inverse
    power = {kind: np.zeros(bands) for one in linear for kind in one.raw}
    mixed = {kind: 1e-12 * np.eye(bands) for kind in power}
    rows: list[list[tuple[str, Numbers, Numbers]]] = []
    for one, (inner, cross, _) in zip(linear, reduced.windows):
        took[:FREE, :FREE] = np.linalg.inv(inner)
        rest = np.column_stack([one.by_state, one.by_z - one.by_state @ np.linalg.solve(inner, cross), one.residual])
        rows.append([])
        for kind, raw in one.raw.items():
            by, rest = np.split(rest, [raw.size])
            at = np.arange(len(raw))
            cosines = np.sqrt(np.where(at == 0, 1, 2) / len(raw))[:, None] * np.cos(np.pi * np.outer(at, at + 0.5) / len(raw))
            band = np.equal.outer(np.arange(bands), np.searchsorted(BANDS, at, side="right") - 1).astype(float)
            by = (cosines @ by.reshape(len(raw), -1)).reshape(by.shape)
            left = (np.eye(len(by)) - by[:, :-1] @ took @ by[:, :-1].T).reshape(raw.shape * 2)
            power[kind] += band @ (by[:, -1].reshape(raw.shape)**2).sum(axis=1)
            mixed[kind] += band @ (left**2).sum(axis=(1, 3)) @ band.T
            rows[-1].append((kind, by[:, FREE:-1], np.repeat(band, raw.shape[1], axis=1)))
    spectrum = {kind: np.ones(bands) for kind in power}
    for kind, each in mixed.items():
        for _ in range(300):
            spectrum[kind] *= each.T @ (power[kind] / np.maximum(each @ spectrum[kind], 1e-300)) / each.sum(axis=0)
    scatter = [sum(by.T @ ((spectrum[kind] @ band)[:, None] * by) for kind, by, band in window) for window in rows]
    whole = sum(scatter, np.eye(len(inverse)))
    found, expected = np.zeros(len(inverse)), np.full(len(inverse), 1e-300)
    for of, (told, pull) in zip(scatter, reduced.pulls):
        fitted = inverse @ told
        found += (inverse @ pull)**2
        expected += np.diag(inverse @ (of - of @ fitted - fitted.T @ of + fitted.T @ whole @ fitted) @ inverse)
    return np.asarray(inverse @ whole @ inverse), np.sqrt(np.maximum(1, found / expected)) if len(rows) > 1 else np.ones(len(inverse))


def correlation_time(linear: Sequence[Linear]) -> float:
    """Rows after which residuals are new, at least 1: the largest of all sensors."""
    longest = 1.0
    for kind in linear[0].raw:
        sums = np.zeros(40)
        for one in linear:
            good = np.where(one.weight[kind][:, None] >= 1, one.raw[kind], 0)
            for lag in range(min(len(sums), len(good) - 1)):
                sums[lag] += float((good[lag:] * good[:len(good) - lag]).sum())
        share = sums / sums[0] if sums[0] > 0 else np.zeros(1)
        ends = np.flatnonzero(share < 0.05)
        longest = max(longest, 1 + 2 * float(share[1:ends[0] if len(ends) else None].sum()))
    return longest
