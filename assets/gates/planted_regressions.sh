#!/usr/bin/env bash
# Does the gate judge truthfully? Plants four regressions, lets the gate judge each, and measures
# each on other seeds in a long run: a regression that really lowers success must fail, one that does
# not must pass. Prints both side by side.
#
#   assets/gates/planted_regressions.sh [SEEDS_OF_THE_LONG_RUN] [WORKERS]
set -euo pipefail
cd "$(dirname "$0")/../.."
seeds=${1:-200} workers=${2:-2}
gates=assets/gates out=out/planted
turbidock=build/bin/turbidock
mkdir -p "$out"

# a gate, a name, what is planted
thrust=("vehicle.thrusters.effectiveness=[0.6, 0.6, 0.6, 0.6]")
delay=(camera_delay_frames=4)
hue=(marker_may_differ=true marker.balls.0.hue_rad=2.618 marker.balls.1.hue_rad=0.5236
  marker.balls.2.hue_rad=4.7124)
drag=("vehicle.hydrodynamics.linear_damping_diagonal=[6, 3.5, 6.5, 0.05, 0.075, 0.4]"
  "vehicle.hydrodynamics.quadratic_damping_diagonal=[27.5, 72.5, 38, 0.05, 0.075, 0.25]")

sets() { for assignment in "$@"; do printf '%s\0' --set "$assignment"; done; }

# long_run PLAN NAME ASSIGNMENT...: trials of $seeds seeds that the gate does not use
long_run() {
  local plan=$1 name=$2 set=() ; shift 2
  if [ $# -gt 0 ]; then mapfile -d '' set < <(sets "$@"); fi
  "$turbidock" batch "$gates/$plan.yaml" --seeds "$seeds" --workers "$workers" \
    --out "$out/$name.db" --quiet "${set[@]}"
}

# judge GATE PLAN NAME ASSIGNMENT...: against the long run of PLAN as it is
judge() {
  local gate=$1 plan=$2 name=$3 set=() verdict=pass code=0; shift 3
  mapfile -d '' set < <(sets "$@")
  "$turbidock" gate "$gates/$gate.yaml" --baseline "$out/$gate.baseline.yaml" \
    --workers "$workers" --out "$out/$name" --bundles 0 --quiet "${set[@]}" || code=$?
  case $code in 0) ;; 1) verdict=fail ;; 3) verdict=inconclusive ;; *) exit "$code" ;; esac
  long_run "$plan" "$name" "$@"
  echo "== $name: the gate says $verdict"
  "$turbidock" compare "$out/$plan.db" "$out/$name.db" --figure "$out/$name.png" |
    grep -v -E '^  (lost|gained)'
}

for gate in planted_regressions planted_regressions_p; do
  if [ ! -f "$out/$gate.baseline.yaml" ]; then
    "$turbidock" gate "$gates/$gate.yaml" --baseline "$out/$gate.baseline.yaml" --update \
      --workers "$workers"
  fi
done
long_run long_run long_run
long_run long_run_p long_run_p
judge planted_regressions long_run thrust_less_40_percent "${thrust[@]}"
judge planted_regressions long_run camera_delay_3_frames_more "${delay[@]}"
judge planted_regressions long_run hue_shifted_30_degrees "${hue[@]}"
judge planted_regressions_p long_run_p drag_halved_with_p_gains "${drag[@]}"
