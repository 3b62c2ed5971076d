#!/usr/bin/env bash
# Runs nestrad.sbatch on a real Slurm cluster of three nodes on this machine: the same bytes as in process, with
# a node lost amid the solve too, and the exit code of a solve that fails. BIN is the folder of the programs.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
bin=$(cd "${1:-$here/../../target/debug}" && pwd)

skip() {
    echo "slurm: skipped: $*"
    exit 0
}
[ "$(id -u)" -eq 0 ] || skip 'only root can run a cluster here'
packages=(slurm-wlm munge iproute2 openssl)
if ! dpkg -s "${packages[@]}" >/dev/null 2>&1; then
    command -v apt-get >/dev/null || skip "needs Debian's packages ${packages[*]}"
    { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
        "${packages[@]}"; } >/dev/null 2>&1 || skip "cannot install ${packages[*]}"
fi
command -v slurmctld >/dev/null || skip 'no slurmctld'

work=$(mktemp -d)
export SLURM_CONF=$work/slurm.conf NESTRAD_BIN=$bin
unset NESTRAD_TOKEN
say() { printf 'slurm: %s\n' "$*"; }
fail() {
    say "FAILED: $*"
    tail -n 40 "$work"/log/*.log "$work"/*.out 2>/dev/null || true
    exit 1
}
# until CONDITION holds, for a bounded time: within SECONDS WHAT CONDITION...
within() {
    local until=$((SECONDS + $1)) what=$2
    shift 2
    until "$@"; do
        [ "$SECONDS" -lt "$until" ] || fail "no $what in time"
        sleep 0.2
    done
}
own_munged=
down() {
    scancel --user=root 2>/dev/null || true
    local pid pids=()
    for pidfile in "$work"/run/*.pid $own_munged; do
        if [ -e "$pidfile" ]; then pids+=("$(cat "$pidfile")"); fi
    done
    for pid in "${pids[@]}"; do kill "$pid" 2>/dev/null || true; done
    # what has ended has no program any more, though nobody may collect it
    for pid in "${pids[@]}"; do
        for _ in $(seq 50); do
            [ -e "/proc/$pid/exe" ] || continue 2
            sleep 0.2
        done
        kill -9 "$pid" 2>/dev/null || true
    done
    rm -rf "$work"
}
trap down EXIT
listening() { ss -Hltn "sport = :$1" | grep -q .; }
for port in 16817 17001 17002 17003; do
    ! listening $port || skip "port $port is taken: another cluster runs here"
done

# start NAME COMMAND...: a daemon of the cluster. A machine on which it does not start, for reasons that it gives
# itself, has no cluster to test on.
start() {
    local name=$1 try
    shift
    for try in 1 2 3; do
        if "$@" >>"$work/$name.start" 2>&1; then return; fi
        say "$name did not start (try $try of 3):"
        tail -n 5 "$work/$name.start"
        sleep 2
    done
    skip "$name does not start here"
}

if [ ! -e /run/munge/munge.socket.2 ] || ! munge -n </dev/null >/dev/null 2>&1; then
    install -d -o munge -g munge -m 0755 /run/munge
    [ -e /etc/munge/munge.key ] || mungekey --create
    chown munge:munge /etc/munge/munge.key
    own_munged=/run/munge/munged.pid
    start munged runuser -u munge -- munged --force --pid-file="$own_munged"
fi
mkdir -p "$work"/{state,run,log,spool/n1,spool/n2,spool/n3}
cat >"$SLURM_CONF" <<END
ClusterName=canopy
SlurmctldHost=localhost
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
CryptoType=crypto/munge
SlurmctldPort=16817
SlurmctldPidFile=$work/run/slurmctld.pid
SlurmdPidFile=$work/run/slurmd.%n.pid
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool/%n
SlurmctldLogFile=$work/log/slurmctld.log
SlurmdLogFile=$work/log/slurmd.%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/backfill
SchedulerParameters=batch_sched_delay=1,sched_interval=1,bf_interval=1,sched_min_interval=0
ReturnToService=2
SwitchType=switch/none
MpiDefault=none
SlurmdTimeout=60
SlurmctldTimeout=60
SlurmdParameters=config_overrides
NodeName=n[1-3] NodeHostname=$(hostname) NodeAddr=127.0.0.1 Port=[17001-17003] CPUs=2 Boards=1 SocketsPerBoard=1 CoresPerSocket=2 ThreadsPerCore=1 RealMemory=4000 State=UNKNOWN
PartitionName=debug Nodes=n[1-3] Default=YES MaxTime=INFINITE State=UP OverSubscribe=NO
END
start slurmctld slurmctld -f "$SLURM_CONF"
for node in n1 n2 n3; do start "slurmd-$node" slurmd -f "$SLURM_CONF" -N $node; done
idle() { [ "$(sinfo --noheader --Node --format=%T 2>/dev/null | grep -cx idle)" -eq "$1" ]; }
within 20 'three idle nodes' idle 3
say 'slurmctld and three slurmd are up'

cd "$work"
"$bin/nestrad" generate maize --rows 1x4 --leaf-triangle 2e-4 --out scene >/dev/null
options=(--accuracy 0.3 --memory 2)
"$bin/nestrad" solve scene/scene.toml --out expected --quiet "${options[@]}" >/dev/null

# submit NAME ARGUMENTS...: prints the job's number; its output is NAME.out
submit() {
    local name=$1
    shift
    sbatch --parsable --cpus-per-task=1 --output="$work/$name.out" "$here/nestrad.sbatch" "$@"
}
field() { scontrol show job "$1" --oneliner | grep -o " $2=[^ ]*" | cut -d= -f2; }
ended() { case $(field "$1" JobState) in PENDING | RUNNING | CONFIGURING | COMPLETING) false ;; esac }
same_bytes() {
    for table in organs.csv triangles.csv; do
        cmp "expected/$table" "$1/$table" || fail "$1/$table differs from the solve in process"
    done
}
cleaned_up() { [ -z "$(find . -maxdepth 1 -name '.nestrad-*')" ] || fail 'a job left its private folder behind'; }

job=$(submit whole scene/scene.toml whole "${options[@]}")
within 60 'end of the job' ended "$job"
[ "$(field "$job" ExitCode)" = 0:0 ] || fail "the job ended with $(field "$job" ExitCode)"
[ "$(grep -c 'joined' whole.out)" -eq 2 ] || fail 'not two workers'
same_bytes whole
cleaned_up
say 'a job of three nodes: the same bytes as in process'

within 20 'three idle nodes' idle 3
job=$(submit failing scene/none.toml failing)
within 60 'end of the job' ended "$job"
"$bin/nestrad" solve scene/none.toml --out failing --quiet 2>/dev/null && fail 'a scene that is not there was solved'
[ "$(field "$job" ExitCode)" = 1:0 ] || fail "the failing job ended with $(field "$job" ExitCode), not 1"
[ ! -e failing ] || fail 'the failing job left results'
cleaned_up
say 'a solve that fails: its exit code'

# workers_of JOB NODE: the workers' processes; NODE may be a pattern
workers_of() {
    local pid
    for pid in $(pgrep -x nestrad-worker); do
        if grep -qzx "SLURM_JOB_ID=$1" "/proc/$pid/environ" && grep -qzx "SLURMD_NODENAME=$2" "/proc/$pid/environ"; then
            echo "$pid"
        fi
    done
}
parent_of() { awk '/^PPid/ { print $2 }' "/proc/$1/status"; }
# computing NAME: both workers of the job have got what they need to trace
computing() { [ "$(grep -cs 'block is ready' "$1.out")" = 2 ]; }

within 20 'three idle nodes' idle 3
job=$(submit deserted scene/scene.toml deserted "${options[@]}")
within 60 'two workers at work' computing deserted
mapfile -t lost < <(workers_of "$job" 'n[23]')
[ "${#lost[@]}" -eq 2 ] || fail "${#lost[@]} workers, not two"
kill -9 "${lost[@]}"
within 60 'end of the job without workers' ended "$job"
[ "$(field "$job" ExitCode)" = 1:0 ] || fail "the job without workers ended with $(field "$job" ExitCode), not 1"
grep -q 'all workers are gone' deserted.out || fail 'the job does not say that its workers are gone'
[ ! -e deserted ] || fail 'the job without workers left results'
cleaned_up
say 'all workers lost: an error, and no waiting'

within 20 'three idle nodes' idle 3
job=$(submit losing scene/scene.toml losing "${options[@]}")
within 60 'two workers at work' computing losing
# everything of node n3 at once: its worker, the shell and the step's daemon above it, and the node's daemon
mapfile -t lost < <(workers_of "$job" n3)
[ "${#lost[@]}" -eq 1 ] || fail "${#lost[@]} workers on n3, not one"
shell=$(parent_of "${lost[0]}")
kill -9 "${lost[0]}" "$(parent_of "$shell")" "$shell" "$(cat run/slurmd.n3.pid)"
[ "$(field "$job" JobState)" = RUNNING ] || fail 'the job was over before its node was lost'
[ ! -e losing ] || fail 'the solve was over before its node was lost'
# the job itself cannot be tidied away on a node that is gone
over() { ended "$job" || [ "$(field "$job" JobState)" = COMPLETING ]; }
within 60 'end of the job that lost a node' over
[ "$(field "$job" ExitCode)" = 0:0 ] || fail "the job that lost a node ended with $(field "$job" ExitCode)"
same_bytes losing
cleaned_up
say 'a node lost amid the solve: the same bytes'
