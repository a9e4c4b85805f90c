# trade --view: its runs in one page, as Chromium shows them.
load helper
load browser

FRONT="fov=90&camera=0,0,1,0,0,0"

# A floor of 2 × 2 seen from above, and a wall at its right border, in the other half of the lightmap.
write_corner() {
    printf '%s\n' 'o floor' 'v -1 -1 0' 'v 1 -1 0' 'v 1 1 0' 'v -1 1 0' 'vt 0 0' 'vt 0.5 0' 'vt 0.5 1' 'vt 0 1' \
        'f 1/1 2/2 3/3' 'f 1/1 3/3 4/4' 'o wall' 'v 1 -1 0' 'v 1 -1 1' 'v 1 1 1' 'v 1 1 0' 'vt 0.6 0' 'vt 1 0' 'vt 1 1' \
        'vt 0.6 1' 'f 5/5 6/6 7/7' 'f 5/5 7/7 8/8' >corner.obj
}

TRADE=(--sun 1,0.2,1 --sun-angle 30 --size 32 --resolutions 32 --truth-rays 64 --budget 10 --quiet)

@test "truth and runs: each side of the slider shows the one that is chosen, with its error and seconds" {
    write_corner
    shade trade corner.obj "${TRADE[@]}" --csv trade.csv -o trade.html --view runs.html
    done_well
    no_leftovers
    # the runs are numbered as in the table, behind the truth
    hard=$(awk -F, '$2 == "hard" { print NR - 1 }' trade.csv)
    "$VDBSHADE" bake corner.obj --sun 1,0.2,1 --sun-angle 30 --size 32 --resolution 32 --method hard --bits 8 \
        --pack R=shadow.sun,G=shadow.sun,B=shadow.sun -o hard.png --quiet
    # 16 × 32 texels over 400 × 400 pixels; texel (12, 16) is in the penumbra of the wall, which hard light has not
    look runs.html "ui=0&$FRONT&texels=1&mode=light&channel=shadow.sun&left=0&right=$hard&split=0.5"
    state_is ready
    pixel_is 287 206 $(picture get hard.png 11 16)
    pixel_is 387 206 $(picture get hard.png 15 16)
    look runs.html "ui=1&$FRONT&texels=1&mode=light&channel=shadow.sun&left=0&right=$hard&split=1&pick=0.72,0.5"
    rmse=$(awk -F, '$2 == "hard" { printf "%.4f", $13 }' trade.csv) seconds=$(awk -F, '$2 == "hard" { printf "%.3f", $6 }' trade.csv)
    grep -qF "<th>bake</th><td>shadow: --method hard --resolution 32: RMSE $rmse, $seconds s</td>" page.dom ||
        fail "$(grep -o 'id="picked".*' page.dom)"
    grep -qF '<th>bake</th><td>shadow: the truth</td>' page.dom || fail "no truth"
    [ "$(grep -o '<option value="[0-9]*">shadow' page.dom | wc -l)" = "$((2 * $(wc -l <trade.csv)))" ] || fail "not every run, twice"
    # where the truth is neither lit nor dark, it is shown so
    look runs.html "ui=0&$FRONT&texels=1&mode=light&channel=shadow.sun&split=1"
    picture get page.png 262 206 287 206 312 206 337 206 >truth
    awk '$1 > 12 && $1 < 243 { ++n } END { exit n == 0 }' truth || fail "no penumbra: $(cat truth)"
    look runs.html "ui=0&$FRONT&texels=1&mode=light&channel=shadow.sun&left=$hard&split=1" value:left-bake=0
    picture get page.png 262 206 287 206 312 206 337 206 >chosen
    cmp truth chosen || fail "not the truth: $(cat chosen)"
}

@test "borders of charts are lit by their own texels" {
    write_corner
    shade trade corner.obj "${TRADE[@]}" --sun 0,0,1 --budget 0.001 -o trade.html --view runs.html
    done_well
    # texel 15 is the floor's last, and at pixel 398 the lookup reaches halfway to 16, which no chart covers
    look runs.html "ui=0&$FRONT&mode=light&channel=shadow.sun&split=1&texels=1"
    border=$(picture get page.png 390 206)
    [ "${border%% *}" -gt 60 ] || fail "the border is as dark as what is not covered: $border"
    look runs.html "ui=0&$FRONT&mode=light&channel=shadow.sun&split=1"
    picture get page.png 398 206 | awk -v border="$border" '{ split(border, a); exit $1 < a[1] - 8 || $1 > a[1] + 8 }' ||
        fail "$(picture get page.png 398 206), beside $border"
}

@test "what a page of runs cannot show is refused" {
    write_corner
    shade trade corner.obj "${TRADE[@]}" -o trade.html --view runs.png
    refused 2 "--view 'runs.png': expected a name that ends in .html"
    shade trade corner.obj "${TRADE[@]}" -o trade.html --view trade.html
    refused 2 'both the output and the --view page'
    echo '{"casters": [{"mesh": "corner.obj"}], "lights": [{"name": "sun", "type": "directional", "direction": [0, 0, 1]}],
        "receivers": [{"mesh": "corner.obj", "output": "a.exr"}, {"mesh": "corner.obj", "output": "b.exr"}]}' >scene.json
    shade trade scene.json -o trade.html --view runs.html
    refused 2 "shows one lightmap of one mesh; see --receiver"
    sed 's/"b.exr"/"b.exr", "unwrap": "always"/' scene.json >unwrapped.json
    shade trade unwrapped.json --quiet --receiver 1 -o trade.html --view runs.html
    refused 2 "shows UVs of the mesh's file"
    shade bake corner.obj --ao 1 --unwrap always -o baked.png --view baked.html
    refused 2 "--view 'baked.html': an image does not hold the UVs that are made"
    shade trade scene.json --receiver 1 --size 16 --resolutions 16 --truth-rays 16 --budget 0.001 -o trade.html --view runs.html
    done_well
}
