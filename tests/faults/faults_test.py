#!/usr/bin/env python3
"""Faults of the machine through the real program: nothing is lost, doubled or silently wrong.

    PROGRAM=build/bin/turbidock KILLS=40 python3 tests/faults/faults_test.py [Faults.TEST ...]

KILLS: how often commands are killed at random instants, in all. Some tests need root, or namespaces of one's own, for
disks that are full or read-only and libraries that are not there; one needs faketime, one the Debian package locales.
"""

import contextlib
import os
import pathlib
import random
import resource
import shlex
import shutil
import signal
import sqlite3
import subprocess
import tempfile
import time
import unittest

PROGRAM = str(pathlib.Path(os.environ.get('PROGRAM', 'build/bin/turbidock')).resolve())
KILLS = int(os.environ.get('KILLS', '40'))

FILES = {
    # Without cameras: some 50 ms a trial.
    'plan.yaml': """schema_version: 1
description: 'short trials: ä'
scenario: sea_night_active
seeds: 20
trial_time_limit_s: 20
set: {estimator.pose_source: true_pose, trial.duration_s: 5}
grid: {control.use: [pid, lqg]}
""",
    # Each trial holds the vehicle for a minute: a worker is hardly ever between two of them.
    'long.yaml': """schema_version: 1
description: long trials
scenario: sea_night_active
seeds: 8
trial_time_limit_s: 10
set: {estimator.pose_source: true_pose, control.use: pid, trial.duration_s: 60, trial.after_docked_s: 60}
""",
    'study.yaml': """schema_version: 1
description: a try-out
scenario: sea_night_active
seeds: 2
set: {estimator.pose_source: true_pose, control.use: pid, trial.duration_s: 5}
tuning:
  gains:
    - {key: control.pid.sway.kp_per_s2, low: 0.4, high: 42, scale: log}
  objective:
    - {metric: final_error_true_y_m, weight: 500}
  success_at_least: 0
  start_may_fail: true
  optimiser: {population: 5, generations: 3}
  proof: {held_out_seeds: 2, cameras: false}
""",
    'gate.yaml': """schema_version: 1
description: short trials
scenario: short.yaml
seeds: 8
gate: {baseline: gate.baseline.yaml, margins: {success_rate: 0.5}}
""",
    'short.yaml': """schema_version: 1
description: short
trial: {scene: pool_active.xml, seed: 1, duration_s: 15}
estimator: {pose_source: true_pose}
""",
    'calibration.yaml': """frames: 1
cell_share: 1
parameters:
  - {key: water.scattering_scale, low: 0.55, high: 1.1, start: 1, source: a try-out}
""",
    'cells.yaml': """schema_version: 1
scenario: pool_active
set: {trial.scene: tank_active.xml, cameras.optics: published, start: {lateral_m: 0, vertical_m: 0, heading_rad: 0, distance_min_m: 0.6, distance_max_m: 0.6}}
grid: {water.milk_ml_m3: [0, 20]}
""",
    'table.csv': 'milk_ml_m3,distance_mm,fitness_mean\n0,600,0.8\n60,600,0.3\n',
}
RECOGNIZE = ['recognize', 'cells.yaml', '--seconds', '0.5']
CALIBRATE = ['calibrate', '--plan', 'calibration.yaml', '--active', 'table.csv', '--passive', 'table.csv',
             '--generations', '1']
SEEN = ['run', 'sea_night_active', '--set', 'trial.duration_s=0.5']  # by cameras
BLIND = ['run', 'sea_night_active', '--set', 'estimator.pose_source=true_pose', '--set', 'trial.duration_s=2']


def trials_of(file):
    """What a batch found, without what differs from run to run."""
    # for writing, too: SQLite then undoes what a killed program left half done
    with contextlib.closing(sqlite3.connect(f'{pathlib.Path(file).as_uri()}?mode=rw', uri=True)) as db:
        return [db.execute('SELECT * FROM results ORDER BY trial').fetchall()]


def text_of(file):
    return file.read_text() if file.exists() else None


def children_of(pid):
    found = []
    for stat in pathlib.Path('/proc').glob('[0-9]*/stat'):
        with contextlib.suppress(OSError):
            fields = stat.read_text().rpartition(')')[2].split()
            if int(fields[1]) == pid and fields[0] != 'Z':
                found.append(int(stat.parent.name))
    return found


class Faults(unittest.TestCase):
    """Each test works in a folder of its own, whose name asks for care."""

    def setUp(self):
        self.random = random.Random(self._testMethodName)
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="turbidock fäults 'n "))
        self.addCleanup(shutil.rmtree, self.folder)
        for name, text in FILES.items():
            (self.folder / name).write_text(text)

    def start(self, words, folder=None, **more):
        return subprocess.Popen([PROGRAM, *words], cwd=folder or self.folder, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True, start_new_session=True, **more)

    def run_program(self, words, expect=0, **more):
        """Ends within three minutes with `expect`, and with one line that says why when that is an error."""
        with self.start(words, **more) as process:
            try:
                out, err = process.communicate(timeout=180)
            finally:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
        self.assertEqual(process.returncode, expect, f'{words}: {out}{err}')
        if expect in (2, 4):
            last = err.strip().splitlines()[-1]
            self.assertTrue(last.startswith('turbidock: '), err)
        return out + err

    def shell(self, script, expect=0):
        """In a mount namespace of its own."""
        own = ['unshare', '--mount'] if os.geteuid() == 0 else ['unshare', '--map-root-user', '--mount']
        result = subprocess.run([*own, 'bash', '-c', script], cwd=self.folder, capture_output=True, text=True,
                                timeout=180, check=False)
        self.assertEqual(result.returncode, expect, result.stdout + result.stderr)
        return result.stdout + result.stderr

    def batch(self, out, *words, expect=0, **more):
        return self.run_program(['batch', 'plan.yaml', '--out', out, '--quiet', *words], expect, **more)

    def whole(self):
        """What the plan's trials are when nothing happens."""
        if not (self.folder / 'whole.db').exists():
            self.batch('whole.db')
        return trials_of(self.folder / 'whole.db')

    def no_remains(self):
        self.assertEqual([str(f) for f in self.folder.rglob('*.partial*')], [])

    # Killed at random instants

    def kill_often(self, words, kills, after_kill, whole_s):
        """Kills the command at random instants of its time; one that has ended by itself is none."""
        done = 0
        while done < kills:
            process = self.start(words)
            try:
                _, err = process.communicate(timeout=self.random.uniform(0.01, whole_s))
                self.assertEqual(process.returncode, 0, f'{words}: {err}')
                after_kill(True)
                continue
            except subprocess.TimeoutExpired:
                workers = children_of(process.pid)
                process.kill()
                process.communicate()
                done += 1
            # workers end with the program that they work for
            deadline = time.monotonic() + 20
            while any(os.path.exists(f'/proc/{pid}') for pid in workers):
                self.assertLess(time.monotonic(), deadline, 'workers are left')
                time.sleep(0.02)
            after_kill(False)

    def timed(self, words):
        begin = time.monotonic()
        self.run_program(words)
        return time.monotonic() - begin

    def test_batch_killed(self):
        words = ['batch', 'plan.yaml', '--out', 'a.db', '--quiet']
        whole_s = self.timed([*words[:3], 'whole.db', '--quiet'])
        file, known = self.folder / 'a.db', 0

        def check(ended):
            nonlocal known
            if not file.exists():
                self.assertEqual(known, 0)
                return
            self.run_program(['status', 'a.db'], 0 if file.stat().st_size else 2)
            found = trials_of(file)[0] if file.stat().st_size else []
            self.assertGreaterEqual(len(found), known, 'lost')
            self.assertEqual(len(found), len({row[0] for row in found}), 'doubled')
            known = len(found)
            if ended:
                self.assertEqual(trials_of(file), self.whole())
                file.unlink()
                known = 0

        self.kill_often(words, KILLS // 2, check, whole_s)
        self.run_program(words)
        self.assertEqual(trials_of(file), self.whole())

    def test_tune_killed(self):
        words = ['tune', 'study.yaml', '--out', 'tuned', '--quiet']
        whole_s = self.timed([*words[:3], 'whole', '--quiet'])
        gains = (self.folder / 'whole/gains.yaml').read_text()

        def check(ended):
            found = text_of(self.folder / 'tuned/gains.yaml')
            self.assertIn(found, (None, gains))
            if ended:
                self.assertEqual(found, gains)
                shutil.rmtree(self.folder / 'tuned')

        self.kill_often(words, KILLS // 5, check, whole_s)
        self.run_program(words)
        self.assertEqual((self.folder / 'tuned/gains.yaml').read_text(), gains)

    def test_calibrate_killed(self):
        """The optics are those of a search that ran through, and no evaluation that was kept is lost."""
        words = [*CALIBRATE[:-1], '3', '--quiet', '--out']
        whole_s = self.timed([*words, 'whole.yaml'])
        optics, known = (self.folder / 'whole.yaml').read_text(), 0
        out, file = self.folder / 'found.yaml', self.folder / 'found.yaml.evaluations.sqlite'

        def check(ended):
            nonlocal known
            self.assertIn(text_of(out), (None, optics))
            found = 0
            if file.exists() and file.stat().st_size:
                with contextlib.closing(sqlite3.connect(f'{file.as_uri()}?mode=rw', uri=True)) as db:
                    found = db.execute('SELECT count(*) FROM outputs').fetchone()[0]
            self.assertGreaterEqual(found, known, 'lost')
            known = found
            if ended:
                self.assertEqual(text_of(out), optics)
                out.unlink()
                file.unlink()
                known = 0

        self.kill_often([*words, 'found.yaml'], KILLS // 5, check, whole_s)
        self.run_program([*words, 'found.yaml'])
        self.assertEqual(text_of(out), optics)

    def test_gate_killed(self):
        """The verdict is that of a gate that ran through, and no trial that was stored is lost."""
        self.run_program(['gate', 'gate.yaml', '--update', '--quiet'])
        self.assertFalse((self.folder / 'gate.baseline.yaml.trials.db').exists())
        words = ['gate', 'gate.yaml', '--out', 'judged', '--quiet']
        whole_s = self.timed([*words[:3], 'whole', '--quiet'])
        summary, known = (self.folder / 'whole/summary.json').read_text(), 0

        def check(ended):
            nonlocal known
            self.assertIn(text_of(self.folder / 'judged/summary.json'), (None, summary))
            file = self.folder / 'judged/trials.db'
            found = trials_of(file)[0] if file.exists() and file.stat().st_size else []
            self.assertGreaterEqual(len(found), known, 'lost')
            known = len(found)
            if ended:
                self.assertEqual(text_of(self.folder / 'judged/summary.json'), summary)
                shutil.rmtree(self.folder / 'judged')
                known = 0

        self.kill_often(words, KILLS // 5, check, whole_s)
        self.run_program(words)
        self.assertEqual(text_of(self.folder / 'judged/summary.json'), summary)

    def test_others_killed(self):
        """What is written is there whole or not at all, and what stood there before until then; but for an earlier verdict,
        which goes before the trials of a new one."""
        self.run_program(['gate', 'gate.yaml', '--update', '--quiet'])
        for words, out in (([*CALIBRATE, '--out', 'result.yaml', '--quiet'], 'result.yaml'),
                           (['gate', 'gate.yaml', '--update', '--quiet'], 'gate.baseline.yaml'),
                           (['gate', 'gate.yaml', '--out', 'judged', '--quiet'], 'judged/junit.xml')):
            with self.subTest(words[0], out=out):
                whole_s = self.timed(words)
                file = self.folder / out
                result = file.read_text()
                before = '# what stood there before\n'
                if out != 'gate.baseline.yaml':
                    file.write_text(before)

                allowed = (before, result, None) if out == 'judged/junit.xml' else (before, result)

                def check(_ended):
                    self.assertIn(text_of(file), allowed)

                self.kill_often(words, KILLS // 12, check, whole_s)
                self.run_program(words)
                self.assertEqual(file.read_text(), result)
                self.assertFalse((self.folder / 'gate.baseline.yaml.trials.db').exists())

    # Workers

    def disturbed(self, signal_number, outcome):
        """One of two workers gets the signal once the first trial is stored: both are at work by then."""
        self.run_program(['batch', 'long.yaml', '--out', 'long.db', '--quiet'])
        process = self.start(['batch', 'long.yaml', '--out', 'disturbed.db', '--workers', '2', '--quiet'])
        while not self.stored('disturbed.db') and process.poll() is None:
            time.sleep(0.01)
        os.kill(children_of(process.pid)[0], signal_number)
        _, err = process.communicate(timeout=180)
        self.assertEqual(process.returncode, 0, err)
        found, whole = trials_of(self.folder / 'disturbed.db'), trials_of(self.folder / 'long.db')
        self.assertEqual(len(found[0]), len(whole[0]))
        differ = [a for a, b in zip(found[0], whole[0]) if a != b]
        self.assertEqual([outcome in row for row in differ], [True], differ)

    def stored(self, name):
        try:
            return len(trials_of(self.folder / name)[0])
        except sqlite3.OperationalError:  # not begun, or locked at this instant
            return 0

    def test_worker_killed(self):
        """As the kernel does for memory: one trial has crashed, the others are as they were."""
        self.disturbed(signal.SIGKILL, 'crashed')

    def test_worker_hangs(self):
        self.disturbed(signal.SIGSTOP, 'hung')

    # Disks

    def test_full_disk(self):
        """Every command that writes says so, leaves nothing half done, and a batch goes on elsewhere."""
        self.whole()
        # its journal needs room besides
        trials = os.path.getsize(self.folder / 'whole.db')
        for words, room in ((['batch', 'plan.yaml', '--out', 'small/a.db', '--quiet'], trials),
                            ([*BLIND, '--out', 'small/run', '--quiet'], '16k'),
                            (['tune', 'study.yaml', '--out', 'small/tuned', '--quiet'], '80k'),
                            ([*RECOGNIZE, '--figure', 'small/cells.png', '--quiet'], '4k'),
                            (['report', 'whole.db', '--out', 'small/page.html'], '80k'),
                            ([*BLIND, '--figure', 'small/figure.png', '--quiet'], '16k')):
            with self.subTest(words):
                fill = 'cat /dev/zero > small/filler 2>/dev/null;' if room == '4k' else ''
                said = self.shell(f'mkdir -p small && mount -t tmpfs -o size={room} none small && {fill} '
                                  f'{shlex.join([PROGRAM, *words])}; code=$?; ls -A small; '
                                  f'cp small/a.db kept.db 2>/dev/null; test $code = 4 || test $code = 2')
                self.assertIn('turbidock: ', said)
                self.assertNotIn('.partial', said)
        self.assertIn(len(trials_of(self.folder / 'kept.db')[0]), range(1, len(self.whole()[0])))
        self.batch('kept.db')
        self.assertEqual(trials_of(self.folder / 'kept.db'), self.whole())

    def test_read_only_disk(self):
        self.whole()
        for words in (['batch', 'plan.yaml', '--out', 'locked/a.db'], [*BLIND, '--out', 'locked/run'],
                      ['tune', 'study.yaml', '--out', 'locked/tuned'], ['batch', 'plan.yaml', '--out', 'locked/whole.db']):
            with self.subTest(words):
                said = self.shell('mkdir -p locked && cp whole.db locked && mount --bind locked locked && '
                                  f'mount -o remount,ro,bind locked && {shlex.join([PROGRAM, *words, "--quiet"])}', 2)
                self.assertEqual(len(said.strip().splitlines()), 1, said)
        # looking needs no writing
        said = self.shell('mkdir -p locked && cp whole.db locked && mount --bind locked locked && '
                          f'mount -o remount,ro,bind locked && {PROGRAM} status locked/whole.db')
        self.assertIn('40', said)

    def test_file_removed_in_use(self):
        """Whoever removes a batch's file hears that its trials are lost."""
        process = self.start(['batch', 'plan.yaml', '--out', 'gone.db', '--quiet', '--workers', '1'])
        while not (self.folder / 'gone.db').exists() or not children_of(process.pid):
            time.sleep(0.01)
        time.sleep(0.2)
        (self.folder / 'gone.db').unlink()
        _, err = process.communicate(timeout=180)
        self.assertNotEqual(process.returncode, 0, err)
        self.assertRegex(err, r'gone\.db.*removed')
        self.batch('gone.db')
        self.assertEqual(trials_of(self.folder / 'gone.db'), self.whole())

    # Surroundings

    def test_clock_jumps(self):
        """Days back and forth while it runs: the same trials, no hang, no time below zero."""
        stamp = self.folder / 'clock'
        library = next(pathlib.Path('/usr/lib').glob('*/faketime/libfaketime.so.1'))
        environment = {**os.environ, 'LD_PRELOAD': str(library), 'FAKETIME_TIMESTAMP_FILE': str(stamp),
                       'FAKETIME_NO_CACHE': '1', 'FAKETIME_DONT_FAKE_MONOTONIC': '1', 'DONT_FAKE_MONOTONIC': '1'}
        stamp.write_text('+0')
        process = self.start(['batch', 'plan.yaml', '--out', 'a.db'], env=environment)
        while process.poll() is None:
            stamp.write_text(self.random.choice(['-400d', '+0', '+3000d', '-1h']))
            time.sleep(0.1)
        out, err = process.communicate()
        self.assertEqual(process.returncode, 0, out + err)
        self.assertNotRegex(err, r'-\d+(:\d+)* (h|min|s) left')
        self.assertEqual(trials_of(self.folder / 'a.db'), self.whole())
        with contextlib.closing(sqlite3.connect(self.folder / 'a.db')) as db:
            self.assertGreaterEqual(db.execute('SELECT min(wall_time_s) FROM trials').fetchone()[0], 0)

    def test_comma_locale(self):
        """Where a decimal point is a comma the files are the same."""
        subprocess.run(['localedef', '-i', 'de_DE', '-f', 'UTF-8', self.folder / 'de_DE.UTF-8'], check=True)
        german = {**os.environ, 'LOCPATH': str(self.folder), 'LC_ALL': 'de_DE.UTF-8'}
        printf = subprocess.run(['bash', '-c', "printf '%.1f' 1,5"], env=german, capture_output=True, text=True, check=True)
        self.assertEqual(printf.stdout, '1,5', 'the locale is in force')
        self.batch('a.db', env=german)
        self.assertEqual(trials_of(self.folder / 'a.db'), self.whole())
        said = []
        for name, environment in (('german', german), ('plain', None)):
            self.run_program([*SEEN, '--out', name, '--quiet'], env=environment)
            said.append(self.run_program([*RECOGNIZE, '--json', '--quiet'], env=environment))
        for file in ('trajectory.csv', 'resolved.yaml'):
            self.assertEqual((self.folder / 'german' / file).read_text(), (self.folder / 'plain' / file).read_text())
        self.assertEqual(*said)

    def test_closed_streams(self):
        """A file that is opened does not become standard output; a report that nobody gets is said by the exit code."""
        for words, file in ((['batch', 'plan.yaml', '--out', 'a.db'], 'a.db'), ([*BLIND, '--out', 'run'], 'run/result.json')):
            script = f'exec {shlex.join([PROGRAM, *words])} <&- >&- 2>&-'
            result = subprocess.run(['bash', '-c', script], cwd=self.folder, timeout=180, check=False)
            self.assertEqual(result.returncode, 2, words)
            self.assertTrue((self.folder / file).exists())
        self.assertEqual(trials_of(self.folder / 'a.db'), self.whole())
        self.run_program([*BLIND, '--out', 'open', '--quiet'])
        self.assertEqual((self.folder / 'run/trajectory.csv').read_text(), (self.folder / 'open/trajectory.csv').read_text())

    def limited(self, limit, value, words, check):
        """Works as ever or says in a line why it does not."""
        process = self.start([*words, '--quiet'], preexec_fn=lambda: resource.setrlimit(limit, (value, value)))
        out, err = process.communicate(timeout=180)
        self.assertIn(process.returncode, (0, 2, 4), f'{value}: {out}{err}')
        if process.returncode == 0:
            check()
        else:
            self.assertRegex(err, r'turbidock: \S')
        return process.returncode

    def test_few_descriptors(self):
        self.whole()
        codes = []
        for number in (8, 12, 16, 20, 24, 32):
            (self.folder / 'a.db').unlink(missing_ok=True)
            codes.append(self.limited(resource.RLIMIT_NOFILE, number, ['batch', 'plan.yaml', '--out', 'a.db'],
                                      lambda: self.assertEqual(trials_of(self.folder / 'a.db'), self.whole())))
            self.limited(resource.RLIMIT_NOFILE, number, [*SEEN, '--out', 'run'], lambda: None)
        self.assertEqual(codes[-1], 0)

    def test_little_memory(self):
        self.whole()
        codes = []
        for mib in (120, 200, 300, 400, 2000):  # libraries alone take some 80
            (self.folder / 'a.db').unlink(missing_ok=True)
            codes.append(self.limited(resource.RLIMIT_AS, mib << 20, ['batch', 'plan.yaml', '--out', 'a.db'],
                                      lambda: self.assertEqual(trials_of(self.folder / 'a.db'), self.whole())))
            self.limited(resource.RLIMIT_AS, mib << 20, [*SEEN, '--out', 'run'], lambda: None)
        self.assertEqual(codes[-1], 0)

    def test_missing_helpers(self):
        """Without ffmpeg, gnuplot or OpenGL: a line that names the package, nothing begun or destroyed."""
        (self.folder / 'run').mkdir()
        (self.folder / 'run/video.mp4').write_text('a film')
        bare = {**os.environ, 'PATH': '/nowhere'}
        said = self.run_program([*SEEN, '--out', 'run', '--video', '--quiet'], 4, env=bare)
        self.assertRegex(said, 'install the package')
        self.assertEqual((self.folder / 'run/video.mp4').read_text(), 'a film')
        self.batch('a.db', env=bare)
        self.assertEqual(trials_of(self.folder / 'a.db'), self.whole())
        hide = 'for f in /usr/lib/*/libOSMesa.so.8* /usr/lib/*/libEGL.so.1*; do mount --bind /dev/null $f; done; '
        said = self.shell(hide + shlex.join([PROGRAM, *SEEN, '--out', 'blind', '--quiet']), 4)
        self.assertRegex(said, 'libosmesa6')
        self.shell(hide + shlex.join([PROGRAM, 'batch', 'plan.yaml', '--out', 'b.db', '--quiet']))
        self.assertEqual(trials_of(self.folder / 'b.db'), self.whole())

    def test_no_fonts(self):
        environment = {**os.environ, 'FONTCONFIG_FILE': '/dev/null', 'FONTCONFIG_PATH': '/nowhere'}
        self.run_program([*SEEN, '--out', 'run', '--video', '--quiet'], env=environment)
        self.assertGreater((self.folder / 'run/figure.png').stat().st_size, 10000)


if __name__ == '__main__':
    unittest.main(verbosity=2)
