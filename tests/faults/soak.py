#!/usr/bin/env python3
"""A long soak: thousands of short trials in one worker, whose memory, open files and time a trial stay as they are.

    python3 tests/faults/soak.py build/bin/turbidock --trials 10000 [--seconds 1] [--cameras] [--csv soak.csv]
    python3 tests/faults/soak.py build/bin/turbidock --trials 1500 --seconds 20     eight hours and more of simulated docking

The last tenth against the first (which begins after 100 trials) for memory, the second half against the first for open
files, of which a trial has one more for an instant, so that the median counts. For time the last tenth against as many
trials of a fresh worker run at the same time, since the machine's own speed changes over the hour, and of both the
tenth percentile, since other work only makes a trial slower. Exit code 1 when one of them grew by more than 2 %.
"""

import argparse
import concurrent.futures
import contextlib
import csv
import os
import pathlib
import sqlite3
import statistics
import subprocess
import sys
import tempfile
import time

PLAN = """schema_version: 1
description: soak
scenario: sea_night_active
seeds: 1
trial_time_limit_s: 60
set: {{trial.duration_s: {seconds}, trial.after_docked_s: {seconds}, estimator.pose_source: {pose_source}}}
grid: {{control.use: [pid]}}
"""
MOST = 1.02
WARM = 100  # trials before anything is compared


def open_files(pid):
    with contextlib.suppress(OSError):
        return len(os.listdir(f'/proc/{pid}/fd'))
    return None


def children(pid):
    with contextlib.suppress(OSError):
        return [int(c) for c in pathlib.Path(f'/proc/{pid}/task/{pid}/children').read_text().split()]
    return []


def fly(folder, name, trials, arguments, on_done=lambda done: None):
    """Rows (trial, resident bytes, processor seconds) in order, and open files of batch and worker as time goes on."""
    plan = folder / f'{name}.yaml'
    plan.write_text(PLAN.format(seconds=arguments.seconds, pose_source='cameras' if arguments.cameras else 'true_pose'))
    file, log_file, watched = folder / f'{name}.db', folder / f'{name}.log', []
    with open(log_file, 'w') as log:
        process = subprocess.Popen([arguments.program, 'batch', plan, '--seeds', str(trials), '--workers', '1', '--quiet', '--out', file],
                                   stdout=log, stderr=log)
        while process.poll() is None:
            time.sleep(0.5)
            workers = children(process.pid)
            if not workers:
                continue
            counts = open_files(process.pid), open_files(workers[0])
            with contextlib.suppress(sqlite3.Error), contextlib.closing(
                    sqlite3.connect(f'file:{file}?mode=ro', uri=True, timeout=5)) as db:
                on_done(db.execute('SELECT count(*) FROM trials').fetchone()[0])
                if None not in counts:
                    watched.append(counts)
    if process.returncode != 0:
        sys.exit(f'{arguments.program} ended with {process.returncode}: {log_file.read_text()}')
    with contextlib.closing(sqlite3.connect(file)) as db:
        rows = db.execute('SELECT trial, rss_bytes, cpu_time_s FROM trials ORDER BY rowid').fetchall()
    return rows, watched


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('program')
    parser.add_argument('--trials', type=int, default=10000)
    parser.add_argument('--seconds', type=float, default=1, help='of a trial; docked it holds the vehicle for the rest')
    parser.add_argument('--cameras', action='store_true', help='by cameras instead of on the true pose')
    parser.add_argument('--csv', help='the figures as a table')
    arguments = parser.parse_args()
    tenth = arguments.trials // 10
    if tenth < WARM:
        sys.exit(f'--trials {arguments.trials}: at least {10 * WARM}')
    beside = []
    with tempfile.TemporaryDirectory() as name, concurrent.futures.ThreadPoolExecutor(1) as pool:
        folder = pathlib.Path(name)

        def start_fresh(done):
            if done >= arguments.trials - tenth - WARM and not beside:
                beside.append(pool.submit(fly, folder, 'fresh', tenth + WARM, arguments))

        rows, watched = fly(folder, 'soak', arguments.trials, arguments, start_fresh)
        start_fresh(arguments.trials)
        fresh, _ = beside[0].result()
    if len(rows) != arguments.trials:
        sys.exit(f'{len(rows)} of {arguments.trials} trials')
    first, last = rows[WARM:WARM + tenth], rows[-tenth:]
    median = lambda table, column: statistics.median(row[column] for row in table)
    quick_ms = lambda table: 1000 * statistics.quantiles((row[2] for row in table), n=10)[0]
    middle = len(watched) // 2
    results = [
        ('resident memory of the worker, MiB', median(first, 1) / 2**20, median(last, 1) / 2**20),
        ('open files of the batch', median(watched[:middle], 0), median(watched[middle:], 0)),
        ('open files of the worker', median(watched[:middle], 1), median(watched[middle:], 1)),
        ('processor time a trial, ms (of a fresh worker; of the last tenth)', quick_ms(fresh[WARM:]), quick_ms(last)),
    ]
    table = [('quantity', 'first', 'last', 'ratio')]
    table += [(what, f'{a:.4g}', f'{b:.4g}', f'{b / a:.4f}') for what, a, b in results]
    for row in table:
        print(f'{row[0]:70} {row[1]:>9} {row[2]:>9} {row[3]:>7}')
    if arguments.csv:
        with open(arguments.csv, 'w', newline='') as file:
            csv.writer(file, lineterminator='\n').writerows(table)
    grown = [what for what, a, b in results if b > MOST * a]
    for what in grown:
        print(f'grew by more than 2 %: {what}')
    return 1 if grown else 0


if __name__ == '__main__':
    sys.exit(main())
