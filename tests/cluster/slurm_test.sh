#!/usr/bin/env bash
# A batch on a real Slurm cluster of one node, this machine, started for the test: the array's merged result
# must equal the same plan run without Slurm. Needs root (or sudo without a password) and the packages slurm-wlm
# and munge. Where the daemons cannot start the test fails and says why.
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
SlurmdPort=$((port + 1))
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
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
SchedulerParameters=sched_interval=1,batch_sched_delay=0
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=main Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$folder/slurm.conf
slurmctld -D -i >"$folder/slurmctld.out.log" 2>&1 &
pids+=($!)
slurmd -D >"$folder/slurmd.out.log" 2>&1 &
pids+=($!)
node_is_idle() { sinfo -h -o %T | grep -qx idle; }
wait_for 60 "the node does not become idle" node_is_idle

# --------------------------------------------------------------------------------------- the batch
cat >"$folder/tiny.yaml" <<'PLAN'
schema_version: 1
description: tiny trials
seeds: 4
set: {duration_s: 0.1}
grid: {scenario: [pool_active, sea_night_passive]}
random: {water.milk_ml_m3: {uniform: [0, 30]}}
PLAN
out="$folder/my results.db"  # a space is no trouble
"$turbidock" slurm "$folder/tiny.yaml" --tasks 3 --out "$out" --sbatch=--time=10 --submit ||
  fail "turbidock slurm --submit"
queue_is_empty() { [ -z "$(squeue -h)" ]; }
wait_for 300 "the jobs do not end" queue_is_empty
[ -f "$out" ] || fail "the merge job left no file"
"$turbidock" batch "$folder/tiny.yaml" --out "$folder/alone.db" --quiet || fail "turbidock batch"
"$turbidock" export "$out" >"$folder/slurm.csv" || fail "turbidock export"
"$turbidock" export "$folder/alone.db" >"$folder/alone.csv" || fail "turbidock export"
[ "$(wc -l <"$folder/alone.csv")" = 9 ] || fail "8 trials make 9 lines"
cmp "$folder/slurm.csv" "$folder/alone.csv" || fail "the array's rows are not those of one process"
echo "8 trials in an array of 3 tasks, merged: the same rows as in one process"
