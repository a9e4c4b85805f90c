# trade: reports of error against time.
load helper

TINY=(--sun 0.3,1,0.2 --sun-angle 20 --size 24 --resolutions 12,24 --truth-rays 64 --budget 60)

# column NAME: that column of trade.csv.
column() {
    awk -F, -v name="$1" 'NR == 1 { for (i = 1; i <= NF; ++i) if ($i == name) at = i; next } { print $at }' trade.csv
}

@test "trade writes a page that needs no other file, and its numbers as CSV" {
    succeed trade box.obj "${TINY[@]}" --ao 0.5 -o trade.html --csv trade.csv
    [ -z "$output" ] || fail "something on standard output"
    no_leftovers
    for word in '<title>box.obj: ' 'trade.html, made by <code>vdbshade trade ' 'svg{width:100%' '</svg>' '<table' 'All runs' 'Ambient occlusion' 'Pareto front' '</html>'; do
        grep -q -- "$word" trade.html || fail "no $word"
    done
    ! grep -qE '(src|href)="?(https?:|/|\.)' trade.html || fail "the page needs something beside it"
    for target in 0.05 0.02 0.01 0.005; do
        grep -q "<tr><td>$target</td>" trade.html || fail "nothing about $target"
    done
    [ "$(awk -F, '{ print NF }' trade.csv | sort -u)" = 14 ] || fail "rows of other lengths"
    for method in auto hard classic improved smooth cone rays adaptive exact taps cones; do
        column method | grep -qx "$method" || fail "no $method"
    done
    column resolution | grep -qx 12 && column resolution | grep -qx 24
    ! grep -qE 'nan|inf' trade.csv || fail "a number is none"
    # the plot can be cut out as a file, as `tools/bench curves` does
    sed -n '/<svg/,/<\/svg>/p;/<\/svg>/q' trade.html >plot.svg
    head -1 plot.svg | grep -q '^<svg .*xmlns="http://www.w3.org/2000/svg"' || fail "$(head -1 plot.svg)"
    ! grep -qE 'nan|inf' plot.svg || fail "a number is none"
    column front | grep -qx 1 || fail "nothing on the front"
    # none on the front is beaten in both time and error; each other one is by some, or is as good
    awk -F, 'NR > 1 { n = ++count[$1]; rate[$1, n] = $7; rmse[$1, n] = $11; front[$1, n] = $14 }
             END { for (s in count) for (i = 1; i <= count[s]; ++i) {
                       beaten = matched = 0
                       for (k = 1; k <= count[s]; ++k) if (k != i) {
                           beaten += rate[s, k] < rate[s, i] && rmse[s, k] < rmse[s, i]
                           matched += rate[s, k] <= rate[s, i] && rmse[s, k] <= rmse[s, i]
                       }
                       if (front[s, i] ? beaten : !matched) exit 1 } }' trade.csv || fail "$(cat trade.csv)"
}

# scene CASTERS RECEIVERS: scene.json with a wide sun.
scene() {
    cat >scene.json <<JSON
{"casters": [$1],
 "lights": [{"name": "sun", "type": "directional", "direction": [0, 1, 0], "angle_deg": 20}],
 "receivers": [$2]}
JSON
}

BALL='{"sdf": {"shape": "sphere", "radius": 0.5, "translate": [0.5, 2, 0.5]}}'
BOX='{"mesh": "box.obj"}'

# rmse OPTIONS: prints the RMSE of the run with these options.
rmse() {
    awk -F, -v options="$1" '$3 == options { print $11 }' trade.csv
}

@test "a smaller --max-error is nearer to the truth, and the page states the truth's own error" {
    write_floor floor.obj
    scene "$BOX" '{"mesh": "floor.obj", "output": "a.exr"}'
    succeed trade scene.json --size 48 --resolutions 24 --truth-rays 1024 -o trade.html --csv trade.csv --quiet
    [ ! -e a.exr ] || fail "the scene's own output was written"
    holds "$(rmse '--method auto --max-error 0.005') < $(rmse '--method auto --max-error 0.05')"
    holds "$(rmse '--method auto --max-error 0.005') < 0.005"
    # exact traces the same triangles; adaptive is as near on a box, whose field is right, but for the truth's noise
    local exact adaptive
    exact=$(rmse '--method exact --max-error 0.005 --resolution 24')
    adaptive=$(rmse '--method adaptive --max-error 0.005 --resolution 24')
    holds "$exact < 0.005"
    holds "$exact < $adaptive + 0.001"
    grep -q 'differs by 0.0004 for shadow and 0.0023 for AO' trade.html || fail "no word of the truth's own error"
}

@test "the truth of shapes and meshes is rays against both" {
    write_floor floor.obj
    scene '{"sdf": {"shape": "torus", "radius": 0.8, "tube_radius": 0.06}}' '{"mesh": "floor.obj", "output": "a.exr"}'
    succeed trade scene.json --size 48 --resolutions 8,64 --truth-rays 256 -o trade.html --csv trade.csv --quiet
    # a ring half a voxel thick is not the ring; one of four voxels is, nearly
    holds "$(rmse '--method rays --rays 64 --resolution 64') < 0.02"
    holds "0.06 < $(rmse '--method rays --rays 64 --resolution 8')"
    holds "$(rmse '--method exact --max-error 0.005 --resolution 8') < 0.005"
    # the box alone, or the ball alone, would leave a part of the shadow out
    scene "$BALL, $BOX" '{"mesh": "floor.obj", "output": "a.exr"}'
    succeed trade scene.json --size 48 --resolutions 96 --truth-rays 256 -o trade.html --csv trade.csv --quiet
    holds "$(rmse '--method rays --rays 64 --resolution 96') < 0.02"
}

@test "the truth of a .vdb caster is rays against its surface" {
    succeed voxelize box.obj -o box.vdb --resolution 48 --quiet
    scene '{"vdb": "box.vdb"}' '{"mesh": "box.obj", "output": "a.exr"}'
    succeed trade scene.json --size 24 --resolutions 24 --truth-rays 64 -o trade.html --csv trade.csv --quiet
    holds "$(rmse '--method exact --max-error 0.005 --resolution 24') < 0.005"
}

# count COLUMN: its value in all rows of trade.csv, which must be the same.
count() {
    [ "$(column "$1" | sort -u | wc -l)" -eq 1 ] || fail "$1: $(column "$1" | sort | uniq -c)"
    column "$1" | head -1
}

@test "all receivers are measured together" {
    write_floor floor.obj
    scene "$BOX" '{"mesh": "floor.obj", "output": "a.exr"}, {"mesh": "box.obj", "output": "b.exr"}'
    succeed trade scene.json --size 24 --resolutions 24 --truth-rays 16 -o trade.html --csv trade.csv --quiet
    [ "$(count covered)" -gt 576 ] || fail "the floor's 24 × 24 texels alone"
    [ "$(count texels)" -gt 576 ] || fail "the floor's 24 × 24 texels alone"
}

@test "texels that are invalid at one voxel size are left out of all runs" {
    # a ball that is sunk into the floor: π 0.9² of 36 are under the ball, and more of them for coarse voxels
    write_floor floor.obj
    scene '{"sdf": {"shape": "sphere", "radius": 0.9, "translate": [0, -1, 0]}}' \
        '{"mesh": "floor.obj", "output": "a.exr"}'
    succeed trade scene.json --size 64 --resolutions 64 --truth-rays 64 -o trade.html --csv trade.csv --quiet
    [ "$(count covered)" -eq 4096 ]
    local fine=$((4096 - $(count texels)))
    [ "$fine" -gt 260 ] && [ "$fine" -lt 348 ] || fail "$fine invalid texels"
    succeed trade scene.json --size 64 --resolutions 8,64 --truth-rays 64 -o trade.html --csv trade.csv --quiet
    [ "$((4096 - $(count texels)))" -gt "$fine" ] || fail "no more of them for coarse voxels"
    grep -q "$(count texels) of 4096 texels" trade.html || fail "not said"
}

@test "runs over the budget are left out and counted" {
    succeed trade box.obj "${TINY[@]}" --budget 0.000001 -o trade.html --csv trade.csv
    grep -q 'did not fit into the budget' trade.html
    [[ $stderr == *"left out"* ]] || fail "not said"
}

@test "bad usage is refused, and leaves old outputs alone" {
    old_output trade.html
    refuse_each trade box.obj <<'LIST'
2 --sun --ao | -o trade.html
2 trade.html 'two outputs' | "${TINY[@]}" -o trade.html --csv trade.html
2 box.obj | "${TINY[@]}" -o trade.html --csv box.obj
4 'over the memory limit' | "${TINY[@]}" --size 2048 --memory-limit 60M -o trade.html
LIST
    untouched trade.html
}
