# Error against time.
load helper

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
    write_box box.obj
}

TINY=(--sun 0.3,1,0.2 --sun-angle 20 --size 24 --resolutions 12,24 --truth-rays 64 --budget 60)

# column NAME: that column of trade.csv.
column() {
    awk -F, -v name="$1" 'NR == 1 { for (i = 1; i <= NF; ++i) if ($i == name) at = i; next } { print $at }' trade.csv
}

@test "a mesh: a page that needs nothing beside it, and its numbers as CSV" {
    shade trade box.obj "${TINY[@]}" --ao 0.5 -o trade.html --csv trade.csv
    done_well
    [ -z "$output" ] || fail "something on standard output"
    no_leftovers
    for word in '<svg' '</svg>' '<table>' 'data:image/png;base64,' 'Ambient occlusion' 'Pareto front' '</html>'; do
        grep -q -- "$word" trade.html || fail "no $word"
    done
    ! grep -qE '(src|href)="?(https?:|/|\.)' trade.html || fail "the page needs something beside it"
    for target in 0.05 0.02 0.01 0.005; do
        grep -q "<tr><td>$target</td>" trade.html || fail "nothing about $target"
    done
    [ "$(head -1 trade.csv | tr ',' '\n' | wc -l)" -eq 18 ] || fail "not 18 columns"
    [ "$(awk -F, '{ print NF }' trade.csv | sort -u)" = 18 ] || fail "rows of other lengths"
    for method in hard classic improved smooth cone rays adaptive taps cones; do
        column method | grep -qx "$method" || fail "no $method"
    done
    column resolution | grep -qx 12
    column resolution | grep -qx 24
    ! grep -qE 'nan|inf' trade.csv || fail "a number is none"
    column front | grep -qx 1 || fail "nothing on the front"
}

@test "more rays are nearer to the truth" {
    shade trade box.obj "${TINY[@]}" -o trade.html --csv trade.csv --quiet
    done_well
    column method | grep -qx embree || skip "built without Embree"
    awk -F, '$2 == "embree" { if (NR > 2 && last != "" && $10 > last + 0.02) exit 1; last = $10 }' trade.csv ||
        fail "$(cat trade.csv)"
}

@test "procedural casters: the truth is a finer field" {
    cat >scene.json <<'JSON'
{"casters": [{"sdf": {"shape": "sphere", "radius": 0.5, "translate": [0, 2, 0]}}, {"mesh": "box.obj"}],
 "lights": [{"name": "sun", "type": "directional", "direction": [0, 1, 0], "angle_deg": 20}],
 "receivers": [{"mesh": "box.obj", "output": "a.exr"}]}
JSON
    shade trade scene.json --size 24 --resolutions 24 --truth-rays 64 -o trade.html --csv trade.csv --quiet
    done_well
    grep -q 'a field of 48 voxels' trade.html || fail "no word of the truth"
    [ ! -e a.exr ] || fail "the scene's own output was written"
    ! column method | grep -qx 'exact\|embree' || fail "triangles without triangles"
}

@test "what does not fit into the budget is left out and counted" {
    shade trade box.obj "${TINY[@]}" --budget 0.000001 -o trade.html --csv trade.csv
    done_well
    grep -q 'did not fit into the budget' trade.html
    [[ $stderr == *"left out"* ]] || fail "not said"
}

@test "bad usage is refused, and leaves old outputs alone" {
    old_output trade.html
    shade trade box.obj --sun 0,1,0
    refused 2 '-o OUT.html'
    shade trade box.obj --sun 0,1,0 -o trade.txt
    refused 2 trade.txt '-o OUT.html'
    shade trade box.obj -o trade.html
    refused 2 --sun --ao
    shade trade box.obj "${TINY[@]}" -o trade.html --csv trade.html
    refused 2 trade.html --csv
    shade trade box.obj "${TINY[@]}" -o trade.html --csv box.obj
    refused 2 box.obj
    shade trade box.obj "${TINY[@]}" -o nowhere/trade.html
    refused 3 nowhere/trade.html
    while read -r option value; do
        shade trade box.obj "${TINY[@]}" -o trade.html "$option" "$value"
        refused 2 "$option" "$value"
    done <<'LIST'
--size 0
--size 5000
--resolutions 1
--resolutions 64,
--resolutions 64;128
--truth-rays 15
--budget 0
LIST
    untouched trade.html
}
