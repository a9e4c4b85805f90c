# docs/formats.md: what it says is written is written, what it says is not is refused, and the help names the same.
load helper

: "${DOCS:=$BATS_TEST_DIRNAME/../../docs}"

# endings_after TEXT: the endings in the first column of the table whose head holds the text.
endings_after() {
    awk -F'|' -v text="$1" 'index($0, text) { inside = 1 }
                            inside && /^$/ { exit }
                            inside && /^\| `/ { gsub(/[`,]/, "", $2); print $2 }' "$DOCS/formats.md"
}

@test "every format of the first table is written" {
    local written=0 ending
    for ending in $(endings_after '| ending | bits'); do
        shade bake box.obj "${SMALL[@]}" --ao 1 --quiet -o "out.$ending"
        done_well || fail "$ending"
        [ -s "out.$ending" ] || fail "$ending: no file"
        [ -z "$stderr" ] || fail "$ending: said something"
        written=$((written + 1))
    done
    [ "$written" -ge 25 ] || fail "only $written endings found"
    no_leftovers
}

@test "every format of the second table is refused with a reason" {
    local refusals=0 ending
    for ending in $(endings_after '| ending | why'); do
        refuses 2 "out.$ending" "'$ending' is not written: " -- bake box.obj "${SMALL[@]}" -o "out.$ending"
        refusals=$((refusals + 1))
    done
    [ "$refusals" -ge 8 ] || fail "only $refusals endings found"
}

@test "the help names the first ending of every row" {
    succeed bake --help
    local ending
    for ending in $(endings_after '| ending | bits' | while read -r first _; do echo "$first"; done); do
        [[ $output == *".$ending"* ]] || fail "$ending"
    done
    [[ $output == *docs/formats.md* ]] || fail "no reference"
}

@test "light in a PNG is sRGB, and light over 1 is told once with its share" {
    bake=(bake box.obj --sun 0,3,4 --irradiance --size 32 --resolution 24 --bits 8)
    succeed "${bake[@]}" -o light.png --quiet
    "$VDBSHADE" info light.png | grep -qx 'vdbshade_color_space: sRGB' || fail "it does not say sRGB"
    shade "${bake[@]}" --pack R=shadow.sun,A=A -o data.png --quiet
    "$VDBSHADE" info data.png | grep -qx 'vdbshade_color_space: linear' || fail "it does not say linear"
    write_scene linear.json box.obj '' '"color_space": "linear"' '0, 3, 4'
    no_sun "${bake[@]:2}"
    shade bake linear.json "${rest[@]}" -o linear.png --quiet
    ! same_values light.png linear.png || fail "color_space changes nothing"
    write_scene srgb.json box.obj '' '"color_space": "srgb"'
    refuses 2 srgb -- bake srgb.json "${rest[@]}" -o x.tif --bits 32
    shade "${bake[@]}" -o light.png
    [[ $stderr != *"brighter than 1"* ]] || fail "nothing is"
    succeed "${bake[@]}" --ambient 0.5,0.5,2.25 --ao 1 -o light.png
    [ "$(grep -c 'texels are brighter than 1, up to 3.05, and cut to 1' <<<"$stderr")" -eq 1 ] || fail "not told"
    shade "${bake[@]}" --ambient 0.5,0.5,2.25 --ao 1 --bits 32 -o light.exr
    [[ $stderr != *"brighter than 1"* ]] || fail "EXR holds it"
}
