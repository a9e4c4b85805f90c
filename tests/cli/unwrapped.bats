#!/usr/bin/env bats
# Receivers whose lightmap UVs are made for them: --unwrap, --texels-per-unit, --pages.
load helper

# The box without UVs, and with a second one beside it.
write_bare() {
    write_box full.obj
    sed -e '/^vt /d' -e 's,/[0-9]*,,g' full.obj >"$1"
    rm full.obj
}

write_two() {
    write_box one.obj
    {
        cat one.obj
        echo 'o second'
        sed -n 's/^v \([0-9]\) /v \1.5 /p' one.obj | sed 's/^v \([0-9]\)\.5/v 3\1/'
        sed -n 's/^f //p' one.obj | awk '{ out = "f"; for (i = 1; i <= NF; ++i) { split($i, p, "/"); out = out " " p[1] + 8 "/" p[2] } print out }'
    } >"$1"
    rm one.obj
}

@test "a mesh without lightmap UVs gets some where an asset is written" {
    write_bare box.obj
    shade bake box.obj "${SMALL[@]}" --ao 1 -o lit.glb
    [ "$status" -eq 0 ] || fail "$stderr"
    grep -aq '"TEXCOORD_0"' lit.glb || fail "no UVs"
    grep -aq '"MOZ_lightmap"' lit.glb || fail "no light"
}

@test "for an image it gets none unasked, and the error says how" {
    write_bare box.obj
    shade bake box.obj "${SMALL[@]}" -o x.exr
    [ "$status" -eq 2 ] || fail "status $status"
    [[ $stderr == *"--unwrap auto"* ]] || fail "$stderr"
    shade bake box.obj "${SMALL[@]}" --unwrap auto -o x.exr
    [ "$status" -eq 0 ] || fail "$stderr"
}

@test "UVs that can be baked are kept, and always replaces them" {
    write_box box.obj
    "$VDBSHADE" bake box.obj "${SMALL[@]}" -o plain.exr --quiet
    "$VDBSHADE" bake box.obj "${SMALL[@]}" --unwrap auto -o auto.exr --quiet
    "$VDBSHADE" bake box.obj "${SMALL[@]}" --unwrap always -o always.exr --quiet
    same_values plain.exr auto.exr
    ! same_values plain.exr always.exr || fail "the same UVs"
}

@test "objects that each fill the square are packed apart" {
    write_two two.obj
    shade bake two.obj "${SMALL[@]}" --size 64 -o x.exr
    [ "$status" -ne 0 ] || fail "baked over each other"
    shade bake two.obj "${SMALL[@]}" --size 64 --unwrap auto -o x.exr --verbose
    [ "$status" -eq 0 ] || fail "$stderr"
    [[ $stderr != *"overlap"* ]] || fail "$stderr"
}

@test "a density fills as many pages as it takes, each with an image of its own" {
    write_two two.obj
    shade bake two.obj "${SMALL[@]}" --size 64 --unwrap always --texels-per-unit 20 --irradiance \
        --ambient 0.25,0.25,0.25 -o x.exr
    [ "$status" -eq 0 ] || fail "$stderr"
    [ -s x.0.exr ] && [ -s x.1.exr ] && [ ! -e x.exr ] || fail "$(ls)"
    shade bake two.obj "${SMALL[@]}" --size 64 --unwrap always --texels-per-unit 20 --seams keep \
        --exr y.exr -o y.glb
    [ "$status" -eq 0 ] || fail "$stderr"
    [ -s y.glb ] || fail "no asset"
    same_values x.0.exr y.0.exr
    same_values x.1.exr y.1.exr
}

@test "a mesh that no page can hold lies on several, each triangle on one" {
    write_box box.obj
    shade bake box.obj "${SMALL[@]}" --size 32 --unwrap always --texels-per-unit 20 -o x.exr --stats x.json --verbose
    [ "$status" -eq 0 ] || fail "$stderr"
    [ -s x.5.exr ] && [ ! -e x.6.exr ] || fail "$(ls)"
    [[ $stderr != *"lie over"* ]] || fail "$stderr"
    # six squares of 20 texels and a border
    texels=$(grep -o '"texels": [0-9]*' x.json | grep -o '[0-9]*')
    [ "$texels" -ge 2400 ] && [ "$texels" -le 2904 ] || fail "$texels texels"
    # solid still, though it is cut in six
    [[ $stderr != *"sheet"* && $stderr != *"open edges"* ]] || fail "$stderr"
}

@test "UVs that can be baked are packed anew where a density is asked for" {
    write_box box.obj
    shade bake box.obj "${SMALL[@]}" --size 64 --unwrap auto --texels-per-unit 8 -o few.exr
    [ "$status" -eq 0 ] || fail "$stderr"
    shade bake box.obj "${SMALL[@]}" --size 64 --unwrap auto --texels-per-unit 16 -o many.exr --stats many.json
    [ "$status" -eq 0 ] || fail "$stderr"
    # six unit squares
    texels=$(grep -o '"texels": [0-9]*' many.json | grep -o '[0-9]*')
    [ "$texels" -ge 1536 ] && [ "$texels" -le 1850 ] || fail "$texels texels"
}

@test "info tells density and stretch of UVs, and what auto would do" {
    write_two two.obj
    write_bare bare.obj
    write_box box.obj
    shade info box.obj --size 100
    [[ $output == *"lightmap UVs: 36.12 texels a unit at 100 × 100, stretch 1.048"* ]] || fail "$output"
    [[ $output == *"--unwrap auto: bakes these UVs as they are"* ]] || fail "$output"
    shade info two.obj
    [[ $output == *"--unwrap auto: packs the charts of 2 meshes anew, and makes those of 0"* ]] || fail "$output"
    shade info bare.obj
    [[ $output != *"lightmap UVs"* ]] || fail "$output"
    [[ $output == *"--unwrap auto: packs the charts of 0 meshes anew, and makes those of 1"* ]] || fail "$output"
}

@test "a density that does not fit the pages is refused with one that does" {
    write_two two.obj
    old_output x.exr
    shade bake two.obj "${SMALL[@]}" --size 64 --unwrap always --texels-per-unit 20 --pages 1 -o x.exr
    [ "$status" -ne 0 ] || fail "fitted"
    [[ $stderr == *"two.obj"* && $stderr == *"fit"* ]] || fail "$stderr"
    [ "$(cat x.exr)" = old ] || fail "the old output is gone"
}

@test "threads and bands change no bit of what is unwrapped" {
    write_two two.obj
    "$VDBSHADE" bake two.obj "${SMALL[@]}" --size 64 --ao 1 --unwrap always --threads 1 -o one.exr --quiet
    "$VDBSHADE" bake two.obj "${SMALL[@]}" --size 64 --ao 1 --unwrap always --threads 4 --band-rows 8 -o four.exr --quiet
    same_values one.exr four.exr
}
