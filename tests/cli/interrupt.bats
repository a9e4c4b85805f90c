# SIGINT and SIGTERM.
load helper

# ms; a sanitizer (tools/sanitize) makes everything ten times as slow
most=$((1000 * ${VSH_SLOWER:-1}))

milliseconds() {
    echo $(($(date +%s%N) / 1000000))
}

# interrupt SIGNAL SECONDS: starts a long bake, waits until it says something and then some, signals, and sets status,
# took (ms). A shell's background jobs ignore SIGINT until the program has its own handler, so a signal before that
# would be lost; and a bake that is not interrupted ends by its limit of processor seconds.
interrupt() {
    old_output out.exr
    rm -f err.txt # it is what is waited for
    (
        ulimit -t 60
        exec "$VDBSHADE" bake "$ASSETS/cloister.glb" --sun -0.5,0.8,-0.6 --sun-angle 20 --ao 2 --ao-method cones \
            --size 4096 --supersample 2 --resolution 512 --progress -o out.exr 2>err.txt
    ) &
    local pid=$! start
    until [ -s err.txt ]; do
        sleep 0.01
    done
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
        [ "$took" -le "$most" ] || fail "took $took ms, $after s after the start"
        [[ $stderr == *interrupted* ]] || fail "says nothing"
        untouched out.exr
    done
}

@test "SIGTERM does the same" {
    interrupt TERM 1
    [ "$status" -eq 130 ] || fail "wrong code"
    [ "$took" -le "$most" ] || fail "took $took ms"
    untouched out.exr
}

@test "SIGHUP does the same, and is ignored under nohup" {
    interrupt HUP 0.5
    [ "$status" -eq 130 ] || fail "wrong code"
    [ "$took" -le "$most" ] || fail "took $took ms"
    untouched out.exr
    write_box box.obj
    (
        trap '' HUP
        exec "$VDBSHADE" bake box.obj --sun 0,1,0 --sun-angle 5 --size 1024 --resolution 256 --progress --sandbox off -o long.exr 2>long.txt
    ) &
    local pid=$!
    until [ -s long.txt ]; do
        sleep 0.01
    done
    kill -s HUP "$pid"
    wait "$pid" || fail "ended by SIGHUP"
    [ -s long.exr ] || fail "not baked"
}
