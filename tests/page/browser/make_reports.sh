#!/usr/bin/env bash
# make_reports.sh PROGRAM FOLDER: a report of every kind, of trials as short as they can be (about two minutes).
set -euo pipefail
program=$(realpath "$1") footage=$(realpath "$(dirname "$0")/../../../assets/footage")
mkdir -p "$2"
cd "$2"

# Docks within 3 s: small images, a start right in front of the dock.
cat >short.yaml <<'END'
schema_version: 1
description: 'a <b id="injected">short</b> trial & more'
trial: {scene: pool_active.xml, seed: 1, duration_s: 3.5, after_docked_s: 0}
water: {background: pure, milk_ml_m3: 10}
lights: {lamps: {enabled: false}, marker: {enabled: true}}
cameras: {rig: {width_px: 320, height_px: 240}}
control: {use: pid}
start: {distance_min_m: 0.45, distance_max_m: 0.5, lateral_m: 0.02, vertical_m: 0.02, heading_rad: 0.02}
procedure: {found_hold_s: 0.1, servo_x_m: 0.45, docking_rate_mps: 0.1}
END

# Without cameras: a tenth of a second a trial.
cat >plan.yaml <<'END'
schema_version: 1
description: 'docking over current, <i>three</i> laws'
scenario: sea_night_active
seeds: 6
series_every_frames: 6
set: {estimator.pose_source: true_pose, trial.duration_s: 30}
grid:
  sea.current.surface_velocity_mps[1]: [0, 0.1, 0.2]
  control.use: [p_voltage, pid, lqg]
strata:
  near: {start.distance_min_m: 0.9, start.distance_max_m: 1.15}
  far: {start.distance_min_m: 1.15, start.distance_max_m: 1.4}
random:
  start.heading_rad: {uniform: [0, 0.6]}
END
sed 's/control.use: \[.*/control.use: [pid, lqg]/; s/seeds: 6/seeds: 4/' plan.yaml >two.yaml

cat >study.yaml <<'END'
schema_version: 1
description: lqg sway, a try-out
scenario: sea_night_active
seeds: 3
set: {estimator.pose_source: true_pose, control.use: lqg, trial.duration_s: 30}
tuning:
  gains:
    - {key: control.lqg.sway.effort_share, low: 0.09, high: 1.4, scale: log}
    - {key: control.lqg.yaw.error_rad, low: 0.02, high: 0.3, scale: log}
  objective:
    - {metric: time_s, weight: 1, failed: 60}
    - {metric: final_error_true_y_m, weight: 500}
  success_at_least: 0.5
  optimiser: {population: 5, generations: 2}
  proof: {held_out_seeds: 6, cameras: false}
END

cat >cells.yaml <<'END'
schema_version: 1
description: both markers over milk and distance
set: {cameras.optics: published, start: {lateral_m: 0, vertical_m: 0, heading_rad: 0}}
cases:
  active 400 mm: {scenario: pool_active, trial.scene: tank_active.xml, start.distance_min_m: 0.4, start.distance_max_m: 0.4}
  active 1000 mm: {scenario: pool_active, trial.scene: tank_active.xml, start.distance_min_m: 1, start.distance_max_m: 1}
  passive 400 mm: {scenario: pool_passive, trial.scene: tank_passive.xml, start.distance_min_m: 0.4, start.distance_max_m: 0.4}
  passive 1000 mm: {scenario: pool_passive, trial.scene: tank_passive.xml, start.distance_min_m: 1, start.distance_max_m: 1}
grid: {water.milk_ml_m3: [0, 40, 120]}
END

cat >gate.yaml <<'END'
schema_version: 1
description: short trials
scenario: short.yaml
seeds: 9
cases: {short: {}}
gate: {baseline: gate.baseline.yaml, alpha: 0.1, beta: 0.1, margins: {success_rate: 0.4}}
END

"$program" run short.yaml --out trial --video --report --quiet
# milk that nothing is seen through
"$program" run short.yaml --out lost --seed 3 --set water.milk_ml_m3=400 --set trial.duration_s=7 --video --quiet || [ $? = 1 ]
"$program" run short.yaml --out still --set estimator.pose_source=true_pose --report --quiet
"$program" batch plan.yaml --out batch.db --quiet
"$program" status batch.db --by control.use --json >batch_by_law.json
"$program" batch two.yaml --out a.db --quiet
sed '/control.use:/d; s/seeds: 6/seeds: 4/' plan.yaml >few.yaml
"$program" batch few.yaml --out none.db --set trial.duration_s=0.3 --quiet
sed '/^grid:/,$d; s/seeds: 6/seeds: 1/' plan.yaml >single.yaml
"$program" batch single.yaml --out single.db --quiet
"$program" batch two.yaml --out b.db --set vehicle.rigid_body.mass_kg=17 --quiet
"$program" tune study.yaml --out study --quiet >/dev/null
"$program" step-response sea_night_active --out steps --quiet >/dev/null
"$program" check-vehicle vehicle.xml --out vehicle >/dev/null
"$program" gate gate.yaml --update --quiet
# with a third of the time no trial docks any more
"$program" gate gate.yaml --set trial.duration_s=1.2 --bundles 2 --out gate --quiet || [ $? = 1 ]
"$program" recognize cells.yaml --seconds 1 --json --figure recognition.png --quiet >recognition.json

"$program" estimate --left "$footage/left.mp4" --right "$footage/right.mp4" --frames 20 --overlay frame.png --json \
  --quiet >estimate.json

"$program" report trial --out trial.html
"$program" report estimate.json --out estimate.html
"$program" report lost --out lost.html
"$program" report still --out still.html
"$program" report none.db --out none.html
"$program" report single.db --out single.html
"$program" report batch.db --out batch.html
"$program" compare a.db b.db --by control.use --out compare.html >compare.txt
"$program" report study --out tuning.html
"$program" report steps/report.json --out steps.html
"$program" report vehicle/report.json --out vehicle.html
# ten thousand trials: those of the batch over and over, each figure a little different, under the plan of so many
sed 's/seeds: 6/seeds: 1112/' plan.yaml >many.yaml
"$program" batch many.yaml --shard 1/5004 --out begun.db --quiet
python3 - batch.db many.db 10000 begun.db <<'END'
import random, shutil, sqlite3, sys
shutil.copy(sys.argv[1], sys.argv[2])
db, count = sqlite3.connect(sys.argv[2]), int(sys.argv[3])
random.seed(1)
parameters = {row[1] for row in db.execute('PRAGMA table_info(trials)') if row[2] == ''}
cursor = db.execute('SELECT * FROM trials ORDER BY trial')
names, rows = [c[0] for c in cursor.description], cursor.fetchall()
for trial in range(len(rows), count):
    row = list(rows[trial % len(rows)])
    for i, (name, value) in enumerate(zip(names, row)):
        if name == 'trial': row[i] = trial
        elif name == 'seed': row[i] = random.getrandbits(62)
        elif isinstance(value, float) and name not in parameters: row[i] = value * random.gauss(1, 0.1)
    db.execute(f'INSERT INTO trials VALUES ({",".join("?" * len(row))})', row)
db.execute('ATTACH ? AS begun', (sys.argv[4],))
for key in ('trials', 'plan', 'plan_hash'):
    db.execute('UPDATE meta SET value = (SELECT value FROM begun.meta WHERE key = ?1) WHERE key = ?1', (key,))
db.execute("UPDATE meta SET value = '0.1.0 made up' WHERE key = 'build'")
db.commit()
END
"$program" report many.db --out many.html
"$program" report gate --out gate.html
"$program" report recognition.json --out recognition.html
