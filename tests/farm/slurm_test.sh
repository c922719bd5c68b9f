#!/bin/sh
# slurm_test.sh SYNTH BATCH.SBATCH [LINES]: a real one-node Slurm of its own; a task's process is killed and requeued, and
# nothing may be lost or made twice. 77 where Slurm is not there or this is not root.
set -u
synth=$1
script=$2
lines=${3:-160}
tasks=8
for program in munged slurmctld slurmd sbatch scontrol squeue; do
  command -v "$program" >/dev/null 2>&1 || PATH=$PATH:/usr/sbin
  if ! command -v "$program" >/dev/null 2>&1; then
    echo "skipped: no $program; get it with: sudo apt-get install slurm-wlm munge"
    exit 77
  fi
done
if [ "$(id -u)" != 0 ]; then
  echo "skipped: only root can start slurmd"
  exit 77
fi
share=$(dirname "$synth")/../share/mouthpiece
if [ ! -f "$share/sample.corpus" ]; then
  echo "skipped: no sample corpus; make it with: make data"
  exit 77
fi

work=$(mktemp -d)
pids=
finish() {
  for pid in $pids; do kill "$pid" 2>/dev/null; done
  sleep 1
  for pid in $pids; do kill -9 "$pid" 2>/dev/null; done
  rm -rf "$work"
}
trap finish EXIT
fail() {
  echo "FAILED: $*"
  tail -n 15 "$work"/*.log 2>/dev/null
  exit 1
}

# Its own ports, socket and state: another Slurm on this machine is not touched.
host=$(hostname -s)
head -c 1024 /dev/urandom >"$work/munge.key"
chmod 400 "$work/munge.key"
munged --foreground --force --key-file="$work/munge.key" --socket="$work/munge.sock" --pid-file="$work/munged.pid" \
  --log-file="$work/munged.log" --seed-file="$work/munge.seed" 2>"$work/munged.err.log" &
pids="$pids $!"
mkdir "$work/state" "$work/spool"
cat >"$work/slurm.conf" <<CONF
ClusterName=mouthpiece
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=16817
SlurmdPort=16818
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
# A requeued task waits as long as a credential lives, by default two minutes.
AuthInfo=socket=$work/munge.sock,cred_expire=10
CredType=cred/munge
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerType=sched/builtin
# What is requeued is looked at once a minute otherwise.
SchedulerParameters=sched_interval=2
MpiDefault=none
ReturnToService=2
NodeName=$host NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP OverSubscribe=NO
CONF
export SLURM_CONF="$work/slurm.conf"
for _ in 1 2 3 4 5 6 7 8 9 10; do [ -S "$work/munge.sock" ] && break; sleep 0.5; done
# Daemons that this machine's sandbox does not let run tell nothing of the script.
cannot() {
  echo "skipped: $*"
  tail -n 5 "$work"/*.log 2>/dev/null
  exit 77
}
[ -S "$work/munge.sock" ] || cannot "munged does not start here"
slurmctld -D 2>"$work/slurmctld.err.log" &
pids="$pids $!"
sleep 1
cpus=$(nproc)
slurmd -D -N "$host" 2>"$work/slurmd.err.log" &
pids="$pids $!"
for _ in $(seq 60); do scontrol show node "$host" 2>/dev/null | grep -q "State=IDLE" && break; sleep 0.5; done
if ! scontrol show node "$host" 2>/dev/null | grep -q "State=IDLE"; then
  [ "$cpus" -lt 2 ] && cannot "one processor alone"
  scontrol show node "$host" 2>&1 | head -n 20
  cannot "Slurm's node does not come up here"
fi

{
  echo "text,id,scene"
  i=0
  while [ "$i" -lt "$lines" ]; do
    i=$((i + 1))
    echo "the time is now just after $((1 + i % 11)) in the morning,line$i,s$((i % 5))"
  done
} >"$work/lines.csv"
cd "$work" || exit 1
out=$work/out
MOUTHPIECE_SYNTH=$synth sbatch --parsable --array=1-$tasks --output="$work/task-%a.log" "$script" "$work/lines.csv" "$out" \
  --format arkit.csv --voice flite:slt --fps 24 >"$work/job" || fail "sbatch refuses the script"
job=$(cat "$work/job")

# Kill a task's process in the middle of its work, as a node that dies does.
victim=
for _ in $(seq 600); do
  done_now=$(grep -c '}' "$out/manifest.2-of-$tasks.journal" 2>/dev/null || true)
  if [ "${done_now:-0}" -ge 5 ]; then
    victim=$(pgrep -f -- "batch $work/lines.csv .*--shard 2/$tasks" | head -n 1)
    [ -n "$victim" ] && kill -9 "$victim" && break
  fi
  sleep 0.1
done
[ -n "$victim" ] || fail "task 2 was never seen at work"
made_before=$(ls "$out"/*.arkit.csv | wc -l)
ls --full-time "$out"/*.arkit.csv | awk '{print $9, $7}' | sort >"$work/before"
for _ in $(seq 100); do
  state=$(scontrol show job "${job}_2" 2>/dev/null | grep -o "JobState=[A-Z]*")
  case $state in JobState=FAILED | JobState=COMPLETED | JobState=CANCELLED) break ;; esac
  sleep 0.2
done
scontrol requeue "${job}_2" || fail "task 2 cannot be requeued ($state)"
for _ in $(seq 1500); do
  [ -z "$(squeue -h -j "$job" 2>/dev/null)" ] && break
  sleep 0.2
done
[ -z "$(squeue -h -j "$job" 2>/dev/null)" ] || fail "the job does not end"

"$synth" merge "$out" >"$work/merged" || fail "merge: $(cat "$work/merged")"
cat "$work/merged"
grep -q "^$tasks manifests: $lines of $lines lines made, 0 failed, 0 missing, 0 in two manifests" "$work/merged" ||
  fail "something is lost or made twice"
[ "$(ls "$out"/*.arkit.csv | wc -l)" = "$lines" ] || fail "not every file is there"
# What was made before the kill was not made again, but for the two lines that may have been under way.
ls --full-time "$out"/*.arkit.csv | awk '{print $9, $7}' | sort >"$work/after"
kept=$(comm -12 "$work/before" "$work/after" | wc -l)
[ "$kept" -ge $((made_before - 2)) ] || fail "$kept of $made_before files kept their times"
[ -z "$(find "$out" -name '*.tmp*' -o -name '*.journal')" ] || fail "leftovers: $(ls "$out" | grep -v csv)"
echo "$lines lines, $tasks tasks, killed after $made_before files: $kept of them kept"
