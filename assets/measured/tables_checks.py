"""The table of long checks: each is a command that fails where something was harmed."""

import re

from making import Command, table


def step(name, check):
    """A step of CI that passes or fails."""
    return Command(('bash', '.ci/run', name), None, at_root=True, key=(check, 'once', lambda text: 'passed'))


def soak(text):
    ratios = {line[:30].strip(): line.split()[-1] for line in text.splitlines() if re.search(r'\d\.\d{4}$', line)}
    memory, time = (next(ratio for name, ratio in ratios.items() if name.startswith(word)) for word in ('resident', 'processor'))
    return f'last over first: memory {memory}, open files unchanged, processor time a trial {time}'


def mutation(text):
    return re.findall(r'(\d+ of \d+) noticed', text)[-1] + ' noticed'


def fuzzing(text):
    units = [int(number) for number in re.findall(r'number_of_executed_units: (\d+)', text)]
    return f'no harm; {min(units):,} to {max(units):,} inputs each' if units else 'no harm'


UNHARMED = 'nothing lost or doubled, no worker left'
CHECKS = [
    Command(('KILLS=1000', 'python3', 'tests/faults/faults_test.py'),
            ('KILLS=8', 'python3', 'tests/faults/faults_test.py', 'Faults.test_batch_killed'),
            key=('kills of batch, tune, calibrate and gate at random instants', '1,000', lambda text: UNHARMED)),
    Command(('python3', 'tests/faults/soak.py', 'build/bin/turbidock', '--trials', '10000'), None,
            key=('short trials in one worker', '10,000', soak)),
    Command(('python3', 'tests/faults/soak.py', 'build/bin/turbidock', '--trials', '1500', '--seconds', '20'), None,
            key=('docking trials of 20 s in one worker', '1,500', soak)),
    Command(('make', 'fuzz', 'SECONDS=120'), None, at_root=True,
            key=('fuzzing, each reader of files and requests', '120 s', fuzzing)),
    Command(('python3', 'tests/mutation/mutate.py', 'planted', '--jobs', '2'), None, at_root=True,
            key=('faults planted by hand in the core', '32', mutation)),
    Command(('python3', 'tests/mutation/mutate.py', 'drawn', '--count', '240', '--jobs', '2'), None, at_root=True,
            key=('faults drawn at random in the core', '240', mutation)),
    step('clang', 'all tests in a build by clang, with the golden digests of gcc'),
    step('threads', 'server and live page under ThreadSanitizer'),
    step('lint', 'cppcheck'),
    step('container', 'container: a batch by an ordinary user without a network'),
    step('tarball', 'tarball: in bare Debian 12 and 13, the same digest as here'),
    step('roots', '`make run`, `make test` and a wheel in bare Debian 12 and 13'),
]


@table(CHECKS, '40 h; as root', ['make faults KILLS=1000', 'make soak', 'make fuzz SECONDS=120', 'make mutation COUNT=240',
                                'bash .ci/run clang threads lint container tarball roots'])
def trust(runs):
    return [['check', 'how often', 'found'], *([check, times, found(run.text)] for run in runs for check, times, found in [run.key])]
