# SIGINT and SIGTERM.
load helper

milliseconds() {
    echo $(($(date +%s%N) / 1000000))
}

# A shell starts its background jobs with SIGINT ignored: what comes before the program has taken the signal
# over is lost.
wait_for_handler() {
    local caught=0
    while ((!(0x$caught & 2))); do
        sleep 0.01
        caught=$(awk '/^SigCgt:/ { print $2 }' "/proc/$1/status")
    done
}

# interrupt SIGNAL SECONDS: starts a long bake, waits, signals, and sets status, took (ms).
interrupt() {
    old_output out.exr
    "$VDBSHADE" bake "$ASSETS/cloister.glb" --sun -0.5,0.8,-0.6 --sun-angle 20 --ao 2 --ao-cones 256 \
        --size 4096 --supersample 2 --resolution 512 -o out.exr 2>err.txt &
    local pid=$! start
    wait_for_handler "$pid"
    sleep "$2"
    kill -s "$1" "$pid"
    start=$(milliseconds)
    status=0
    wait "$pid" || status=$?
    took=$(($(milliseconds) - start))
    output=
    stderr=$(cat err.txt)
}

@test "a signal ends a bake within a second, at whatever stage, with nothing left behind" {
    for after in 0 0.3 1 2.5 5; do
        interrupt INT "$after"
        [ "$status" -eq 130 ] || fail "after $after s"
        [ "$took" -le 1000 ] || fail "took $took ms, $after s after the start"
        [[ $stderr == *interrupted* ]] || fail "says nothing"
        untouched out.exr
    done
}

@test "SIGTERM does the same" {
    interrupt TERM 1
    [ "$status" -eq 130 ] || fail "wrong code"
    [ "$took" -le 1000 ] || fail "took $took ms"
    untouched out.exr
}
