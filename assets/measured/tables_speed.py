"""Tables of speed: a frame by stage, whole trials, smaller images, Python, ROS 2 nodes."""

from making import ROOT, Command, aside, grouped, median, table, turbidock

NEAR = 'bench --json --quiet --frames 200 --set start.distance_min_m=0.6 --set start.distance_max_m=0.75'
STAGES = (('render, read-back', ('render', 'read_back')), ('water', ('water',)), ('sensor', ('sensor',)), ('labels', ('labels',)),
          ('estimate', ('estimate',)), ('physics, control, log', ('physics', 'control', 'log')))


@table([turbidock(NEAR, key='region', quick='--frames 20 --repeats 1'),
        turbidock(f'{NEAR} --set trial.region_of_interest=false', key='whole images', quick='--frames 20 --repeats 1')], '0.01 h; a quiet machine')
def speed_stages(runs):
    found = [(f'{name}, {run.key}', scenario) for place, name in enumerate(('sea_night_active', 'pool_passive'))
             for run in runs for scenario in [run.json()['scenarios'][place]]]
    rows = [['stage', *(name for name, _ in found)]]
    for name, parts in STAGES:
        rows.append([name, *(f'{sum(s["stages_ms"][part] for part in parts):.2f}' for _, s in found)])
    for name, key, digits in (('frame', 'frame_ms', 2), ('real-time factor', 'real_time_factor', 1),
                              ('frame over bare rendering', 'ratio_to_bare_render', 2)):
        rows.append([name, *(f'{s[key]:.{digits}f}' for _, s in found)])
    return rows


COUNTED = 'speed_instructions.csv'


@table([turbidock(f'bench --instructions {COUNTED} --update', quick=None,
                  files={COUNTED: (ROOT / f'assets/measured/{COUNTED}').read_text()})], '0.05 h',
       [f'turbidock bench --instructions assets/measured/{COUNTED} --update'], '`bash .ci/run instructions`')
def speed_instructions(runs):
    return runs[0].rows(COUNTED)


THROUGHPUT = 'batch assets/measured/plans/throughput.yaml --quiet'
TRUE_POSE = f'{THROUGHPUT} --set estimator.pose_source=true_pose --seeds 200'


@table([turbidock(f'{line} --workers {workers} --out {name.replace(" ", "_")}_{workers}.db', key=(name, workers), fresh=True,
                  quick='--seeds 2')
        for name, line in (('cameras', THROUGHPUT), ('true pose', TRUE_POSE)) for workers in (1, 2)], '0.05 h; a quiet machine')
def speed_throughput(runs):
    hour = {run.key: 3600 * len(run.trials()) / run.wall_s for run in runs}
    names = ('cameras', 'true pose')
    return [['what', *names],
            *([f'trials an hour, {count}', *(f'{hour[name, workers]:,.0f}' for name in names)]
              for workers, count in ((1, '1 worker'), (2, '2 workers on two cores'))),
            ['2 workers over 1', *(f'{hour[name, 2] / hour[name, 1]:.2f}' for name in names)]]


STAGES_OF_A_TRIAL = ('approach', 'visual_servoing', 'docking', 'docked', 'undocking', 'search')


@table([turbidock('batch assets/measured/plans/resolution.yaml --out resolution.db --workers 1', quick='--seeds 1 --shard 1/3')],
       '24 trials, 0.03 h')
def speed_resolution(runs):
    rows = [['images', 'scenario', 'docked', 'time, s', 'true y, z, mm', 'F', 'x real time']]
    for (case, scenario), trials in grouped(runs[0].trials(), 'case', 'scenario').items():
        held = [trial for trial in trials if trial['outcome'] == 'success']
        simulated = sum(t[f'{stage}_time_s'] for t in trials for stage in STAGES_OF_A_TRIAL)
        rows.append([case, scenario, f'{len(held)} of {len(trials)}', median(held, 'time_s', 1), aside(held),
                     median(trials, 'fitness_mean', 2), f'{simulated / sum(t["cpu_time_s"] for t in trials):.1f}'])
    return rows


@table([Command(('python', 'tests/python/speed.py', '25'), ('python', 'tests/python/speed.py', '1'))], '0.3 h')
def speed_python(runs):
    names = {'true pose, stepped': 'true pose, stepped', 'true pose, stepped, every frame looked at': 'true pose, every frame looked at',
             'cameras, stepped': 'cameras, stepped', 'cameras, stepped, images handed out': 'cameras, images handed out'}
    rows = [['what', 'over run']]
    for name, ratio in runs[0].rows()[1:]:
        name = name.split(':')[0]
        rows += [[names[name], ratio]] if name in names else []
    return rows


@table([Command(('python', 'tests/python/ros_speed.py', '200'), ('python', 'tests/python/ros_speed.py', '60'))], '0.02 h; a quiet machine')
def speed_ros(runs):
    names, *found = runs[0].rows()
    kept = {'what': 'what', 'frames': 'frames', 'median_ms': 'median', 'of_nine_in_ten_ms': 'nine in ten', 'processor_ms': 'processor',
            'nodes_processor_ms': "nodes' processor"}
    return [list(kept.values()), *([row[names.index(name)] for name in kept] for row in found)]
