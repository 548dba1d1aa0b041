#!/usr/bin/env python3
"""The map of a batch of `rough_sea`: docked trials over wave height and period, a panel for each law and current. Two
lines are the thrusters' and no controller's: the height up to which they can hold the vehicle still (`turbidock check-vehicle`),
and that up to which they can keep it within the 40 mm allowed to either side, where it goes with the wave as far as
that.

    python3 assets/measured/sea_map.py rough.db map.png >assets/measured/docking_over_waves.csv

The figure is drawn by gnuplot; the rows of the result file go to stdout.
"""
import argparse
import contextlib
import csv
import datetime
import json
import math
import pathlib
import re
import sqlite3
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
HEIGHT, PERIOD = 'sea.waves.0.height_m', 'sea.waves.0.period_s'
CURRENT = 'sea.current.surface_velocity_mps'
ALLOWED_M = 0.04  # to either side, of the published docking criterion


def speed_mps(current):
    return math.hypot(*(float(v) for v in current.strip('[]').split(',')))


def loads(program, height_m, period_s, current):
    """Of sway and heave: the force that the sea asks for at most to hold still, and what there is; N."""
    command = [program, 'check-vehicle', 'vehicle.xml', '--json', '--set', 'sea.state=custom', '--set',
               f'sea.waves=[{{height_m: {height_m}, period_s: {period_s}, direction_rad: 1.5708}}]', '--set',
               f'{CURRENT}={current}']
    said = subprocess.run(command, capture_output=True, text=True, check=False).stdout
    axes = {axis['axis']: axis for axis in json.loads(said)['axes']}
    return [(axes[a]['load'], min(axes[a]['most'], -axes[a]['most_back'])) for a in ('sway', 'heave')]


def limit_m(program, period_s, current, gives_m):
    """The highest wave of which the sea asks for no more than there is, from a vehicle that gives way so far: swinging
    by an amplitude a takes (mass + added mass) a w^2 off the force that holds it still, at best."""
    text = (ROOT / 'models/vehicle.yaml').read_text()
    mass_kg = float(re.search(r'mass_kg: ([\d.]+)', text)[1])
    added_kg = [float(v) for v in re.search(r'added_mass_diagonal: \[(.*?)\]', text)[1].split(',')][1:3]
    relief_newton = [(mass_kg + a) * gives_m * (2 * math.pi / period_s)**2 for a in added_kg]

    def holds(height_m):
        return all(load - relief <= most
                   for (load, most), relief in zip(loads(program, height_m, period_s, current), relief_newton))

    low, high = 0.0, 2.0
    for _ in range(9):
        middle = (low + high) / 2
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('file', type=pathlib.Path)
    parser.add_argument('figure', type=pathlib.Path)
    parser.add_argument('--program', default=ROOT / 'build/bin/turbidock')
    arguments = parser.parse_args()
    with contextlib.closing(sqlite3.connect(f'{arguments.file.resolve().as_uri()}?mode=ro', uri=True)) as db:
        found = db.execute(f'SELECT controller, "{CURRENT}", "{PERIOD}", "{HEIGHT}", outcome FROM results').fetchall()
        build = db.execute("SELECT value FROM meta WHERE key = 'build'").fetchone()[0].split()[-1]
    cells = {}
    for law, current, period_s, height_m, outcome in found:
        cells.setdefault((law, current), {}).setdefault((float(period_s), float(height_m)), []).append(
            outcome == 'success')
    periods_s = sorted({p for panel in cells.values() for p, _ in panel})
    heights_m = sorted({h for panel in cells.values() for _, h in panel})
    currents = sorted({current for _, current in cells}, key=speed_mps)
    laws = sorted({law for law, _ in cells}, key=['lqg', 'pid', 'p_voltage'].index)
    limits_m = {c: {p: [limit_m(arguments.program, p, c, gives_m) for gives_m in (0, ALLOWED_M)] for p in periods_s}
                for c in currents}

    def place_of(height_m):
        """Where a height lies between the rows, which are not evenly spaced."""
        rows = [0.0] + heights_m
        for i in range(len(rows) - 1):
            if height_m <= rows[i + 1]:
                return i - 1 + (height_m - rows[i]) / (rows[i + 1] - rows[i])
        return len(heights_m) - 0.5

    def speed(current):
        return f'{100 * speed_mps(current):.0f} cm/s'

    columns, rows = len(laws), len(currents)
    plot = [f"set terminal pngcairo size {420 * columns},{400 * rows} font 'DejaVu Sans,11'",
            f"set output '{arguments.figure}'",
            f"set multiplot layout {rows},{columns} title 'Docking over waves across the dock, % of trials. The "
            "thrusters can hold still below the line, and within 40 mm below the dashes'",
            "set palette defined (0 '#b2182b', 0.5 '#f7f0dc', 1 '#2166ac')", 'set cbrange [0:100]', 'unset colorbox',
            'unset key', f'set xrange [-0.5:{len(periods_s) - 0.5}]', f'set yrange [-0.5:{len(heights_m) - 0.5}]',
            "set xlabel 'period, s'", "set ylabel 'height, m'", 'set tics scale 0',
            'set xtics (' + ', '.join(f"'{p:g}' {i}" for i, p in enumerate(periods_s)) + ')',
            'set ytics (' + ', '.join(f"'{h:g}' {i}" for i, h in enumerate(heights_m)) + ')']
    for current in currents:
        plot.append('$limit << E\n' + '\n'.join(
            f'{i} {place_of(limits_m[current][p][0])} {place_of(limits_m[current][p][1])}'
            for i, p in enumerate(periods_s)) + '\nE')
        for law in laws:
            panel = cells[law, current]
            plot.append('$cells << E\n' + '\n'.join(
                f'{i} {j} {100 * sum(panel[p, h]) / len(panel[p, h]):.0f}' for i, p in enumerate(periods_s)
                for j, h in enumerate(heights_m)) + '\nE')
            plot += [f"set title '{law}, current {speed(current)}' noenhanced",
                     "plot $cells using 1:2:3 with image, $cells using 1:2:(sprintf('%d', $3)) with labels, "
                     "$limit using 1:2 with lines lw 3 lc 'black', "
                     "$limit using 1:3 with lines lw 3 dt 2 lc 'black'"]
    subprocess.run(['gnuplot'], input='\n'.join(plot) + '\n', text=True, check=True)

    day = datetime.date.fromtimestamp(arguments.file.stat().st_mtime).isoformat()
    print('# title: Docking over waves across the dock, the true pose with the estimator\'s noise; docked of '
          f'{len(next(iter(cells[laws[0], currents[0]].values())))} by wave height, and the heights up to which the '
          'thrusters can hold the vehicle still, and within 40 mm')
    print(f'# command: turbidock batch rough_sea --out {arguments.file.name}')
    print(f'# build: {build}\n# machine: two cores, shared\n# date: {day}')
    writer = csv.writer(sys.stdout, lineterminator='\n')
    writer.writerow(['law', 'current', 'period, s'] + [f'{h:g} m' for h in heights_m] +
                    ['held still to, m', 'within 40 mm to, m'])
    for law in laws:
        for current in currents:
            for p in periods_s:
                writer.writerow([law, speed(current), f'{p:g}'] + [sum(cells[law, current][p, h]) for h in heights_m] +
                                [f'{limit:.2f}' for limit in limits_m[current][p]])


if __name__ == '__main__':
    main()
