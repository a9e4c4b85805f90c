# compare: each defect of a bake fails the measure that is made for it; limits, noise and reports.
load helper

POST='{"sdf": {"shape": "capsule", "half_height": 0.5, "radius": 0.05, "translate": [-1, 0.55, -1.3]}},'

# scene NAME [ANGLE] [POST] [FLOOR]: a ball, a box, a ring and (POST not empty) a thin post on a floor, under a sun.
scene() {
    local post=${3-$POST}
    cat >"$1.json" <<JSON
{"casters": [$post
  {"sdf": {"shape": "plane", "half_size": [2.5, 2.5], "thickness": 0.4}},
  {"sdf": {"shape": "sphere", "radius": 0.5, "translate": [-0.8, 0.7, 0.3]}},
  {"sdf": {"shape": "box", "half_size": [0.4, 0.3, 0.3], "translate": [0.9, 0.3, -0.6]}},
  {"sdf": {"shape": "torus", "radius": 0.5, "tube_radius": 0.15, "translate": [0.6, 0.5, 1.1]}}],
 "voxel_size": 0.05, "method": "cone",
 "lights": [{"name": "sun", "type": "directional", "direction": [-0.5, 0.6, -0.6], "angle_deg": ${2:-10}}],
 "ao": {"distance": 0.6, "method": "cones"},
 "receivers": [{"mesh": "${4:-$ASSETS/seeds_floor.obj}", "size": 96, "output": "$1.exr"}]}
JSON
}

# The bakes are made once, and kept for all tests of this file.
setup_file() {
    cd "$BATS_FILE_TMPDIR" || return 1
    scene golden
    scene wider 11
    scene narrower 9
    scene half 5
    scene lost 10 ''
    awk '$1 == "vt" { printf "vt %.9g %s\n", $2 + 1 / 96, $3; next } { print }' "$ASSETS/seeds_floor.obj" >moved.obj
    scene shifted 10 "$POST" moved.obj
    local one
    for one in golden wider narrower half lost shifted; do
        "$VDBSHADE" bake $one.json --quiet || return 1
        "$VDBSHADE" volume $one.json --box -2.5,0,-2.5,2.5,1.5,2.5 --box-voxel-size 0.125 --quiet -o $one.vdb || return 1
    done
    "$VDBSHADE" bake golden.json --bits 16 --quiet -o half_float.exr
    "$VDBSHADE" bake golden.json --threads 1 --quiet -o again.exr
    "$VDBSHADE" bake golden.json --bits 16 --quiet -o golden.png
    "$VDBSHADE" bake golden.json --bits 8 --quiet -o eight.png
    "$VDBSHADE" volume golden.json --box -2.5,0,-2.5,2.5,1.5,2.5 --box-voxel-size 0.125 --half --quiet -o half_float.vdb
}

setup() {
    cd "$BATS_FILE_TMPDIR" || return 1
}

# line CHANNEL: prints the line of output about the channel.
line() {
    local one
    for one in "${lines[@]}"; do
        [[ $one != "$1: "* ]] || echo "$one"
    done
}

# of_sun EXPRESSION: evaluates a Python expression on the values of shadow.sun in the JSON on standard output.
of_sun() {
    python3 -c 'import json, sys
sun = next(one for one in json.load(sys.stdin)["channels"] if one["name"] == "shadow.sun")
print(eval(sys.argv[1]))' "$1" <<<"$output"
}

# fails FILE MEASURE OTHERS: that measure of shadow.sun fails against golden, and the OTHERS do not.
fails() {
    ends 1 compare golden.exr "$1" --json
    [ "$(of_sun "'$2' in sun['failed'] and not set('$3'.split()) & set(sun['failed'])")" = True ] || fail "$1: $2"
}

# between LEAST MEASURE MOST: whether that measure of shadow.sun is between the two.
between() {
    [ "$(of_sun "$1 <= sun['measures']['$2'] <= $3")" = True ] || fail "$2 is $(of_sun "sun['measures']"), not within $1 … $3"
}

@test "a bake is like itself, like the one of another instruction set, and like its half floats" {
    local one
    for one in golden again half_float; do
        succeed_printing "A: alike; " $'\nao: alike; ' $'\nshadow.sun: alike; shift 0, penumbra ' ", lost 0, gained 0, rmse " ", p99 " ", max " " at (" -- \
            compare golden.exr "$one.exr"
        [ "${#lines[@]}" -eq 3 ] || fail "$one: not a line a channel"
    done
    succeed compare golden.vdb half_float.vdb
    succeed compare golden.png eight.png
}

@test "a golden without R, G and B is like a bake that has them beside its channels" {
    "$VDBSHADE" bake golden.json --pack channels --quiet -o without.exr
    succeed compare without.exr golden.exr
    [ "${#lines[@]}" -eq 3 ] || fail "not a line a channel"
    succeed compare golden.exr without.exr
    "$VDBSHADE" bake golden.json --pack rgb --quiet -o picture.exr
    succeed compare picture.exr picture.exr
    [ "${#lines[@]}" -eq 4 ] || fail "a picture alone has R, G, B and A"
}

@test "a light's angle that is a tenth off fails the penumbra's width and no other shape" {
    fails narrower.exr penumbra "shift lost gained"
    fails wider.exr penumbra "shift lost gained"
    between 0.07 penumbra 0.13
    between 0 shift 0.05
    differ_printing "shadow.sun: not alike: penumbrae 1." " times as wide, " " (limit ±3 %); " -- compare golden.exr wider.exr
    [[ $(line ao) == "ao: alike; "* ]] || fail "AO knows no sun"
}

@test "a shift by a texel fails with its length, and in coverage" {
    fails shifted.exr shift "penumbra lost gained"
    between 0.95 shift 1.05
    shade compare golden.exr shifted.exr
    [[ $(line shadow.sun) == "shadow.sun: not alike: shifted by (1.0"*" texels, which explains "* ||
        $(line shadow.sun) == "shadow.sun: not alike: shifted by (0.9"*" texels, which explains "* ]] || fail "not named first"
    [[ $(line A) == "A: not alike: coverage differs in "* ]] || fail "coverage"
}

@test "a lost thin caster is reported with its place, and a new one too" {
    fails lost.exr lost "penumbra shift gained"
    differ_printing "shadow.sun: not alike: " " texels around (" ") got lighter by up to " ": a lost caster? (limit 3)" -- compare golden.exr lost.exr
    differ_printing "shadow.sun: not alike: " " got darker by up to " ": a new caster? (limit 3)" -- compare lost.exr golden.exr
}

@test "volumes report lost casters, penumbrae and other voxels" {
    differ_printing "shadow.sun: " " voxels around (" ") got lighter " ": a lost caster?" -- compare golden.vdb lost.vdb
    differ_printing "shadow.sun: not alike: penumbrae 0." -- compare golden.vdb half.vdb
    "$VDBSHADE" volume golden.json --box -2.375,0,-2.5,2.5,1.5,2.5 --box-voxel-size 0.125 --quiet -o elsewhere.vdb
    differ_printing "grid 'shadow.sun': other voxels" -- compare golden.vdb elsewhere.vdb
}

@test "different sizes, channels and formats are reported as such" {
    "$VDBSHADE" bake golden.json --size 48 --quiet -o small.exr
    ends 1 compare golden.exr small.exr
    [ "$output" = "not alike: size: golden is 96 × 96, new is 48 × 48" ] || fail "size"
    differ_printing "not alike: format: golden is 'exr', new is 'png'" "not alike: channel 'shadow.sun': in golden alone" -- compare golden.exr golden.png
    ends 1 compare golden.exr golden.vdb
    [ "$output" = "not alike: format: golden is 'exr', new is 'vdb'" ] || fail "kind"
}

@test "limits come from the command line, or from a file beside the golden" {
    cp golden.exr mine.exr
    succeed compare mine.exr narrower.exr --max-penumbra 0.2 --max-rmse 0.1 --max-p99 0.2
    cat >mine.exr.tolerance.json <<'JSON'
{"coverage": 0.1, "channels": {"shadow.*": {"penumbra": 0.2, "rmse": 0.1, "p99": 0.2}}}
JSON
    succeed compare mine.exr narrower.exr
    differ_printing "shadow.sun: not alike: penumbrae " " (limit ±1 %)" -- compare mine.exr narrower.exr --max-penumbra 0.01
    cp mine.exr.tolerance.json other.json
    echo '{"rms": 1}' >mine.exr.tolerance.json
    refuses 2 'mine.exr.tolerance.json:1:2: rms: unknown key' 'rmse' -- compare mine.exr narrower.exr
    succeed compare mine.exr narrower.exr --tolerances other.json
}

# picture N: of the Nth picture of out.html, means of red, green and blue.
picture() {
    grep -o 'data:image/png;base64,[^"]*' out.html | sed -n "$1s/.*,//p" | base64 -d >"picture$1.png"
    "$VDBSHADE" info "picture$1.png" | sed -nE "s/^channel '[RGB]': .*mean ([0-9.]+),.*/\1/p" | paste -sd ' '
}

@test "the report's difference is red where the new bake is lighter and blue where it is darker" {
    local b g r lit
    shade compare golden.exr lost.exr --html out.html
    read -r r g b < <(picture 1)
    lit=$g
    read -r r g b < <(picture 2)
    awk "BEGIN { exit !($g > $lit) }" || fail "a lost caster makes no lighter picture: $lit, $g"
    read -r r g b < <(picture 3)
    awk "BEGIN { exit !($r > $b + 0.01 && $g < $r) }" || fail "lighter is not red: $r $g $b"
    shade compare lost.exr golden.exr --html out.html
    read -r r g b < <(picture 3)
    awk "BEGIN { exit !($b > $r + 0.01 && $g < $b) }" || fail "darker is not blue: $r $g $b"
}

@test "reports: JSON, JUnit, and a page that needs nothing beside it" {
    ends 1 compare golden.exr lost.exr --json --junit out.xml --html out.html
    [[ $output == '{'*'"alike": false'*'}' ]] || fail "no JSON"
    [ "$(grep -c '<testcase ' out.xml)" -eq 4 ] || fail "not a test case a channel, and one of the files"
    grep -q '<testsuites tests="4" failures="2" time=' out.xml || fail "counts"
    grep -q '<failure message="[^"<]*a lost caster?' out.xml || fail "no reason"
    [ "$(grep -o 'data:image/png;base64,iVBORw0KGgo[^"]*' out.html | wc -l)" -eq 6 ] || fail "not three pictures a channel"
    ! grep -qE '(src|href)="?(https?:|/|\.)' out.html || fail "the page needs something beside it"
    grep -q '</html>' out.html || fail "cut short"
    no_leftovers
    succeed compare golden.exr golden.exr --quiet --junit out.xml
    [ -z "$output$stderr" ] || fail "not quiet"
    grep -q '<testsuites tests="4" failures="0" time=' out.xml || fail "counts"
}

@test "files that cannot be compared end with an error, not with a difference" {
    echo text >text.exr
    head -c 3000 golden.vdb >cut.vdb
    refuse_each compare <<'CASES'
3 nowhere.exr | golden.exr nowhere.exr
3 text.exr | text.exr golden.exr
3 cut.vdb | golden.vdb cut.vdb
2 'no NEW' | golden.exr
2 wider.exr | golden.exr half.exr wider.exr
2 'half.exr: the output is also an input' | golden.exr half.exr --html half.exr
2 same.xml | golden.exr half.exr --html same.xml --junit same.xml
CASES
}

# of_error E OUT [options]: shadows and AO of a ball over a floor by rays.
of_error() {
    local error=$1 out=$2
    shift 2
    cat >rays.json <<JSON
{"casters": [{"mesh": "$ASSETS/seeds_floor.obj"}, {"sdf": {"shape": "sphere", "radius": 0.8, "translate": [0, 0.9, 0]}}],
 "voxel_size": 0.05, "lights": [{"name": "sun", "type": "directional", "direction": [-0.5, 0.6, -0.6], "angle_deg": 12}],
 "ao": {"distance": 1.5}, "receivers": [{"mesh": "$ASSETS/seeds_floor.obj", "size": 96, "output": "rays.exr"}]}
JSON
    run -0 "$VDBSHADE" "bake" rays.json --method adaptive --max-error "$error" --quiet -o "$out" "$@"
}

@test "bakes of different max errors are alike within the noise that they state" {
    of_error 0.05 coarse.exr
    of_error 0.005 fine.exr
    succeed_printing "ao: " "noise of 0.0502 is allowed for (made to max errors 0.005 and 0.05)" -- compare fine.exr coarse.exr
    differ_printing "ao: not alike: " "rmse " "(limit 0.004)" -- compare fine.exr coarse.exr --noise 0
    differ_printing "ao: not alike: rmse " " (limit 0.0001); noise" -- compare fine.exr coarse.exr --max-rmse 0.0001
    echo '{"rmse": 0.0001}' >fine.exr.tolerance.json
    ends 1 compare fine.exr coarse.exr
    rm fine.exr.tolerance.json
    succeed compare coarse.exr coarse.exr
    [[ $output != *"is allowed for"* ]] || fail "bakes made to one error have noise"
    shade compare fine.exr coarse.exr --json
    [[ $(tr -d ' \n' <<<"$output") == *'"max_error":[0.005,0.05],"noise":0.0502'* ]] || fail "$output"
    of_error 0.05 limited.exr --rays 64
    shade compare fine.exr limited.exr --noise 0.07
    [[ $(line ao) != *"made to"* ]] || fail "a limit of rays may leave more than the error: $(line ao)"
    shade compare fine.exr limited.exr
    [[ $(line ao) != *"is allowed for"* ]] || fail "$(line ao)"
}

@test "reports are UTF-8 although names of files and channels are not" {
    local golden=$'bad\xff\xe2\x82.exr' new=$'über\x80.exr'
    LC_ALL=C sed 's/shadow\.sun/shadow.s\xedn/g' golden.exr >"$golden"
    LC_ALL=C sed 's/shadow\.sun/shadow.s\xedn/g' lost.exr >"$new"
    ends 1 compare "$golden" "$new" --json --junit bad.xml --html bad.html
    [[ $output == *'"golden": "bad'$'\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd''.exr"'* && $output == *'"new": "über'$'\xef\xbf\xbd''.exr"'* ]] ||
        fail "files"
    [[ $output == *'"name": "shadow.s?n"'* ]] || fail "channels"
    local one
    printf '%s' "$output" >bad.json
    for one in bad.json bad.xml bad.html; do
        iconv -f UTF-8 -t UTF-8 "$one" >/dev/null || fail "$one is no UTF-8"
    done
    grep -q 'name="shadow.s?n"' bad.xml || fail "channels in XML"
}
