"""What makes no sense in a log: clocks, origins, and columns that contradict each other. Said before any computing."""

from __future__ import annotations

from typing import Callable, Mapping, Sequence

import numpy as np

from .._core import ConfigError
from .._rotation import conjugate, product, rotated, vector_of
from .motion import DEPTH, EULER, POSITION, QUATERNION, TURN_RATE, VELOCITY, Motion, Numbers, has

DOWN = np.array([1.0, -1, -1])
OVER_S = 1.0  # what is compared: how far it went, and turned, in that time
SHIFTS_S = np.round(np.arange(-2, 2.05, 0.1), 1)  # of one clock against the other
Track = tuple[Numbers, Numbers]  # times, values
# In which of ours, of those that a log's factor of `_factor` tells: m, m/s, and m of water.
UNITS = {"feet": 0.3048, "inches": 0.0254, "centimetres": 0.01, "millimetres": 0.001, "knots": 0.5144, "bar": 10.2, "mbar": 0.0102}
CLOCKS = {"milliseconds": 1e-3, "microseconds": 1e-6, "nanoseconds": 1e-9, "days": 86400, "hours": 3600, "minutes": 60}


def check_table(table: Motion, name: str) -> None:
    """ConfigError for times that are no seconds, and for a vehicle above the water."""
    step = float(np.median(np.diff(table["time_s"])))
    for unit, seconds in CLOCKS.items():
        if (step > 0.5 or step < 6e-4 or np.ptp(table["time_s"]) < 2 and seconds > 1) and 5e-4 < step * seconds < 0.5:
            raise ConfigError(f"{name}: time_s has steps of {step:.3g}: it looks like {unit}, must be seconds: multiply by {seconds:g}")
    if has(table, DEPTH) and np.nanmedian(table["depth_m"]) < -0.3:
        raise ConfigError(f"{name}: depth_m is {np.nanmedian(table['depth_m']):.2f} m (median), must be positive below the surface: "
                          "`scale: -1` in a topic's line")
    if not has(table, POSITION):
        return
    z = table["vehicle_z_m"][np.isfinite(table["vehicle_z_m"])]
    if has(table, DEPTH):
        there = np.isfinite(table["depth_m"])
        deep = np.interp(table["time_s"][np.isfinite(table["vehicle_z_m"])], table["time_s"][there], table["depth_m"][there])
        apart = float(np.median(z + deep))
        if abs(np.median(z - deep)) < 0.3 < abs(apart):
            raise ConfigError(f"{name}: vehicle_z_m grows with depth_m: it points down, must point up: `axes: frd` in its line")
        factor = next(iter(_factor(deep - deep.mean(), z.mean() - z, "vehicle_z_m")), "")
        if abs(apart) > 0.3:
            raise ConfigError(f"{name}: vehicle_z_m and depth_m differ by {apart:.2f} m (median)" + (
                f"; depth_m agrees {factor}: `scale` in a topic's line" if factor else ": z is 0 at the surface, depth_m that of B; "
                "absolute pressure is 10.3 m too deep: `offset` in a topic's line; salt water is 2.6 % heavier than fresh: `scale`"))
    if np.median(z) > 0 or np.quantile(z, 0.95) > 0.3:
        raise ConfigError(f"{name}: vehicle_z_m is {np.median(z):.2f} m (median), {z.max():.2f} m at most: above the water. z is 0 at "
                          "the surface and points up: of a pool's floor `offset: -DEPTH`, where it points down `axes: frd`")


def without_repeats(table: Motion, name: str) -> tuple[Motion, list[str]]:
    """The table without poses and velocities that repeat those before to the last digit, as a tracker that lost its body, a DVL that
    lost the bottom, and a recorder faster than they write them, and a note. ConfigError where few are left."""
    kept, notes = dict(table), []
    poses: list[tuple[str, ...]] = [group for group in (POSITION, QUATERNION, EULER, VELOCITY) if has(table, group)]
    rows = [np.asarray(np.isfinite([table[column] for column in group]).all(axis=0)) for group in poses]
    if len(poses) > 1 and poses[0] == POSITION and poses[1] != VELOCITY and (rows[0] == rows[1]).all():
        poses, rows = [poses[0] + poses[1], *poses[2:]], rows[:1] + rows[2:]  # one of both may stand where the vehicle does not turn
    for group, there in zip(poses, rows):
        values, at = np.array([table[column][there] for column in group]), np.flatnonzero(there)[1:]
        again = at[(np.diff(values) == 0).all(axis=0)]
        words = f"{name}: {group[0]} to {group[-1]} repeat the {'row' if group == VELOCITY else 'pose'} before in {len(again)} of {len(at) + 1} rows"
        if len(again) > max(0, len(at) - 9):
            raise ConfigError(f"{words}: they stand still, which no measurement does")
        notes += [f"{words}, first at {table['time_s'][first]:.2f} s: no measurement, left out." for first in again[:1]]
        kept |= {column: np.where(np.isin(np.arange(len(there)), again), np.nan, table[column]) for column in group}
    return kept, notes


def check_velocity(position: Track, attitude: Track, velocity: Track, stretches: Sequence[tuple[float, float]], noise_m: float,
                   name: str) -> None:
    """ConfigError for velocities that are not those of the positions, or of the depths where there are none."""
    tries: dict[str, Callable[[Numbers, Numbers], Numbers]] = {
        "B's axes": rotated, "the world's axes": lambda q, v: v, "axes ahead, right, down": lambda q, v: rotated(q, v * DOWN),
             "the world's axes, z down": lambda q, v: v * DOWN, "axes astern, right, up": lambda q, v: rotated(q, -v * [1, 1, -1])}
    if of_depth := position[1].shape[1] == 1:
        position = position[0], position[1] * [0, 0, -1]
        tries = {axes: lambda q, v, turn=turn: turn(q, v) * [0, 0, 1] for axes, turn in tries.items()}  # type: ignore[misc]
    found = _least(tries, position, attitude, velocity, stretches, False)
    if "B's axes" not in found:
        return
    rms, moved, off, turns = found.pop("B's axes")
    speed = _rms(moved)
    if rms**2 < 0.02**2 + (0.15 * speed)**2 + (3 * noise_m / OVER_S)**2:
        return
    lever = np.linalg.lstsq(turns.reshape(-1, 3), off.ravel(), rcond=None)[0]
    words = {f"along {axes}": each[0] for axes, each in found.items()}
    words["of a point {:.2f}, {:.2f}, {:.2f} m from B".format(*lever)] = _rms(off - turns @ lever)
    flow = off.mean(axis=0)
    words["through water that moves at {:.2f}, {:.2f}, {:.2f} m/s".format(*-flow / OVER_S)] = _rms(off - flow)
    words |= _factor(moved + off, moved, DEPTH[0] if of_depth else "the positions")
    _refuse(name, VELOCITY, DEPTH if of_depth else POSITION, rms, "m/s", words)


def check_turn_rate(attitude: Track, turn_rate: Track, stretches: Sequence[tuple[float, float]], noise_rad: float, name: str) -> Numbers:
    """The gyroscopes' bias, rad/s. ConfigError for turn rates that are not those of the attitudes."""
    tries = {"B's axes": lambda q, w: w, "the world's axes": lambda q, w: rotated(conjugate(q), w),
             "axes ahead, right, down": lambda q, w: w * DOWN, "B's axes in degrees/s": lambda q, w: np.radians(w)}
    if "B's axes" not in (found := _least(tries, attitude, attitude, turn_rate, stretches, True)):
        return np.zeros(3)
    rms, turned, off, _ = found.pop("B's axes")
    if rms**2 > 0.03**2 + (0.2 * _rms(turned))**2 + (3 * noise_rad / OVER_S)**2:
        _refuse(name, TURN_RATE, ("its attitude",), rms, "rad/s", {f"along {axes}": each[0] for axes, each in found.items()})
    bias = np.asarray(off.mean(axis=0) / OVER_S)
    return bias if np.linalg.norm(bias) > 0.002 + 5 * rms / np.sqrt(len(off)) else np.zeros(3)


def _refuse(name: str, these: Sequence[str], those: Sequence[str], rms: float, unit: str, tries: Mapping[str, float]) -> None:
    best = min(tries, key=lambda words: tries[words])
    otherwise = f", {tries[best]:.3f} if they were {best}" if tries[best] < 0.5 * rms else ""
    raise ConfigError(f"{name}: {', '.join(these)} contradict {', '.join(those)}: they differ by {rms:.3f} {unit} (rms), taken along "
                      f"B's axes{otherwise}")


def _least(tries: Mapping[str, Callable[[Numbers, Numbers], Numbers]], place: Track, attitude: Track, rate: Track,
           stretches: Sequence[tuple[float, float]], biased: bool) -> dict[str, tuple[float, Numbers, Numbers, Numbers]]:
    """By axes, at the clocks' shift that suits them best: how far the rate is off (rms), how far it went, each, and its turns."""
    found: dict[str, tuple[float, Numbers, Numbers, Numbers]] = {}
    for axes, turn in tries.items():
        for shift in SHIFTS_S:
            moved, way, turns = _compared(place, attitude, rate, stretches, shift, turn)
            off = way - moved
            if len(off) > 10 and (rms := _rms(off - biased * off.mean(axis=0))) < found.get(axes, (np.inf,))[0]:
                found[axes] = rms, moved, off, turns
    return found


def _factor(theirs: Numbers, ours: Numbers, of: str) -> dict[str, float]:
    """In words by how much theirs must be multiplied to be ours, and how far they are off then; nothing where it explains little."""
    by = float((theirs * ours).sum() / max((theirs**2).sum(), 1e-12))
    if abs(by - 1) < 0.015 or by <= 0 or _rms(by * theirs - ours) > 0.5 * _rms(theirs - ours):
        return {}
    off, unit = min((abs(factor / size - 1), f" ({whose}{unit})") for factor, whose in ((by, ""), (1 / by, f"{of} in "))
                    for unit, size in UNITS.items())
    return {f"multiplied by {by:.3g}" + unit * (off < 0.05): _rms(by * theirs - ours)}


def _rms(values: Numbers) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _compared(place: Track, attitude: Track, rate: Track, stretches: Sequence[tuple[float, float]], shift_s: float,
              turn: Callable[[Numbers, Numbers], Numbers]) -> tuple[Numbers, Numbers, Numbers]:
    """What changed in every OVER_S, what the rate makes of it, and how the vehicle turned, (n, 3, 3)."""
    moved, ways, turns = [np.zeros((0, 3))], [np.zeros((0, 3))], [np.zeros((0, 3, 3))]
    for begin, end in stretches:
        t, count = np.arange(begin + max(0, -shift_s), end - max(0, shift_s), 0.1), round(10 * OVER_S)
        if len(t) < 2 * count:
            continue
        q = _at(attitude, t)
        rates = turn(q, _at(rate, t + shift_s))
        way = np.concatenate([np.zeros((1, 3)), np.cumsum(0.05 * (rates[1:] + rates[:-1]), axis=0)])
        ways.append(way[count:] - way[:-count])
        there = _at(place, t)
        if there.shape[1] == 4:  # how it turned, step by step, along B's axes
            there = np.concatenate([np.zeros((1, 3)), np.cumsum(vector_of(product(conjugate(q[:-1]), q[1:])), axis=0)])
        moved.append(there[count:] - there[:-count])
        axes = np.stack([rotated(q, np.broadcast_to(axis, (len(q), 3))) for axis in np.eye(3)], axis=-1)
        turns.append(axes[count:] - axes[:-count])
    return np.concatenate(moved), np.concatenate(ways), np.concatenate(turns)


def _at(track: Track, t: Numbers) -> Numbers:
    first, last = np.searchsorted(track[0], t[[0, -1]])
    times, values = (each[max(first - 1, 0):last + 1] for each in track)
    made = np.stack([np.interp(t, times, column) for column in values.T], axis=1)
    return made / np.linalg.norm(made, axis=1, keepdims=True) if values.shape[1] == 4 else made
