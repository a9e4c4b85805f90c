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
    local one
    for one in "INT 0" "INT 0.3" "INT 1" "INT 2.5" "INT 5" "TERM 1" "HUP 0.5"; do
        # shellcheck disable=SC2086 # words
        interrupt $one
        [ "$status" -eq 130 ] || fail "$one: wrong code"
        [ "$took" -le "$most" ] || fail "$one: took $took ms"
        [[ $stderr == *interrupted* ]] || fail "$one: says nothing"
        untouched out.exr
    done
}

@test "SIGHUP is ignored under nohup" {
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
