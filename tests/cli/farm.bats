# tools/slurm on a private Slurm: munged, slurmctld and two slurmd on this machine, one of which the test kills.
load helper

tools=$BATS_TEST_DIRNAME/../../tools/slurm

# Processes that were started here end here, by their numbers.
teardown() {
    local pid
    for pid in "${daemons[@]}" $(cat steps 2>/dev/null); do
        kill -KILL "$pid" 2>/dev/null || true
    done
}

free_port() {
    local port
    for ((port = $1; port < $1 + 2000; ++port)); do
        (: <>"/dev/tcp/127.0.0.1/$port") 2>/dev/null || { echo "$port" && return; }
    done
    return 1
}

# within SECONDS COMMAND …: until the command succeeds, at most so many seconds.
within() {
    local end=$((SECONDS + $1))
    shift
    until "$@" >/dev/null 2>&1; do
        [ $SECONDS -lt $end ] || return 1
        sleep 0.1
    done
}

start() { # COMMAND …: a daemon in the foreground, its number in $started
    "$@" >>daemons.log 2>&1 3>&- &
    started=$!
    daemons+=("$started")
}

start_slurm() {
    local folder=$PWD name controller
    name=$(hostname -s)
    mkdir -p state spool.n1 spool.n2
    chmod 755 . # munged's socket is for everybody
    head -c 128 /dev/urandom >munge.key
    chmod 600 munge.key
    controller=$(free_port $((20000 + $$ % 20000)))
    cat >slurm.conf <<CONF
ClusterName=vdbshade
SlurmctldHost=$name(127.0.0.1)
SlurmctldPort=$controller
AuthInfo=socket=$folder/munge.socket,cred_expire=5
SlurmUser=root
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool.%n
SlurmdPidFile=$folder/slurmd.%n.pid
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdLogFile=$folder/slurmd.%n.log
SlurmctldLogFile=$folder/slurmctld.log
SlurmdTimeout=4
MessageTimeout=2
TCPTimeout=1
KillWait=1
MpiDefault=none
SlurmdParameters=config_overrides
SchedulerParameters=batch_sched_delay=0,sched_min_interval=0,sched_interval=1
NodeName=n1 NodeHostname=$name NodeAddr=127.0.0.1 Port=$(free_port $((controller + 1))) CPUs=1 RealMemory=4000
NodeName=n2 NodeHostname=$name NodeAddr=127.0.0.1 Port=$(free_port $((controller + 2001))) CPUs=1 RealMemory=4000
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
    export SLURM_CONF=$folder/slurm.conf
    start munged --foreground --force --socket "$folder/munge.socket" --key-file "$folder/munge.key" \
        --pid-file "$folder/munge.pid" --log-file "$folder/munge.log" --seed-file "$folder/munge.seed" --num-threads 2
    within 5 test -S munge.socket || fail "munged did not start: $(tail -3 munge.log daemons.log)"
    start slurmctld -D
    start slurmd -D -N n1
    start slurmd -D -N n2
    second=$started
    within 15 eval '[ "$(sinfo -h -t idle -o %D)" = 2 ]' || fail "no two nodes: $(tail -5 slurmctld.log slurmd.n1.log)"
}

needs_slurm() {
    local program
    for program in munged slurmctld slurmd sbatch; do
        command -v $program >/dev/null || skip "no $program: Debian's slurmctld, slurmd, slurm-client, munge"
    done
    [ "$(id -u)" -eq 0 ] || skip "slurmd is started by root alone"
}

@test "a bake on Slurm has the bytes of one bake although a node's daemon is killed" {
    needs_slurm
    bake=(bake box.obj --sun 0.3,1,0.2 --sun-angle 5 --ao 1 --size 256)
    "$VDBSHADE" "${bake[@]}" -o one.exr --quiet
    daemons=()
    start_slurm
    # parts take two seconds; the second node never comes to an end of its first
    cat >program <<PROGRAM
#!/usr/bin/env bash
case "\$SLURMD_NODENAME \$*" in
    "n2 "*--shard*) echo \$\$ \$PPID >>"$PWD/steps"; touch "$PWD/on_second"; exec sleep 50 ;;
    *--shard*) sleep 0.5 ;;
esac
exec "$VDBSHADE" "\$@"
PROGRAM
    chmod +x program
    read -r array merge < <(VDBSHADE=$PWD/program "$tools/submit" 4 "${bake[@]}" -o out.exr)
    within 10 test -e on_second || fail "no part on the second node: $(squeue)"
    within 10 test -e out.exr.1-of-4.part || within 5 test -e out.exr.2-of-4.part || fail "no part is done: $(squeue)"
    [ ! -e out.exr ] || fail "all was done before the node was killed"
    kill -KILL "$second"
    within 40 test -e out.exr || fail "no output: $(squeue; sinfo; cat out.exr.logs/*; tail -20 slurmctld.log)"
    cmp one.exr out.exr
    within 5 eval '[ -z "$(ls ./*.part 2>/dev/null)" ]' || fail "parts are left: $(ls)"
    # a log a part, and what was on the dead node was started again on the other
    [ "$(ls out.exr.logs | tr '\n' ' ')" = "1.log 2.log 3.log 4.log merge.log " ] || fail "$(ls out.exr.logs)"
    grep -h "on n2, started again 0 times" out.exr.logs/*.log || fail "nothing was on the second node"
    grep -h "on n1, started again 1 times" out.exr.logs/*.log || fail "nothing was started again"
    [ -n "$array" ] && [ -n "$merge" ]
}

@test "submit asks for the estimated memory, and refuses commands that have no parts" {
    mkdir bin
    printf '#!/bin/sh\nprintf "%%s\\n" "$*" >>asked\necho 7\n' >bin/sbatch
    chmod +x bin/sbatch
    run -0 env PATH="$PWD/bin:$PATH" CPUS=2 SBATCH="--partition=night" "$tools/submit" 5 bake box.obj "${SMALL[@]}" -o out.exr
    [ "$output" = "7 7" ]
    [[ $(head -1 asked) =~ --array=1-5\ --requeue\ .*--cpus-per-task=2\ --mem=([0-9]+)\ .*--partition=night\ .*part.sbatch\ bake\ box.obj ]]
    [ "${BASH_REMATCH[1]}" -ge 256 ] && [ "${BASH_REMATCH[1]}" -le 600 ]
    [[ $(tail -1 asked) == *"--dependency=afterok:7 "*"merge.sbatch out.exr 5" ]]
    printf '#!/bin/sh\necho "$*" >words\necho "memory about 400 MiB"\n' >told
    chmod +x told
    rm asked
    run -0 env PATH="$PWD/bin:$PATH" VDBSHADE="$PWD/told" "$tools/submit" 64 bake box.obj -o out.exr
    [[ $(head -1 asked) == *"--mem=856 "* ]]
    [[ $(cat words) == *"box.obj -o out.exr --dry-run"* ]]
    # memory that is given is taken, and more options of merge
    rm asked
    run -0 env PATH="$PWD/bin:$PATH" MEMORY=500 MERGE="--stats out.json" "$tools/submit" 2 bake box.obj --sun 0,1,0 -o out.exr
    [[ $(head -1 asked) =~ --mem=500\ .*part.sbatch\ bake\ box.obj\ --sun ]]
    [[ $(tail -1 asked) == *"merge.sbatch out.exr 2 --stats out.json" ]]
    for parts in 0 x 20000; do
        run -2 "$tools/submit" $parts bake box.obj -o out.exr
    done
    run -2 "$tools/submit" 2 bake box.obj --ao 1
    run -2 "$tools/submit" 2 volume box.obj -o out.vdb
    run -2 env PATH="$PWD/bin:$PATH" "$tools/submit" 2 bake none.obj --ao 1 -o out.exr
}
