# A Slurm cluster on this machine, for scripts: one controller and two nodes, which reach each other over 127.0.0.1 and nobody else.
#
#   source tests/slurm/cluster.sh
#   enter "$@"                  once, first: begin this script again in namespaces of its own
#   start FOLDER CPUS           all of it, with CPUS for each node
#   start_node 2; kill_node 2   a node, with all that runs on it
#
# A node is a process namespace with a name and a disk (FOLDER/disk) of its own: killing it is like pulling its plug. The network has a
# loopback device alone. When the script ends, however that comes, the kernel ends what is left in its namespace.

# Installs what is missing; Debian's packages.
install_slurm() {
    local become=()
    [ "$(id -u)" -eq 0 ] || become=(sudo)
    if ! command -v slurmctld munged ip >/dev/null || ! command -v slurmd >/dev/null; then
        "${become[@]}" apt-get update -qq
        DEBIAN_FRONTEND=noninteractive "${become[@]}" apt-get install -y -qq --no-install-recommends \
            slurm-wlm munge iproute2 >/dev/null
    fi
    command -v slurmctld slurmd munged ip >/dev/null
}

enter() {
    if [ "${IN_OWN_NAMESPACES:-}" != yes ]; then
        IN_OWN_NAMESPACES=yes exec unshare --net --mount --uts --pid --fork --mount-proc --kill-child bash "$0" "$@"
    fi
    ip link set lo up
    # The C library looks no address up where there is none but 127.0.0.1. This one is for documentation and leads nowhere.
    ip address add 192.0.2.1/32 dev lo
    hostname controller
}

start() {
    folder="$1"
    mkdir -p "$folder"/{state,log,disk,spool}
    head -c 1024 /dev/urandom >"$folder/munge.key"
    chmod go-rwx "$folder/munge.key"
    printf '127.0.0.1 localhost controller node1 node2\n' >"$folder/hosts"
    mount --bind "$folder/hosts" /etc/hosts
    cat >"$folder/slurm.conf" <<CONF
ClusterName=mackrl
SlurmctldHost=controller(127.0.0.1)
SlurmctldPort=27817
SlurmUser=root
AuthType=auth/munge
# A requeued job waits until its old credential has expired: two minutes otherwise.
AuthInfo=socket=$folder/munge.socket,cred_expire=8
CredType=cred/munge
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmdParameters=config_overrides
SchedulerParameters=sched_interval=2,bf_interval=2,batch_sched_delay=0
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool/%n
SlurmctldPidFile=$folder/controller.pid
SlurmdPidFile=$folder/%n.pid
SlurmctldLogFile=$folder/log/controller
SlurmdLogFile=$folder/log/%n
SlurmctldDebug=info
SlurmdDebug=info
SlurmdTimeout=12
KillWait=10
ReturnToService=2
JobRequeue=1
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/filetxt
JobCompLoc=$folder/completed
MailProg=/bin/true
NodeName=node[1-2] NodeAddr=127.0.0.1 Port=[27818-27819] CPUs=$2 RealMemory=2000
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE
CONF
    export SLURM_CONF="$folder/slurm.conf"
    # The shell need not tell how what it starts has ended: disown.
    munged --force --foreground --key-file="$folder/munge.key" --socket="$folder/munge.socket" --seed-file="$folder/munge.seed" \
        --pid-file="$folder/munge.pid" --log-file="$folder/log/munge" >"$folder/log/munge.out" 2>&1 &
    echo $! >"$folder/munged.pid"
    disown
    await 30 "the authentication" test -S "$folder/munge.socket"
    slurmctld -D >"$folder/log/controller.out" 2>&1 &
    echo $! >"$folder/slurmctld.pid"
    disown
    await 30 "the controller" scontrol ping
    start_node 1
    start_node 2
    await 60 "two nodes" has_nodes 2 idle
}

start_node() {
    unshare --pid --fork --uts --mount --mount-proc --kill-child bash -c "
        hostname node$1
        mount -t tmpfs tmpfs '$folder/disk'
        slurmd -D -N node$1 &
        wait" >"$folder/log/node$1.out" 2>&1 &
    echo $! >"$folder/node$1.unshare.pid"
    disown
}

kill_node() {
    kill -KILL "$(cat "$folder/node$1.unshare.pid")"
    rm "$folder/node$1.unshare.pid"
}

# Ends everything, in order.
finish() {
    local file
    for file in "$folder"/node?.unshare.pid "$folder"/slurmctld.pid "$folder"/munged.pid; do
        [ ! -f "$file" ] || kill -KILL "$(cat "$file")" 2>/dev/null || true
    done
}

has_nodes() {
    [ "$(sinfo --noheader --Node --states="$2" --format=%N | sort -u | wc -l)" -eq "$1" ]
}

# await SECONDS WHAT COMMAND...: until the command succeeds.
await() {
    local limit=$((SECONDS + $1)) what="$2"
    shift 2
    until "$@" >/dev/null 2>&1; do
        if [ "$SECONDS" -ge "$limit" ]; then
            printf 'error: waited in vain for %s\n' "$what" >&2
            return 1
        fi
        sleep 0.5
    done
}
