#!/usr/bin/env bash
# plugins_test.sh PROGRAM FOLDER: a program with a controller and an estimator of its own (my_docking.cc) does with them
# whatever turbidock does with its own.
set -euo pipefail
# A pipe is read to its end (grep without -q): a program whose reader has left fails.
program=$(realpath "$1")
folder=$(realpath -m "$2")
rm -rf "$folder"
mkdir -p "$folder"
cd "$folder"
quick=(--set estimator.pose_source=true_pose --set control.use=damped_p)

"$program" list keys | grep 'damped_p.gain_newton_per_m' >/dev/null
"$program" run pool_active "${quick[@]}" --seed 3 --out run --expect success --quiet
grep -q 'use: damped_p' run/resolved.yaml
"$program" run run/resolved.yaml --json --quiet >again.json
cmp <(grep '"digest"' run/result.json) <(grep '"digest"' again.json)
"$program" run pool_active --set estimator.use=cautious --set trial.duration_s=1 --json --quiet | grep '"cautious"' >/dev/null
if "$program" run pool_active --set control.damped_p.gain=3 2>error.txt; then exit 1; fi
grep -q 'did you mean gain_newton_per_m' error.txt

"$program" batch smoke "${quick[@]}" --seeds 3 --workers 2 --out batch.db --quiet
"$program" replay batch.db 0 --out replay --no-video --quiet
"$program" report batch.db --out batch.html
"$program" step-response pool_active --set control.use=damped_p --axis y --json --quiet | grep damped_p >/dev/null
cat >cells.yaml <<'CELLS'
schema_version: 1
scenario: pool_active
set: {trial.scene: tank_active.xml, cameras.optics: published, start: {lateral_m: 0, vertical_m: 0, heading_rad: 0, distance_min_m: 0.6, distance_max_m: 0.6}}
grid: {water.milk_ml_m3: [0]}
CELLS
"$program" recognize cells.yaml --set estimator.use=cautious --set estimator.cautious.largest_jump_m=0.2 --seconds 0.2 --json --quiet | grep '"right": 1' >/dev/null

cat >gate.yaml <<'GATE'
schema_version: 1
description: damped_p in the pool
scenario: pool_active
set: {estimator.pose_source: true_pose, control.use: damped_p}
seeds: 20
gate: {baseline: gate.baseline.yaml, margins: {success_rate: 0.4}}
GATE
"$program" gate gate.yaml --update --workers 2 --quiet
"$program" gate gate.yaml --workers 2 --quiet --out gate

cat >study.yaml <<'STUDY'
schema_version: 1
description: damped_p in the pool
scenario: pool_active
set: {control.use: damped_p, estimator.pose_source: true_pose, trial.duration_s: 20}
seeds: 2
tuning:
  gains:
    - {key: control.damped_p.gain_newton_per_m, low: 10, high: 160, scale: log}
  objective:
    - {metric: time_s, weight: 1, failed: 60}
  optimiser: {population: 5, generations: 1}
  proof: {held_out_seeds: 2, cameras: false}
STUDY
"$program" tune study.yaml --out tune --workers 2 --quiet
grep -q 'use: damped_p' tune/gains.yaml
echo "a controller and an estimator of one's own: run, batch, replay, report, step-response, recognize, gate, tune"
