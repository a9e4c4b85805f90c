# SIGINT and SIGTERM.
load helper

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
