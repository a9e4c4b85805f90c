# A folder of scenes and their golden bakes.
load helper

prepare() {
    export TMPDIR=$BATS_TEST_TMPDIR
    mkdir scenes
    write_box scenes/box.obj
    scene box 10
}

# scene NAME ANGLE
scene() {
    cat >"scenes/$1.json" <<JSON
{"casters": [{"sdf": {"shape": "sphere", "radius": 0.25, "translate": [0.5, 1.5, 0.5]}}, {"mesh": "box.obj"}],
 "resolution": 32,
 "lights": [{"name": "sun", "type": "directional", "direction": [0.2, 1, 0.1], "angle_deg": $2}],
 "receivers": [{"mesh": "box.obj", "size": 64, "output": "$1.exr"}]}
JSON
}

# finds PATTERN [option …]: regress succeeds and prints what matches the pattern.
finds() {
    succeed regress scenes "${@:2}"
    # shellcheck disable=SC2053 # a pattern
    [[ $output == $1 ]] || fail "expected $1"
}

# clean: nothing was left behind, here or among the scenes.
clean() {
    no_leftovers
    [ -z "$(find . -name 'vdbshade-regress-*')" ] || fail "bakes were left behind"
}

@test "a scene without a golden bake fails, and --update makes one" {
    ends 1 regress scenes
    [[ $output == "box: not alike"*"no golden bake scenes/golden/box.exr"*"--update"* ]] || fail "no hint"
    [ ! -e scenes/golden ] || fail "made a golden bake"
    succeed regress scenes --update
    [ -s scenes/golden/box.exr ] || fail "no golden bake"
    [ ! -e scenes/box.exr ] || fail "baked into the scenes' folder"
    finds "box: alike"
    clean
}

@test "changed cases are reported, and --update replaces their golden bakes" {
    shade regress scenes --update
    scene other 8
    finds $'box: alike\nother: updated*' --update
    cp scenes/golden/box.exr old.exr
    scene box 20
    differ_printing $'box: not alike\n' "  box.exr: shadow.sun: not alike: " penumbrae "other: alike" -- regress scenes
    cmp -s scenes/golden/box.exr old.exr || fail "the golden bake was touched"
    ends 1 regress scenes
    succeed_printing "box: updated" "  box.exr: shadow.sun: not alike: " penumbrae -- regress scenes --update
    ! cmp -s scenes/golden/box.exr old.exr || fail "the golden bake stayed"
    succeed regress scenes
    clean
}

@test "a golden bake's tolerances count, and limits of the command line replace them" {
    shade regress scenes --update
    scene box 11
    ends 1 regress scenes
    echo '{"penumbra": 0.5, "rmse": 0.5, "p99": 0.5}' >scenes/golden/box.exr.tolerance.json
    finds "box: alike"
    ends 1 regress scenes --max-rmse 0.0001
}

@test "a list names cases with commands and options of their own" {
    cat >scenes/regress.json <<'JSON'
{"cases": [{"scene": "box.json", "name": "rough", "options": ["--method", "hard", "--caster", "box.obj"], "output": "rough.exr"},
           {"scene": "box.json", "name": "air", "command": "volume", "output": "air.vdb",
            "options": ["--box", "0,1,0,1,2,1", "--box-voxel-size", "0.125"]}]}
JSON
    scene more 4
    succeed regress scenes --update
    [[ $output == "rough: updated"*"air: updated"*"more: updated"* ]] || fail "cases"
    [ -s scenes/golden/rough.exr ] && [ -s scenes/golden/air.vdb ] && [ -s scenes/golden/more.exr ] || fail "bakes"
    finds "air: alike" --only air
    finds "more: alike" --only more
    "$VDBSHADE" compare scenes/golden/rough.exr scenes/golden/more.exr --quiet && fail "the options did nothing"
    sed -i 's/"output": "rough.exr"/"output": "more.exr"/' scenes/regress.json
    refuses 2 "both 'rough' and 'more' write 'more.exr'" -- regress scenes
    echo '{"cases": [{"scene": "box.json", "optoins": []}]}' >scenes/regress.json
    refuses 2 'cases[0]: ' optoins -- regress scenes
    echo '{"cases": [{"scene": "box.json", "command": "volume"}]}' >scenes/regress.json
    ends 2 regress scenes
    [[ $stderr == *"nothing says what 'box' writes"* && $output == "box: failed"* ]] || fail "not told"
}

@test "a scene that cannot be baked fails without the others, with its exit code" {
    scene broken 5
    sed -i 's/"mesh": "box.obj", "size"/"mesh": "gone.obj", "size"/' scenes/broken.json
    ends 3 regress scenes --update
    [[ $stderr == *gone.obj* ]] || fail "no reason"
    sed -i 's/gone.obj/box.obj/; s/"resolution": 32/"voxel_size": 1e-9/' scenes/broken.json
    ends 4 regress scenes --update --junit out.xml
    [[ $output == "box: "*"broken: failed"*"exit code 4: "*broken.json*"voxels along"* ]] || fail "not told"
    [ -s scenes/golden/box.exr ] || fail "the other was not baked"
    grep -q 'name="broken/broken.exr" tests="1" failures="1"' out.xml || fail "JUnit"
    grep -q 'exit code 4: .*voxels along' out.xml || fail "no reason in JUnit"
    ends 4 regress scenes --json
    prints '"status": "failed"' '"exit_code": 4' '"reason": "' "voxels along"
    clean
}

@test "reports of all cases, and new bakes that are kept" {
    scene other 8
    shade regress scenes --update
    scene other 16
    ends 1 regress scenes --json --junit out.xml --html out.html --bakes new
    [[ $output == *'"name": "box"'*'"status": "alike"'*'"name": "other"'*'"status": "not alike"'* ]] || fail "JSON"
    grep -q '<testsuite name="box/box.exr" tests="3" failures="0"' out.xml || fail "JUnit"
    grep -q '<testsuite name="other/other.exr" tests="3" failures="1"' out.xml || fail "JUnit"
    [ "$(grep -o 'data:image/png' out.html | wc -l)" -eq 6 ] || fail "pictures"
    in_order page "$(<out.html)" "<title>Bakes of scenes</title>" "1 passed" "1 failed</b> in " "other/other.exr: " "shadow.sun: " "A: " "box/box.exr: "
    [ -s new/box.exr ] && [ -s new/other.exr ] || fail "bakes"
    "$VDBSHADE" compare scenes/golden/box.exr new/box.exr --quiet || fail "bakes"
}

@test "a scene that cannot be read fails without the others; a missing or empty folder is an error" {
    succeed regress scenes --update
    echo '{"casters": [' >scenes/aa.json
    scene other 8
    ends 2 regress scenes --junit out.xml
    [[ $stderr == *"scenes/aa.json:2:"* ]] || fail "no place"
    [[ $output == "aa: failed"*"aa.json: the bake ended with exit code 2: "*aa.json:2:*"box: alike"*"other: not alike"* ]] ||
        fail "not told, or the others were left out"
    [[ $(<out.xml) == *'name="aa'*"failure"* ]] || fail "not in the report"
    mkdir empty
    refuse_each regress <<'LIST'
3 "nowhere: cannot be read: No such file or directory" | nowhere
2 'empty: no scenes' | empty
2 "'nothing'" | scenes --only nothing
LIST
    clean
}

# asking OPTION …: makes a folder whose list has the options for `bake` or $COMMAND.
asking() {
    local words
    words=$(printf ', "%s"' "$@")
    printf '{"cases": [{"scene": "box.json"}, {"scene": "box.json", "name": "sly", "command": "%s", "output": "sly.exr", "options": [%s]}]}' \
        "${COMMAND:-bake}" "${words:2}" >scenes/regress.json
    shade regress scenes
}

@test "a folder's list cannot have files written, or parsed unconfined" {
    local one
    mkdir elsewhere
    for one in "--sandbox off" "--stats $PWD/elsewhere/a" "--stats=$PWD/elsewhere/a" "-o $PWD/elsewhere/a.exr" "-o$PWD/elsewhere/a.exr" \
        "--output $PWD/elsewhere/a.exr" "-o $PWD/elsewhere/" "--invalid $PWD/elsewhere/a.png" --dry-run \
        "--threads 1" "--memory-limit 0" "--sand off" "--per-object" "-- x" "box.json" "--size 8 --sandbox off" "--size=8 --stats elsewhere/a"; do
        # shellcheck disable=SC2086 # words
        asking $one
        [[ $one != "--size"* ]] || one=${one#--size?8 }
        refused 2 "scenes/regress.json: case 'sly': option '${one%% *}' of 'bake'"
    done
    for one in flat volume voxelize; do
        COMMAND=$one asking --stats "$PWD/elsewhere/a"
        refused 2 "option '--stats' of '$one'"
    done
    asking --method --sandbox # a value, and no option
    [[ $stderr == *"--method '--sandbox': "* ]] || fail "not taken for a value"
    asking --size 8 --method=hard
    [ "$status" -eq 1 ] || fail "options that change values"
    ends 1 regress scenes --sandbox off --only sly
    [ -z "$(ls elsewhere)" ] || fail "written elsewhere"
    clean
}

@test "a scene whose name looks like an option is a scene" {
    mv scenes/box.json "scenes/--stats=sly.json"
    succeed regress scenes --update
    [[ $output == "--stats=sly: updated"* ]] || fail "not baked"
    [ ! -e sly.json ] && [ ! -e scenes/sly.json ] || fail "taken for an option"
}

@test "a run that is interrupted removes its bakes" {
    sed -i 's/"size": 64/"size": 4096, "supersample": 4/' scenes/box.json
    "$VDBSHADE" regress scenes --quiet &
    local pid=$! folder=
    until [ -n "$folder" ]; do
        sleep 0.01
        folder=$(find . -maxdepth 1 -name 'vdbshade-regress-*')
    done
    touch "$folder/.box.exr.1.tmp.exr"
    kill -s HUP "$pid"
    status=0
    wait "$pid" || status=$?
    [ "$status" -eq 130 ] || fail "expected 130"
    [ ! -e "$folder" ] || fail "SIGHUP left bakes"
}
