#!/usr/bin/env bash
# make_pictures.sh PROGRAM FOLDER PICTURES: the pictures of the pages in assets/pictures. Runs what they show in
# FOLDER (some five minutes on two quiet cores; what is there already is not run again) and takes them in Chromium.
set -euo pipefail
program=$(realpath "$1") here=$(realpath "$(dirname "$0")")
mkdir -p "$2" "$3"
pictures=$(realpath "$3")
cd "$2"

# Without cameras: a tenth of a second a trial.
cat >currents.yaml <<'END'
schema_version: 1
description: docking at night over current, three controllers
scenario: sea_night_active
seeds: 20
series_every_frames: 6
set: {estimator.pose_source: true_pose, trial.duration_s: 60}
grid:
  sea.current.surface_velocity_mps[1]: [0, 0.05, 0.1, 0.15, 0.2]
  control.use: [p_voltage, pid, lqg]
random:
  start.heading_rad: {uniform: [0, 0.4]}
END
sed 's/^description: .*/description: docking at night over current/; s/seeds: 20/seeds: 8/; /control.use:/d' currents.yaml >laws.yaml
cat >cells.yaml <<'END'
schema_version: 1
description: both markers over milk and distance
set: {cameras.optics: published, start: {lateral_m: 0, vertical_m: 0, heading_rad: 0}}
cases:
  active 400 mm: {scenario: pool_active, trial.scene: tank_active.xml, start.distance_min_m: 0.4, start.distance_max_m: 0.4}
  active 600 mm: {scenario: pool_active, trial.scene: tank_active.xml, start.distance_min_m: 0.6, start.distance_max_m: 0.6}
  active 1000 mm: {scenario: pool_active, trial.scene: tank_active.xml, start.distance_min_m: 1, start.distance_max_m: 1}
  passive 400 mm: {scenario: pool_passive, trial.scene: tank_passive.xml, start.distance_min_m: 0.4, start.distance_max_m: 0.4}
  passive 600 mm: {scenario: pool_passive, trial.scene: tank_passive.xml, start.distance_min_m: 0.6, start.distance_max_m: 0.6}
  passive 1000 mm: {scenario: pool_passive, trial.scene: tank_passive.xml, start.distance_min_m: 1, start.distance_max_m: 1}
grid: {water.milk_ml_m3: [0, 20, 40, 60, 80, 120, 200]}
END

cat >gate.yaml <<'END'
schema_version: 1
description: docking at night, a heavier vehicle
scenario: sea_night_active
set: {estimator.pose_source: true_pose}
seeds: 60
cases: {calm: {}, moderate sea: {sea.state: moderate}}
gate: {baseline: gate.baseline.yaml, alpha: 0.05, beta: 0.1, margins: {success_rate: 0.2, time_s: 4}}
END

[ -e trial/report.html ] || "$program" run sea_night_active --out trial --video --report --quiet
"$program" batch currents.yaml --out currents.db --quiet
"$program" batch laws.yaml --set control.use=p_voltage --out p_voltage.db --quiet
"$program" batch laws.yaml --set control.use=lqg --out lqg.db --quiet
[ -e study/report.html ] || "$program" tune tryout --out study --quiet >/dev/null
[ -e gate.baseline.yaml ] || "$program" gate gate.yaml --update --quiet
[ -e gate/report.html ] || "$program" gate gate.yaml --set vehicle.rigid_body.mass_kg=15.35 --bundles 2 --out gate --quiet || [ $? = 1 ]
[ -e cells.json ] || {
  "$program" recognize cells.yaml --seconds 0.5 --json --quiet >cells.part
  mv cells.part cells.json
}

"$program" report trial --out trial.html
"$program" report currents.db --out batch.html
"$program" compare p_voltage.db lqg.db --by 'sea.current.surface_velocity_mps[1]' --out compare.html >compare.txt
"$program" report study --out tuning.html
"$program" report gate --out gate.html
"$program" report cells.json --out recognition.html
PROGRAM=$program node "$here/take_pictures.mjs" . "$pictures"
