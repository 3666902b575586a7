#!/usr/bin/env bash
# Bakes a project on three Slurm nodes of this machine, kills one in the middle, and holds what comes out against one
# machine's. Run it manually, as root, with slurm-wlm, munge and ninja-build installed:
#   scripts/slurm/try.sh [FOLDER-OF-PROGRAMS]      (default: build/release/bin)
# Everything is in a folder under /tmp that is removed, and ends with the script.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
bin=$(cd "${1:-$root/build/release/bin}" && pwd)
PATH=$bin:/usr/sbin:$PATH
work=$(mktemp -d /tmp/modar-slurm-XXXXXX)
chmod 755 "$work"
pids=()
stop() {
  kill -9 "${pids[@]}" 2>/dev/null || true
  for pid in "$work"/node*.pid; do [ ! -s "$pid" ] || kill -9 "$(cat "$pid")" 2>/dev/null || true; done
  rm -rf "$work"
}
trap stop EXIT
say() { printf '%-58s %s\n' "$1" "$2"; }
now() { date +%s.%N; }
since() { echo "$(now) - $1" | bc; }

# --- Munge, a controller and three nodes on loopback, with keys and sockets of their own ---
mkdir -p "$work"/{munge,state,spool}
chmod 700 "$work/munge"
head -c 128 /dev/urandom >"$work/munge/key"
chmod 400 "$work/munge/key"
munged --force --foreground --key-file="$work/munge/key" --socket="$work/munge.socket" --pid-file="$work/munge/pid" \
  --log-file="$work/munge/log" --seed-file="$work/munge/seed" >"$work/munge.out" 2>&1 & pids+=($!)
cat >"$work/slurm.conf" <<END
ClusterName=modar
SlurmctldHost=localhost(127.0.0.1)
SlurmctldPort=26817
AuthType=auth/munge
AuthInfo=socket=$work/munge.socket
CryptoType=crypto/munge
SlurmUser=root
SlurmdUser=root
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool/%n
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/%n.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/builtin
MpiDefault=none
ReturnToService=2
SlurmdTimeout=10
KillWait=2
InactiveLimit=0
NodeName=node[1-3] NodeHostname=localhost NodeAddr=127.0.0.1 Port=[26821-26823] CPUs=2 RealMemory=1000 State=UNKNOWN
PartitionName=all Nodes=node[1-3] Default=YES MaxTime=INFINITE State=UP
END
export SLURM_CONF=$work/slurm.conf
slurmctld -D -f "$SLURM_CONF" >"$work/controller.out" 2>&1 & pids+=($!)
for node in 1 2 3; do
  mkdir -p "$work/spool/node$node"
  slurmd -D -N "node$node" -f "$SLURM_CONF" >"$work/node$node.out" 2>&1 & pids+=($!)
done
for _ in $(seq 60); do
  [ "$(sinfo -h -t idle -o %D 2>/dev/null || true)" != 3 ] || break
  sleep 0.5
done
disown -a  # the shell does not report their end
[ "$(sinfo -h -t idle -o %D)" = 3 ] || { echo "the nodes did not come up:" >&2; tail -n 5 "$work"/*.log >&2; exit 4; }

# --- Projects ---
# A wavy surface each, N by N squares, another for each number.
model() {
  awk -v n="$1" -v k="$2" 'BEGIN {
    for (y = 0; y <= n; y++) for (x = 0; x <= n; x++) printf "v %g %g %g\n", x, y, 2 * sin(x * (k + 3) / 40) * cos(y / 7)
    for (y = 0; y < n; y++) for (x = 0; x < n; x++) {
      a = y * (n + 1) + x + 1; printf "f %d %d %d %d\n", a, a + 1, a + n + 2, a + n + 1 } }'
}
project() {  # FOLDER COUNT SIDE
  mkdir -p "$1/models"
  for k in $(seq "$2"); do model "$3" "$k" >"$1/models/m$k.obj"; done
  printf '[[model]]\nfile = "models/*.obj"\n' >"$1/modar.toml"
}
project "$work/one" 24 120
cp -r "$work/one" "$work/many"

start=$(now)
(cd "$work/one" && modar bake --quiet)
say "24 assets on one machine" "$(since "$start") s"

# --- Three nodes, one of them killed in the middle ---
cd "$work/many"
modar plan --ninja --run 'srun -Q -n1' --cache "$work/cache" >build.ninja
start=$(now)
ninja -j 6 -k 0 >ninja.log 2>&1 & ninja=$!
until [ "$(find .modar/plan -type f ! -name '*.d' 2>/dev/null | wc -l)" -ge 6 ]; do sleep 0.1; done
# First the bakes of node2, as soon as it has one: theirs is an environment of this cluster that names the node. A bake that is
# killed is an edge that fails, whatever the moment. Then its daemon.
killed=0
while [ $killed = 0 ] && kill -0 "$ninja" 2>/dev/null; do
  for pid in $(pgrep -x modar); do
    environment=$({ tr '\0' '\n' <"/proc/$pid/environ"; } 2>/dev/null || true)
    if grep -qx "SLURM_CONF=$SLURM_CONF" <<<"$environment" && grep -qx SLURMD_NODENAME=node2 <<<"$environment" &&
      kill -9 "$pid" 2>/dev/null; then
      killed=$((killed + 1))
    fi
  done
done
[ $killed -gt 0 ] || { echo "try.sh: node2 was given no bake" >&2; exit 4; }
kill -9 "$(cat "$work/node2.pid")"
scontrol update nodename=node2 state=down reason=killed
wait "$ninja" && first=0 || first=$?
failed=$(grep -c '^FAILED' ninja.log || true)
[ "$first" = 0 ] || ninja -j 4 >>ninja.log 2>&1
say "24 assets on three nodes, one killed after 6" "$(since "$start") s, $killed processes killed, $failed edges ran again"
[ "$failed" -gt 0 ]
cmp out/*.modar "$work"/one/out/*.modar
say "the same bytes as one machine" "yes"
modar cache verify --cache "$work/cache" --json >verify.json
grep -q '"damaged": \[\]' verify.json
say "cache: $(sed -n 's/.*"entries": \([0-9]*\).*/\1/p' verify.json) entries, none damaged" "yes"
ninja -j 4 | grep -q 'no work to do'
say "a second run" "no work to do"

# --- Large collections again ---
for count in 400 1000; do
  project "$work/large$count" $count 4
  cd "$work/large$count"
  modar bake --quiet
  start=$(now)
  modar bake --json --quiet >again.json
  seconds=$(since "$start")
  [ "$(grep -c '"state": "fresh"' again.json)" = $count ]
  say "$count assets again, 0 baked" "$seconds s"
done
cd "$work/large1000"
modar plan --ninja >build.ninja
ninja >/dev/null
start=$(now)
ninja | grep -q 'no work to do'
say "1000 assets again by ninja, 0 baked" "$(since "$start") s"
