#!/usr/bin/env python3
"""How the trials of a batch ended, by some of its parameters: the rows of a result file.

    python3 assets/measured/outcomes.py faults.db scenario faults
    python3 assets/measured/outcomes.py faults.db scenario faults --title 'How trials end under each fault' \\
      --command 'turbidock batch faults --out faults.db' --machine 'two cores' >assets/measured/faults.csv

A row for each group of trials, in the order in which they were planned: how many docked, how often each outcome and
failure came, the median time, and what the first trial that did not dock (or the first) says. With --title also the
lines that say where the table comes from; build and day are the file's. Exit code 1 when a trial says `docked` and the
pole is not in the hole.
"""

import argparse
import collections
import contextlib
import csv
import datetime
import pathlib
import re
import sqlite3
import statistics
import sys


def plain(value):
    """A group of keys as a plan writes it, without its brackets: {fish: [{begin_s: 6}]} is "fish: begin_s 6"."""
    text = str(value).strip()
    if not text.startswith('{'):
        return text
    if text == '{}':
        return 'none'
    keys = re.sub(r'[\w.]+: \[\{.*?\}\]', lambda m: m.group().replace(': [{', '\0', 1).replace(': ', ' '), text[1:-1])
    return keys.replace('\0', ': ').replace('}, {', '; ').replace('}]', '')


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('file', type=pathlib.Path)
    parser.add_argument('keys', nargs='+', metavar='KEY')
    parser.add_argument('--title')
    parser.add_argument('--command', default='not recorded')
    parser.add_argument('--machine', default='not recorded')
    arguments = parser.parse_args()
    columns = ', '.join('"' + key.replace('"', '""') + '"' for key in arguments.keys)
    with contextlib.closing(sqlite3.connect(f'{arguments.file.resolve().as_uri()}?mode=ro', uri=True)) as db:
        found = db.execute(f'SELECT {columns}, outcome, failure, time_s, reason, inserted FROM results '
                           'ORDER BY cell, sample').fetchall()
        build = db.execute("SELECT value FROM meta WHERE key = 'build'").fetchone()[0].split()[-1]
    day = datetime.date.fromtimestamp(arguments.file.stat().st_mtime).isoformat()
    groups, false_docks = {}, 0
    for *group, outcome, failure, time_s, reason, inserted in found:
        groups.setdefault(tuple(group), []).append((outcome, failure, time_s, reason))
        false_docks += outcome == 'success' and not inserted
    counted = lambda values: ', '.join(f'{n} {value}' for value, n in collections.Counter(values).most_common())
    if arguments.title:
        for key, value in (('title', arguments.title), ('command', arguments.command), ('build', build),
                           ('machine', arguments.machine), ('date', day)):
            print(f'# {key}: {value}')
    writer = csv.writer(sys.stdout, lineterminator='\n')
    writer.writerow([*arguments.keys, 'outcomes', 'failures', 'median time, s', 'reason, of the first that did not dock'])
    for group, trials in groups.items():
        failed = [trial for trial in trials if trial[0] != 'success']
        writer.writerow([*map(plain, group), counted(t[0] for t in trials), counted(t[1] for t in trials),
                         f'{statistics.median(t[2] for t in trials):.1f}', failed[0][3] if failed else ''])
    return 1 if false_docks else 0


if __name__ == '__main__':
    sys.exit(main())
