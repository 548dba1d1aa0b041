#!/usr/bin/env bash
# Does the gate judge truthfully? Plants four regressions, lets the gate judge each, and measures
# each on other seeds in a long run: a regression that really lowers success must fail, one that does
# not must pass. Prints both side by side.
#
#   experiments/gates/planted_regressions.sh [SEEDS_OF_THE_LONG_RUN] [WORKERS]
set -euo pipefail
cd "$(dirname "$0")/../.."
seeds=${1:-200} workers=${2:-2}
gates=experiments/gates out=out/planted
turbidock=build/bin/turbidock
mkdir -p "$out"

# a gate, a name, what is planted
p_gains=(controller=p_voltage duration_s=60)
thrust=("vehicle.thrusters.effectiveness=[0.6, 0.6, 0.6, 0.6]")
delay=(camera_delay_frames=4)
hue=(marker_may_differ=true marker.balls.0.hue_rad=2.618 marker.balls.1.hue_rad=0.5236
  marker.balls.2.hue_rad=4.7124)
drag=("vehicle.hydrodynamics.linear_damping_diagonal=[10, 12, 16, 0.2, 0.3, 0.14]"
  "vehicle.hydrodynamics.quadratic_damping_diagonal=[110, 180, 140, 0.2, 0.3, 0.4]")

sets() { for assignment in "$@"; do printf '%s\0' --set "$assignment"; done; }

# long_run NAME ASSIGNMENT...: trials of $seeds seeds that the gate does not use
long_run() {
  local name=$1 set=() ; shift
  if [ $# -gt 0 ]; then mapfile -d '' set < <(sets "$@"); fi
  "$turbidock" batch "$gates/long_run.yaml" --seeds "$seeds" --workers "$workers" \
    --out "$out/$name.db" --quiet "${set[@]}"
}

# judge GATE BASE NAME ASSIGNMENT...
judge() {
  local gate=$1 base=$2 name=$3 base_set=() set=() verdict=pass code=0; shift 3
  if [ "$base" = p_gains ]; then base_set=("${p_gains[@]}"); fi
  mapfile -d '' set < <(sets "$@")
  "$turbidock" gate "$gates/$gate.yaml" --baseline "$out/$gate.baseline.yaml" \
    --workers "$workers" --out "$out/$name" --bundles 0 --quiet "${set[@]}" || code=$?
  case $code in 0) ;; 1) verdict=fail ;; 3) verdict=inconclusive ;; *) exit "$code" ;; esac
  long_run "$name" "${base_set[@]}" "$@"
  echo "== $name: the gate says $verdict"
  "$turbidock" compare "$out/$base.db" "$out/$name.db" --figure "$out/$name.png" |
    grep -v -E '^  (lost|gained)'
}

for gate in planted_regressions planted_regressions_p; do
  if [ ! -f "$out/$gate.baseline.yaml" ]; then
    "$turbidock" gate "$gates/$gate.yaml" --baseline "$out/$gate.baseline.yaml" --update \
      --workers "$workers"
  fi
done
long_run as_is
long_run p_gains "${p_gains[@]}"
judge planted_regressions as_is thrust_less_40_percent "${thrust[@]}"
judge planted_regressions as_is camera_delay_3_frames_more "${delay[@]}"
judge planted_regressions as_is hue_shifted_30_degrees "${hue[@]}"
judge planted_regressions_p p_gains drag_doubled_with_p_gains "${drag[@]}"
