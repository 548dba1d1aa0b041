"""A log as `identify` sees it: commands, measurements by sensor, and windows between its gaps."""

from __future__ import annotations

import json
import pathlib
from dataclasses import dataclass, field
from typing import Any, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from .. import _core
from ..scenario import Scenario
from ._checks import check_table, check_turn_rate, check_velocity, without_repeats
from .._rotation import conjugate, product, quaternion_of, rotated, turned, vector_of
from .motion import (DEPTH, EULER, POSITION, QUATERNION, TURN_RATE, VELOCITY, WATER, Motion, Numbers, check_motion, has, read_motion,
                     without_zeros, write_motion)

STATE = 13  # x, y, z in W, w, x, y, z of R_WB, velocity in B, turn rate in B: as `_core.predict` has it
MOST_HZ = 20.0  # measurements of a sensor: of more, means tell as much of a vehicle


@dataclass
class Sensor:
    """What one sensor measured."""

    kind: str  # position, attitude, velocity, turn_rate, depth
    time_s: Numbers
    values: Numbers  # (n, 3), quaternions (n, 4), depth (n, 1)
    delay: str  # the parameter that says how old it is, besides offset_s
    std: float = 0  # of a component, m, rad, m/s, rad/s; found from the log
    offset_s: float = 0  # of its clock, roughly
    jumps: dict[int, float] = field(default_factory=dict)  # how far, by the row before


@dataclass
class Window:
    """A stretch of a log without a gap: the vehicle's state at begin_s is unknown, what follows is compared."""

    begin_s: float
    first_s: float
    last_s: float
    rows: dict[str, npt.NDArray[np.int64]] = field(default_factory=dict)


def add_estimates(folder: pathlib.Path, records: Sequence[Mapping[str, Any]], scenario: Scenario) -> None:
    """Writes into the folder's motion.csv where the scenario's vehicle was when its cameras found the marker. The world has the
    marker's axes, 5 m above it unless a depth was measured. ConfigError where the table has poses already."""
    file = folder / "motion.csv"
    motion = read_motion(file) if file.exists() else {}
    if has(motion, POSITION) or has(motion, QUATERNION):
        raise _core.ConfigError(f"{file}: has poses already: leave odometry out")
    begin_ns = json.loads((folder / "log.json").read_text(encoding="utf-8"))["start_ns"]
    found = [record for record in records if record["detected"]]
    times = np.array([(record["time_ns"] - begin_ns) / 1e9 for record in found])
    seen = np.array([[*record["position_m"], *record["quaternion_wxyz"]] for record in found]).reshape(-1, 7)
    head = np.array(json.loads(_core.trial_model(scenario._cpp))["scene"]["X_BH"])
    turn = conjugate(product(head[3:], seen[:, 3:]))  # R_MB
    place = -rotated(turn, head[:3] + rotated(np.tile(head[3:], (len(seen), 1)), seen[:, :3]))
    depth_m = 5.0
    if has(motion, DEPTH):
        there = np.isfinite(motion["depth_m"])
        depth_m = float(np.median(np.interp(times, motion["time_s"][there], motion["depth_m"][there]) + place[:, 2]))
    stamps = np.union1d(motion.get("time_s", times), times)
    table = {"time_s": stamps}
    poses = dict(zip(POSITION + QUATERNION, np.hstack([place - [0, 0, depth_m], turn]).T))
    for of, columns in ((motion.get("time_s", times), motion), (times, poses)):
        for name, column in columns.items():
            table.setdefault(name, np.full(len(stamps), np.nan))[np.searchsorted(stamps, of)] = column
    write_motion(table, file)


class Log:
    """Commands and motion of one run, its time from 0 on."""

    def __init__(self, motion: Mapping[str, npt.ArrayLike], scenario: Scenario, name: str = "motion") -> None:
        table, self.notes = without_zeros(check_motion(motion, name))
        check_table(table, name)
        table, notes = without_repeats(table, name)
        self.notes += notes
        self.name, self.clock_begin_s = name, float(table["time_s"][0])
        time_s = table["time_s"] - self.clock_begin_s
        self.command_times, self.volts = _core.commands(scenario._cpp, dict(table), name)
        self.command_times = self.command_times - self.clock_begin_s
        self.commands: Motion = {"time_s": self.command_times} | {
            f"{thruster}_v": volts for thruster, volts in zip(_core.thrusters(scenario._cpp), self.volts.T)}
        self.sensors = _sensors(table, time_s, name)
        self.water, self.table = has(table, WATER), table
        jumps = [f"{name}: the {sensor.kind} jumps by {size:.2f} {'m' if sensor.kind == 'position' else 'rad'} at "
                       f"{sensor.time_s[row + 1] + self.clock_begin_s:.2f} s ({len(sensor.jumps)} such places; another solution of the "
                       "tracker, or another log? Taken as gaps)" for sensor in self.sensors for row, size in list(sensor.jumps.items())[:1]]
        if self.sensor("attitude") is None:
            raise _core.ConfigError(f"{name}: has no attitude: vehicle_qw to vehicle_qz, or roll_rad, pitch_rad, yaw_rad")
        if self.sensor("position") is None and self.sensor("velocity") is None:
            raise _core.ConfigError(f"{name}: has neither positions (vehicle_x_m, ...) nor velocities (surge_mps, ...)")
        self.notes += jumps
        self._compare(" and ".join(jumps) or name)

    def _compare(self, said: str) -> None:
        """ConfigError for rates that contradict what they are the rates of; a gyroscope's bias is taken off and noted."""
        position, velocity, attitude, turn_rate = (self.sensor(kind) for kind in ("position", "velocity", "attitude", "turn_rate"))
        assert attitude is not None
        still = (attitude.time_s, attitude.values)
        if (place := position or self.sensor("depth")) is not None and velocity is not None:
            check_velocity((place.time_s, place.values), still, (velocity.time_s, velocity.values), self.stretches(), place.std, said)
        if turn_rate is not None:
            bias = check_turn_rate(still, (turn_rate.time_s, turn_rate.values), self.stretches(), attitude.std, said)
            turn_rate.values = turn_rate.values - bias
            if bias.any():
                self.notes.append("{}: the turn rates are biased by {:.4f}, {:.4f}, {:.4f} rad/s against the attitude; taken "
                                  "off.".format(self.name, *bias))

    def sensor(self, kind: str) -> Sensor | None:
        return next((sensor for sensor in self.sensors if sensor.kind == kind), None)

    def set_offset(self, offset_s: float) -> None:
        """Of the poses' clock, roughly: they are of so much earlier, on the commands' clock, than they say."""
        for sensor in self.sensors:
            if sensor.delay == "delay.pose":
                sensor.time_s = sensor.time_s + sensor.offset_s - offset_s
                sensor.offset_s = offset_s

    def stretches(self) -> list[tuple[float, float]]:
        """From and to, between gaps of the commands and of any sensor."""
        begin, end = self.command_times[0], 2 * self.command_times[-1] - self.command_times[-2]
        gaps = _gaps(self.command_times, 1.0)
        for sensor in self.sensors:
            begin, end = max(begin, sensor.time_s[0]), min(end, sensor.time_s[-1])
            gaps += _gaps(sensor.time_s, 0.5) + [(sensor.time_s[row], sensor.time_s[row + 1]) for row in sensor.jumps]
        found, at = [], begin
        for gap_begin, gap_end in [*sorted(gaps), (end, end)]:
            found.append((at, min(gap_begin, end)))
            at = max(at, gap_end)
        return [(a, b) for a, b in found if b > a]

    def windows(self, length_s: float, before_s: float, least_s: float = 2.0) -> list[Window]:
        """The stretches cut into windows of about that length; each begins before_s before the first measurement that it
        is compared with, which a clock's error may shift by."""
        found = []
        for begin, end in self.stretches():
            usable = end - begin - before_s
            if usable < least_s:
                continue
            count = max(1, round(usable / length_s))
            edges = begin + before_s + usable * np.arange(count + 1) / count
            found += [self.window(first, last, before_s) for first, last in zip(edges, edges[1:])]
        return [window for window in found if window is not None]

    def window(self, first_s: float, last_s: float, before_s: float) -> Window | None:
        made = Window(np.floor((first_s - before_s) * 30) / 30, first_s, last_s)  # a tick of every usual clock
        for sensor in self.sensors:
            made.rows[sensor.kind] = np.flatnonzero((sensor.time_s >= first_s) & (sensor.time_s < last_s))
        return made if all(len(rows) >= 3 for rows in made.rows.values()) else None

    def state_at(self, time_s: float, span_s: float = 0.6) -> Numbers:
        """A first guess of the vehicle's state: parabolas through what was measured about then."""
        state = np.zeros(STATE)
        attitude = self.sensor("attitude")
        assert attitude is not None
        state[3:7], state[10:13], _ = _parabola(attitude, time_s, span_s)
        position = self.sensor("position")
        if position is not None:
            state[:3], velocity_W, _ = _parabola(position, time_s, span_s)
            state[7:10] = rotated(conjugate(state[3:7]), velocity_W)
        elif (depth := self.sensor("depth")) is not None:
            state[2] = -_parabola(depth, time_s, span_s)[0][0]
        for kind, part in (("velocity", slice(7, 10)), ("turn_rate", slice(10, 13))):
            if (sensor := self.sensor(kind)) is not None:
                state[part] = _parabola(sensor, time_s, span_s)[0]
        return state


def _sensors(table: Motion, time_s: Numbers, name: str) -> list[Sensor]:
    def columns(names: tuple[str, ...]) -> tuple[Numbers, Numbers]:
        values = np.stack([table[name] for name in names], axis=-1)
        there = np.isfinite(values).all(axis=1)
        return time_s[there], values[there]

    found = []
    if has(table, POSITION):
        found.append(Sensor("position", *columns(POSITION), "delay.pose"))
    if has(table, QUATERNION):
        times, values = columns(QUATERNION)
        length = np.linalg.norm(values, axis=1)
        if abs(length[worst := abs(length - 1).argmax()] - 1) > 0.1:
            raise _core.ConfigError(f"{name}: vehicle_qw to vehicle_qz are no unit quaternion: of length {length[worst]:.3g} at "
                                    f"{times[worst] + table['time_s'][0]:.2f} s")
        found.append(Sensor("attitude", times, values / length[:, None], "delay.pose"))
    elif has(table, EULER):
        times, angles = columns(EULER)
        if (abs(angles) > [3.2, 1.6, 63]).any():
            raise _core.ConfigError(f"{name}: roll_rad, pitch_rad, yaw_rad beyond a half, a quarter, ten turns look like degrees")
        found.append(Sensor("attitude", times, quaternion_of(*angles.T), "delay.onboard"))
    for kind, names in (("velocity", VELOCITY), ("turn_rate", TURN_RATE), ("depth", DEPTH)):
        if has(table, names):
            found.append(Sensor(kind, *columns(names), "delay.onboard"))
    for sensor in found:
        sensor.time_s, sensor.values = averaged(sensor.time_s, sensor.values, sensor.kind == "attitude")
        if len(sensor.time_s) < 10:
            raise _core.ConfigError(f"{name}: only {len(sensor.time_s)} measurements of {sensor.kind}, in {np.ptp(time_s):.3g} s")
        if sensor.kind == "attitude":  # a quaternion and its negative are the same
            products = (sensor.values * np.roll(sensor.values, 1, axis=0)).sum(axis=1)
            sensor.values = sensor.values * np.cumprod(np.where(products < 0, -1, 1))[:, None]
        sensor.std = _noise(sensor)
        sensor.jumps = _jumps(sensor) if sensor.kind in ("position", "attitude") else {}
        fastest = np.quantile(abs(sensor.values), 0.9) * 5 if sensor.kind == "velocity" else _fastest(sensor)
        if sensor.kind in ("position", "depth", "velocity") and max(sensor.std, fastest / 50) > 0.5:
            raise _core.ConfigError(f"{name}: {sensor.kind} has noise of {sensor.std:.3g} {'m/s' if sensor.kind == 'velocity' else 'm'} "
                                    f"and moves at {fastest:.3g} m/s: it looks like milli- or centimetres, or the times are no seconds")
    return found


def averaged(time_s: Numbers, values: Numbers, quaternions: bool = False) -> tuple[Numbers, Numbers]:
    """Times and values, where they come at twice MOST_HZ or more as means over its periods."""
    if len(time_s) < 2 or np.median(np.diff(time_s)) > 0.5 / MOST_HZ:
        return time_s, values
    _, first, count = np.unique(np.floor(time_s * MOST_HZ + 1e-6), return_index=True, return_counts=True)
    if quaternions:  # of which a quaternion and its negative are the same attitude
        about = np.repeat(values[first], count, axis=0)
        values = values * np.where((values * about).sum(axis=1, keepdims=True) < 0, -1, 1)
    times, means = np.add.reduceat(time_s, first) / count, np.add.reduceat(values, first) / count[:, None]
    return times, means / np.linalg.norm(means, axis=1, keepdims=True) if quaternions else means


def _fastest(sensor: Sensor) -> float:
    """Speed that it has a tenth of the time, over a second, m/s."""
    later = np.searchsorted(sensor.time_s, sensor.time_s + 1)
    there = np.flatnonzero(later < len(sensor.time_s))
    moved = np.linalg.norm(sensor.values[later[there]] - sensor.values[there], axis=1)
    return float(np.quantile(moved / (sensor.time_s[later[there]] - sensor.time_s[there]), 0.9)) if len(there) else 0.0


def errors(kind: str, predicted: Numbers, measured: Numbers) -> Numbers:
    """Predicted less measured, (n, k): of an attitude a rotation vector, rad, in B."""
    if kind == "attitude":
        return vector_of(product(conjugate(measured), predicted[..., 3:7]))
    if kind == "depth":
        return np.asarray(-predicted[..., 2:3] - measured)
    first = {"position": 0, "velocity": 7, "turn_rate": 10}[kind]
    return np.asarray(predicted[..., first:first + 3] - measured)


def _steps(sensor: Sensor) -> Numbers:
    """From row to row; of an attitude rotation vectors."""
    values = sensor.values
    return vector_of(product(conjugate(values[:-1]), values[1:])) if sensor.kind == "attitude" else np.diff(values, axis=0)


def _noise(sensor: Sensor) -> float:
    """Standard deviation of its noise, from third differences, which motion hardly has."""
    return float(max(1.4826 * np.median(np.abs(np.diff(_steps(sensor), 2, axis=0))) / np.sqrt(20), 1e-4))


def _jumps(sensor: Sensor) -> dict[int, float]:
    """Steps of poses that stay, farther than those about them by 0.2 m or rad, 12 deviations and what 10 m/s^2 or rad/s^2 does."""
    steps, apart_s = _steps(sensor), np.diff(sensor.time_s)[:, None]
    about = np.lib.stride_tricks.sliding_window_view(np.pad(steps / apart_s, ((3, 3), (0, 0)), "edge"), 7, axis=0)
    off = steps - np.median(about, axis=-1) * apart_s
    five = np.lib.stride_tricks.sliding_window_view(np.pad(off, ((2, 2), (0, 0))), 5, axis=0).sum(axis=-1)
    size, stays = np.linalg.norm(off, axis=1), np.linalg.norm(five, axis=1)
    rows = np.flatnonzero((size > max(0.2, 12 * sensor.std) + 5 * apart_s[:, 0]**2) & (stays > 0.5 * size))
    return {int(row): float(size[row]) for row in rows}


def _gaps(times: Numbers, shortest_s: float) -> list[tuple[float, float]]:
    steps = np.diff(times)
    longest = max(shortest_s, 10 * float(np.median(steps)))
    return [(float(times[i]), float(times[i + 1])) for i in np.flatnonzero(steps > longest)]


def _parabola(sensor: Sensor, time_s: float, span_s: float) -> tuple[Numbers, Numbers, Numbers]:
    """Value, rate and acceleration at a time, from a robust parabola; of an attitude its quaternion and turn rates in B."""
    near = np.sort(np.argsort(np.abs(sensor.time_s - time_s))[:max(8, int((np.abs(sensor.time_s - time_s) < span_s).sum()))])
    t, values = sensor.time_s[near] - time_s, sensor.values[near]
    about = np.zeros(0)
    if sensor.kind == "attitude":
        about = values[np.argmin(np.abs(t))]
        values = vector_of(product(conjugate(about), values))
    basis = np.stack([np.ones_like(t), t, 0.5 * t * t], axis=1)
    weight = np.ones(len(t))
    fitted: Numbers = np.zeros((3, values.shape[1]))
    for _ in range(4):
        fitted = np.asarray(np.linalg.lstsq(basis * weight[:, None], values * weight[:, None], rcond=None)[0], float)
        off = np.linalg.norm(values - basis @ fitted, axis=1)
        scale = 1.5 * np.median(off) + 1e-9
        weight = np.sqrt(np.minimum(1, 2 * scale / np.maximum(off, 1e-12)))
    return product(about, turned(fitted[0])) if sensor.kind == "attitude" else fitted[0], fitted[1], fitted[2]
