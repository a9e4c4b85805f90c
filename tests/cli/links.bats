# Links, pipes and files of others where outputs go: what the user names is followed, what a stranger's files name is not.
load helper

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    mkdir theirs elsewhere
    write_box theirs/box.obj
    scene box.exr
    old_output elsewhere/mine.exr
}

# scene OUTPUT
scene() {
    cat >theirs/scene.json <<JSON
{"casters": [{"mesh": "box.obj"}], "resolution": 16, "method": "hard",
 "lights": [{"name": "sun", "type": "directional", "direction": [0.2, 1, 0.1], "angle_deg": 5}],
 "receivers": [{"mesh": "box.obj", "size": 16, "output": "$1"}]}
JSON
}

# told CODE TEXT: how the last run ended, and what it said last.
told() {
    [ "$status" -eq "$1" ] || fail "expected exit code $1"
    [[ ${stderr_lines[-1]} == "vdbshade: $2"* ]] || fail "expected '$2'"
}

# kept: nothing was written elsewhere, nor left behind.
kept() {
    [ "$(ls -A elsewhere)" = mine.exr ] || fail "elsewhere: $(ls -A elsewhere)"
    untouched elsewhere/mine.exr
}

@test "an output that a scene names does not leave its folder by a link" {
    ln -s ../elsewhere/mine.exr theirs/box.exr
    shade bake theirs/scene.json
    refused 3 "theirs/box.exr: cannot be written: a link leads from the folder of 'theirs/scene.json' to " elsewhere/mine.exr
    kept
    ln -sf ../elsewhere/new.exr theirs/box.exr # to nothing that is there
    refuses 3 "theirs/box.exr: cannot be written: a link leads" -- bake theirs/scene.json
    kept
    ln -s "$PWD/elsewhere" theirs/sub
    local one
    for one in sub/mine.exr ./sub/../sub/new.exr; do
        scene "$one"
        refuses 3 "a link leads" -- bake theirs/scene.json
        kept
        (cd theirs && run --separate-stderr "$VDBSHADE" bake scene.json && refused 3 "a link leads") || fail "from inside"
        kept
    done
    scene sub/made/x.exr
    refuses 3 "a link leads" -- bake theirs/scene.json --per-object
    kept
}

@test "a link that stays below the scene's folder, and one that the user names, are followed" {
    mkdir theirs/bakes
    ln -s bakes/kept.exr theirs/box.exr
    old_output theirs/bakes/kept.exr
    succeed bake theirs/scene.json --quiet
    [ -L theirs/box.exr ] && [ "$(wc -c <theirs/bakes/kept.exr)" -gt 100 ] || fail "not followed"
    ln -s elsewhere/mine.exr link.exr
    succeed bake theirs/scene.json -o link.exr --quiet
    [ -L link.exr ] && [ "$(wc -c <elsewhere/mine.exr)" -gt 100 ] || fail "the user's link"
    scene ../elsewhere/said.exr # openly elsewhere
    succeed bake theirs/scene.json --quiet
    [ -s elsewhere/said.exr ] || fail "not written"
    scene absent/x.exr
    refuses 3 "there is no folder 'theirs/absent'" -- bake theirs/scene.json
}

@test "a scene of 2D does not write through a link" {
    ln -s ../elsewhere/mine.exr theirs/flat.exr
    cat >theirs/flat.json <<'JSON'
{"region": [-1, -1, 1, 1], "size": 16, "output": "flat.exr",
 "casters": [{"shape": "box", "half_size": [0.3, 0.1]}],
 "lights": [{"name": "moon", "type": "directional", "direction": [1, 1], "angle_deg": 5}]}
JSON
    refuses 3 "theirs/flat.exr: cannot be written: a link leads" -- flat theirs/flat.json
    kept
}

@test "a folder of scenes does not have its cache or golden bakes written elsewhere" {
    old_output elsewhere/mine.exr
    ln -s ../elsewhere/mine.exr theirs/.regress-cache.json
    refuses 3 "theirs/.regress-cache.json: cannot be written: a link leads" -- regress theirs
    kept
    rm theirs/.regress-cache.json
    ln -s ../elsewhere theirs/golden
    shade regress theirs --update --quiet
    [ "$status" -eq 3 ] && [[ $stderr == *"theirs/golden/box.exr: cannot be written: a link leads"* ]] || fail "folder"
    kept
    rm theirs/golden
    mkdir theirs/golden
    sed 's/0.2, 1, 0.1/1, 0.2, 0/' theirs/scene.json >theirs/other.json
    "$VDBSHADE" bake theirs/other.json -o elsewhere/mine.exr --quiet
    rm theirs/other.json
    cp elsewhere/mine.exr mine.exr
    ln -s ../../elsewhere/mine.exr theirs/golden/box.exr
    shade regress theirs --update --quiet
    [ "$status" -eq 3 ] && [[ $stderr == *"theirs/golden/box.exr: cannot be written: a link leads"* ]] || fail "file"
    cmp mine.exr elsewhere/mine.exr
}
