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


def check_table(table: Motion, name: str) -> None:
    """ConfigError for times that are no seconds, and for a vehicle above the water."""
    step = float(np.median(np.diff(table["time_s"])))
    for unit, factor in (("milliseconds", 1e3), ("microseconds", 1e6), ("nanoseconds", 1e9)):
        if step > 0.5 and 5e-4 < step / factor < 0.5:
            raise ConfigError(f"{name}: time_s has steps of {step:g}: it looks like {unit}, must be seconds: divide by {factor:g}")
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
        if abs(apart) > 0.3:
            raise ConfigError(f"{name}: vehicle_z_m and depth_m differ by {apart:.2f} m (median): z is 0 at the surface, depth_m "
                              "that of B; absolute pressure is 10.3 m too deep: `offset` in a topic's line")
    if np.median(z) > 0 or np.quantile(z, 0.95) > 0.3:
        raise ConfigError(f"{name}: vehicle_z_m is {np.median(z):.2f} m (median), {z.max():.2f} m at most: above the water. z is 0 at "
                          "the surface and points up: of a pool's floor `offset: -DEPTH`, where it points down `axes: frd`")


def without_repeats(table: Motion, name: str) -> tuple[Motion, list[str]]:
    """The table without poses that repeat the one before to the last digit, as a tracker that lost its body and a recorder faster than
    it write them, and a note. ConfigError where few are left."""
    kept, notes = dict(table), []
    poses: list[tuple[str, ...]] = [group for group in (POSITION, QUATERNION, EULER) if has(table, group)]
    rows = [np.asarray(np.isfinite([table[column] for column in group]).all(axis=0)) for group in poses]
    if len(poses) > 1 and (rows[0] == rows[1]).all():  # one of both may stand where the vehicle does not turn
        poses, rows = [poses[0] + poses[1]], rows[:1]
    for group, there in zip(poses, rows):
        values, at = np.array([table[column][there] for column in group]), np.flatnonzero(there)[1:]
        again = at[(np.diff(values) == 0).all(axis=0)]
        words = f"{name}: {group[0]} to {group[-1]} repeat the pose before in {len(again)} of {len(at) + 1} rows"
        if len(again) > max(0, len(at) - 9):
            raise ConfigError(f"{words}: they stand still, which no measurement does")
        notes += [f"{words}, first at {table['time_s'][first]:.2f} s: no measurement, left out." for first in again[:1]]
        kept |= {column: np.where(np.isin(np.arange(len(there)), again), np.nan, table[column]) for column in group}
    return kept, notes


def check_velocity(position: Track, attitude: Track, velocity: Track, stretches: Sequence[tuple[float, float]], noise_m: float,
                   name: str) -> None:
    """ConfigError for velocities that are not those of the positions."""
    tries = {"B's axes": rotated, "the world's axes": lambda q, v: v, "axes ahead, right, down": lambda q, v: rotated(q, v * DOWN),
             "the world's axes, z down": lambda q, v: v * DOWN, "axes astern, right, up": lambda q, v: rotated(q, -v * [1, 1, -1])}
    found = _least(tries, position, attitude, velocity, stretches, False)
    if "B's axes" not in found:
        return
    rms, speed, off, turns = found.pop("B's axes")
    if rms**2 < 0.02**2 + (0.15 * speed)**2 + (3 * noise_m / OVER_S)**2:
        return
    lever = np.linalg.lstsq(turns.reshape(-1, 3), off.ravel(), rcond=None)[0]
    words = {f"along {axes}": each[0] for axes, each in found.items()}
    words["of a point {:.2f}, {:.2f}, {:.2f} m from B".format(*lever)] = _rms(off - turns @ lever)
    flow = off.mean(axis=0)
    words["through water that moves at {:.2f}, {:.2f}, {:.2f} m/s".format(*-flow / OVER_S)] = _rms(off - flow)
    _refuse(name, VELOCITY, POSITION, rms, "m/s", words)


def check_turn_rate(attitude: Track, turn_rate: Track, stretches: Sequence[tuple[float, float]], noise_rad: float, name: str
                    ) -> Numbers:
    """The gyroscopes' bias, rad/s. ConfigError for turn rates that are not those of the attitudes."""
    tries = {"B's axes": lambda q, w: w, "the world's axes": lambda q, w: rotated(conjugate(q), w),
             "axes ahead, right, down": lambda q, w: w * DOWN, "B's axes in degrees/s": lambda q, w: np.radians(w)}
    found = _least(tries, attitude, attitude, turn_rate, stretches, True)
    if "B's axes" not in found:
        return np.zeros(3)
    rms, rate, off, _ = found.pop("B's axes")
    if rms**2 > 0.03**2 + (0.2 * rate)**2 + (3 * noise_rad / OVER_S)**2:
        _refuse(name, TURN_RATE, ("its attitude",), rms, "rad/s", {f"along {axes}": each[0] for axes, each in found.items()})
    bias = np.asarray(off.mean(axis=0) / OVER_S)
    return bias if np.linalg.norm(bias) > 0.002 + 5 * rms / np.sqrt(len(off)) else np.zeros(3)


def _refuse(name: str, these: Sequence[str], those: Sequence[str], rms: float, unit: str, tries: Mapping[str, float]) -> None:
    best = min(tries, key=lambda words: tries[words])
    otherwise = f", {tries[best]:.3f} if they were {best}" if tries[best] < 0.5 * rms else ""
    raise ConfigError(f"{name}: {', '.join(these)} contradict {', '.join(those)}: they differ by {rms:.3f} {unit} (rms), taken along "
                      f"B's axes{otherwise}")


def _least(tries: Mapping[str, Callable[[Numbers, Numbers], Numbers]], place: Track, attitude: Track, rate: Track,
           stretches: Sequence[tuple[float, float]], biased: bool) -> dict[str, tuple[float, float, Numbers, Numbers]]:
    """By axes, at the clocks' shift that suits them best: how far the rate is off (rms), how far it went, each, and its turns."""
    found: dict[str, tuple[float, float, Numbers, Numbers]] = {}
    for axes, turn in tries.items():
        for shift in SHIFTS_S:
            moved, way, turns = _compared(place, attitude, rate, stretches, shift, turn)
            off = way - moved
            if len(off) > 10 and (rms := _rms(off - biased * off.mean(axis=0))) < found.get(axes, (np.inf,))[0]:
                found[axes] = rms, _rms(moved), off, turns
    return found


def _rms(values: Numbers) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _compared(place: Track, attitude: Track, rate: Track, stretches: Sequence[tuple[float, float]], shift_s: float,
              turn: Callable[[Numbers, Numbers], Numbers]) -> tuple[Numbers, Numbers, Numbers]:
    """What changed in every OVER_S, what the rate makes of it, and how the vehicle turned, (n, 3, 3)."""
    moved, ways, turns = [np.zeros((0, 3))], [np.zeros((0, 3))], [np.zeros((0, 3, 3))]
    for begin, end in stretches:
        t = np.arange(begin + max(0, -shift_s), end - max(0, shift_s), 0.1)
        count = round(10 * OVER_S)
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
    times, values = track
    if values.shape[1] == 4:
        values = values * np.cumprod(np.where((values * np.roll(values, 1, axis=0)).sum(axis=1) < 0, -1, 1))[:, None]
    made = np.stack([np.interp(t, times, column) for column in values.T], axis=1)
    return made / np.linalg.norm(made, axis=1, keepdims=True) if values.shape[1] == 4 else made
