#!/usr/bin/env python3
"""The tables and the figure of docking over turbidity, from a batch of `turbidity_sweep` and from trials that were
run before the plan had strata, counted by the same sixths of the distance from which the vehicle begins.

    python3 assets/measured/turbidity.py sweep.db --figure assets/pictures/turbidity_sweep.png

writes three result files beside this script, or into --out. What the pages show is kept in trials/: the batch, packed
(the build that it names goes on from there), and the earlier counts.
"""
import argparse
import contextlib
import csv
import datetime
import math
import pathlib
import sqlite3
import subprocess

HERE = pathlib.Path(__file__).resolve().parent
BATCH, EARLIER = HERE / 'trials/turbidity_sweep.db.xz', HERE / 'trials/turbidity_before_strata.csv'
COMMAND = 'turbidock batch turbidity_sweep --out sweep.db'
MARKERS = ('active', 'passive')
COLORS = ('#0072b2', '#d55e00')


def of_batch(file):
    """By marker, milk and stratum: docked and all."""
    counts = {}
    with contextlib.closing(sqlite3.connect(f'{file.resolve().as_uri()}?mode=ro', uri=True)) as db:
        for scenario, milk, stratum, docked, trials in db.execute(
                'SELECT scenario, "water.milk_ml_m3", stratum, sum(failure = \'none\'), count(*) FROM results '
                'GROUP BY 1, 2, 3'):
            counts[scenario.rsplit('_', 1)[1], milk, stratum] = (docked, trials)
        build = db.execute("SELECT value FROM meta WHERE key = 'build'").fetchone()[0].split()[-1][:7]
    return counts, build


def of_table(file):
    """The same of a table by start."""
    lines = file.read_text(encoding='utf-8').splitlines()
    build = next(line for line in lines if line.startswith('# build: ')).removeprefix('# build: ')
    rows = csv.DictReader(line for line in lines if not line.startswith('#'))
    return {(row['marker'], float(row['milk, ml/m3']), stratum): tuple(map(int, cell.split(' of ')))
            for row in rows for stratum, cell in row.items() if ' of ' in cell}, build


def interval(strata):
    """The rate over strata of one size, whatever their numbers of trials, and its 95 % interval: Wilson's of the
    effective number, as experiments/statistics/intervals.h has it for strata with trials in proportion."""
    size, z = len(strata), 1.959963984540054
    p = sum(docked / n for docked, n in strata) / size
    smooth = [(docked + 0.5) / (n + 1) for docked, n in strata]
    mean = sum(smooth) / size
    variance = sum(q * (1 - q) * (n + 1)**2 / (n * n + n + 1) / n for q, (_, n) in zip(smooth, strata)) / size**2
    n = max(mean * (1 - mean) / variance, sum(n for _, n in strata))
    middle = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return p, max(0, middle - half), min(1, middle + half)


def crossing(doses, rates):
    """Where a falling line through these points is at 1/2."""
    for (x, p), (next_x, q) in zip(zip(doses, rates), list(zip(doses, rates))[1:]):
        if p >= 0.5 > q:
            return x + (p - 0.5) / (p - q) * (next_x - x)
    return None


def tables(counts):
    """Rows of the three result files by name, and rates and intervals by marker."""
    milk = sorted({milk for _, milk, _ in counts})
    strata = sorted({stratum for *_, stratum in counts})
    cells = {(marker, m): [counts[marker, m, s] for s in strata] for marker in MARKERS for m in milk}
    rates = {marker: [interval(cells[marker, m]) for m in milk] for marker in MARKERS}
    over = [['milk, ml/m3'] + [f'{marker} marker, {what}' for marker in MARKERS
                               for what in ('trials', 'docked, %', '95 % interval')]]
    for i, m in enumerate(milk):
        over.append([f'{m:g}'])
        for marker in MARKERS:
            p, low, high = (100 * value for value in rates[marker][i])
            over[-1] += [sum(n for _, n in cells[marker, m]), f'{p:.1f}', f'{low:.1f} to {high:.1f}']
    start = [['marker', 'milk, ml/m3', *strata]] + [
        [marker, f'{m:g}', *(f'{docked} of {n}' for docked, n in cells[marker, m])] for marker in MARKERS for m in milk]
    half = [['marker', 'ml/m3', '95 % interval']]
    for marker in MARKERS:
        at, low, high = (crossing(milk, column) for column in zip(*rates[marker]))
        half.append([marker, *((f'{at:.1f}', f'{low:.1f} to {high:.1f}') if at else
                               ('fewer than half without milk', ''))])
    return {'docking_over_turbidity': over, 'docking_by_start': start, 'docking_turbidity_limit': half}, milk, rates


def draw(path, milk, rates):
    plot = ["set terminal pngcairo size 1000,520 font 'DejaVu Sans,11'", f"set output '{path}'",
            "set xlabel 'milk, ml/m³'", "set ylabel 'docked within 50 s, % (95 % intervals)'", 'set yrange [-3:103]',
            f'set xrange [{-0.03 * milk[-1]}:{1.03 * milk[-1]}]', 'set grid', 'set key top right']
    for i, marker in enumerate(MARKERS):
        shift = 0.004 * milk[-1] * (2 * i - 1)  # or bars would hide each other
        plot.append(f'$d{i} << E\n' + '\n'.join(
            f'{m + shift} {100 * p} {100 * low} {100 * high}' for m, (p, low, high) in zip(milk, rates[marker])) + '\nE')
    plot.append('plot 50 with lines dt 2 lc "#808080" notitle, ' + ', '.join(
        f"$d{i} using 1:2 with lines lw 2 lc '{color}' notitle, $d{i} using 1:2:3:4 with yerrorbars pt 7 lw 2 "
        f"lc '{color}' title '{marker} marker'" for i, (marker, color) in enumerate(zip(MARKERS, COLORS))))
    subprocess.run(['gnuplot'], input='\n'.join(plot) + '\n', text=True, check=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('file', type=pathlib.Path)
    parser.add_argument('--out', type=pathlib.Path, default=HERE)
    parser.add_argument('--figure', type=pathlib.Path)
    arguments = parser.parse_args()
    counts, build = of_batch(arguments.file)
    earlier, earlier_build = of_table(EARLIER)
    both = {key: tuple(map(sum, zip(counts[key], earlier[key]))) for key in earlier}
    found, milk, rates = tables(both)
    here = sum(n for _, n in counts.values())
    titles = {
        'docking_over_turbidity': 'Docking over turbidity, both markers in the sea at night, from 0.6 to 1.5 m: '
                                  f'{here:,} trials over six strata of the distance and '
                                  f'{sum(n for _, n in earlier.values()):,} before there were strata',
        'docking_by_start': 'The same trials by the distance from which the vehicle begins: docked',
        'docking_turbidity_limit': 'Milk at which half of the trials dock, on straight lines between the rates above '
                                   'and between the ends of their intervals',
    }
    day = datetime.date.fromtimestamp(arguments.file.stat().st_mtime).isoformat()
    for name, rows in found.items():
        with open(arguments.out / f'{name}.csv', 'w', encoding='utf-8', newline='') as file:
            for key, value in (('title', titles[name]), ('command', COMMAND),
                               ('command', 'python3 assets/measured/turbidity.py sweep.db'),
                               ('build', f'{build}; before the strata {earlier_build}'),
                               ('machine', 'two cores, shared'), ('date', day)):
                file.write(f'# {key}: {value}\n')
            csv.writer(file, lineterminator='\n').writerows(rows)
    if arguments.figure:
        draw(arguments.figure, milk, rates)


if __name__ == '__main__':
    main()
