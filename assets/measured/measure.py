#!/usr/bin/env python3
"""Makes tables of measured results: runs their commands and writes their rows.

    python3 assets/measured/measure.py --list                the tables, their commands, cost and build
    python3 assets/measured/measure.py docking_moored        makes a table and draws the pages anew; without names all
    python3 assets/measured/measure.py --quick               a seed or two of each, to see that commands and rules work

Commands and rules stand in the tables_*.py beside this. What commands leave is in out/measured/ (of --quick in its folder
quick, which is emptied first): the same command goes on where it was interrupted. Exit code 1 when a table could not be made; the
others are made all the same.
"""

import argparse
import csv
import datetime
import json
import os
import pathlib
import re
import resource
import shutil
import subprocess
import sys
import time

import draw
from making import LONG, ROOT, TABLES, Run
import tables_checks, tables_docking, tables_estimator, tables_speed  # noqa: E401,F401

HERE = pathlib.Path(__file__).resolve().parent


class Failed(Exception):
    """A command that ended otherwise than it should."""


def program_words(command, words, given):
    """Words to run: the program, the Python that has the package, files of the repository and of its build."""
    named = {'turbidock': given.program, 'python': given.python, 'python3': sys.executable}
    build = given.program.parents[2]
    place = lambda word: str(ROOT / word if word.startswith(('assets/', 'tests/')) else build / word if word.startswith('build/') else word)
    found = [str(named.get(words[0], words[0])), *map(place, words[1:])] if words[0] in named else [*map(place, words)]
    is_long = words[0] == 'turbidock' and words[1] in LONG
    if command.workers or is_long and '--workers' not in words:
        found += ['--workers', str(given.workers)]
    if is_long and given.slurm and not command.fresh:
        found += ['--slurm', str(given.slurm), *(f'--sbatch={option}' for option in given.sbatch)]
    return found


def run(command, name, folder, given):
    """Runs a command whose output is not there yet; what it says is kept beside its other files."""
    said = folder / f'{name}.json'
    key = [list(command.words), given.build]
    if said.exists() and not command.fresh:
        kept = json.loads(said.read_text())
        if kept['key'] == key:
            return Run(command, kept['stdout'], kept['wall_s'], folder)
    for file, text in command.files.items():
        (folder / file).write_text(text)
    words = command.quickly() if given.quick else command.words
    if command.fresh and '--out' in words:
        for old in folder.glob(words[words.index('--out') + 1] + '*'):
            old.unlink()
    environment = os.environ | {'PROGRAM': str(given.program), 'PYTHONDONTWRITEBYTECODE': '1'}
    while '=' in words[0]:
        environment |= dict([words[0].split('=', 1)])
        words = words[1:]
    print(f'    {" ".join(words)}', file=sys.stderr, flush=True)
    begin = time.monotonic()
    with open(folder / f'{name}.log', 'w') as log:
        ended = subprocess.run(program_words(command, words, given), cwd=ROOT if command.at_root else folder, env=environment,
                               stdout=subprocess.PIPE, stderr=log, text=True, check=False)
    wall_s = time.monotonic() - begin
    if ended.returncode != 0:
        last = (folder / f'{name}.log').read_text()[-1500:] or ended.stdout[-1500:]
        raise Failed(f'{" ".join(words)} ends with {ended.returncode}:\n{last}')
    said.write_text(json.dumps({'key': key, 'stdout': ended.stdout, 'wall_s': wall_s}))
    return Run(command, ended.stdout, wall_s, folder)


def make(table, folder, given):
    """Runs a table's commands and writes its file; returns that."""
    commands = [command for command in table.commands if not given.quick or command.quick is not None]
    rows = table.rule([run(command, f'{table.name}-{table.commands.index(command)}', folder, given) for command in commands])
    if len(rows) < 2 or any(len(row) != len(rows[0]) for row in rows):
        raise Failed(f'{table.name}: {len(rows)} rows of {sorted({len(row) for row in rows})} cells')
    committed, file = HERE / f'{table.name}.csv', given.out / f'{table.name}.csv'
    title = committed.read_text(encoding='utf-8').partition('\n')[0].removeprefix('# title: ')
    with open(file, 'w', encoding='utf-8', newline='') as out:
        origin = [('title', title), *(('command', line) for line in table.shown), ('build', given.build), ('machine', given.machine),
                  ('date', datetime.date.today().isoformat())]
        out.writelines(f'# {key}: {value}\n' for key, value in origin)
        csv.writer(out, lineterminator='\n').writerows(rows)
    draw.read_table(file.read_text(encoding='utf-8'), file)
    return file


def processor_s():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def show_list(tables):
    for table in tables:
        file = HERE / f'{table.name}.csv'
        build = re.search('^# build: (.*)$', file.read_text(encoding='utf-8'), re.M) if file.exists() else None
        print(f'{table.name}: {table.cost}; now of {build[1] if build else "no build"}', *(f'    {line}' for line in table.shown), sep='\n')
    print(f'{len(tables)} tables')


def parse():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('tables', nargs='*', metavar='TABLE', help='all unless named')
    parser.add_argument('--list', action='store_true', help='run nothing: the tables, their commands and cost')
    parser.add_argument('--quick', action='store_true', help='a seed or two of each, to out/measured/quick; no page is drawn')
    parser.add_argument('--workers', type=int, default=len(os.sched_getaffinity(0)), help='processes [%(default)s]; of a Slurm task')
    parser.add_argument('--slurm', type=int, metavar='TASKS', help='run the long commands as job arrays of so many tasks')
    parser.add_argument('--sbatch', action='append', default=[], metavar='OPTION', help='a further option of sbatch')
    parser.add_argument('--machine', default=f'{os.cpu_count()} cores', help='what to say of the machine [%(default)s]')
    parser.add_argument('--program', type=pathlib.Path, default=ROOT / 'build/bin/turbidock')
    parser.add_argument('--python', type=pathlib.Path, help='the Python that has the package [out/venv/bin/python if it is there]')
    parser.add_argument('--out', type=pathlib.Path, help='folder for the tables [assets/measured]')
    given = parser.parse_args()
    unknown = [name for name in given.tables if name not in TABLES]
    if unknown:
        parser.error(f'{", ".join(unknown)}: no such table; there are {", ".join(TABLES)}')
    if not given.list and not given.program.exists():
        parser.error(f'--program {given.program}: there is no such file; build it by `make build`')
    venv = ROOT / 'out/venv/bin/python'
    given.python = given.python or (venv if venv.exists() else pathlib.Path(sys.executable))
    given.program = given.program.absolute()
    return given


def main():
    given = parse()
    tables = [TABLES[name] for name in given.tables or TABLES]
    if given.list:
        return show_list(tables)
    folder = ROOT / 'out/measured' / ('quick' if given.quick else '')
    if given.quick:
        shutil.rmtree(folder, ignore_errors=True)
    given.out = given.out or (folder if given.quick else HERE)
    for each in (folder, given.out):
        each.mkdir(parents=True, exist_ok=True)
    version = subprocess.run([given.program, '--version'], capture_output=True, text=True, check=True).stdout
    given.build = next(line.split()[1] for line in version.splitlines() if line.startswith('git '))
    failed = 0
    for table in tables:
        if given.quick and all(command.quick is None for command in table.commands):
            print(f'{table.name}: its commands are tried by {table.elsewhere}', flush=True)
            continue
        begin = processor_s()
        try:
            file = make(table, folder, given)
        except (Failed, OSError, KeyError, ValueError, IndexError, TypeError) as error:
            failed += 1
            print(f'{table.name}: {type(error).__name__}: {error}', file=sys.stderr, flush=True)
        else:
            print(f'{table.name}: {os.path.relpath(file)}, {processor_s() - begin:.1f} s of processors', flush=True)
    print(f'{len(tables) - failed} of {len(tables)} tables, {processor_s():.0f} s of processors')
    if not given.quick and given.out == HERE:
        subprocess.run([sys.executable, HERE / 'draw.py', *HERE.glob('*.md'), ROOT / 'GLOSSARY.md'], check=True)
    return 1 if failed else 0


if __name__ == '__main__':
    sys.exit(main())
