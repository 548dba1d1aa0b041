#!/usr/bin/env bash
# Long commands on a real Slurm cluster, started for the test: three nodes on this machine. What comes out must
# equal what comes out without Slurm, whatever happens to a node, a task or the controller meanwhile. Needs root
# (or sudo without a password) and the packages slurm-wlm and munge. Where the daemons cannot start the test
# fails and says why.
#
#   slurm_test.sh PATH/TO/turbidock
set -uo pipefail

turbidock=$(realpath "$1")
if [ "$(id -u)" != 0 ]; then exec sudo -n "$0" "$turbidock"; fi
folder=$(mktemp -d /tmp/turbidock_slurm.XXXXXX)
chmod 755 "$folder"
pids=()

finish() {
  for pid in "${pids[@]}"; do kill "$pid" 2>/dev/null; done
  for pid in "${pids[@]}"; do wait "$pid" 2>/dev/null; done
  rm -rf "$folder"
}
trap finish EXIT

fail() {
  echo "FAILED: $1"
  for log in "$folder"/*.log "$folder"/*/*.log; do
    [ -s "$log" ] && echo "--- $log" && tail -n 15 "$log"
  done
  exit 1
}

# wait_for SECONDS WHAT COMMAND...: until the command succeeds.
wait_for() {
  local deadline=$((SECONDS + $1)) what=$2
  shift 2
  until "$@" >/dev/null 2>&1; do
    [ $SECONDS -lt $deadline ] || fail "$what"
    sleep 0.2
  done
}

for program in munged slurmctld slurmd sbatch sinfo squeue; do
  PATH=$PATH:/usr/sbin command -v $program >/dev/null ||
    fail "$program is missing: install the packages slurm-wlm and munge"
done
export PATH=$PATH:/usr/sbin

# ------------------------------------------------------------------------------------- the cluster
mkdir "$folder"/{munge,state,spool}
dd if=/dev/urandom of="$folder/munge/key" bs=128 count=1 status=none
chown -R munge: "$folder/munge"
chmod 400 "$folder/munge/key"
chmod 755 "$folder/munge"
socket=$folder/munge/socket
setpriv --reuid munge --regid munge --clear-groups munged --foreground --key-file "$folder/munge/key" \
  --socket "$socket" --pid-file "$folder/munge/pid" --log-file "$folder/munge/munged.log" \
  --seed-file "$folder/munge/seed" >"$folder/munge.log" 2>&1 &
pids+=($!)
wait_for 20 "munged does not start" test -S "$socket"

host=$(hostname -s)
port=$((20000 + $$ % 10000))
cat >"$folder/slurm.conf" <<CONF
ClusterName=test
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$socket
CredType=cred/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
MpiDefault=none
ReturnToService=2
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool/%n
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/%n.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/%n.log
SlurmdParameters=config_overrides
SlurmdTimeout=10
SlurmctldTimeout=10
SchedulerParameters=sched_interval=1,batch_sched_delay=0
NodeName=n[1-3] NodeHostname=$host NodeAddr=127.0.0.1 Port=[$((port + 1))-$((port + 3))] CPUs=1 State=UNKNOWN
PartitionName=main Nodes=n[1-3] Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$folder/slurm.conf
start_controller() {  # with -i: as if there had been none before
  slurmctld -D "$@" >>"$folder/slurmctld.out.log" 2>&1 &
  controller=$!
  pids+=($!)
}
declare -A node_pid
start_node() {
  mkdir -p "$folder/spool/$1"
  slurmd -D -N "$1" >>"$folder/$1.out.log" 2>&1 &
  node_pid[$1]=$!
  pids+=($!)
}
start_controller -i
for node in n1 n2 n3; do start_node $node; done
nodes_are_idle() { [ "$(sinfo -h -N -o %T | grep -cx idle)" = 3 ]; }
wait_for 60 "the nodes do not become idle" nodes_are_idle

# What runs on a node, by the environment that Slurm gives it.
processes_of() {
  local process
  for process in /proc/[0-9]*; do
    if grep -qzx "SLURMD_NODENAME=$1" "$process/environ" 2>/dev/null &&
      grep -qzx "SLURM_CONF=$SLURM_CONF" "$process/environ" 2>/dev/null; then basename "$process"; fi
  done
}

# catch_task NODE RESULTS: stops a task there that has at least so many results, but not all, so that what comes
# next meets it in mid-flight however slow this machine is. Tasks live for a tenth of a second and more: it looks
# all the time, at one after the other.
catch_task() {
  local deadline=$((SECONDS + 120)) process words jobs results
  while [ $SECONDS -lt $deadline ]; do
    for process in $(pgrep -f "slurm-task $folder/"); do
      grep -qzx "SLURMD_NODENAME=$1" "/proc/$process/environ" || continue
      mapfile -d '' words <"/proc/$process/cmdline"  # turbidock slurm-task FOLDER --task K --workers N
      kill -STOP "$process" || continue
      caught=$(processes_of "$1")  # all of it: the task, or one of its workers, is what was stopped
      kill -STOP $caught
      jobs=$(($(wc -l <"${words[2]}/jobs-${words[4]}.jsonl") - 1))
      results=$(find "${words[2]}" -name "result-${words[4]}-*.json" | wc -l)
      [ "$results" -ge "$2" ] && [ "$results" -lt "$jobs" ] && return 0
      kill -CONT $caught
    done
  done 2>/dev/null
  fail "no task on node $1 caught in mid-flight"
}

# As if somebody had pulled the plug.
lose_node() {
  local process parent
  { kill -9 "${node_pid[$1]}" && wait "${node_pid[$1]}"; } 2>/dev/null
  for process in $(processes_of "$1"); do
    parent=$(awk '{print $4}' "/proc/$process/stat" 2>/dev/null)
    if [ "$(cat "/proc/$parent/comm" 2>/dev/null)" = slurmstepd ]; then kill -9 "$parent"; fi
    kill -9 "$process" 2>/dev/null
  done
}

queue_is_empty() { local jobs && jobs=$(squeue -h) && [ -z "$jobs" ]; }

# ------------------------------------------------------------------- commands that wait for their tasks
# without cameras: a tenth of a second a trial
cat >"$folder/plan.yaml" <<'PLAN'
schema_version: 1
description: over current
scenario: sea_night_active
seeds: 40
set: {estimator.pose_source: true_pose, trial.duration_s: 60, control.use: pid}
grid: {"sea.current.surface_velocity_mps[1]": [0, 0.1]}
PLAN
cat >"$folder/study.yaml" <<'STUDY'
schema_version: 1
description: two gains
scenario: sea_night_active
seeds: 12
set: {estimator.pose_source: true_pose, control.use: lqg, trial.duration_s: 60}
tuning:
  gains:
    - {key: control.lqg.sway.effort_share, low: 0.1, high: 2, scale: log}
    - {key: control.lqg.yaw.error_rad, low: 0.02, high: 0.3, scale: log}
  objective:
    - {metric: time_s, weight: 1, failed: 60}
  success_at_least: 0.5
  optimiser: {population: 6, generations: 3}
  proof: {held_out_seeds: 12, cameras: false}
STUDY
cat >"$folder/search.yaml" <<'SEARCH'
schema_version: 1
description: the current in which it docks
scenario: sea_night_active
set: {estimator.pose_source: true_pose, trial.duration_s: 60, control.use: pid}
ranges: {"sea.current.surface_velocity_mps[1]": {from: 0, to: 0.3, success: falls}}
find: {rate: 0.9, width: 0.15}
SEARCH
cat >"$folder/gate.yaml" <<'GATE'
schema_version: 1
description: a calm and a moderate sea
scenario: sea_night_active
set: {estimator.pose_source: true_pose}
seeds: 40
cases: {calm: {}, moderate: {sea.state: moderate}}
gate: {baseline: gate.baseline.yaml, margins: {success_rate: 0.2}}
GATE

# on_slurm NAME ARGUMENTS...: the program in the background, three tasks at a time; its words in NAME.said.log
on_slurm() {
  local name=$1
  shift
  "$turbidock" "$@" --slurm 3 --sbatch=--time=10 >"$folder/$name.out" 2>"$folder/$name.said.log" &
  running=$!
  began=$(date +%s.%N)
}
# ends NAME CODE: its exit code, and nothing left behind.
ends() {
  wait "$running"
  local code=$?
  took=$(awk -v a="$began" -v b="$(date +%s.%N)" 'BEGIN {printf "%.1f", b - a}')
  [ $code = "$2" ] || fail "$1 ended with $code, not $2"
  wait_for 60 "$1 leaves jobs" queue_is_empty
}
same() { cmp "$1" "$2" || fail "$3: not what comes out on one machine"; }
rows_of() { python3 -c 'import sqlite3, sys
print(*sqlite3.connect(sys.argv[1]).execute("SELECT * FROM results ORDER BY trial"), sep="\n")' "$1"; }

began=$(date +%s.%N)
"$turbidock" batch "$folder/plan.yaml" --out "$folder/batch_alone.db" --quiet --workers 2 || fail "turbidock batch"
alone_s=$(awk -v a="$began" -v b="$(date +%s.%N)" 'BEGIN {printf "%.1f", b - a}')
rows_of "$folder/batch_alone.db" >"$folder/batch_alone.csv"
[ "$(wc -l <"$folder/batch_alone.csv")" = 80 ] || fail "80 trials make 80 lines"
on_slurm batch batch "$folder/plan.yaml" --out "$folder/batch.db"
ends batch 0
rows_of "$folder/batch.db" >"$folder/batch.csv"
same "$folder/batch.csv" "$folder/batch_alone.csv" "batch --slurm"
[ ! -e "$folder/batch.db.slurm" ] || fail "batch --slurm leaves its folder"
echo "batch: 80 trials as on one machine, digest by digest ($took s; two processes alone $alone_s s)"

# a search, whose next trials follow from those before
"$turbidock" batch "$folder/search.yaml" --out "$folder/search_alone.db" --quiet --workers 2 >"$folder/search_alone.out" ||
  fail "a search"
on_slurm search batch "$folder/search.yaml" --out "$folder/search.db"
catch_task n1 0
kill -CONT $caught
ends search 0
for name in search search_alone; do rows_of "$folder/$name.db" >"$folder/$name.csv"; done
sed -i 's/search_alone/search/g' "$folder/search_alone.out"
same "$folder/search.csv" "$folder/search_alone.csv" "a search with --slurm"
same "$folder/search.out" "$folder/search_alone.out" "the boundary of a search with --slurm"
echo "batch: a search's $(wc -l <"$folder/search.csv") trials and boundary as on one machine ($took s)"

# a node is lost while it works
"$turbidock" tune "$folder/study.yaml" --out "$folder/study_alone" --quiet --workers 2 >/dev/null || fail "turbidock tune"
on_slurm study tune "$folder/study.yaml" --out "$folder/study"
catch_task n2 0
lose_node n2
ends study 0
grep -q 'submitted again' "$folder/study.said.log" || fail "tune --slurm does not say that tasks were lost"
for file in gains.yaml report.json; do
  same "$folder/study/$file" "$folder/study_alone/$file" "tune --slurm with a lost node"
done
rows_of "$folder/study/evaluations.sqlite" >"$folder/study.csv"
rows_of "$folder/study_alone/evaluations.sqlite" >"$folder/study_alone.csv"
same "$folder/study.csv" "$folder/study_alone.csv" "tune --slurm with a lost node"
echo "tune: $(wc -l <"$folder/study.csv") trials as on one machine, a node lost in mid-flight ($took s)"
start_node n2
wait_for 60 "node n2 does not come back" nodes_are_idle

# a task is cancelled, the controller is killed and comes back
"$turbidock" gate "$folder/gate.yaml" --update --quiet --workers 2 || fail "turbidock gate --update"
"$turbidock" gate "$folder/gate.yaml" --out "$folder/gate_alone" --quiet --workers 2 || fail "turbidock gate"
mv "$folder/gate.baseline.yaml" "$folder/baseline_alone.yaml"
mkdir "$folder/lost"
cd "$folder/lost" || exit 1  # where the log of the cancelled task is kept
on_slurm update gate "$folder/gate.yaml" --update
cd "$folder" || exit 1
catch_task n1 0
cancel_on_n1() { scancel "$(squeue -h -t R -w n1 -o %i | sed -n 1p)"; }
wait_for 60 "the task on node n1 cannot be cancelled" cancel_on_n1
kill -CONT $caught 2>/dev/null  # unless Slurm has ended it already
ends update 0
grep -q 'submitted again' "$folder/update.said.log" || fail "gate --slurm does not say that a task was lost"
same "$folder/gate.baseline.yaml" "$folder/baseline_alone.yaml" "gate --update --slurm with a cancelled task"
on_slurm gate gate "$folder/gate.yaml" --out "$folder/gate"
catch_task n3 0
kill -CONT $caught
{ kill -9 $controller && wait $controller; } 2>/dev/null
sleep 8
# It forgets the jobs since it last saved: a number of theirs that it gave again would have the node drained.
echo FirstJobId=1000 >>"$SLURM_CONF"
start_controller
controller_is_back() { scontrol ping | grep UP >/dev/null; }
wait_for 60 "the controller does not come back" controller_is_back
# It drains a node whose tasks ended while it was away, when it notices; a node that is not drained refuses.
keep_resuming() {
  local node
  while sleep 2; do
    for node in n1 n2 n3; do scontrol update "NodeName=$node" State=RESUME 2>/dev/null; done
  done
}
keep_resuming &
resumer=$!
pids+=($resumer)
ends gate 0
same "$folder/gate/summary.json" "$folder/gate_alone/summary.json" "gate --slurm while the controller was away"
echo "gate: baseline and verdict as on one machine, a task cancelled, the controller killed and started again"

# a task that Slurm starts again goes on where it stopped
wait_for 60 "the nodes do not become idle" nodes_are_idle
kill $resumer
on_slurm again batch "$folder/plan.yaml" --out "$folder/again.db" --sbatch=--requeue
catch_task n1 1
requeue_on_n1() { scontrol requeue "$(squeue -h -t R -w n1 -o %i | sed -n 1p)"; }
wait_for 60 "the task on node n1 cannot be requeued" requeue_on_n1
kill -CONT $caught 2>/dev/null  # unless Slurm has ended it already
ends again 0
rows_of "$folder/again.db" >"$folder/again.csv"
same "$folder/again.csv" "$folder/batch_alone.csv" "batch --slurm with a requeued task"
echo "batch: a requeued task went on ($took s, with the two minutes that Slurm makes it wait)"

# cells and sets of values instead of trials
cat >"$folder/cells.yaml" <<'CELLS'
schema_version: 1
scenario: pool_active
set: {trial.scene: tank_active.xml, cameras.optics: published, start: {lateral_m: 0, vertical_m: 0, heading_rad: 0, distance_min_m: 0.6, distance_max_m: 0.6}}
grid: {water.milk_ml_m3: [0, 40, 80]}
CELLS
cells=(recognize "$folder/cells.yaml" --seconds 0.2 --json --quiet)
"$turbidock" "${cells[@]}" >"$folder/cells_alone.json" || fail "turbidock recognize"
cd "$folder" || exit 1
on_slurm cells "${cells[@]}"
ends cells 0
same "$folder/cells.out" "$folder/cells_alone.json" "recognize --slurm"
images=(dataset "$folder/cells.yaml" --pairs-per-shard 1 --quiet)
"$turbidock" "${images[@]}" --out "$folder/images_alone" || fail "turbidock dataset"
on_slurm images "${images[@]}" --out "$folder/images"
ends images 0
diff -r "$folder/images" "$folder/images_alone" >/dev/null || fail "dataset --slurm makes other images"
printf 'milk_ml_m3,distance_mm,fitness_mean\n0,600,0.8\n60,600,0.3\n' >"$folder/table.csv"
cat >"$folder/calibration.yaml" <<'CALIBRATION'
frames: 1
cell_share: 1
parameters:
  - {key: water.scattering_scale, low: 0.55, high: 1.1, start: 0.7, source: a try-out}
  - {key: cameras.sensor.chroma_coring_dn, low: 0, high: 40, start: 20, source: a try-out}
CALIBRATION
fit=(calibrate --plan "$folder/calibration.yaml" --active "$folder/table.csv" --passive "$folder/table.csv"
  --generations 2 --json --quiet)
"$turbidock" "${fit[@]}" --out "$folder/fit_alone.yaml" >"$folder/fit_alone.json" || fail "turbidock calibrate"
grep -q '"evaluations": 13' "$folder/fit_alone.json" || fail "the start and two generations of 6 are 13 evaluations"
on_slurm fit "${fit[@]}" --out "$folder/fit.yaml"
ends fit 0
same "$folder/fit.out" "$folder/fit_alone.json" "calibrate --slurm"
same "$folder/fit.yaml" "$folder/fit_alone.yaml" "calibrate --slurm"
[ ! -e "$folder/fit.yaml.slurm" ] || fail "calibrate --slurm leaves its folder"
echo "calibrate: as on one machine ($took s)"
[ -z "$(ls -d "$folder"/turbidock-*.slurm 2>/dev/null)" ] || fail "a folder is left"
echo "recognize, dataset: as on one machine"

# What an array costs: three trials of a tenth of a second, five times, here and there.
sed 's/seeds: 40/seeds: 3/; s/trial.duration_s: 60/trial.duration_s: 0.1/; /^grid/d' "$folder/plan.yaml" >"$folder/short.yaml"
wait_for 60 "the nodes do not become idle" nodes_are_idle
seconds() {  # of five runs
  local begin i
  begin=$(date +%s.%N)
  for i in 1 2 3 4 5; do
    rm -f "$folder/short.db"
    "$turbidock" batch "$folder/short.yaml" --out "$folder/short.db" --quiet "$@" || fail "turbidock batch $*"
  done
  awk -v a="$begin" -v b="$(date +%s.%N)" 'BEGIN {print b - a}'
}
here=$(seconds --workers 2) there=$(seconds --slurm 3)
awk -v a="$here" -v b="$there" 'BEGIN {printf "an array costs %.2f s more than two processes (mean of 5)\n", (b - a) / 5}'

# ------------------------------------------------------------------------------ refused, in one line
# refused NAME CODE WORDS COMMAND...
refused() {
  local name=$1 code=$2 words=$3
  shift 3
  "$@" >/dev/null 2>"$folder/refused.said"
  local got=$?
  [ $got = "$code" ] || fail "$name: exit code $got, not $code"
  [ "$(wc -l <"$folder/refused.said")" = 1 ] || fail "$name: not one line: $(cat "$folder/refused.said")"
  grep -q "$words" "$folder/refused.said" || fail "$name: $(cat "$folder/refused.said")"
}
cat >"$folder/tiny.yaml" <<'PLAN'
schema_version: 1
description: tiny trials
scenario: pool_active
seeds: 2
set: {estimator.pose_source: true_pose, trial.duration_s: 0.1}
PLAN
tiny=(batch "$folder/tiny.yaml" --out "$folder/tiny.db" --quiet)
refused partition 4 'invalid partition' "$turbidock" "${tiny[@]}" --slurm 2 --sbatch=--partition=nowhere
refused "no cluster" 4 'sbatch' env SLURM_CONF=/nonexistent "$turbidock" "${tiny[@]}" --slurm 2
refused "no cluster to calibrate on" 4 'sbatch' env SLURM_CONF=/nonexistent "$turbidock" "${fit[@]}" --slurm 2
refused "no Slurm" 4 'slurm-client' env PATH="$folder" "$turbidock" "${tiny[@]}" --slurm 2
refused --sbatch 2 'requires --slurm' "$turbidock" "${tiny[@]}" --sbatch=--time=1
refused "tasks that cannot run" 4 'ended 3 times' "$turbidock" "${tiny[@]}" --slurm 2 --sbatch=--output=/nonexistent/log
echo "what Slurm refuses is said in one line"
