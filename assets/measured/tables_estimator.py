"""Tables of estimator, recognition, gate, envelope, identification of parameters and milk."""

import collections
import json
import math
import re
import statistics

from making import ROOT, Command, median, share, table, turbidock

TRACED = 'tests/data/pathtraced'
PAIRS = [pair for name in ('active_21', 'passive_22') for pair in json.loads((ROOT / TRACED / f'{name}.json').read_text())]


def turn_rad(a, b):
    """Angle between two rotations."""
    norm = math.sqrt(sum(x * x for x in a) * sum(x * x for x in b))
    return 2 * math.acos(min(1, abs(sum(x * y for x, y in zip(a, b))) / norm))


@table([turbidock(f'estimate --left {TRACED}/{pair["left"]} --right {TRACED}/{pair["right"]} --seed {seed} --json --quiet', key=pair,
                  quick=() if seed == 1 else None) for pair in PAIRS for seed in range(1, 21)], '160 runs, 0.02 h',
       [f'turbidock estimate --left {TRACED}/PAIR_left.png --right {TRACED}/PAIR_right.png --seed SEED --json'])
def estimator_pathtraced(runs):
    rows = [['marker', 'estimates', 'within 2 mm and 0.3°', 'median, mm', 'worst, mm', 'median, °', 'worst, °']]
    for kind in ('active', 'passive'):
        errors = []
        for run in (run for run in runs if run.key['kind'] == kind):
            found = run.json()
            errors.append((1000 * math.dist(found['position_m'], run.key['position_m']),
                           math.degrees(turn_rad(found['quaternion_wxyz'], run.key['quaternion_wxyz']))))
        mm, degrees = zip(*errors)
        rows.append([kind, len(errors), sum(a <= 2 and b <= 0.3 for a, b in errors), f'{statistics.median(mm):.2f}', f'{max(mm):.2f}',
                     f'{statistics.median(degrees):.2f}', f'{max(degrees):.2f}'])
    return rows


STARTS = [('active', 'modern_digital', '0', 550, 913), ('active', 'modern_digital', '10', 550, 914),
          ('active', 'published', '0', 400, 923), ('active', 'published', '10', 500, 924),
          ('passive', 'modern_digital', '5', 250, 911), ('passive', 'modern_digital', '10', 250, 912),
          ('passive', 'published', '0', 600, 921), ('passive', 'published', '2.5', 400, 922)]


@table([Command(('build/bin/cold_starts', marker, optics, milk, str(starts), str(seed)),
                ('build/bin/cold_starts', marker, optics, milk, '1', str(seed)) if milk == '10' and marker == 'active' else None)
        for marker, optics, milk, starts, seed in STARTS], '3,500 starts, 0.2 h', ['build/bin/cold_starts MARKER OPTICS MILK STARTS SEED'])
def estimator_cold_starts(runs):
    rows = [['marker', 'optics', 'milk, ml/m3', 'F at the true pose', 'starts', 'right and detected', 'wrong and detected', 'not detected']]
    for run in runs:
        found = [line[2:].split(',') for line in run.text.splitlines() if line.startswith('# ')]
        rows += sorted(found, key=lambda row: row[3], reverse=True)
    return rows


@table([Command(('build/bin/vision_data_test', '--gtest_filter=AlteredPairs.AreRightOrUnsure'), None)], '0.02 h',
       elsewhere='ctest -R vision.data')
def estimator_altered(runs):
    names = {'none': 'nothing', 'colours exchanged': 'red and green exchanged'}
    rows = [['altered', 'right and detected', 'not detected', 'wrong and detected']]
    for match in re.finditer(r'^([a-z][^\n\[]*?),16,(\d+),(\d+),(\d+)$', runs[0].text, re.M):
        rows.append([names.get(match[1], match[1]), *match.groups()[1:]])
    return rows


@table([turbidock('batch assets/measured/plans/confidence.yaml --out confidence.db', quick='--seeds 1 --shard 1/4')], '140 trials, 0.3 h')
def estimator_confidence(runs):
    rows = [['scenario', 'trials', 'docked', 'false confidence, s', 'normalised error squared']]
    trials = runs[0].trials()
    for case in dict.fromkeys(trial['case'] for trial in trials):
        mine = [trial for trial in trials if trial['case'] == case]
        false_s = [trial['false_confidence_s'] or 0 for trial in mine]
        errors2 = [trial['normalised_error2_mean'] for trial in mine if trial['normalised_error2_mean'] is not None]
        rows.append([case, len(mine), sum(trial['outcome'] == 'success' for trial in mine),
                     f'{statistics.mean(false_s):.2f} ({max(false_s):.2f})', f'{statistics.mean(errors2):.1f}' if errors2 else ''])
    return rows


@table([Command(('build/bin/gate_error_rates', '10000'), ('build/bin/gate_error_rates', '20'))], '5 s')
def gate_error_rates(runs):
    names = {'twins': 'twins that do the same', 'independent': 'independent'}
    return [['pairs', 'false alarms at 0.95', 'missed at 0.85', 'pairs at 0.95', 'pairs at 0.85'],
            *([names[row[0]], *row[1:]] for row in runs[0].rows())]


PLANTED = Command(('python3', 'assets/measured/planted_regressions.py', 'planted'),
                  ('--only', '1', '--seeds', '1', '--set', 'estimator.pose_source=true_pose', '--set', 'trial.duration_s=1'), workers=True)
PLANTED_SHOWN = ['python3 assets/measured/planted_regressions.py out/planted']


@table([PLANTED], '20,000 trials, 15 h', PLANTED_SHOWN)
def gate_planted_regressions(runs):
    names, *found = runs[0].rows('planted/planted.csv')
    at = [1, 2, 3, *(names.index(name) for name in ('the gate says', 'trials'))]
    because = lambda row: '; '.join(f'{measure.replace("_", " ")} ({number})' for measure, number in collections.Counter(
        part.split(': ')[1] for part in row[-1].split('; ') if part).most_common())
    return [[*(names[i] for i in at), 'because of'], *([*(row[i] for i in at), because(row)] for row in found)]


@table([PLANTED], 'with the planted regressions', PLANTED_SHOWN)
def gate_harmless(runs):
    trials = {}
    for _, verdict, number, *_ in runs[0].rows('planted/harmless.csv')[1:]:
        trials.setdefault(verdict, []).append(int(number))
    return [['the gate says', 'of changes', 'after trials'],
            *([verdict, len(numbers), f'{min(numbers)} to {max(numbers)}'] for verdict, numbers in trials.items())]


ENVELOPE = """schema_version: 1
description: the current in which 90 % dock, roughly
scenario: sea_night_active
master_seed: 20268
set: {trial.duration_s: 20, estimator.pose_source: true_pose}
ranges:
  sea.current.surface_velocity_mps[1]: {from: 0, to: 0.4, success: falls}
find: {rate: 0.9, width: 0.5}
"""


@table([turbidock('batch current_envelope --json --quiet --out current_envelope.db', files={'quick.yaml': ENVELOPE},
                  quick=('turbidock', 'batch', 'quick.yaml', '--json', '--quiet', '--out', 'quick_envelope.db'))], '700 trials, 0.05 h')
def envelope_current(runs):
    envelope = runs[0].json()['envelope']['envelopes'][0]
    rows = [['gusts, cm/s', '90 % dock up to a current of, m/s', '95 % band, m/s', 'trials in all']]
    for crossing in envelope['crossings']:
        if not crossing['key'].startswith('sea.current.surface'):
            continue
        gusts = 100 * next(iter(crossing['at'].values()), 0.01)
        value, low, high = ('' if crossing[side] is None else f'{crossing[side]:.3f}' for side in ('value', 'low', 'high'))
        band = f'{low} to {high}' if low and high else f'up to {high}' if high else f'from {low}' if low else ''
        rows.append([f'{gusts:.0f}', value or 'none', band, envelope['trials']])
    return rows


@table([Command(('build/bin/envelope_coverage', ranges, boundary, '20000', str(number)),
                ('build/bin/envelope_coverage', ranges, boundary, '20000', '1')
                if boundary not in ('curve', 'line') or ranges == '1' else None, key=(ranges, boundary))
        for ranges, boundary, number in (('1', 'line', 100), ('1', 'step', 100), ('1', 'corner', 100), ('2', 'curve', 28),
                                         ('2', 'corner', 63), ('2', 'step', 56), ('3', 'line', 30))], '0.2 h')
def envelope_coverage(runs):
    rows = [['ranges', 'boundary', 'held', 'but for 0.019', 'trials', 'choosing, s']]
    for run in runs:
        found = run.rows()
        mean = lambda column: statistics.mean(float(row[column]) for row in found)
        rows.append([*run.key, *(f'{sum(row[i] == "1" for row in found)} of {len(found)}' for i in (3, 4)), f'{mean(7):.0f}',
                     f'{mean(8):.2g}'])
    return rows


IDENTIFICATION = ('python', 'assets/measured/identification.py', '--logs', '100', '--seconds', '60')


@table([Command(IDENTIFICATION, ('--logs', '1', '--seconds', '12'), workers=True)], '100 logs, 0.8 h')
def identification_coverage(runs):
    names, *found = runs[0].rows()
    often = lambda told: int(told.split()[0]) >= 0.05 * int(told.split()[-1])
    return [names, *(row for row in found if often(row[1]))]


@table([Command(('build/bin/milk_visibility', '0', '10', '20', '30', '50', '100', '200'), ('build/bin/milk_visibility', '0', '20'))], 'none')
def milk_visibility(runs):
    rows = [['milk, ml/m³', 'one could see, m', 'attenuation, 1/m', 'FTU (active)', 'FTU (passive)']]

    def digits(value):
        return '0' if value <= 0 else f'{value:.2g}' if value >= 9.95 else f'{value:.1f}'

    for milk, sight, attenuation in runs[0].rows():
        active, passive = (digits(slope * float(milk) - offset) for slope, offset in ((0.128, 0.1), (0.231, 1.6)))
        rows.append([milk, f'{float(sight):.2g}', f'{float(attenuation):.2f}', active, passive if float(milk) <= 119 else ''])
    return rows


def recognition_plan(marker):
    """A plan of a few cells."""
    text = (ROOT / f'assets/plans/recognition_{marker}.yaml').read_text()
    text = re.sub(r'water\.milk_ml_m3: \[.*?\]', 'water.milk_ml_m3: [0, 119]', text, flags=re.S)
    return re.sub(r'\n  600 mm: .*', '', text)


DISTANCES_MM = (400, 800, 1000)


@table([turbidock(f'recognize recognition_{marker} --seconds 10 --json --quiet --out recognition_{marker}.db', key=marker,
                  files={f'quick_{marker}.yaml': recognition_plan(marker)},
                  quick=('turbidock', 'recognize', f'quick_{marker}.yaml', '--seconds', '0.3', '--json', '--quiet'))
        for marker in ('active', 'passive')], '300 cells, 1 h')
def recognition_reached(runs):
    columns = []
    for run in runs:
        found = run.json()
        table_, cells = found['tables'][run.key], [cell for cell in found['cells'] if cell['distance_mm'] in DISTANCES_MM]
        known = [cell for cell in cells if cell.get('reference_mean') is not None]
        rmse = lambda of: math.sqrt(statistics.mean((c['fitness_mean'] - c['reference_mean'])**2 for c in of))
        at = lambda mm: [cell for cell in known if cell['distance_mm'] == mm]
        area = lambda f: 'I' if f >= 0.6 else 'II' if f >= 0.22 else 'III'
        clear = [cell['fitness_mean'] for mm in DISTANCES_MM for cell in cells if cell['milk_ml_m3'] == 0 and cell['distance_mm'] == mm]
        ratios = [table_['loss_milk_ratio'].get(str(mm)) for mm in DISTANCES_MM]
        number = lambda value, digits: '' if value is None else f'{value:.{digits}f}'
        columns.append([number(rmse(known), 3), ', '.join(number(rmse(at(mm)), 3) for mm in DISTANCES_MM),
                        f'{100 * statistics.mean(area(c["fitness_mean"]) == area(c["reference_mean"]) for c in known):.0f} %',
                        ', '.join(number(value, 2) for value in clear), *(number(ratio, 2) for ratio in ratios),
                        number(table_['lost_fitness_error'], 2), number(table_['fitness_std'], 3)])
    asked = ['0.055; 0.09', '', '92 %', 'passive, 1000 mm: 0.62', *3 * ['0.9 to 1.1'], 'within 0.04', '0.02 to 0.06']
    names = ['root-mean-square error of mean F', 'the same at 400, 800, 1000 mm', 'same Area', 'F in clear water, 400, 800, 1000 mm',
             'milk at F = 0.22 over the published, 400 mm', 'the same, 800 mm', 'the same, 1000 mm', 'F of a lost marker, less the published',
             'deviation of F within a cell, mean']
    return [['measure', 'active marker', 'passive marker', 'asked'], *map(list, zip(names, *columns, asked))]


PLAN = (ROOT / 'assets/calibration.yaml').read_text()
PARAMETERS = re.findall(r'- key: (\S+)\n    low: (\S+)\n    high: (\S+)\n    start: (\S+)\n((?:    .*\n)*)', PLAN)


def moved(key, sign):
    """The calibration's plan with one start moved by 5 % of its range; nothing where the range ends before."""
    low, high, start, others = next((float(p[1]), float(p[2]), float(p[3]), p[4]) for p in PARAMETERS if p[0] == key)
    if 'logarithmic: true' in others:
        value = math.exp(math.log(start) + sign * 0.05 * math.log(high / low))
    else:
        value = start + sign * 0.05 * (high - low)
    if not low <= value <= high:
        return None
    return re.sub(rf'(- key: {re.escape(key)}\n.*\n.*\n    start: )\S+', rf'\g<1>{value:.9g}', PLAN)


def calibrations():
    plans = [('as shipped', 0, PLAN), *((p[0], sign, moved(p[0], sign)) for p in PARAMETERS for sign in (-1, 1))]
    for i, (key, sign, text) in enumerate(plan for plan in plans if plan[2]):
        few = re.sub(r'cell_share: \S+', 'cell_share: 0.02', text)
        yield turbidock(f'calibrate --generations 0 --plan calibrate_{i}.yaml --json --quiet', key=(key, sign),
                        files={f'calibrate_{i}.yaml': text, f'quick_{i}.yaml': few},
                        quick=f'--plan quick_{i}.yaml' if i < 2 else None)


@table(list(calibrations()), '0.2 h',
       ['turbidock calibrate --generations 0 --plan PLAN --json'])
def calibration_sensitivity(runs):
    misfits = {run.key: run.json()['misfit'] for run in runs}
    rows = [['parameter', 'value', 'misfit, lower', 'misfit, higher'], ['as shipped', '', *2 * [f'{misfits["as shipped", 0]:.2f}']]]
    for key, _, _, start, _ in PARAMETERS:
        row = [f'{misfits[key, sign]:.2f}' if (key, sign) in misfits else '' for sign in (-1, 1)]
        rows += [[f'`{key}`', start, *row]] if any(row) else []
    return rows


def plan_from_afar():
    """The calibration's plan, begun away from the shipped values, with a third of the cells."""
    text = PLAN
    for key, start in (('water.scattering_scale', 1), ('lights.lamps.intensity_w_sr', 0.05), ('lights.marker.core_radiance_w_m2_sr', 0.04),
                       ('lights.marker.core_width_m', 0.008), ('cameras.sensor.chroma_coring_dn', 50), ('cameras.sensor.video_noise_dn', 5),
                       ('cameras.sensor.auto_level', 0.3)):
        text = re.sub(rf'(- key: {re.escape(key)}\n.*\n.*\n    start: )\S+', rf'\g<1>{start}', text)
    for key, value in (('cell_share', 0.34), ('frames', 1), ('spread', 0.1)):
        text = re.sub(rf'{key}: \S+', f'{key}: {value}', text)
    return text


@table([turbidock('calibrate --generations 0 --json --quiet', key='all', quick=None),
        *(turbidock(f'calibrate --plan from_afar.yaml --leave-out {mm} --generations 14 --json --quiet --out apart_{mm}.yaml', key=mm,
                    files={'from_afar.yaml': plan_from_afar(),
                           'quick.yaml': re.sub('cell_share: 0.34', 'cell_share: 0.02', plan_from_afar())},
                    quick='--plan quick.yaml --generations 0' if mm == 800 else None) for mm in DISTANCES_MM)], '1 h',
       ['turbidock calibrate --generations 0 --json',
        'turbidock calibrate --plan PLAN --leave-out MM --generations 14 --json'])
def recognition_left_out(runs):
    found = {run.key: {(c['marker'], round(1000 * c['distance_m'])): f'{c["rmse"]:.3f}, {100 * c["area_agreement"]:.0f} %'
                       for c in run.json()['columns']} for run in runs}
    rows = [['distance left out, mm', 'active, fitted to all', 'active, left out', 'passive, fitted to all', 'passive, left out']]
    for mm in (mm for mm in DISTANCES_MM if mm in found):
        rows.append([str(mm), *(found[of][marker, mm] if of in found else ''
                                for marker in ('active', 'passive') for of in ('all', mm))])
    return rows
