#!/usr/bin/env python3
"""Plants faults in the core, one at a time, and says which tests notice.

    tests/mutation/mutate.py planted                 the faults of planted.txt, chosen by hand
    tests/mutation/mutate.py drawn --count 200       operators, constants and signs, drawn at random

Works in a clone of the repository (--work, made when it is not there) with a build of its own, so
that the checkout is left alone. A fault that does not compile is drawn again; one that no test notices is a
survivor and is listed with its place. Exit code 0 when at least --least of them were noticed.
"""

import argparse
import os
import pathlib
import random
import re
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent

# What is mutated at random, and the tests that are to notice: rooms as ctest names them.
CORE = {
    'sim/vehicle': 'vehicle check trial', 'sim/light': 'light camera', 'sim/camera': 'camera',
    'vision': 'vision', 'control': 'control trial', 'experiments/statistics': 'statistics gate',
    'experiments/studies/gate/judge.cc': 'gate', 'experiments/trial/recorder.cc': 'trial',
    'experiments/trial/failure.cc': 'trial', 'experiments/trial/ending.cc': 'trial',
    'experiments/farm/agenda.cc': 'farm', 'experiments/farm/result_store.cc': 'farm compare',
}
LABELS = ['unit', 'law', 'oracle', 'two_route', 'repeat']

# (name, pattern, what stands there instead)
OPERATORS = [
    ('sign', r'(?<=[\w\])] )\+(?= [\w(])', '-'), ('sign', r'(?<=[\w\])] )-(?= [\w(])', '+'),
    ('factor', r'(?<=[\w\])] )\*(?= [\w(])', '/'), ('factor', r'(?<=[\w\])] )/(?= [\w(])', '*'),
    ('order', r'(?<= )<(?= )', '<='), ('order', r'(?<= )<=(?= )', '<'),
    ('order', r'(?<= )>(?= )', '>='), ('order', r'(?<= )>=(?= )', '>'),
    ('logic', r' && ', ' || '), ('logic', r' \|\| ', ' && '),
    ('bound', r'std::min\(', 'std::max('), ('bound', r'std::max\(', 'std::min('),
    ('index', r'\[0\]', '[1]'), ('index', r'\.x\(\)', '.y()'), ('index', r'\.y\(\)', '.z()'),
    ('constant', r'(?<![\w.])0\.5(?![\w.])', '0.55'), ('constant', r'(?<![\w.])2(?= \* )', '2.2'),
    ('constant', r'(?<![\w.])(\d+\.\d+)(?![\w.])', lambda m: repr(1.1 * float(m.group(1)))),
]


def run(command, where, log):
    with open(log, 'ab') as out:
        return subprocess.run(command, cwd=where, stdout=out, stderr=out, check=False).returncode


def drawn_faults(rng, count):
    """Places in the core, each with what to write there."""
    places = []
    for part, rooms in CORE.items():
        path = ROOT / part
        files = [path] if path.is_file() else sorted(path.glob('*.cc'))
        for file in files:
            for number, line in enumerate(file.read_text().splitlines(), 1):
                code = line.split('//')[0]
                if 'TD_CHECK' in code or 'throw' in code or '"' in code or code.startswith('#'):
                    continue
                for name, pattern, instead in OPERATORS:
                    for found in re.finditer(pattern, code):
                        text = instead(found) if callable(instead) else instead
                        places.append((str(file.relative_to(ROOT)), number, name,
                                       line[:found.start()] + text + line[found.end():], rooms))
    rng.shuffle(places)
    return places[:count * 2], count


def planted_faults():
    """Those of planted.txt: FILE | TEXT | INSTEAD | ROOMS | WHAT, a line each."""
    faults = []
    for line in (HERE / 'planted.txt').read_text().splitlines():
        if not line or line.startswith('#'):
            continue
        file, text, instead, rooms, what = (part.strip() for part in line.split(' | '))
        lines = (ROOT / file).read_text().splitlines()
        found = [i for i, each in enumerate(lines) if text in each]
        if not found:
            sys.exit(f'planted.txt: {file} has no {text!r}')
        faults.append((file, found[0] + 1, what, lines[found[0]].replace(text, instead, 1), rooms))
    return faults, len(faults)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('kind', choices=['planted', 'drawn'])
    parser.add_argument('--count', type=int, default=200)
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--least', type=float, default=0.9)
    parser.add_argument('--jobs', default='2')
    parser.add_argument('--work', default='build-mutation', help='folder of the clone')
    arguments = parser.parse_args()

    work = pathlib.Path(arguments.work).resolve()
    if not work.exists():
        subprocess.run(['git', 'clone', '-q', str(ROOT), str(work)], check=True)
    log = work / 'mutation.log'
    if not (work / 'build').exists():
        run(['cmake', '--preset', 'release'], work, log)
    rng = random.Random(arguments.seed)
    faults, wanted = planted_faults() if arguments.kind == 'planted' else drawn_faults(
        rng, arguments.count)

    noticed, survivors = 0, []
    for file, number, name, line, rooms in faults:
        if noticed + len(survivors) == wanted:
            break
        path = work / file
        good = path.read_text()
        lines = good.splitlines(keepends=True)
        was = lines[number - 1].strip()
        lines[number - 1] = line + '\n'
        path.write_text(''.join(lines))
        begun = time.time()
        tests = [f'{room}_{label}_test' for room in rooms.split() for label in LABELS
                 if (work / 'build/CMakeFiles').exists()
                 and f'{room}_{label}_test' in targets(work)]
        built = run(['cmake', '--build', 'build', '-j', arguments.jobs, '--target', *tests], work,
                    log) == 0
        by = ''
        if built:
            for test in tests:
                scratch = work / 'build/scratch-mutation'
                scratch.mkdir(exist_ok=True)
                environment = dict(os.environ, TMPDIR=str(scratch), TEST_TMPDIR=f'{scratch}/')
                try:
                    end = subprocess.run([f'build/bin/{test}', '--gtest_brief=1'], cwd=work,
                                         env=environment, capture_output=True, text=True,
                                         timeout=300, check=False)
                    failed = re.search(r'\[  FAILED  \] (\S+)', end.stdout)
                    by = failed.group(1) if failed else ('crash' if end.returncode else '')
                except subprocess.TimeoutExpired:
                    by = 'timeout'
                if by:
                    break
        path.write_text(good)
        place = f'{file}:{number}: {name}: {was} -> {line.strip()}'
        if not built:
            print(f'no build   {place}', flush=True)
            continue
        if by:
            noticed += 1
        else:
            survivors.append(place)
        print(f'{"noticed " if by else "SURVIVED"} {place} [{by}] {time.time() - begun:.0f} s',
              flush=True)
    all_of_them = noticed + len(survivors)
    print(f'{noticed} of {all_of_them} noticed')
    for place in survivors:
        print('survivor:', place)
    return 0 if noticed >= arguments.least * all_of_them else 1


def targets(work):
    """The test programs that the build knows."""
    if not hasattr(targets, 'known'):
        ninja = (work / 'build/build.ninja').read_text()
        targets.known = set(re.findall(r'^build (\w+_test): phony', ninja, re.M))
    return targets.known


if __name__ == '__main__':
    sys.exit(main())
