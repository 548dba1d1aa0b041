#!/usr/bin/env python3
"""Plants faults in the core and says which tests notice.

    tests/mutation/mutate.py planted                     the faults of planted.txt, chosen by hand
    tests/mutation/mutate.py planted drawn --count 200   and operators, constants, signs, indices, statements drawn
                                                         at random

All faults are compiled into one build of what is committed, in a clone (--work, made when it is not there), and an
environment variable chooses one (mutation.h). Every test is run once by itself without a fault, to see how long it
takes and which faults it comes by; then, a fault at a time, the tests that come by it, the quickest first, until one
fails. Faults that do not compile are left out. Exit code 0 when at least --least were noticed.
"""

import argparse
import collections
import concurrent.futures
import csv
import json
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile
import time

import places

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent

CORE = ['sim/vehicle', 'sim/light', 'sim/camera', 'vision', 'control', 'experiments/statistics',
        'experiments/studies/gate/judge.cc', 'experiments/studies/compare/comparison.cc', 'experiments/trial/recorder.cc',
        'experiments/trial/ending.cc', 'experiments/batch/trial_scheduler.cc',
        'experiments/batch/result_store.cc']
# Of these modules the tests are run, whatever module the fault is in.
MODULES = 'base vehicle check view light camera vision control statistics search trial batch compare gate tuning'
# Tests of a fault end at once after QUICK seconds of them in all; those that take longer are run one by one.
QUICK = 2.0


def in_core(work, parts):
    files = []
    for part in parts:
        path = work / part
        files += [path] if path.is_file() else sorted(path.glob('*.cc'))
    return [str(file.relative_to(work)) for file in files]


def drawn_faults(work, parts, seed, count):
    """`count` places of these parts of the core, equally likely."""
    commands = {e['file']: e['command'] for e in json.loads((work / 'build/compile_commands.json').read_text())}
    found = []
    files = in_core(work, parts)
    for file in files:
        found += places.Source(work, file, commands[str(work / file)]).places()
    print(f'{len(found)} places in {len(files)} files', flush=True)
    return random.Random(seed).sample(found, min(count, len(found)))


def planted_faults(work, parts):
    """Those of planted.txt: FILE | TEXT | INSTEAD | WHAT, a line each."""
    faults = []
    for line in (HERE / 'planted.txt').read_text().splitlines():
        if not line or line.startswith('#'):
            continue
        file, text, instead, what = (part.strip() for part in line.split(' | '))
        if not file.startswith(tuple(parts)):
            continue
        source = (work / file).read_bytes()
        if source.count(text.encode()) != 1:
            sys.exit(f'planted.txt: {file} has {source.count(text.encode())} times {text!r}')
        begin = source.index(text.encode())
        end = begin + len(text.encode())
        open_, close = (f'if (mutation::On(#)) {{ {instead} }} else {{ ', ' }') if text.endswith(';') else (
            f'(mutation::On(#) ? ({instead}) : (', '))')
        edits = [places.Edit(begin, begin, open_, (begin, end)), places.Edit(end, end, close, (begin, end), False)]
        faults.append(places.Fault(file, source[:begin].count(b'\n') + 1, what, text, instead, edits))
    return faults


def compile_with(work, faults, modules, without, jobs, log):
    """Writes the faults into the sources and builds; returns those that compile, by number."""
    numbered = dict(enumerate(faults))
    originals = {fault.file: (work / fault.file).read_bytes() for fault in faults}
    known = set(re.findall(r'^build (\w+_test): phony', (work / 'build/build.ninja').read_text(), re.M))
    targets = sorted(t for t in known if t.split('_')[0] in modules and not re.search(f'check_vehicle|{without}', t))
    header = f'#include "{HERE}/mutation.h"\n'.encode()
    for _ in range(12):
        for file, text in originals.items():
            mine = [(n, f) for n, f in numbered.items() if f.file == file]
            # Behind what is precompiled or guarded: in front of the first include.
            body = places.written(text, mine).replace(b'#include', header + b'#include', 1) if mine else text
            if (work / file).read_bytes() != body:
                (work / file).write_bytes(body)
        end = subprocess.run(['cmake', '--build', 'build', '-j', str(jobs), '--target', *targets, '--', '-k', '0'],
                             cwd=work, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
        log.write_text(end.stdout)
        if end.returncode == 0:
            return numbered, targets
        wrong = set(re.findall(r'([\w/]+\.(?:cc|h)):(\d+):(?:\d+:)?\s+(?:error:|required from here)', end.stdout))
        bad = [n for n, f in numbered.items()
               if any(file.endswith(f.file) and 0 < int(line) - f.line <= 1 + f.was.count('\n') for file, line in wrong)]
        if not bad:
            sys.exit(f'does not build: {log}')
        for number in bad:
            f = numbered.pop(number)
            print(f'does not compile: {f.file}:{f.line}: {short(f.was)} -> {short(f.becomes)}', flush=True)
    sys.exit(f'does not build: {log}')


def environment(scratch, **more):
    return {**os.environ, 'TMPDIR': scratch, 'TEST_TMPDIR': f'{scratch}/', **more}


def run_tests(work, test, names, scratch, timeout, **more):
    """The first that failed, 'crash' or 'hang', or '' when all passed."""
    try:
        end = subprocess.run([f'build/bin/{test}', '--gtest_brief=1', '--gtest_fail_fast', f'--gtest_filter={":".join(names)}'],
                             cwd=work, env=environment(scratch, **more), capture_output=True, text=True, timeout=timeout,
                             errors='replace', check=False)
    except subprocess.TimeoutExpired:
        return 'hang'
    failed = re.search(r'\[  FAILED  \] (\S+?),? ', end.stdout + ' ')
    return failed.group(1) if failed else f'crash in {test}' if end.returncode else ''


def names_of(work, test):
    listed = subprocess.run([f'build/bin/{test}', '--gtest_list_tests'], cwd=work, capture_output=True, text=True, check=True)
    suite, names = '', []
    for line in listed.stdout.splitlines():
        word = line.split('#')[0].strip()
        if line.startswith(' '):
            names.append(suite + word)
        elif word.endswith('.'):
            suite = word
    return [name for name in names if 'DISABLED_' not in name]


def look_around(work, targets, numbers, jobs):
    """What each test takes, and the faults that it comes by: {fault: [(seconds, program, test)]}."""
    def look(test, name):
        with tempfile.TemporaryDirectory(prefix='mutation') as scratch:
            marks = pathlib.Path(scratch) / 'reached'
            marks.write_bytes(bytes(max(numbers) + 1))
            start = time.time()
            said = run_tests(work, test, [name], scratch, 900, MUTATION_REACHED=str(marks))
            return said, time.time() - start, marks.read_bytes()

    reached = collections.defaultdict(list)
    total = 0
    for test in targets:
        begun, names = time.time(), names_of(work, test)
        with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
            for name, (said, took, marks) in zip(names, pool.map(look, [test] * len(names), names)):
                if said:
                    print(f'fails without a fault: {name} ({said})', flush=True)
                    continue
                for number in numbers:
                    if marks[number]:
                        reached[number].append((took, test, name))
        total += len(names)
        print(f'{test}: {len(names)} tests in {time.time() - begun:.0f} s', flush=True)
    print(f'{total} tests', flush=True)
    return reached


def noticed_by(work, number, tests, limit_s):
    """The test that notices a fault, or ''."""
    with tempfile.TemporaryDirectory(prefix='mutation') as scratch:
        tests = sorted(tests)
        spent, quick = 0.0, collections.defaultdict(list)
        while tests and spent + tests[0][0] <= QUICK:
            took, test, name = tests.pop(0)
            spent += took
            quick[test].append(name)
        for test, names in quick.items():
            if by := run_tests(work, test, names, scratch, 30 + 10 * spent, MUTATION=str(number)):
                return by
        for took, test, name in tests:
            spent += took
            if spent > limit_s:
                break
            if by := run_tests(work, test, [name], scratch, 30 + 10 * took, MUTATION=str(number)):
                return by
    return ''


def short(text):
    text = ' '.join(text.split())
    return text if len(text) <= 90 else text[:87] + '...'


def room_of(file):
    return file.rsplit('/', 1)[0].removeprefix('experiments/').removeprefix('studies/')


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('kind', nargs='+', choices=['planted', 'drawn'])
    parser.add_argument('--count', type=int, default=200)
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--least', type=float, default=0.9)
    parser.add_argument('--jobs', type=int, default=2)
    parser.add_argument('--work', default='build-mutation', help='folder of the clone')
    parser.add_argument('--parts', nargs='+', help='files and folders of the core; all of it')
    parser.add_argument('--modules', default=MODULES, help='whose tests are run')
    parser.add_argument('--without', default='scenario|batch_repeat', help='programs of tests that are left out, a pattern')
    parser.add_argument('--limit-s', type=float, default=120, help='of tests, for a fault that none of them notices')
    parser.add_argument('--csv', help='a row for each fault')
    arguments = parser.parse_args()

    work = pathlib.Path(arguments.work).resolve()
    if not work.exists():
        subprocess.run(['git', 'clone', '-q', str(ROOT), str(work)], check=True)
    # what is committed, whatever was planted before
    subprocess.run(['git', 'fetch', '-q', str(ROOT), 'HEAD'], cwd=work, check=True)
    subprocess.run(['git', 'checkout', '-q', '-f', '--detach', 'FETCH_HEAD'], cwd=work, check=True)
    if not (work / 'build/build.ninja').exists():
        subprocess.run(['cmake', '--preset', 'release'], cwd=work, stdout=subprocess.DEVNULL, check=True)
    faults = planted_faults(work, arguments.parts or ['']) if 'planted' in arguments.kind else []
    planted = len(faults)
    if 'drawn' in arguments.kind:  # some more than asked: not all compile
        faults += drawn_faults(work, arguments.parts or CORE, arguments.seed, arguments.count * 11 // 10)
    numbered, targets = compile_with(work, faults, arguments.modules.split(), arguments.without, arguments.jobs, work / 'mutation.log')
    drawn = [number for number in numbered if number >= planted][arguments.count:]
    numbered = {number: fault for number, fault in numbered.items() if number not in drawn}
    reached = look_around(work, targets, numbered, arguments.jobs)

    rows = []

    def judge(number):
        begun, fault = time.time(), numbered[number]
        by = noticed_by(work, number, reached[number], arguments.limit_s)
        if not by:
            by = 'no test' if reached[number] else 'no test comes by'
        print(f'{"SURVIVED" if by.startswith("no test") else "noticed "} {fault.file}:{fault.line}: {fault.kind}: '
              f'{short(fault.was)} -> {short(fault.becomes)} [{by}] {time.time() - begun:.0f} s', flush=True)
        return (room_of(fault.file), f'{fault.file}:{fault.line}', fault.kind, short(fault.was), short(fault.becomes), by)

    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        rows = sorted(pool.map(judge, numbered))
    if arguments.csv:
        with open(arguments.csv, 'w', newline='') as file:
            writer = csv.writer(file, lineterminator='\n')
            writer.writerow(['module', 'place', 'kind', 'was', 'becomes', 'noticed by'])
            writer.writerows(rows)
    for module in dict.fromkeys(row[0] for row in rows):
        mine = [row for row in rows if row[0] == module]
        print(f'{module:24} {sum(not row[5].startswith("no test") for row in mine):4} of {len(mine)}')
    noticed = sum(not row[5].startswith('no test') for row in rows)
    print(f'{noticed} of {len(rows)} noticed')
    return 0 if noticed >= arguments.least * len(rows) else 1


if __name__ == '__main__':
    sys.exit(main())
