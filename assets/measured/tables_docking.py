"""Tables of docking trials: the published night, turbidity, from 5 m, sea, moving stations, tuned gains, faults."""

import collections
import math
import re

from making import aside, beside, docked, failures, grouped, median, share, table, turbidock

MARKER = {'sea_night_active': 'active', 'sea_night_passive': 'passive', 'sea_night_fiducial': 'AprilTags',
          'paper_sea_night_active': 'active', 'paper_sea_night_passive': 'passive'}
MILK, CURRENT = 'water.milk_ml_m3', 'sea.current.surface_velocity_mps'


@table([turbidock('batch paper_sea_night --seeds 60 --out night.db', quick='--seeds 1 --shard 1/2', key='waits'),
        turbidock('batch paper_sea_night --seeds 60 --set procedure.approach.mode=pilot --set trial.duration_s=180 --out pilot.db',
                  quick='--seeds 1 --shard 1/2', key='is brought nearer by a pilot')], '240 trials, 1 h')
def docking_published_night(runs):
    rows = [['marker', 'the vehicle', 'trials', 'docked in the hole', 'within 50 s of finding the marker', 'beside the hole']]
    for run in runs:
        for (scenario,), trials in grouped(run.trials(), 'scenario').items():
            held = docked(trials)
            in_time = sum(trial['time_s'] - (trial['handover_time_s'] or 0) <= 50 for trial in held)
            rows.append([MARKER[scenario], run.key, len(trials), len(held), share(in_time, len(trials), ''), beside(trials)])
    return rows


@table([turbidock('batch turbidity_sweep --seeds 6 --out sweep.db', quick='--seeds 6 --shard 1/96')], '96 trials, 0.6 h')
def docking_over_turbidity(runs):
    cells = grouped(runs[0].trials(), MILK, 'scenario')
    rows = [['milk, ml/m3', *(f'{name}' for marker in ('active', 'passive')
                              for name in (f'{marker} marker, docked', 'first seen at, m', 'time, s'))]]
    for milk in dict.fromkeys(milk for milk, _ in cells):
        row = [milk]
        for scenario in ('sea_night_active', 'sea_night_passive'):
            trials = cells.get((milk, scenario), [])
            held = docked(trials)
            row += [share(len(held), len(trials)), median(held, 'first_sight_m', 2), median(held, 'time_s')]
        rows.append(row)
    return rows


QUICK_ENVELOPE = """schema_version: 1
description: a try-out
set: {estimator.pose_source: true_pose, trial.duration_s: 20, control.use: lqg}
cases: {active marker: {scenario: sea_night_active}}
ranges:
  navigation.position_bias_std_m: {from: 0.03, to: 1.5, scale: logarithmic, success: falls}
  sea.current.surface_velocity_mps.1: {from: 0, to: 0.3, success: falls}
find: {trials: 100, width: 0.5}
"""


@table([turbidock('batch docking_envelope --json --quiet --out envelope.db', files={'quick_docking.yaml': QUICK_ENVELOPE},
                  quick=('turbidock', 'batch', 'quick_docking.yaml', '--json', '--quiet', '--out', 'envelope.db'))], '300 trials, 0.7 h')
def docking_envelope(runs):
    found = runs[0].json()['envelope']
    over = found['ranges'][0]['key']

    def reach(text):
        boundary = re.search(r'((?:before |beyond )?[\d.e+-]+) \[([^,]*), ([^]]*)\]', text)
        return '{} [{}, {}]'.format(*boundary.groups()) if boundary else text.partition(' at every')[0]

    crossings = [[each for each in envelope['crossings'] if each['key'] == over] for envelope in found['envelopes']]
    hours = {case: sum(trial['cpu_time_s'] for trial in trials) / 3600 for (case,), trials in grouped(runs[0].trials(), 'case').items()}
    rows = [['marker', *(f'{100 * next(iter(each["at"].values())):.0f} cm' for each in crossings[0]), 'trials', 'processor hours']]
    for envelope, along in zip(found['envelopes'], crossings):
        rows.append([envelope['name'], *(reach(each['text']) for each in along), envelope['trials'], f'{hours[envelope["name"]]:.1f}'])
    return rows


@table([turbidock('batch last_leg --out last.db', quick='--seeds 1')], '800 trials, 0.1 h')
def docking_last_leg(runs):
    rows = [['out of sight for the last, m', 'goes on without for, s', 'docked in the hole', 'time, s', 'true y, z, mm', 'beside the hole']]
    for (nearest, blind), trials in grouped(runs[0].trials(), 'estimator.true_pose.nearest_m', 'procedure.blind_max_s').items():
        held = docked(trials)
        rows.append([f'{max(0, round(float(nearest) - 0.35, 2)):g}', blind, share(len(held), len(trials)), median(held, 'time_s'),
                     aside(held), beside(trials)])
    return rows


@table([turbidock('batch sea_state --out sea.db', quick='--seeds 1 --shard 1/5'),
        turbidock('batch bluerov2_calm --seeds 60 --out heavy.db', quick='--seeds 1')], '240 trials, 0.4 h')
def docking_over_sea(runs):
    rows = [['vehicle', 'sea', 'current, cm/s', 'docked', 'time, s', 'true y, z, mm', 'others']]
    cells = [('published', sea, f'{100 * float(current.strip("[]").split(",")[1]):.0f}', trials)
             for (sea, current), trials in grouped(runs[0].trials(), 'sea.state', CURRENT).items()]
    for vehicle, sea, current, trials in [*cells, ('BlueROV2 Heavy', 'calm', '2', runs[1].trials())]:
        held = docked(trials)
        rows.append([vehicle, sea, current, share(len(held), len(trials)), median(held, 'time_s'), aside(held), failures(trials)])
    return rows


@table([turbidock('batch rough_sea --out rough.db', quick='--seeds 1 --shard 1/25')], '2,160 trials, 0.4 h')
def docking_over_waves(runs):
    cells = grouped(runs[0].trials(), 'control.use', CURRENT, 'sea.waves.0.period_s', 'sea.waves.0.height_m')
    periods = sorted({key[2] for key in cells}, key=float)
    rows = [['controller', 'current, cm/s', *(f'{float(period):g} s' for period in periods)]]
    for controller, current in dict.fromkeys(key[:2] for key in cells):
        row = [controller, f'{100 * float(current.strip("[]").split(",")[1]):.0f}']
        for period in periods:
            best = ''
            for height in sorted({key[3] for key in cells if key[:3] == (controller, current, period)}, key=float):
                trials = cells[controller, current, period, height]
                if len(docked(trials)) < len(trials):
                    best = best or 'none'
                    break
                best = f'{float(height):g}'
            row.append(best)
        rows.append(row)
    return rows


@table([turbidock('batch fiducial_turbidity --seeds 6 --out apriltags.db', quick='--seeds 1 --shard 1/12')], '144 trials, 0.5 h')
def docking_apriltags(runs):
    trials = runs[0].trials()
    cells, markers = grouped(trials, MILK, 'scenario'), list(dict.fromkeys(trial['scenario'] for trial in trials))
    off = lambda t: sum((t[f'final_error_estimated_{a}_m'] - t[f'final_error_true_{a}_m'])**2 for a in 'xyz')**0.5
    rows = [['milk, ml/m3', *(text for name in markers for text in (f'{MARKER[name]}, docked', f'{MARKER[name]}, mm'))]]
    for milk in dict.fromkeys(milk for milk, _ in cells):
        row = [milk]
        for marker in markers:
            group = cells.get((milk, marker), [])
            row += [share(len(docked(group)), len(group)), median(docked(group), off, 1, 1000)]
        rows.append(row)
    return rows


@table([turbidock('batch moored_dock --out moored.db', quick='--seeds 1 --shard 1/6')], '1,000 trials, 0.1 h')
def docking_moored(runs):
    cells = grouped(runs[0].trials(), 'station.mooring.swing_y_m', 'station.mooring.swing_period_s')
    periods = sorted({key[1] for key in cells}, key=float)
    rows = [['amplitude, mm', *(f'{float(period):g} s' for period in periods)]]
    for amplitude in dict.fromkeys(key[0] for key in cells):
        rows.append([f'{1000 * float(amplitude):.0f}', *(len(docked(cells[amplitude, period])) if (amplitude, period) in cells else ''
                                                         for period in periods)])
    return rows


ROBUST = 'batch robustness'


@table([turbidock(f'{ROBUST} --set estimator.pose_source=true_pose --out robustness.db', quick='--seeds 1 --shard 1/8'),
        turbidock(f'{ROBUST} --seeds 40 --set estimator.pose_source=true_pose --set control.use=pid --out robustness_pid.db',
                  quick='--seeds 1 --shard 1/8'),
        turbidock('batch robustness_cameras --seeds 60 --out cameras.db', quick='--seeds 1 --shard 1/3'),
        turbidock(f'{ROBUST} --seeds 20 --out robustness_cameras.db', quick='--seeds 1 --shard 1/21')], '5,600 trials, 0.7 h')
def tuning_robustness(runs):
    cells = [grouped(run.trials(), 'case') for run in runs]
    seen = {key: [*cells[2].get(key, []), *cells[3].get(key, [])] for key in [*cells[2], *cells[3]]}
    rows = [['what the controller is not told', '`lqg`, true pose', '`pid`, true pose', '`lqg`, cameras', 'true y, z, mm']]
    for key in dict.fromkeys([*cells[0], *seen]):
        counts = [f'{len(docked(group))} of {len(group)}' if (group := of.get(key)) else '' for of in (cells[0], cells[1], seen)]
        held = docked(seen.get(key, []))
        rows.append([key[0].replace('nominal', 'nothing'), *counts, aside(held)])
    return rows


QUICK_STUDY = """schema_version: 1
description: a try-out
scenario: sea_night_active
seeds: 2
set: {estimator.pose_source: true_pose, control.use: lqg, trial.duration_s: 20}
tuning:
  gains: [{key: control.lqg.sway.effort_share, low: 0.09, high: 1.4, scale: log}]
  objective: [{metric: time_s, weight: 1, failed: 60}]
  success_at_least: 0
  start_may_fail: true
  optimiser: {population: 5, generations: 1}
  proof: {held_out_seeds: 4, cameras: false}
"""


@table([turbidock(f'tune {study} --json --quiet --out tuned_{study}', key=study, files={'quick.yaml': QUICK_STUDY},
                  quick=('turbidock', 'tune', 'quick.yaml', '--json', '--quiet', '--out', 'tuned') if study == 'lqg_moderate' else None)
        for study in ('lqg_moderate', 'pid_moderate', 'p_voltage_moderate')], '19,000 trials, 5 h')
def tuning_held_out(runs):
    rows = [['study', 'trials', 'docked before', 'docked tuned', 'paired difference of the cost']]
    for run in runs:
        found = run.json()
        cost, rate = found['held_out']['cost_difference'], found['held_out']['changes'][0]
        low, high = cost['confidence_95']
        rows.append([f'`{run.key}`', f'{found["trials"]:,}', *(f'{rate[side] * rate["pairs"]:.0f} of {rate["pairs"]}' for side in 'ab'),
                     f'{cost["mean"]:.3g} [{low:.3g}, {high:.3g}]'])
    return rows


@table([turbidock(f'step-response --set control.use={controller} --json --quiet', key=controller,
                  quick='--axis x' if controller == 'pid' else None)
        for controller in ('p_voltage', 'pid', 'lqg')], '0.02 h')
def tuning_steps(runs):
    rows = [['controller', 'axis', 'rise, s', 'overshoot, %', 'settles, s', 'push moves', 'phase margin, degrees', 'gain margin, factor']]
    number = lambda value, digits, scale=1: 'never' if value is None else f'{scale * value:.{digits}f}'
    for run in runs:
        for axis in run.json()['axes']:
            step, loop, push = axis['step'], axis['loop'], axis['disturbance']
            moved = abs(push['peak'])
            rows.append([f'`{run.key}`', axis['axis'], number(step['rise_time_s'], 1), number(step['overshoot'], 0, 100),
                         number(step['settling_time_s'], 1),
                         f'{math.degrees(moved):.0f}°' if axis['axis'] == 'yaw' else f'{1000 * moved:.0f} mm',
                         number(loop['phase_margin_rad'], 0, math.degrees(1)).replace('never', ''),
                         f'{loop["gain_margin"]:.2g}' if loop['gain_margin'] else ''])
    return rows


def plain(value):
    """A fault as a plan writes it, without its brackets: {fish: [{begin_s: 6}]} is "fish: begin_s 6"."""
    if value.strip() == '{}':
        return 'none'
    keys = re.sub(r'[\w.]+: \[\{.*?\}\]', lambda m: m.group().replace(': [{', '\0', 1).replace(': ', ' '), value.strip()[1:-1])
    return keys.replace('\0', ': ').replace('}, {', '; ').replace('}]', '')


@table([turbidock('batch faults --out faults.db', quick='--seeds 1 --shard 1/37')], '148 trials, 0.4 h')
def faults(runs):
    cells = grouped(runs[0].trials(), 'faults', 'scenario')
    rows = [['fault', 'active marker, sea at night', 'passive marker, pool']]

    def ends(trials):
        counts = collections.Counter(trial['outcome'].replace('success', 'docked').replace('_', ' ') for trial in trials)
        return ', '.join(f'{number} {end}' for end, number in counts.most_common())

    def name(fault):
        short = re.sub(r' begin_s 6,|,? begin_s 6', '', plain(fault)).removesuffix(':')
        return short if 'begin_s' in fault else f'{short}, from the start'

    scenarios, held = ('sea_night_active', 'pool_passive'), 0
    for fault in dict.fromkeys(key[0] for key in cells):
        trials = [cells.get((fault, scenario), []) for scenario in scenarios]
        if all(len(docked(group)) == len(group) for group in trials):
            held += 1
        else:
            rows.append([name(fault), *map(ends, trials)])
    return [*rows, [f'the other {held} of the plan', 'all docked', 'all docked']]
