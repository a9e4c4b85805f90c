# One exit code for one thing: 3 for a file that cannot be read through, 2 for what is written in one that can.
load helper

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    write_box box.obj
    "$VDBSHADE" bake box.obj "${SMALL[@]}" --quiet -o box.exr 2>/dev/null
    local ending
    for ending in png tif jpg tga bmp hdr; do
        "$VDBSHADE" bake box.obj "${SMALL[@]}" --quiet -o "box.$ending" 2>/dev/null
    done
    "$VDBSHADE" voxelize box.obj --resolution 16 --quiet -o box.vdb
    cp "$BATS_TEST_DIRNAME"/../models/scene.{glb,stl,ply,fbx} .
}

@test "what is cut short, or of another kind than its name says, ends with 3" {
    local one
    for one in box.exr box.png box.tif box.jpg box.vdb scene.glb scene.stl scene.ply scene.fbx; do
        head -c $(($(stat -c %s "$one") / 3)) "$one" >"cut.${one##*.}"
        shade info "cut.${one##*.}"
        [ "$status" -eq 3 ] && [[ $stderr == *"cut.${one##*.}: "* ]] || fail "cut.${one##*.}"
    done
    for one in exr png tif jpg vdb glb stl fbx ply; do
        printf 'nothing of the kind' >"other.$one"
        shade info "other.$one"
        [ "$status" -eq 3 ] && [[ $stderr == *"other.$one: "* ]] || fail "other.$one"
        : >"other.$one"
        shade info "other.$one"
        [ "$status" -eq 3 ] && [[ $stderr == *"other.$one: "* ]] || fail "empty other.$one"
    done
    refuses 3 cut.exr -- compare box.exr cut.exr
}

@test "what can be read and says what cannot be used ends with 2, and its place" {
    printf 'v 0 0 0\nv 1 0\n' >bad.obj
    refuses 2 "bad.obj: line 2" -- info bad.obj
    printf '{"casters": 1}' >bad.json
    refuses 2 "bad.json:1:" -- info bad.json
    printf 'a,b,c\n0,0,0\n' >bad.csv
    refuses 2 "bad.csv: the header names no column x" -- query box.obj --points bad.csv --sun 0,1,0 --sun-angle 5 --resolution 16 -o -
}
