"""What the tables of measured results are made of: commands, what they leave, and how cells are written.

A rule is a function under @table, called as its table, whose title stands in the first line of the committed file. It gets
the runs of its commands in order (in --quick those that have a short form) and returns rows, first the columns' names.
"""

import collections
import contextlib
import csv
import dataclasses
import json
import math
import pathlib
import sqlite3
import statistics

ROOT = pathlib.Path(__file__).resolve().parents[2]
# Subcommands that keep what is done in a file and go on with it, here or on a cluster.
LONG = ('batch', 'gate', 'tune', 'recognize', 'calibrate')


@dataclasses.dataclass(frozen=True)
class Command:
    """Words as a user types them. `quick`: options put in their place in --quick, or another command; None: left out then.
    `files`: texts to write into the folder first. `fresh`: timed, so never gone on with. `workers`: takes --workers.
    `at_root`: runs in the repository's root, not in the folder."""
    words: tuple
    quick: tuple | None = ()
    key: object = None
    files: dict = dataclasses.field(default_factory=dict)
    fresh: bool = False
    workers: bool = False
    at_root: bool = False

    def quickly(self):
        """The words of --quick."""
        if self.quick and not self.quick[0].startswith('-'):
            return self.quick
        name = lambda option, value: (option, value.split('=')[0]) if option == '--set' else option
        new = {name(*pair) for pair in zip(self.quick[::2], self.quick[1::2])}
        kept, words = [], list(self.words)
        while words:
            if words[0].startswith('--') and len(words) > 1 and name(*words[:2]) in new:
                del words[:2]
            else:
                kept.append(words.pop(0))
        return (*kept, *self.quick)


def turbidock(line, *more, quick=(), **other):
    """A command of the program, written as one line; `more` are words with spaces in them."""
    return Command(('turbidock', *line.split(), *more), tuple(quick.split()) if isinstance(quick, str) else quick, **other)


@dataclasses.dataclass
class Run:
    """What a command left: `text` on stdout, files in `folder`, the time it took."""
    command: Command
    text: str
    wall_s: float
    folder: pathlib.Path

    @property
    def key(self):
        return self.command.key

    def json(self):
        return json.loads(self.text)

    def rows(self, name=None):
        """Of a CSV file in the folder, or of stdout, without comments; the first are names."""
        text = (self.folder / name).read_text() if name else self.text
        return list(csv.reader(line for line in text.splitlines() if line and not line.startswith('#')))

    def trials(self):
        """A batch's trials as dictionaries, in the order in which they were planned."""
        file = self.folder / self.command.words[self.command.words.index('--out') + 1]
        with contextlib.closing(sqlite3.connect(f'{file.as_uri()}?mode=ro', uri=True)) as db:
            db.row_factory = sqlite3.Row
            return [dict(row) for row in db.execute('SELECT *, cpu_time_s FROM trials ORDER BY cell, sample')]


@dataclasses.dataclass
class Table:
    """`cost` says trials or processor hours; `shown`: lines of the origin instead of the commands; `elsewhere`: what else
    tries its commands in CI where it has none for --quick."""
    name: str
    commands: list
    cost: str
    rule: object
    shown: list
    elsewhere: str


TABLES: dict = {}


def table(commands, cost, shown=None, elsewhere=''):
    def register(rule):
        lines = shown or list(dict.fromkeys(' '.join(f"'{w}'" if ' ' in w or '*' in w else w for w in c.words) for c in commands))
        TABLES[rule.__name__] = Table(rule.__name__, commands, cost, rule, lines, elsewhere)
        return rule
    return register


def grouped(trials, *keys):
    groups = {}
    for trial in trials:
        groups.setdefault(tuple(trial[key] for key in keys), []).append(trial)
    return groups


def docked(trials):
    """Those with the pole in the hole."""
    return [trial for trial in trials if trial['outcome'] == 'success']


def beside(trials):
    """How many took themselves for docked with the pole beside the hole."""
    return sum(trial['outcome'] == 'false_dock' for trial in trials)


def share(count, of, word=' of '):
    """A count with Wilson's interval of 95 %: 195 of 200 (94-99 %)."""
    if not of:
        return ''
    z = 1.959964
    rate, spread = count / of, z * math.sqrt(count * (of - count) / of + z * z / 4) / of
    middle, scale = rate + z * z / (2 * of), 1 + z * z / of
    low, high = (round(100 * (middle + sign * spread) / scale) for sign in (-1, 1))
    return f'{count}{word}{of if word else ""} ({low}-{high} %)'


def median(trials, key, digits=0, scale=1):
    """Of a result's absolute values; nothing where there are none."""
    values = [abs(value) for trial in trials if (value := trial[key] if isinstance(key, str) else key(trial)) is not None]
    return f'{scale * statistics.median(values):.{digits}f}' if values else ''


def aside(trials):
    """Medians of the true errors to the side and up, mm."""
    y, z = (median(trials, f'final_error_true_{axis}_m', 0, 1000) for axis in 'yz')
    return f'{y}, {z}' if y else ''


def failures(trials):
    """What befell those that did not dock: 2 never found, 1 collision."""
    counts = collections.Counter(trial['failure'].replace('_', ' ') for trial in trials if trial['outcome'] != 'success')
    return ', '.join(f'{number} {failure}' for failure, number in counts.most_common())
