"""Does the gate notice? Plants regressions in every module, from harmless to severe, lets the gate judge each, and
measures each one's true effect on other seeds; then changes that harm nothing. Writes two tables as CSV.

    python3 assets/measured/planted_regressions.py OUT [--seeds N] [--workers N] [--build PROGRAM ...]

The verdicts come first. What was run already is not run again: the same command goes on. `--build` takes the program
of another build of the same source (other compiler, other flags) as one more harmless change.
"""
import argparse
import csv
import json
import math
import os
import pathlib
import re
import sqlite3
import statistics
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
GATE = ROOT / 'assets/gates/docking.yaml'


def shipped(file, key):
    """What the published vehicle or optics have for a key, so that "10 % less" is of that."""
    return json.loads(re.search(rf'(?m)^ *{key}: (\[.*?\]|[\d.e-]+)', (ROOT / file).read_text())[1])


def scaled(group, key, factor):
    """The setting of one of the vehicle's lists, multiplied."""
    return f'vehicle.{group}.{key}={[round(factor * value, 6) for value in shipped("models/vehicle.yaml", key)]}'


def drag(factor):
    return [scaled('hydrodynamics', f'{kind}_damping_diagonal', factor) for kind in ('linear', 'quadratic')]


def heavier(newton):
    return [f'vehicle.rigid_body.mass_kg={shipped("models/vehicle.yaml", "mass_kg") + newton / 9.81:.3f}']


def sensor(key, factor):
    return [f'cameras.sensor.{key}={factor * shipped("assets/optics.yaml", key):.6g}']


def hue(turned_rad):
    """The balls' hues, as the estimator knows them, turned by an angle."""
    return ['marker.may_differ=true'] + [
        f'marker.balls.{i}.hue_rad={(rad + turned_rad) % (2 * math.pi):.4f}'
        for i, rad in enumerate([2.0944, 0, 4.1888])
    ]


def effectiveness(*share):
    return [f'vehicle.thrusters.effectiveness={list(share)}']


# module, what is planted, settings
PLANTED = [
    ('dynamics', 'drag 10 % less', drag(0.9)),
    ('dynamics', 'drag halved', drag(0.5)),
    ('dynamics', 'added mass doubled', [scaled('hydrodynamics', 'added_mass_diagonal', 2)]),
    ('dynamics', 'heavier by 1 N', heavier(1)),
    ('dynamics', 'heavier by 3 N', heavier(3)),
    ('thrusters', 'thrust 10 % less', effectiveness(0.9, 0.9, 0.9, 0.9)),
    ('thrusters', 'thrust 40 % less', effectiveness(0.6, 0.6, 0.6, 0.6)),
    ('thrusters', 'sway thruster 30 % less', effectiveness(1, 1, 0.7, 1)),
    ('thrusters', 'lag 0.2 s instead of 0.08', ['vehicle.thrusters.lag_s=0.2']),
    ('sea', 'gusts of 3 cm/s', ['sea.current.gust_std_mps=0.03']),
    ('sea', 'waves 5 cm higher', ['sea.waves=[{height_m: 0.05, period_s: 2.5, direction_rad: 1.57}]']),
    ('water', '15 ml/m3 of milk', ['water.milk_ml_m3=15']),
    ('water', '35 ml/m3 of milk', ['water.milk_ml_m3=35']),
    ('sensor', 'read noise doubled', sensor('read_noise_electrons', 2)),
    ('sensor', 'gain a third', sensor('gain', 1 / 3)),
    ('timing', 'images one frame later', ['cameras.delay_frames=2']),
    ('timing', 'images four frames later', ['cameras.delay_frames=5']),
    ('timing', 'every other image used', ['cameras.period_frames=2']),
    ('labels', 'hues turned by 10 degrees', hue(math.radians(10))),
    ('labels', 'hues turned by 30 degrees', hue(math.radians(30))),
    ('labels', 'hue window halved', ['estimator.hue.window_rad=0.39']),
    ('search', 'a third of the population', ['estimator.rm_ga.population=20']),
    ('search', 'one generation a frame', ['estimator.rm_ga.generations_per_frame=1']),
    ('refinement', 'off', ['estimator.rm_ga.refine=false']),
    ('filter', 'latency not compensated', ['control.lqg.latency_frames=0']),
    ('filter', 'noise taken for ten times as much',
     ['control.lqg.surge.noise_m=0.03', 'control.lqg.sway.noise_m=0.01', 'control.lqg.heave.noise_m=0.01', 'control.lqg.yaw.noise_rad=0.08']),
    ('law', 'errors cost a ninth',
     ['control.lqg.surge.error_m=0.036', 'control.lqg.sway.error_m=0.036', 'control.lqg.heave.error_m=0.018', 'control.lqg.yaw.error_rad=0.15']),
    ('law', 'the published law', ['control.use=p_voltage']),
    ('procedure', 'docks twice as fast', ['procedure.docking_rate_mps=0.06']),
    ('procedure', 'aims 2 cm aside', ['procedure.servo_y_m=0.02']),
]

# What changes every trial's course, and nothing that matters. (A build by another compiler changes no digest; other seeds
# than the baseline's are refused: its night sea has too few trials to be compared without pairs.)
HARMLESS = [
    ('light computed in tiles of 12 pixels', ['lights.shading.tile_px=12']),
    ('light computed to half the tolerance', ['lights.shading.relative_tolerance=0.005']),
    ('20 physics steps a frame instead of 16', ['trial.clock.ticks_per_frame=20']),
    ('24 physics steps a frame', ['trial.clock.ticks_per_frame=24']),
    ('whole images instead of the marker\'s region', ['trial.region_of_interest=false']),
    ('population of 61', ['estimator.rm_ga.population=61']),
    ('population of 66', ['estimator.rm_ga.population=66']),
    ('mutation rate of 0.11', ['estimator.rm_ga.mutation_rate=0.11']),
    ('thrust 0.1 % less', effectiveness(0.999, 0.999, 0.999, 0.999)),
    ('drag 0.1 % less', drag(0.999)),
    ('read noise 1 % more', sensor('read_noise_electrons', 1.01)),
    ('gain 1 % more', sensor('gain', 1.01)),
    ('light computed in tiles of 20 pixels', ['lights.shading.tile_px=20']),
    ('light computed to 0.8 of the tolerance', ['lights.shading.relative_tolerance=0.008']),
    ('18 physics steps a frame', ['trial.clock.ticks_per_frame=18']),
    ('population of 63', ['estimator.rm_ga.population=63']),
    ('mutation rate of 0.09', ['estimator.rm_ga.mutation_rate=0.09']),
    ('read noise 1 % less', sensor('read_noise_electrons', 0.99)),
    ('gain 1 % less', sensor('gain', 0.99)),
    ('drag 0.1 % more', drag(1.001)),
]


def run(arguments, log, good=(0,)):
    with open(log, 'w') as out:
        code = subprocess.run(arguments, stdout=out, stderr=subprocess.STDOUT, check=False).returncode
    if code not in good:
        sys.exit(f'{log} ends with {code}: {pathlib.Path(log).read_text()[-500:]}')


def sets(assignments):
    return [word for assignment in assignments for word in ('--set', assignment)]


def judge(out, name, assignments, workers, program):
    """Verdict, trials, seconds, and what failed."""
    folder = out / name
    if not (folder / 'seconds').exists():
        begin = time.monotonic()
        run([program, 'gate', GATE, '--baseline', ROOT / 'assets/gates/docking.baseline.yaml', '--out', folder,
             '--bundles', '0', '--quiet', '--workers', str(workers), *sets(assignments)],
            out / f'{name}.log', good=(0, 1, 3))
        (folder / 'seconds').write_text(f'{time.monotonic() - begin:.0f}')
    summary = json.loads((folder / 'summary.json').read_text())
    failed = [f"{c['condition']}: {m['measure']}" for c in summary['conditions'] for m in c['changes']
              if m['verdict'] == 'fail']
    return [summary['verdict'], sum(c['trials'] for c in summary['conditions']), (folder / 'seconds').read_text(),
            '; '.join(failed)]


def trials_of(out, name, assignments, seeds, workers, program):
    """What the gate's own trials on other seeds show: {(case, seed): success}, and medians of those that succeed."""
    file = out / f'{name}.db'
    run([program, 'batch', GATE, '--seed', '733', '--seeds', str(seeds), '--workers', str(workers), '--out', file,
         '--quiet', *sets(assignments)], out / f'{name}.batch.log')
    with sqlite3.connect(f'file:{file}?mode=ro', uri=True) as store:
        trials = {(case, seed): outcome == 'success' for case, seed, outcome in store.execute(
            'SELECT "case", seed, outcome FROM trials')}
        docked = store.execute(
            "SELECT time_s, effort_v, fitness_mean,"
            " final_error_true_x_m, final_error_true_y_m, final_error_true_z_m"
            " FROM trials WHERE outcome = 'success'").fetchall()
    if not docked:
        return trials, [''] * 4
    return trials, [f'{statistics.median(d[0] for d in docked):.1f}', f'{statistics.median(d[1] for d in docked):.2f}',
                    f'{statistics.median(d[2] for d in docked):.2f}',
                    f'{1000 * statistics.median(math.hypot(*d[3:]) for d in docked):.1f}']


def mcnemar(before, now):
    """The exact two-sided p of pairs in which one docked and the other did not."""
    lost = sum(before[key] and not now[key] for key in now)
    won = sum(now[key] and not before[key] for key in now)
    tail = sum(math.comb(lost + won, k) for k in range(min(lost, won) + 1)) / 2**(lost + won)
    return f'{min(1, 2 * tail):.2g}'


def write(file, header, rows):
    with open(file, 'w', newline='') as out:
        csv.writer(out, lineterminator='\n').writerows([header] + rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    parser.add_argument('out', type=pathlib.Path)
    parser.add_argument('--seeds', type=int, default=125, help='trials of each condition on other seeds; 0: none')
    parser.add_argument('--workers', type=int, default=2)
    parser.add_argument('--program', type=pathlib.Path, default=os.environ.get('PROGRAM', ROOT / 'build/bin/turbidock'))
    parser.add_argument('--build', type=pathlib.Path, action='append', default=[],
                        help='program of another build: a harmless change')
    parser.add_argument('--only', type=int, help='the first changes of each kind, to see that it works')
    parser.add_argument('--set', action='append', default=[], dest='settings', metavar='KEY=VALUE', help='of every trial')
    arguments = parser.parse_args()
    out, workers, program = arguments.out.resolve(), arguments.workers, arguments.program.resolve()
    out.mkdir(parents=True, exist_ok=True)

    changes = [('', 'nothing', [])] + PLANTED[:arguments.only]
    changes = [(module, what, arguments.settings + assignments) for module, what, assignments in changes]
    verdicts = []
    for number, (module, what, assignments) in enumerate(changes):
        verdicts.append(judge(out, f'{number:02}', assignments, workers, program))
        print(f'{number} of {len(changes) - 1} {module}, {what}: {verdicts[-1]}', flush=True)

    harmless = [(what, program, arguments.settings + assignments) for what, assignments in HARMLESS[:arguments.only]]
    harmless += [(f'another build, {other}', other.resolve(), []) for other in arguments.build]
    rows = []
    for number, (what, other, assignments) in enumerate(harmless):
        rows.append([what] + judge(out, f'harmless_{number:02}', assignments, workers, other))
        print(f'{number + 1} of {len(harmless)}, {what}: {rows[-1][1:]}', flush=True)
        write(out / 'harmless.csv', ['changed', 'the gate says', 'trials', 'seconds', 'because of'], rows)

    rows, unchanged = [], None
    for number, (module, what, assignments) in enumerate(changes if arguments.seeds else []):
        trials, medians = trials_of(out, f'{number:02}', assignments, arguments.seeds, workers, program)
        unchanged = unchanged or trials
        p = mcnemar(unchanged, trials) if number else ''
        rows.append([module, what, sum(trials.values()), p, *medians, *verdicts[number]])
        print(f'{number} of {len(changes) - 1}: {rows[-1]}', flush=True)
        write(out / 'planted.csv', ['module', 'planted', f'docked of {len(trials)}', 'p', 'time, s', 'effort, V', 'F',
                                    'true error, mm', 'the gate says', 'trials', 'seconds', 'because of'], rows)


if __name__ == '__main__':
    main()
