"""How well identification finds planted parameters: identification.py [--logs N] [--seconds S ...] [--poor hover|surge].

Each log is of a vehicle that the fit does not know, drawn about the published one, under the commands of an experiment that
`turbidock-identify plan` proposes; poses at 10 Hz with 5 mm and 0.5 degrees of noise, commands at 10 Hz, the pose's clock 50 ms
late. Prints a row a parameter: how often it was told, how often its 95 % interval had it then, the median error. With --poor the
logs hover or move ahead and back alone; printed is how often `inform` says what they cannot tell."""

import argparse
import pathlib
import sys
import time

import numpy as np

from turbidock import _core
from turbidock.logs import identify
from turbidock._rotation import product, turned
from turbidock.logs._parameters import AXES, parameters_of, scenario_with, still
from turbidock.scenario import Scenario

COMMANDS_HZ, POSES_HZ, OFFSET_S, NOISE_M, NOISE_RAD = 10, 10, 0.05, 0.005, np.radians(0.5)
SPREAD = {"added_mass": 0.25, "linear_damping": 0.35, "quadratic_damping": 0.35, "trim": 0.5, "thrust": 0.5}


def planted(scenario, rng):
    """Values of a vehicle about the scenario's: a normal factor of the spread above; trim and thrust within half of what is
    known of them before."""
    values = {}
    for parameter in parameters_of(scenario):
        group = parameter.name.split(".")[0]
        if group == "delay":
            continue
        z = rng.standard_normal() * (SPREAD[group] if group in ("trim", "thrust") else SPREAD[group] / parameter.std)
        if not parameter.scale and parameter.at_least == 0:
            z = abs(z)
        values[parameter.name] = parameter.value(z)
    return values


def hover(scenario, seconds):
    """Commands of a vehicle that only keeps its place: a little noise about neutral."""
    rng = np.random.default_rng(1)
    count = int(seconds * COMMANDS_HZ)
    names = _core.thrusters(scenario._cpp)
    return {"time_s": np.arange(count) / COMMANDS_HZ} | {
        f"{name}_v": 2.5 + 0.02 * rng.standard_normal(count) for name in names}


def one_axis(scenario, seconds):
    """Commands of surge alone."""
    most, _ = _core.authority(scenario._cpp)
    t = np.arange(0, seconds, 1 / COMMANDS_HZ)
    surge = 0.5 * most[0] * (np.sin(2 * np.pi * t / 8) + 0.5 * np.sin(2 * np.pi * t / 2.7))
    zero = np.zeros(len(t))
    times, volts = _core.commands(scenario._cpp, {"time_s": t, "surge_newton": surge, "sway_newton": zero,
                                                  "heave_newton": zero, "yaw_newton_m": zero}, "one axis")
    return {"time_s": times} | {f"{name}_v": volts[:, i] for i, name in enumerate(_core.thrusters(scenario._cpp))}


def at_rate(commands, hz):
    """Commands as a log of that rate has them, and as the vehicle is given them."""
    every = int(round(1 / (hz * (commands["time_s"][1] - commands["time_s"][0]))))
    return {name: np.asarray(values)[::every] for name, values in commands.items()}


def log_of(scenario, values, commands, rng, offset_s=OFFSET_S, noise_m=NOISE_M, noise_rad=NOISE_RAD):
    """A table of motion of the vehicle with these values, from rest at 5 m of depth."""
    model = scenario_with(still(scenario), values)
    model._cpp.set(["trial.clock.ticks_per_frame=64"])  # a quarter of the plant's own error
    end_s = commands["time_s"][-1]
    times = np.arange(0, end_s, 1 / POSES_HZ)
    begin = np.zeros((1, 13))
    begin[0, 2], begin[0, 3] = -5, 1
    none = np.zeros(1, np.int64)
    states = _core.predict([model._cpp], commands, np.zeros(1), [times], none, none, begin, 1)[0]
    assert np.isfinite(states).all()
    position = states[:, :3] + noise_m * rng.standard_normal((len(times), 3))
    attitude = product(states[:, 3:7], turned(noise_rad * rng.standard_normal((len(times), 3))))
    return joined(commands, times + offset_s, position, attitude)


def joined(commands, times, position, attitude):
    """One table of commands and poses, each where it was logged."""
    stamps = np.union1d(commands["time_s"], times)
    table = {"time_s": stamps}
    for name, values in commands.items():
        if name != "time_s":
            table[name] = np.full(len(stamps), np.nan)
            table[name][np.searchsorted(stamps, commands["time_s"])] = values
    columns = {f"vehicle_{axis}_m": position[:, i] for i, axis in enumerate("xyz")}
    columns |= {f"vehicle_q{axis}": attitude[:, i] for i, axis in enumerate("wxyz")}
    for name, values in columns.items():
        table[name] = np.full(len(stamps), np.nan)
        table[name][np.searchsorted(stamps, times)] = values
    return table


def poor(scenario, given, seconds):
    """Says how often all is said to be untold of the axes in which nothing is commanded and nothing moves."""
    dark_axes = ("surge", "sway", "yaw") if given.poor == "hover" else ("sway", "yaw")
    commands = (hover if given.poor == "hover" else one_axis)(scenario, seconds)
    good = 0
    for log in range(given.first, given.first + given.logs):
        rng = np.random.default_rng([log, 49])
        values = {name: value for name, value in planted(scenario, rng).items()
                  if not name.startswith("trim.")}  # its pilot keeps it trimmed: it does not drift through its axes
        known = identify.inform(log_of(scenario, values, commands, rng), scenario, workers=given.workers)
        wrong = [parameter.name for parameter, told in zip(known.parameters, known.told())
                 if told and parameter.axis() in dark_axes]
        good += not wrong
        print(f"{given.poor}, {seconds:g} s, log {log}: {', '.join(wrong) or 'said so'}", file=sys.stderr, flush=True)
    print(f"{given.poor}, {seconds:g} s: {good} of {given.logs} are said to tell nothing of {', '.join(dark_axes)}")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenario", default="pool_active")
    parser.add_argument("--logs", type=int, default=10)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seconds", type=float, nargs="+", default=[60])
    parser.add_argument("--poor", choices=("hover", "surge"))
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--csv", type=pathlib.Path)
    given = parser.parse_args()
    scenario = Scenario(given.scenario)
    lines = ["seconds,log,parameter,planted,value,low,high,told,held_out_mm,fit_s"]
    for seconds in given.seconds:
        if given.poor:
            poor(scenario, given, seconds)
            continue
        commands = at_rate(identify.plan(scenario, duration_s=seconds, workers=given.workers), COMMANDS_HZ)
        for log in range(given.first, given.first + given.logs):
            rng = np.random.default_rng([log, 49])
            values = planted(scenario, rng)
            begin = time.perf_counter()
            fit = identify.fit(log_of(scenario, values, commands, rng), scenario, workers=given.workers)
            took = time.perf_counter() - begin
            values = {p.name: p.before for p in fit.parameters} | values | {"delay.pose": OFFSET_S, "delay.drift": 0.0}
            for parameter in fit.parameters:
                low, high = fit.interval(parameter.name)
                lines.append(f"{seconds:g},{log},{parameter.name},{values[parameter.name]:.6g},{fit.value(parameter.name):.6g},"
                             f"{low:.6g},{high:.6g},{int(fit.told(parameter.name) and not fit.doubt)},"
                             f"{1000 * fit.validation.get('median_m', float('nan')):.1f},{took:.1f}")
            said = fit.doubt or f"held out {1000 * fit.validation.get('median_m', float('nan')):.0f} mm"
            print(f"{seconds:g} s, log {log}: {took:.0f} s, {said}", file=sys.stderr, flush=True)
            if given.csv:
                given.csv.write_text("\n".join(lines) + "\n", encoding="utf-8")
    if not given.poor:
        table(lines)


def table(lines):
    """A row a parameter, as identification_coverage.csv has them."""
    rows = [line.split(",") for line in lines[1:]]
    for seconds in dict.fromkeys(row[0] for row in rows):
        print(f"# {seconds} s")
        print("parameter,told,inside,median error")
        inside_all = told_all = 0
        for name in dict.fromkeys(row[2] for row in rows):
            mine = [row for row in rows if row[0] == seconds and row[2] == name]
            told = [row for row in mine if row[7] == "1"]
            inside = sum(float(row[5]) <= float(row[3]) <= float(row[6]) for row in told)
            inside_all, told_all = inside_all + inside, told_all + len(told)
            offset = name.startswith("delay.") or name.startswith("trim.centre")
            off = np.median([abs(float(row[4]) - float(row[3])) / (1 if offset else abs(float(row[3]))) for row in told] or [0])
            print(f"{name},{len(told)} of {len(mine)}," + (f"{inside} of {len(told)}," + (f"{off:.2g}" if offset else
                  f"{100 * off:.1f} %") if told else ","))
        held_out = [float(row[8]) for row in rows if row[0] == seconds]
        took = [float(row[9]) for row in rows if row[0] == seconds]
        print(f"# {inside_all} of {told_all} inside; held out, {np.nanmedian(held_out):.1f} mm in the median of logs; "
              f"a fit took {np.median(took):.0f} s")


if __name__ == "__main__":
    main()
