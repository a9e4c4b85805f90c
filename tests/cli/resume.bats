# `bake --resume`: finished rows are kept, and a bake that was ended goes on from them to the same bytes.
load helper

options=(--sun -0.5,0.8,-0.6 --sun-angle 10 --ao 2 --irradiance --size 256 --resolution 96 --method adaptive)

bake() { # OUT [options]
    local out=$1
    shift
    "$VDBSHADE" bake "$ASSETS/cloister.glb" "${options[@]}" -o "$out" "$@"
}

# Begins a bake with --resume, and sets pid once OUT.resume has so many bytes.
begin() { # OUT BYTES
    "$VDBSHADE" bake "$ASSETS/cloister.glb" "${options[@]}" -o "$1" --resume --threads 1 2>err.txt &
    pid=$!
    while kill -0 "$pid" 2>/dev/null && [ "$(stat -c %s "$1.resume" 2>/dev/null || echo 0)" -lt "$2" ]; do
        sleep 0.01
    done
}

end() { # SIGNAL
    kill -s "$1" "$pid"
    status=0
    wait "$pid" || status=$?
}

@test "a bake that was killed goes on from its finished rows, to the same bytes" {
    bake whole.exr
    for kept in 2000 200000 1000000; do
        old_output out.exr
        begin out.exr "$kept"
        end KILL
        [ "$(cat out.exr)" = old ] || fail "the old output was changed"
        [ -s out.exr.resume ] || fail "nothing was kept"
        run -0 bake out.exr --resume --stats s.json
        cmp whole.exr out.exr
        [ ! -e out.exr.resume ] || fail "the rows are still there"
        [ "$kept" -lt 200000 ] || [ "$(grep -o '"resumed_rows": [0-9]*' s.json | cut -d' ' -f2)" -ge 16 ]
    done
}

@test "statistics go on, too" {
    bake whole.exr --stats whole.json
    begin out.exr 500000
    end KILL
    bake out.exr --resume --stats resumed.json
    for key in texels invalid_texels samples rays; do
        [ "$(grep -o "\"$key\": [0-9]*" whole.json | head -1)" = "$(grep -o "\"$key\": [0-9]*" resumed.json | head -1)" ] ||
            fail "$key"
    done
}

@test "rows of another bake, and damaged ones, are baked again" {
    bake whole.exr
    begin out.exr 500000
    end KILL
    cp out.exr.resume kept
    run --separate-stderr -0 bake other.exr --max-error 0.1
    cp kept other.exr.resume
    cp other.exr expected.exr
    run --separate-stderr -0 bake other.exr --max-error 0.1 --resume
    [[ $stderr == *"other.exr.resume: belongs to another bake (other inputs or options); this one begins anew"* ]]
    cmp expected.exr other.exr
    # a flipped bit within the first band, and a file that was cut within the last
    size=$(stat -c %s kept)
    printf '\xff' | dd of=kept bs=1 seek=$((size / 4)) conv=notrunc status=none
    head -c $((size - 1000)) kept >out.exr.resume
    run -0 bake out.exr --resume
    cmp whole.exr out.exr
}

@test "pages of an asset keep their rows apart, and it goes on from those of each" {
    local -a lit=(cloister.glb "${options[@]}" --unwrap always --pages 2 --seams keep -o lit.glb)
    ln -s "$ASSETS/cloister.glb" .
    "$VDBSHADE" bake "${lit[@]}" --quiet
    mv lit.glb whole.glb
    "$VDBSHADE" bake "${lit[@]}" --quiet --resume
    cmp whole.glb lit.glb
    rm lit.glb
    "$VDBSHADE" bake "${lit[@]}" --resume --threads 1 2>err.txt &
    pid=$!
    while kill -0 "$pid" 2>/dev/null && [ "$(stat -c %s lit.glb.1.resume 2>/dev/null || echo 0)" -lt 100000 ]; do
        sleep 0.01
    done
    end TERM
    grep -Eq "lit.glb: [0-9]+ of 256 rows are kept in lit.glb.1.resume" err.txt || fail "$(cat err.txt)"
    run -0 "$VDBSHADE" bake "${lit[@]}" --resume --stats s.json
    cmp whole.glb lit.glb
    [ "$(grep -o '"resumed_rows": [0-9]*' s.json | cut -d' ' -f2)" -gt 256 ] || fail "$(cat s.json)"
    [ -z "$(ls | grep resume)" ] || fail "the rows are still there"
}

@test "an interrupt says what is kept" {
    begin out.exr 300000
    end TERM
    [ "$status" -eq 130 ]
    grep -Eq "out.exr: [0-9]+ of 256 rows are kept in out.exr.resume; the same command goes on from there" err.txt
    [ ! -e out.exr ]
}

@test "two bakes of one output do not share their rows" {
    begin out.exr 1
    kill -STOP "$pid"
    run --separate-stderr -3 bake out.exr --resume
    kill -CONT "$pid"
    [[ $stderr == *"out.exr.resume: another run has it open"* ]]
    end TERM
}

@test "rows that cannot be kept are no reason to fail" {
    bake whole.exr
    (
        ulimit -f $(($(stat -c %s whole.exr) / 1024 + 50)) # KiB: the lightmap is smaller than its rows
        bake out.exr --resume --trusted 2>err.txt
    )
    grep -q "warning: out.exr.resume: could not be written: File too large; the bake goes on, but cannot be resumed" err.txt
    cmp whole.exr out.exr
    [ ! -e out.exr.resume ]
}

# A chart over a tenth of the rows, so that whole bands have no texel, with everything that is combined with the field.
@test "bands without a texel are baked with AO and layers, spheres or a direct terrain" {
    local kind cast
    printf '%s\n' 'v -2 0 -2' 'v 2 0 -2' 'v 2 0 2' 'v -2 0 2' 'vt 0 0.9' 'vt 1 0.9' 'vt 1 1' 'vt 0 1' 'f 1/1 4/4 3/3 2/2' >floor.obj
    printf 'P2 4 4 9 0 1 2 3 4 5 6 7 8 9 8 7 6 5 4 3\n' >terrain.pgm
    for kind in spheres layer terrain; do
        case $kind in
        spheres) cast='{"spheres": [[0, 1, 0, 0.4]]}' ;;
        layer) cast='{"sdf": {"shape": "sphere", "radius": 0.3, "translate": [0, 2, 0]}, "layer": "top"}' ;;
        terrain) cast='{"heightfield": "terrain.pgm", "size": [4, 4], "height": 0.4, "direct": true, "transform": {"translate": [0, -0.5, 0]}}' ;;
        esac
        for at in '"scale": 1' '"scale": 0.1, "translate": [0, 0.8, 0]'; do # in the open, and inside the box
            cat >scene.json <<JSON
{
    "casters": [{"sdf": {"shape": "box", "half_size": [1, 0.5, 1], "translate": [0, 0.8, 0]}}, $cast],
    $([ $kind = layer ] && echo '"layers": [{"name": "top"}],')
    "voxel_size": 0.1,
    "lights": [{"name": "sun", "type": "directional", "direction": [0.3, 1, 0.2], "angle_deg": 3}],
    "ao": {"distance": 0.6},
    "receivers": [{"mesh": "floor.obj", "output": "out.exr", "transform": {$at}}]
}
JSON
            for how in "" --resume "--band-rows 64 --stats stats.json"; do
                rm -f out.exr out.exr.resume
                run --separate-stderr "$VDBSHADE" bake scene.json --size 400x256 --max-error 0.2 $how --quiet
                if [ "$at" = '"scale": 1' ]; then
                    [ "$status" = 0 ] || fail "$kind, $at, $how: $stderr"
                    [ -n "$how" ] || cp out.exr whole.exr
                    cmp whole.exr out.exr
                    [[ $how != *stats.json ]] || ! grep -q '"bands": 1,' stats.json || fail "$kind: $how is enough for all rows"
                else
                    [[ $stderr == *"nothing to bake: all"*"are inside solids"* ]] || fail "$kind, $at, $how: $stderr"
                fi
            done
        done
    done
}
