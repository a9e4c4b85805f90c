# info: what a file holds, and what is wrong with it.
load helper

@test "a sound mesh has no problems" {
    succeed info box.obj
    [[ $output == *"triangles: 12"*"UV sets: 1"*"bounds: 0 0 0 to 1 1 1"* && $output != *problem* ]] || fail "not so"
}

@test "an open mesh, degenerate triangles and overlapping UVs are problems" {
    { sed -e '$d' -e 's/^vt 0.35 0.02/vt 0.05 0.02/' box.obj && echo 'f 1/1 1/1 2/2'; } >bad.obj
    succeed info bad.obj
    [[ $output == *"problem: 3 open edges"*"problem: 1 triangles of zero area"*"lie over other charts"* ]] || fail "not so"
}

@test "the sample asset is sound" {
    succeed info "$ASSETS/cloister.glb"
    [[ $output != *"other charts"* && $output != *"leave the UV square"* ]] || fail "UVs"
}

@test "a level set" {
    succeed voxelize box.obj -o box.vdb --voxel-size 0.05 --name hull --quiet
    succeed info box.vdb
    [[ $output == *"grid 'hull'"*"class: level set"*"voxel size: 0.05 0.05 0.05"* ]] || fail "not what was written"
    [[ $output != *problem* ]] || fail "a problem"
}

@test "a scene" {
    succeed info "$ASSETS/seeds.json"
    [[ $output == *"caster 0: sdf"*"light 'sun'"*"receiver 0: "* ]] || fail "no summary"
}

@test "missing, damaged and empty files" {
    for ending in obj vdb exr json; do
        refuses 3 "none.$ending" -- info "none.$ending"
    done
    for ending in obj glb ply stl exr png vdb; do
        : >"empty.$ending"
        shade info "empty.$ending"
        [ "$status" -eq 2 ] || [ "$status" -eq 3 ] || fail "$ending: expected 2 or 3"
        refused "$status" "empty.$ending"
    done
}

@test "a damaged level set, byte by byte, never takes the program down" {
    succeed voxelize box.obj -o box.vdb --resolution 16 --quiet
    local size at part # not i: Bats' own tracing counts with it
    size=$(wc -c <box.vdb)
    for ((part = 1; part <= 40; ++part)); do
        at=$((part * size / 41))
        { head -c "$at" box.vdb && printf '\377\377\377\177' && tail -c +$((at + 5)) box.vdb; } >bad.vdb
        shade info bad.vdb
        case $status in
        0 | 2 | 3 | 4) ;;
        *) fail "changed at byte $at" ;;
        esac
    done
}

@test "control characters of a file name stay out of the terminal" {
    refuses 3 'none?[31m?.obj' -- info $'none\033[31m\n.obj'
}

@test "control characters of names within files stay out of the terminal" {
    local name=$'b\033[31mox\302\233'
    write_box "$name.obj"
    printf '{"casters": [{"mesh": "b\\u001b[31mox\\u009b.obj"}], "voxel_size": 0.2,
        "lights": [{"name": "sun", "type": "directional", "direction": [0, 1, 0]}]}' >scene.json
    succeed info scene.json
    [[ "$output" == *'b?[31mox??.obj'* ]] || fail "$output"
    mkdir -p cases
    printf '{"cases": [{"scene": "none.json", "command": "volume", "output": "a\\u001b[31m.vdb", "name": "c\\u001b[31m"}]}' >cases/regress.json
    shade regress cases
    [[ "$output" == *'c?[31m: failed'*'a?[31m.vdb: the bake ended'* ]] || fail "$output"
}
