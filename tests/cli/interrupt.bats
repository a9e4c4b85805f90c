# Signals: SIGINT, SIGTERM and SIGHUP.
load helper

# interrupted SIGNAL SECONDS ARG …: runs the program until it prints something, waits, and sends the signal, which must end it. Sets
# took, the milliseconds until it ended. A shell's background jobs ignore SIGINT until the program has its own handler, so an earlier
# signal would be lost. A run that is not interrupted ends by its limit of processor seconds.
interrupted() {
    local pid start
    rm -f err.txt
    (ulimit -t 60 && exec "$VDBSHADE" "${@:3}" --progress 2>err.txt) &
    pid=$!
    until [ -s err.txt ]; do
        sleep 0.01
    done
    sleep "$2"
    kill -s "$1" "$pid"
    start=$(date +%s%N)
    status=0
    wait "$pid" || status=$?
    took=$((($(date +%s%N) - start) / 1000000)) output= stderr=$(cat err.txt)
    [ "$status" -eq 130 ] || fail "expected 130"
}

@test "a signal ends a bake within a second, at whatever stage, with nothing left behind" {
    local one most=$((1000 * ${VSH_SLOWER:-1})) # ms; a sanitizer (tools/sanitize) makes everything ten times as slow
    for one in "INT 0" "INT 0.3" "INT 1" "INT 2.5" "INT 5" "TERM 1" "HUP 0.5"; do
        old_output out.exr
        # shellcheck disable=SC2086 # words
        interrupted $one bake "$ASSETS/cloister.glb" --sun -0.5,0.8,-0.6 --sun-angle 20 --ao 2 --ao-method cones --size 4096 \
            --supersample 2 --resolution 512 -o out.exr
        [ "$took" -le "$most" ] || fail "$one: took $took ms"
        says interrupted
        untouched out.exr
    done
}

@test "an interrupted flat or volume leaves the old output" {
    printf '{"region": [-2, -2, 2, 2], "casters": [{"shape": "box", "half_size": [1, 0.1]}], "lights": [{"name": "sun",
        "type": "directional", "direction": [0, 1], "angle_deg": 10}]}' >flat.json
    old_output out.exr
    interrupted INT 0 flat flat.json --size 8192 --supersample 16 -o out.exr
    untouched out.exr
    old_output out.vdb
    interrupted INT 0.1 volume box.obj --sun 0,1,0 --box -4,-4,-4,4,4,4 --box-voxel-size 0.03 --ao 3 --ao-method cones -o out.vdb
    untouched out.vdb
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
