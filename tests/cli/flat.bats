# flat: light maps of a plane.
load helper

FONT=/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    cp "$ASSETS/emblem.png" .
    old_output out.exr
    cat >wall.json <<'JSON'
{"region": [-2, -2, 2, 2], "size": 64, "padding": 0,
 "casters": [{"shape": "box", "half_size": [1.5, 0.1], "translate": [-1.5, 0.5]}],
 "lights": [{"name": "lamp", "type": "disc", "position": [0, 1.5], "radius": 0.2, "reach": 3, "color": [1, 0.5, 0]},
            {"name": "sun", "type": "directional", "direction": [0, 1], "angle_deg": 10}]}
JSON
}

# channel FILE NAME: "MIN MEAN MAX" as info tells them.
channel() {
    "$VDBSHADE" info "$1" | sed -n "s/^channel '$2': min \(.*\), mean \(.*\), max \(.*\)$/\1 \2 \3/p"
}

@test "the channels of a map, and how much of it is lit" {
    succeed flat wall.json -o out.exr --quiet
    # the wall covers 1.9 to 2.1 … of 16: x from -2 to 0 and 0.2 high, so 3 or 4 rows of 64, half of them
    read -r _ mean _ <<<"$(channel out.exr A)"
    awk -v m="$mean" 'BEGIN { exit !(m > 1 - 0.032 && m < 1 - 0.022) }' || fail "coverage $mean"
    # under the sun lies the shadow of the left half, below the wall: 2.4 by 2 of 16, its edge at half light
    read -r min mean max <<<"$(channel out.exr shadow.sun)"
    awk -v m="$mean" 'BEGIN { exit !(m > 0.65 && m < 0.69) }' || fail "sun $mean"
    [ "$min" = 0 ] && [ "$max" = 1 ]
    # no light of its own beyond the lamp's reach, and no blue in it
    read -r _ _ red <<<"$(channel out.exr irradiance.R)"
    read -r _ _ blue <<<"$(channel out.exr irradiance.B)"
    awk -v r="$red" -v b="$blue" 'BEGIN { exit !(r > 1.8 && r <= 2 && b == 1) }' || fail "red $red, blue $blue"
}

@test "any number of threads gives the same file" {
    cat >text.json <<JSON
{"region": [-3, -1, 3, 2], "size": [96, 48], "supersample": 2,
 "casters": [{"text": "vdbshade", "font": "$FONT", "height": 1, "align": "center"},
             {"mask": "emblem.png", "size": 1, "translate": [2, 1.2], "rotate_deg": 20}],
 "lights": [{"name": "lamp", "type": "disc", "position": [0, 1.5], "radius": 0.2, "reach": 3},
            {"name": "torch", "type": "spot", "position": [-3, 1], "direction": [1, -0.2], "radius": 0.1,
             "inner_deg": 10, "outer_deg": 20}]}
JSON
    local method
    for method in exact classic hard; do
        succeed flat text.json -o one.exr --threads 1 --method "$method" --quiet
        succeed flat text.json -o seven.exr --threads 7 --method "$method" --quiet
        cmp one.exr seven.exr
    done
}

@test "options go over the scene's" {
    succeed flat wall.json -o small.png --size 32x16 --bits 8 --pack R=shadow.sun --stats stats.json
    [[ $stderr == *"small.png: 32 × 16, 2 lights"* ]] || fail "no summary"
    info_tells small.png "32 × 16"
    grep -q '"texels": 512' stats.json
    sed -i 's/"padding": 0/"padding": 0, "output": "own.exr"/' wall.json
    succeed flat wall.json --quiet
    [ -s own.exr ]
}

@test "info describes a flat scene" {
    succeed info wall.json
    [[ $output == *"flat scene: -2 -2 to 2 2, 64 × 64, method exact"*"caster 0: box"*"light 'lamp': disc"* ]] ||
        fail "not described"
}

# spoilt FROM TO [option …]: the scene with one thing changed.
spoilt() {
    sed "s|$1|$2|" wall.json >bad.json
    shade flat bad.json -o out.exr "${@:3}"
}

@test "bad scenes" {
    refuses 3 none.json -- flat none.json -o out.exr
    refuses 2 wall.json 'no output' -- flat wall.json
    spoilt '"size": 64' '"size": 0'
    refused 2 bad.json:1: size
    spoilt '"size": 64' '"size": 2147483648'
    refused 2 bad.json:1: size
    spoilt '\[-2, -2, 2, 2\]' '[-2, -2, -2, 2]'
    refused 2 bad.json:1: region
    spoilt '"radius": 0.2' '"radius": NaN'
    refused 2 bad.json:3:
    spoilt '"shape": "box", "half_size": \[1.5, 0.1\]' '"mesh": "box.obj"'
    refused 2 bad.json:2: mesh
    spoilt '"shape": "box", "half_size": \[1.5, 0.1\]' '"mask": "none.png", "size": 1'
    refused 3 none.png
    spoilt '"shape": "box", "half_size": \[1.5, 0.1\]' '"shape": "polygon", "points": [[0, 0], [1, 1], [2, 2]]'
    refused 2 'casters[0]' 'no outline'
    refuses 2 seeds.json -- flat "$ASSETS/seeds.json" -o out.exr
    refuses 2 wall.json region -- bake wall.json -o out.exr
    untouched out.exr
}

@test "bad options" {
    refuse_each flat wall.json -o <<'LIST'
2 --method hard | out.exr --method cone
2 --size | out.exr --size 70000
2 --supersample | out.exr --supersample 0
2 out.txt | out.txt
3 none/out.exr | none/out.exr
2 wall.json | wall.json
4 out.exr | out.exr --size 8192 --memory-limit 64MiB
4 | out.exr --method classic --size 2048x64 --memory-limit 2MiB
LIST
    untouched out.exr
}

@test "an output that is a caster's picture" {
    spoilt '"shape": "box", "half_size": \[1.5, 0.1\]' '"mask": "emblem.png", "size": 1'
    done_well
    refuses 2 emblem.png -- flat bad.json -o emblem.png
}

@test "interrupted, the old output stays" {
    sed 's|"size": 64|"size": 8192|' wall.json >bad.json
    # the shell's background jobs ignore SIGINT until the program has its own handler: it is waited for
    (
        ulimit -t 60
        exec "$VDBSHADE" flat bad.json -o out.exr --supersample 16 --progress 2>err.txt
    ) &
    local pid=$!
    until [ -s err.txt ]; do
        sleep 0.01
    done
    kill -INT "$pid"
    status=0
    wait "$pid" || status=$?
    output=
    stderr=$(cat err.txt)
    [ "$status" -eq 130 ] || fail "expected 130"
    untouched out.exr
}
